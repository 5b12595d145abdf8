"""What the interrupts of a board are asked for: the loads that its timing is judged under.

A load says how often each interrupt comes; for one that it does not name, the image's own table says how often it can.
The two stand for use as it is meant, with every usual device at its fastest, and for the most that the line and four
encoder lines can bring.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from boebot.errors import BoebotError
from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from boebot.timing.program import Constants, InterruptRow, Program
from boebot.timing.response import Source

TICK = 160_000  # cycles, at 16 MHz
BYTE = 320  # cycles of a byte at 500,000 bit/s
# Vectors of the ATmega328P (data sheet, table 12-6), numbered as in __vector_N.
ENCODERS, STAMP, WATCHDOG, CARRIER, CAPTURE, EDGE, SLOT, BUZZER = 4, 5, 6, 7, 10, 11, 12, 14
RECEIVE, SEND, EEPROM, TWO_WIRE = 18, 19, 22, 24

_TELEMETRY = messages.Telemetry.LENGTH + FRAME_OVERHEAD
_DEVICES = messages.DevicesTelemetry.LENGTH + FRAME_OVERHEAD
_OWN = messages.Counters.LENGTH + FRAME_OVERHEAD  # or one task's time, which is shorter
_HELLO = messages.Hello.LENGTH + FRAME_OVERHEAD
_SET_POINT = messages.SetpointSignal.LENGTH + FRAME_OVERHEAD
_REQUEST = messages.SetParameter.LENGTH + FRAME_OVERHEAD


@dataclass(frozen=True, slots=True)
class Stream:
    """Requests at least `interval` cycles apart, and for each (n, period) of `bursts` at most n in each period.

    Interval 0: the table's own. So many as `close` more may come at once, early by so many intervals.
    """

    interval: int = 0
    bursts: tuple[tuple[int, int], ...] = ()
    close: int = 0

    def source(self, row: InterruptRow, cycles: int) -> Source:
        """As what asks for an interrupt of so many cycles."""
        interval = self.interval or row.interval
        return Source(row.name, cycles, interval, self.close * interval, self.bursts)


@dataclass(frozen=True, slots=True)
class Load:
    """Streams by vector, several where several lines share one; vectors in `off` are not asked for at all.

    The host's frames are of at least `frame_least` bytes, and come as the line carries them, or in `frame_bursts`.
    """

    name: str
    says: str
    streams: Mapping[int, tuple[Stream, ...]]
    frame_bursts: tuple[tuple[int, int], ...]
    frame_least: int
    off: frozenset[int] = field(default_factory=frozenset)
    byte_interval: int = BYTE

    def sources(self, row: InterruptRow, cycles: int) -> list[Source]:
        """What asks for an interrupt that takes so many cycles."""
        if row.vector in self.off:
            return []
        return [one.source(row, cycles) for one in self.streams.get(row.vector, (Stream(),))]

    @property
    def is_full(self) -> bool:
        """Frames come back to back."""
        return not self.frame_bursts

    def without_answers(self) -> Load:
        """The same, where the board says what it says by itself and no more; with a tone, which frames can bring."""
        return replace(self, streams={**self.streams, SEND: OWN_SENDING}, off=self.off - {BUZZER})

    def is_calm(self, latency: int, said: Constants) -> bool:
        """No line of the encoders is ever stopped for coming too often, when its interrupt waits so long at most: of
        more changes than there are lines two are of one line, and a tick has no more of a line than the limit."""
        lines = self.streams.get(ENCODERS, ())
        closest = max(said.changes_storm * said.changes_close + latency, TICK // said.encoder_limit)
        return 0 < len(lines) <= said.changes_storm and all(line.interval > closest for line in lines)


_EDGE_TO_EDGE = 9_600  # of servo pulses and ends of bursts, the closest: the turret's shortest pulse, 600 us (servo.h)
# Cycles in which three of them can be: the left wheel's longest pulse ends 35,200 into slot 0, the right wheel's
# shortest begins 8,000 into slot 1 and ends 28,800 into it; four: and the burst ends 16,000 into slot 2.
_THREE_EDGES, _FOUR_EDGES = 33_600, 60_800
_ECHO = 115 * 16  # the shortest, from rise to fall
_HALF_PERIOD = 190  # of the carrier's highest frequency
_BUS_STEP = 160  # the shortest of the two-wire bus, a bit at 100 kHz
_BURST, _BURST_TO_BURST = 85, 39_000  # edges of the carrier in 1 ms, at its highest; bursts are in slots 2 and 3
_COMPASS = Stream(_BUS_STEP, ((11, 4 * TICK),))
# In a servo frame: two edges of two wheels and of the turret, and four ends of IR bursts.
_SERVOS_AND_BURSTS = Stream(_EDGE_TO_EDGE, ((2, _THREE_EDGES), (3, _FOUR_EDGES), (10, 2 * TICK)))
_SWEEP = Stream(_HALF_PERIOD, ((_BURST, _BURST_TO_BURST), (2 * _BURST, TICK)))
_ECHOES = Stream(_ECHO, ((2, 4 * TICK),))  # rise and fall; the Ping's shortest period is four ticks
# What a board says by itself, at its fastest.
OWN_SENDING = (
    Stream(BYTE, ((_TELEMETRY, TICK),)),
    Stream(BYTE, ((_DEVICES, 2 * TICK),)),
    Stream(BYTE, ((_OWN, 4 * TICK),)),
    Stream(BYTE, ((_HELLO, 20 * TICK),)),
)
_DEVICES_OFF = frozenset({WATCHDOG, STAMP, BUZZER, EEPROM, TWO_WIRE})  # the watchdog's comes when all is lost

LOADS: dict[str, Load] = {
    "figures": Load(
        "figures",
        "100 Hz tick, both servos, two encoder lines of 1,500 edges/s, IR sweep, Ping at its fastest, telemetry and a "
        "set-point each tick",
        {
            RECEIVE: (Stream(BYTE, ((_SET_POINT, TICK),)),),
            SEND: OWN_SENDING,
            ENCODERS: (Stream(16_000_000 // 1_500),) * 2,
            EDGE: (_SERVOS_AND_BURSTS,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_bursts=((1, TICK),),
        frame_least=_SET_POINT,
        off=_DEVICES_OFF,
    ),
    "saturated": Load(
        "saturated",
        "the same with frames of 15 and 16 bytes back to back (longer ones would be fewer), 50,000 bytes/s each way, "
        "four encoder lines of 4,000 edges/s",
        {
            RECEIVE: (Stream(BYTE),),
            SEND: (Stream(BYTE),),
            ENCODERS: (Stream(16_000_000 // 4_000),) * 4,
            EDGE: (_SERVOS_AND_BURSTS,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_bursts=(),
        frame_least=_REQUEST,
        off=_DEVICES_OFF,
    ),
}
LOADS["everything"] = replace(
    LOADS["figures"],
    name="everything",
    says="the load of the figures with every device built in: light, a tone of 8 kHz, compass, parameters being stored",
    streams={
        **LOADS["figures"].streams,
        STAMP: (Stream(0, ((1, 2 * TICK),)),),
        BUZZER: (Stream(),),
        EEPROM: (Stream(),),
        TWO_WIRE: (_COMPASS,),
    },
    off=frozenset({WATCHDOG}),
)


# What can come at the worst, whatever the load, where the table's interval is not the least.
_DENSEST: dict[int, Stream] = {
    CARRIER: _SWEEP,
    CAPTURE: _ECHOES,
    EDGE: _SERVOS_AND_BURSTS,
    SEND: Stream(close=1),  # the first byte goes on to the shift register at once
    EEPROM: Stream(close=1),  # ready when it is first asked
    TWO_WIRE: _COMPASS,
}


# Never together, by the slots of a servo frame (tasks.def): an exact edge of the wheels' servos meets no burst and no
# slot's begin. (Others of the same interrupt do, and may be late: the turret's edge, the end of a burst.)
APART = {EDGE: frozenset({CARRIER, SLOT})}


def densest(row: InterruptRow, program: Program) -> list[Source]:
    """The most requests of an interrupt in any time, one by one."""
    if row.vector == ENCODERS:  # with the first of a storm and those that make it one, before it masks itself
        return [Stream(close=program.constants.changes_storm).source(row, 1)]
    return [_DENSEST.get(row.vector, Stream()).source(row, 1)]


def load_named(name: str) -> Load:
    """Raises BoebotError where there is none of that name."""
    if name not in LOADS:
        raise BoebotError(f"there is no load {name!r}; expected {' or '.join(LOADS)}")
    return LOADS[name]
