"""Motor behaviors, one per file: parameters are their fields, `Brain` chooses among them."""

from boebot.behaviors.avoid import Avoid as Avoid
from boebot.behaviors.charge_battery import ChargeBattery as ChargeBattery
from boebot.behaviors.escalate import Escalate as Escalate
from boebot.behaviors.escalate import LeakyChain as LeakyChain
from boebot.behaviors.escape import Escape as Escape
from boebot.behaviors.evade import Evade as Evade
from boebot.behaviors.follow_line import FollowLine as FollowLine
from boebot.behaviors.follow_wall import FollowWall as FollowWall
from boebot.behaviors.homing import Homing as Homing
from boebot.behaviors.kinesis import Kinesis as Kinesis
from boebot.behaviors.phototaxis import Klinotaxis as Klinotaxis
from boebot.behaviors.phototaxis import Phototaxis as Phototaxis
from boebot.behaviors.run_and_tumble import RunAndTumble as RunAndTumble
from boebot.behaviors.stop import Stop as Stop
from boebot.behaviors.straight_run import StraightRun as StraightRun
from boebot.behaviors.wander import Wander as Wander
from boebot.behaviors.withdraw import Withdraw as Withdraw
from boebot.offered import offered

__all__ = offered(__name__)
