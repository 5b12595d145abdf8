"""Up to which age a reading of a slow device is fresh, where messages that tell it may be rarer than the readings."""

from __future__ import annotations

import math
from typing import Final

from boebot.devices.infrared import MESSAGE_TICKS as MESSAGE_TICKS
from boebot.devices.infrared import STALE_PERIODS
from boebot.link.frame import FRAME_OVERHEAD
from boebot.link.messages import DevicesTelemetry

LINE_SHARE: Final = 4  # messages fill a quarter of the line at most (PROTOCOL.md, "Delivery")


def message_ticks(devices_period: int, byte_s: float, tick_s: float) -> int:
    """Ticks from one message to the next: as the parameter says, or more where the line is slow.

    `byte_s`: time that a byte needs on the line (s); 0 where that is not known.
    """
    needed_s = LINE_SHARE * (DevicesTelemetry.LENGTH + FRAME_OVERHEAD) * byte_s
    return max(devices_period, math.ceil(needed_s / tick_s - 1e-6))


def fresh_ticks(period_ticks: int, told_ticks: int) -> int:
    """Up to which age (ticks): three of its own periods, or of those of the messages if these are longer."""
    return STALE_PERIODS * max(period_ticks, told_ticks)
