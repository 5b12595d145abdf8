"""Motor behaviors, one per file: parameters are their fields, `Brain` chooses among them."""

from boebot.behaviors.avoid import Avoid
from boebot.behaviors.charge_battery import ChargeBattery
from boebot.behaviors.escalate import Escalate, LeakyChain
from boebot.behaviors.escape import Escape
from boebot.behaviors.evade import Evade
from boebot.behaviors.follow_line import FollowLine
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
    "ChargeBattery",
    "Escalate",
    "Escape",
    "Evade",
    "FollowLine",
    "FollowWall",
    "Homing",
    "Kinesis",
    "Klinotaxis",
    "LeakyChain",
    "Phototaxis",
    "RunAndTumble",
    "Stop",
    "StraightRun",
    "Wander",
    "Withdraw",
]
