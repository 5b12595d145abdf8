"""Explore the office: drive until every place has been seen (chapter 6 of the notes).

    boebot run explore --seconds 1000
    boebot run explore --robot shieldbot-turret --arena office --seconds 5400

What it finds grows as a tree of nodes; `explore_state` is "done" when none is left, after 550 to 920 s. The turret
robot sweeps for four seconds at each of its many nodes: it takes more than an hour, and now and then it is lost.

The brain does not use the office's map to find its way, but to correct where it is: without localization odometry
drifts, and with it the tree.
"""

from boebot.brain import Brain, Utility
from boebot.cognition import Odometry
from boebot.navigation import Explore, LineMap, Localization

ROBOT, ARENA = "roller", "office"
START = (-2.5, 0.0, 0.0)  # m, m, rad: where the arena says that robots begin

localization = Localization(
    plan=LineMap.of("office"), start=START, every=10.0, utility=Utility(b=-1.0, w={"due": 3.0}, tau=0.05)
)
explore = Explore(localization=localization, speed=0.25, turn_speed=0.1, utility=Utility(b=0.5))

brain = Brain([Odometry(), localization, explore], [localization.due_variable])
