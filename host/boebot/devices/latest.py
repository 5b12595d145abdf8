"""The newest message of each kind in which a board's slow devices speak, as an observation has it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import Any, Final, NamedTuple

NEVER: Final = 255  # an age on the wire: never measured, or older
STALE_PERIODS: Final = 3  # a reading older than this many of its periods is not valid
MESSAGE_TICKS: Final = 2  # from one message to the next: parameter devices_period, unless set otherwise


class Latest(NamedTuple):
    """The newest messages at one tick; it never changes."""

    messages: Mapping[type, Any]
    """By kind, as the board sent them."""
    tick: int
    """Of the observation."""

    def of(self, kind: type) -> tuple[Any, float]:
        """The newest message of that kind, and the ticks from it to the observation: one without readings, infinite
        ticks ago, if none has come. Ticks are counted modulo 2^32; a message of a later tick is new."""
        message = self.messages.get(kind)
        if message is None:
            return without_readings(kind), math.inf
        since = (self.tick - message.tick) & 0xFFFFFFFF
        return message, since if since < 1 << 31 else 0


NO_MESSAGES: Final = Latest({}, 0)


@cache
def without_readings(kind: Any) -> Any:
    """A message of that kind in which nothing has been measured yet."""
    return kind(*(NEVER if field.endswith("_age") else 0 for field in kind._fields))


def fresh_ticks(period_ticks: int, message_ticks: int) -> int:
    """Up to which age (ticks) a reading is fresh: three of its periods, or of those of the messages if these are
    longer."""
    return STALE_PERIODS * max(period_ticks, message_ticks)


# ---- analog inputs: the converter's result is a ratio of the supply (data sheet of the ATmega328P, 24.7) -------------

STEPS: Final = 1024
READ_TICKS: Final = 2  # from one reading of an input to the next, when both are on
VOLTS: Final = 0.001  # per count of the supply on the wire


def voltage(result: int, supply: int) -> float | None:
    """Voltage at the pin (V) for a result and the supply in mV; None while the supply is not known."""
    return result / STEPS * supply * VOLTS if supply else None
