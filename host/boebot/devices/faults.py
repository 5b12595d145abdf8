"""How what several kinds of devices have can fail, and what is no device: wheels, the pack, the whole robot. Other
devices say it in their own files, as `Device.FAULTS`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from boebot.devices.device import FaultKind

DIRTY: Final = {"dirty": FaultKind("this share of the light is lost", default=0.5, most=0.99, harmless=0.0)}
MOTOR_FAULTS: Final = {
    "dead": FaultKind("it does not turn its wheel"),
    "weak": FaultKind("it has this share of its torque", default=0.3, harmless=1.0),
    "reversed": FaultKind("it turns the other way"),
}
SAGGING: Final = {"sagging": FaultKind("the pack has this voltage at most", "V", default=4.6, most=30.0)}
_WHEEL: Final = {
    "blocked": FaultKind("the wheel cannot turn"),
    "slipping": FaultKind("the tyre has this coefficient of friction at most", default=0.05, most=2.0),
}
BODY_FAULTS: Final[Mapping[str, Mapping[str, FaultKind]]] = {
    "wheel_left": _WHEEL,
    "wheel_right": _WHEEL,
    "robot": {"lifted": FaultKind("it is held in the air, its wheels turn freely")},
    "battery": SAGGING,
}
"""Of what is no device: wheels, the whole robot, and the pack, which is there without a divider, too."""
