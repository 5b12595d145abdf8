"""What the interrupts of a board are asked for: the loads that its timing is judged under.

A load says how often each interrupt comes; for one that it does not name, the image's own table says how often it can.
The two stand for use as it is meant, with every usual device at its fastest, and for the most that the line and four
encoder lines can bring.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from boebot.errors import BoebotError
from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from boebot.timing.program import InterruptRow
from boebot.timing.response import Source

TICK = 160_000  # cycles, at 16 MHz
BYTE = 320  # cycles of a byte at 500,000 bit/s
# Vectors of the ATmega328P (data sheet, table 12-6), numbered as in __vector_N.
ENCODERS, STAMP, CARRIER, CAPTURE, EDGE, SLOT, BUZZER = 4, 5, 7, 10, 11, 12, 14
RECEIVE, SEND, EEPROM, TWO_WIRE = 18, 19, 22, 24

_TELEMETRY = messages.Telemetry.LENGTH + FRAME_OVERHEAD
_DEVICES = messages.DevicesTelemetry.LENGTH + FRAME_OVERHEAD
_SET_POINT = messages.SetpointSignal.LENGTH + FRAME_OVERHEAD


@dataclass(frozen=True, slots=True)
class Stream:
    """Requests at least `interval` cycles apart, where given at most `burst` in each `period`; interval 0: the table's
    own."""

    interval: int = 0
    burst: int = 0
    period: int = 0


@dataclass(frozen=True, slots=True)
class Load:
    """Streams by vector, several where several lines share one; vectors in `off` are not asked for at all.

    The host's frames are at least `frame_least` bytes long and at most `frame_most`; `frame_burst`: so many in so many
    cycles, (0, 0): as the line carries them.
    """

    name: str
    says: str
    streams: Mapping[int, tuple[Stream, ...]]
    frame_burst: tuple[int, int]
    frame_least: int
    frame_most: int
    off: frozenset[int] = field(default_factory=frozenset)
    byte_interval: int = BYTE

    def sources(self, row: InterruptRow, cycles: int) -> list[Source]:
        """What asks for an interrupt that takes so many cycles."""
        if row.vector in self.off:
            return []
        return [
            Source(row.name, cycles, one.interval or row.interval, 0, one.burst, one.period)
            for one in self.streams.get(row.vector, (Stream(),))
        ]


_SERVOS_AND_BURSTS = Stream(0, 10, 2 * TICK)  # two edges of two wheels and the turret, two ends of IR bursts a tick
_SWEEP = Stream(0, 2 * 85, TICK)  # two bursts of 1 ms in each tick, at the highest of its frequencies 85 toggles each
_ECHOES = Stream(0, 2, 4 * TICK)  # rise and fall; the Ping's shortest period is four ticks
_DEVICES_OFF = frozenset({STAMP, BUZZER, EEPROM, TWO_WIRE})

LOADS: dict[str, Load] = {
    "figures": Load(
        "figures",
        "100 Hz tick, both servos, two encoder lines of 1,500 edges/s, IR sweep, Ping at its fastest, telemetry and a "
        "set-point each tick",
        {
            RECEIVE: (Stream(BYTE, _SET_POINT, TICK),),
            SEND: (Stream(BYTE, 2 * _TELEMETRY + _DEVICES, 2 * TICK),),
            ENCODERS: (Stream(16_000_000 // 1_500),) * 2,
            EDGE: (_SERVOS_AND_BURSTS,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_burst=(1, TICK),
        frame_least=_SET_POINT,
        frame_most=_SET_POINT,
        off=_DEVICES_OFF,
    ),
    "saturated": Load(
        "saturated",
        "the same with valid frames of 20 to 40 bytes, 50,000 bytes/s each way, four encoder lines of 4,000 edges/s",
        {
            RECEIVE: (Stream(BYTE),),
            SEND: (Stream(BYTE),),
            ENCODERS: (Stream(16_000_000 // 4_000),) * 4,
            EDGE: (_SERVOS_AND_BURSTS,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_burst=(0, 0),
        frame_least=20,
        frame_most=40,
        off=_DEVICES_OFF,
    ),
}


def load_named(name: str) -> Load:
    """Raises BoebotError where there is none of that name."""
    if name not in LOADS:
        raise BoebotError(f"there is no load {name!r}; expected {' or '.join(LOADS)}")
    return LOADS[name]
