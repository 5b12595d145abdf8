"""Three behaviors chosen by utility: wander about, avoid near things, charge the battery when it runs low.

The weights are chosen; E is the battery's level, low = 1 - E:

    wander   tanh(0.5), always
    avoid    tanh(-1 + 3 near + 4 contact)
    charge   tanh(1.5 - 3.2 E + 1.9 charging): once it charges, it stays until the battery is nearly full
"""

from boebot.behaviors import Avoid, ChargeBattery, Wander, Withdraw
from boebot.brain import Brain, Utility
from boebot.cognition import BatteryLevel, contact, near

ROBOT, ARENA = "shieldbot-charging", "station"

battery = BatteryLevel(empty=5.0, full=7.8, tau=0.5)

brain = Brain(
    processes=[
        Wander(turn_probability=0.002, utility=Utility(b=0.5)),
        Avoid(utility=Utility(b=-1.0, w={"near": 3.0, "contact": 4.0})),
        ChargeBattery(name="charge", utility=Utility(b=-1.7, w={"low": 3.2, "charging": 1.9})),
        Withdraw(utility=Utility(b=-1.0)),  # a reflex: a touch calls it, whatever the utilities are
        battery,
    ],
    variables=[near(), contact(), battery.variable(), battery.charging_variable()],
)
