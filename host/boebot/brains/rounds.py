"""Visit three rooms of the office again and again, and charge when the battery is low (chapters 6 and 8 of the notes).

    boebot run rounds --seconds 900
    boebot run rounds --robot roller-charging --arena office --seconds 400

Utilities decide, with E the battery's level and low = 1 - E:

    visit      tanh(0.5), always
    recharge   tanh(1.5 - 3.2 E + 1.9 charging): once it charges, it stays until the battery is nearly full
    localize   tanh(2) when the last scan is old, or a place is to be confirmed; else below 0
"""

from __future__ import annotations

from dataclasses import dataclass

from boebot import Robot
from boebot.brain import Brain, Utility
from boebot.cognition import BatteryLevel, Odometry
from boebot.navigation import GoTo, LineMap, Localization

ROBOT, ARENA = "shieldbot-turret", "office"
START = (-2.5, 0.0, 0.0)  # m, m, rad: where the arena says that robots begin
ROOMS = {"upper left": (-0.7, 1.2), "upper right": (1.2, 1.3), "lower left": (-1.5, -1.2)}  # m
CHARGER = (2.6, 0.0)  # m


@dataclass(kw_only=True)
class Visit(GoTo):
    """Goes from room to room."""

    def forget(self) -> None:
        super().forget()
        self.visits = 0

    def step(self, robot: Robot) -> None:
        names = list(ROOMS)
        if self.arrived:
            self.visits += 1
        if self.arrived or self.goal is None:
            self.go(ROOMS[names[self.visits % len(names)]])
        super().step(robot)
        robot.show("visits", self.visits)
        robot.show("next_room", names[self.visits % len(names)])


@dataclass(kw_only=True)
class Recharge(GoTo):
    """Goes to the charger and stands there."""

    def forget(self) -> None:
        super().forget()
        self.go(CHARGER)


battery = BatteryLevel(empty=5.0, full=7.8, tau=0.5)
localization = Localization(
    name="localize",
    plan=LineMap.of("office"),
    start=START,
    every=10.0,
    utility=Utility(b=-1.0, w={"due": 3.0}, tau=0.05),
)

brain = Brain(
    processes=[
        Odometry(),
        battery,
        localization,
        Visit(localization=localization, speed=0.25, turn_speed=0.1, utility=Utility(b=0.5)),
        Recharge(
            localization=localization,
            speed=0.25,
            turn_speed=0.1,
            utility=Utility(b=-1.7, w={"low": 3.2, "charging": 1.9}),
        ),
    ],
    variables=[battery.variable(), battery.charging_variable(), localization.due_variable],
)
