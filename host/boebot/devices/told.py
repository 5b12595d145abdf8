"""What the board told of its slow devices last, and how long ago: what the readers of those devices are called with."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from boebot.devices.infrared import NEVER
from boebot.link.messages import DevicesTelemetry


class Told(NamedTuple):
    """The newest message of the slow devices, as an observation has it."""

    devices: DevicesTelemetry
    """As the board sent it."""
    since: float
    """Ticks from that message to the observation; infinite if none has come."""


NOTHING_TOLD: Final = Told(
    DevicesTelemetry(*(0,) * len(DevicesTelemetry._fields))._replace(
        infrared_zone_age=NEVER, battery_age=NEVER, analog_infrared_age=NEVER, light_age=NEVER, compass_age=NEVER
    ),
    math.inf,
)


def told(devices: DevicesTelemetry, tick: int) -> Told:
    """That message as an observation of `tick` has it: ticks are counted modulo 2^32; one of a later tick is new."""
    since = (tick - devices.tick) & 0xFFFFFFFF
    return Told(devices, since if since < 1 << 31 else 0)
