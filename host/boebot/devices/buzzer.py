"""Buzzer: tones. Each is sent with a token, so that one that comes twice sounds once.

A message may be lost: it is sent again, unchanged, until devices_telemetry brings its token back.

    [device.buzzer]
    type = "buzzer"
    pin = 4

    robot.beep(880, 0.2)
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

from boebot.devices.device import GROUND, Checkup, SlowDevice, Wire
from boebot.link.messages import Buzzer as BuzzerMessage

FREQUENCY_MIN, FREQUENCY_MAX = 40.0, 8000.0  # Hz
DURATION_SCALE = 0.01  # seconds per count on the wire
DURATION_MAX = 2.55  # s
TOKENS = 255  # 1..255; 0 is the board's at the start of a session


def next_token(token: int) -> int:
    """The token after that one."""
    return token % TOKENS + 1


def command(frequency: float, duration: float, token: int) -> BuzzerMessage:
    """The message of a tone (Hz, s); frequency or duration 0 is silence.

    Raises:
        ValueError: a frequency or duration that the board does not have.
    """
    if frequency and not FREQUENCY_MIN <= frequency <= FREQUENCY_MAX:
        raise ValueError(f"a tone of {frequency} Hz; expected {FREQUENCY_MIN:g} to {FREQUENCY_MAX:g}, or 0")
    if not 0.0 <= duration <= DURATION_MAX:
        raise ValueError(f"a tone of {duration} s; expected 0 to {DURATION_MAX}")
    return BuzzerMessage(round(frequency), round(duration / DURATION_SCALE), token)


class Buzzer(NamedTuple):
    """The buzzer."""

    token: int
    """Of the last tone that the board began in this session; 0: none."""
    age: float
    """Seconds since this was so."""
    valid: bool
    """Whether the value may be trusted."""


class PiezoBuzzer(SlowDevice, tag="buzzer", frozen=True, kw_only=True):
    """Piezo speaker."""

    pin: int | str

    READING: ClassVar = Buzzer
    NAMES: ClassVar[tuple[str, ...]] = ("buzzer",)
    PINS: ClassVar[dict[str, str]] = {"pin": ""}
    HEARS: ClassVar[frozenset[str]] = frozenset({"pin"})
    WIRES: ClassVar[tuple[Wire, ...]] = (Wire("pin", "+"), Wire(GROUND, "-"))
    NEEDS: ClassVar[dict[str, str]] = {"Timer0": ""}
    COLUMNS: ClassVar = (("token", "", 0),)
    SHOWN: ClassVar = ("token", "tones", 1.0, 0)

    def checkup(self, readings: Sequence[Buzzer]) -> Checkup:
        """See `Device`."""
        return Checkup("silent" if readings[-1].token == 0 else "a tone has sounded", "silent")

    def reading(self, message: Any, name: str, age: float, fresh: bool) -> Buzzer:
        """See `SlowDevice`."""
        return Buzzer(message.buzzer_token, age, fresh)
