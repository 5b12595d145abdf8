"""What the interrupts of a board are asked for: the loads that its timing is judged under.

A load says how often each interrupt comes; for one that it does not name, the image's own table says how often it can.
"figures" is use as it is meant, with every usual device at its fastest; then nothing is lost. "everything" has the
other devices, too. "overload" is more than can be worked off: the most that the line and four encoder lines can bring,
and noise on one of these. Then the tick and the pulses of the servos are kept, and bytes and edges may be lost.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from avr_timing.interrupts.byte_reads import RECEIVE
from avr_timing.interrupts.response import Source, Spell
from boebot.errors import BoebotError
from boebot.link import messages
from boebot.link.frame import FRAME_OVERHEAD
from boebot_timing.table import Constants, InterruptRow

TICK = 160_000  # cycles, at 16 MHz
BYTE = 320  # cycles of a byte at 500,000 bit/s
# Vectors of the ATmega328P (data sheet, table 12-6), numbered as in __vector_N.
ENCODERS, STAMP, WATCHDOG, CARRIER, CAPTURE, EDGE, SLOT, BUZZER = 4, 5, 6, 7, 10, 11, 12, 14
SEND, EEPROM, TWO_WIRE = 19, 22, 24
VECTORS = 25

_TELEMETRY = messages.Telemetry.LENGTH + FRAME_OVERHEAD
_DEVICES = messages.DevicesTelemetry.LENGTH + FRAME_OVERHEAD
_OWN = messages.Counters.LENGTH + FRAME_OVERHEAD  # or one task's time, which is shorter
_HELLO = messages.Hello.LENGTH + FRAME_OVERHEAD
_SET_POINT = messages.SetpointSignal.LENGTH + FRAME_OVERHEAD
_REQUEST = messages.SetParameter.LENGTH + FRAME_OVERHEAD


@dataclass(frozen=True, slots=True)
class Stream:
    """Requests at least `interval` cycles apart, and for each (n, period) of `bursts` at most n in each period.

    Interval 0: the table's own. `close` more may come at once, early by that many intervals.
    """

    interval: int = 0
    bursts: tuple[tuple[int, int], ...] = ()
    close: int = 0
    parts: tuple[tuple[int, int], ...] = ()  # together at most the sum of n in each period
    spells: tuple[Spell, ...] = ()  # of a servo frame, in which alone they come

    def source(self, row: InterruptRow, cycles: int) -> Source:
        """As what asks for an interrupt of that many cycles."""
        interval = self.interval or row.interval
        period = 2 * TICK if self.spells else 1
        early = self.close * interval
        return Source(
            row.name, cycles, interval, early, self.bursts, parts=self.parts, spells=self.spells, period=period
        )


@dataclass(frozen=True, slots=True)
class Load:
    """Streams by vector, several where several lines share one; vectors in `off` are not asked for at all.

    The host's frames are of at least `frame_least` bytes, and come as the line carries them, or in `frame_bursts`.
    `is_overload`: bytes and edges may be lost, and an encoder line is noisy. Interrupts in `may_be_late` may wait
    longer than their rows of the image's table allow.
    """

    name: str
    says: str
    streams: Mapping[int, tuple[Stream, ...]]
    frame_bursts: tuple[tuple[int, int], ...]
    frame_least: int
    off: frozenset[int] = field(default_factory=frozenset)
    is_overload: bool = False
    may_be_late: frozenset[int] = field(default_factory=frozenset)

    def sources(self, row: InterruptRow, cycles: int) -> list[Source]:
        """What asks for an interrupt that takes that many cycles."""
        if row.vector in self.off:
            return []
        return [one.source(row, cycles) for one in self.streams.get(row.vector, (Stream(),))]

    def requests(self, row: InterruptRow, constants: Constants) -> list[Source]:
        """What asks for an interrupt at the worst, one by one; a noisy line stops its interrupt soon."""
        if self.is_overload and row.vector == ENCODERS:  # those of a storm, before it masks itself
            return [Stream(close=constants.changes_storm - 1).source(row, 1)]
        return self.sources(row, 1)


_EDGE_TO_EDGE = 9_600  # of servo pulses and ends of bursts, the closest: the turret's shortest pulse, 600 us (servo.h)
# Cycles in which three of them can be: the left wheel's longest pulse ends 37,200 into slot 0, the right wheel's
# shortest begins 10,000 into slot 1 and ends 30,800 into it; four: with the left pulse's beginning.
_THREE_EDGES, _FOUR_EDGES = 33_600, 60_800
_ECHO = 115 * 16  # the shortest, from rise to fall
_HALF_PERIOD = 190  # of the carrier's highest frequency
_BUS_STEP = 160  # the shortest of the two-wire bus, a bit at 100 kHz
# What comes n times in a period P, each up to J late, comes at most n times in any P - J.
_TASK = TICK  # by which what a task begins is off at most: no task ends in another tick
_BURST, _BURST_LATE = 76, 4_000  # edges of the carrier in 1 ms; by which its burst begins late. It is in slots 2 and 3
_ECHOES_DIFFER = 294_160  # echoes of 115 us and of 18.5 ms
_TURRETS_DIFFER = 28_800  # the turret's pulses of 600 us and of 2,400 us
_COMPASS = Stream(_BUS_STEP, ((11, 4 * TICK - _TASK),))
# In a servo frame: two edges of two wheels and of the turret.
_SLOT_CYCLES, _RISE, _BURST_CYCLES = TICK // 4, 10_000, 16_036  # from a slot's begin to the rise (servo.c); of a burst
_EARLY, _LATE = 2_000, 4_000  # by which a request is before what it is for, and by which it may wait
_EDGES_OF = {0: 37_200, 1: 37_200, 4: 48_400}  # slots of the servos, and when the longest pulse ends (tasks.def)
_SERVO_EDGES = Stream(
    _EDGE_TO_EDGE,
    ((2, _THREE_EDGES), (3, _FOUR_EDGES), (6, 2 * TICK - _TURRETS_DIFFER)),
    spells=tuple(
        Spell(slot * _SLOT_CYCLES + _RISE - _EARLY, slot * _SLOT_CYCLES + end + _LATE, 2, _EDGE_TO_EDGE)
        for slot, end in _EDGES_OF.items()
    ),
)
_SWEEP = Stream(
    _HALF_PERIOD,
    ((_BURST, TICK // 4 - _BURST_LATE), (2 * _BURST, TICK - _BURST_LATE)),
    spells=tuple(
        Spell(slot * _SLOT_CYCLES, slot * _SLOT_CYCLES + _BURST_CYCLES + _LATE, _BURST, _HALF_PERIOD)
        for slot in (2, 3, 6, 7)
    ),
)
_ECHOES = Stream(_ECHO, ((2, 4 * TICK - _TASK - _ECHOES_DIFFER),))  # rise and fall; the shortest period is four ticks
# What leaves while slots keep the main loop from polls: what the send ring held, 127 bytes, the answer of a poll
# before, and one message of each task that sends in a tick, two of events.
_EVENT = messages.Event.LENGTH + FRAME_OVERHEAD
_ANSWERS = messages.Answer.LENGTH + FRAME_OVERHEAD
_LONGEST = messages.Identity.LENGTH + FRAME_OVERHEAD
_LONGEST_OF_POLL = messages.Description.LENGTH + FRAME_OVERHEAD
SENT_WHILE_BUSY = (
    (127 + _LONGEST_OF_POLL, 1 << 30),
    (_TELEMETRY + _DEVICES + _OWN + _LONGEST + 2 * _EVENT + _ANSWERS, TICK),
)
# What a board says by itself, at its fastest. The first byte goes on to the shift register, and a second is asked for
# at once (data sheet, 20.6.3: UDRE0).
_SENDING = Stream(
    BYTE, close=1, parts=((_TELEMETRY, TICK), (_DEVICES, 2 * TICK), (_OWN, 4 * TICK), (_HELLO, 20 * TICK))
)
# A light sensor's edge, once in a servo frame, after its release and before slot 7, which charges it (light.c).
_LIGHT = Stream(TICK // 4, ((2, 2 * TICK),))
_WHEEL = Stream(16_000_000 // 1_510)  # an encoder's line of 1,500 edges/s, a little faster than it should be
_NOISE = Stream(160, ((16, TICK),))  # 100,000 edges/s mask the line after some five a tick; two ticks may be close
_SET_POINTS = 159_000  # the host's tick, by a clock that is 0.6 % fast
_DEVICES_OFF = frozenset({WATCHDOG, STAMP, BUZZER, EEPROM, TWO_WIRE})  # the watchdog's comes when all is lost

LOADS: dict[str, Load] = {
    "figures": Load(
        "figures",
        "100 Hz tick, both servos, four encoder lines of 1,500 edges/s, IR sweep, Ping at its fastest, telemetry and a "
        "set-point each tick",
        {
            RECEIVE: (Stream(BYTE, ((_SET_POINT, _SET_POINTS),)),),
            SEND: (_SENDING,),
            ENCODERS: (_WHEEL,) * 4,
            EDGE: (_SERVO_EDGES,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_bursts=((1, _SET_POINTS),),
        frame_least=_SET_POINT,
        off=_DEVICES_OFF,
    ),
    "overload": Load(
        "overload",
        "the same with the line full both ways, 50,000 bytes/s each, four encoder lines of 4,000 edges/s, and noise of "
        "100,000 edges/s on one",
        {
            RECEIVE: (Stream(BYTE),),
            SEND: (Stream(BYTE, close=1),),
            ENCODERS: (*(Stream(16_000_000 // 4_000),) * 3, _NOISE),  # what comes on a noisy line is its noise
            EDGE: (_SERVO_EDGES,),
            CARRIER: (_SWEEP,),
            CAPTURE: (_ECHOES,),
        },
        frame_bursts=(),
        frame_least=_REQUEST,
        off=_DEVICES_OFF,
        is_overload=True,
        may_be_late=frozenset(range(1, VECTORS + 1)) - {EDGE, SLOT},
    ),
}
LOADS["everything"] = replace(
    LOADS["figures"],
    name="everything",
    says="the load of the figures with every device built in: light, a tone of 8 kHz, compass, parameters being "
    "stored, and answers that fill the line",
    streams={
        **LOADS["figures"].streams,
        SEND: (Stream(BYTE, close=1),),  # answers may fill the line
        ENCODERS: (*LOADS["figures"].streams[ENCODERS], _LIGHT),
        STAMP: (_LIGHT,),
        BUZZER: (Stream(),),
        EEPROM: (Stream(),),
        TWO_WIRE: (_COMPASS,),
    },
    off=frozenset({WATCHDOG}),
    may_be_late=frozenset({RECEIVE}),  # so that no byte is lost is measured then, and not proven
)


# Never together, by the slots of a servo frame (tasks.def): no edge of a servo comes within 2,500 cycles of a burst,
# and a burst, which begins with a slot, has ended long before the next one.
NEVER_NEAR = (EDGE, CARRIER)
APART = {EDGE: frozenset({CARRIER}), SLOT: frozenset({CARRIER})}


def load_named(name: str) -> Load:
    """Raises BoebotError where there is none of that name."""
    if name not in LOADS:
        raise BoebotError(f"there is no load {name!r}; expected {' or '.join(LOADS)}")
    return LOADS[name]
