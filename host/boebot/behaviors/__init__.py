"""Motor behaviors, one per file: parameters are their fields, `Brain` chooses among them."""

from boebot.behaviors.avoid import Avoid
from boebot.behaviors.stop import Stop
from boebot.behaviors.straight_run import StraightRun
from boebot.behaviors.wander import Wander

__all__ = ["Avoid", "Stop", "StraightRun", "Wander"]
