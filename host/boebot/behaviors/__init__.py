"""Motor behaviors, one per file: parameters are their fields, `Brain` chooses among them."""

from boebot.behaviors.avoid import Avoid
from boebot.behaviors.follow_wall import FollowWall
from boebot.behaviors.homing import Homing
from boebot.behaviors.kinesis import Kinesis
from boebot.behaviors.phototaxis import Klinotaxis, Phototaxis
from boebot.behaviors.run_and_tumble import RunAndTumble
from boebot.behaviors.stop import Stop
from boebot.behaviors.straight_run import StraightRun
from boebot.behaviors.wander import Wander
from boebot.behaviors.withdraw import Withdraw

__all__ = [
    "Avoid",
    "FollowWall",
    "Homing",
    "Kinesis",
    "Klinotaxis",
    "Phototaxis",
    "RunAndTumble",
    "Stop",
    "StraightRun",
    "Wander",
    "Withdraw",
]
