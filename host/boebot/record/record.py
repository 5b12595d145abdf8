"""The record of a run: an append-only sequence of (stream, time, bytes), and what its streams mean.

While a run goes on, only that is kept. Everything else is made of it (boebot.record.columns, overview).

stream              time, s                     bytes
to_board, to_host   transport's clock           as they crossed the wire, piece by piece
telemetry           the run's, of the tick      the payload; then host time of the tick and its error bound (s), doubles
NAME of a message   that of the newest tick     the payload of a message of slow devices (`devices_telemetry`)
event               the board's, since reset    kind, value, whether it was before the session
readings            the run's, of the step      of a robot without a board: tick, status, motor signals, ages, readings
command             that of the observation     kind (index of KINDS), left, right: what the brain asked for in one step
clock               0                           the transport's clock at the run's time 0 (s)
truth               the world's                 of a simulated robot: doubles, `boebot.boards.TRUTH` without the time
pins                transport's clock           of an emulated board, if asked for: a pin's Arduino number and its level
inputs              transport's clock           likewise of the ATmega328P: what the outside drives a pin to
line_in, line_out   transport's clock, start    likewise: a frame on its line, to it and from it: `LINE_FRAME`
waits               the world's                 a moving shape has begun or ended to wait for a robot: shape, waited (s)
shifts              the world's                 a moving shape was put elsewhere: shape, by how much it is off its way
                                                from then on (m, m, rad)
brain_step          the run's, of the step      of a brain of processes, doubles: index of the active motor behavior,
                                                state variables, utilities, gammas
switch              the run's, of the step      of a brain of processes, JSON: what became inactive, active, and why
shown               the run's, of the step      JSON: what the brain shows from then on, by name
sketch              the run's, of the step      JSON: what a layer of its sketches shows (`boebot.showing.Sketch`)
intervention        the run's, of the step      JSON: what a person did before that step (boebot.running.hands)
vehicle, movers     the run's, of the step      of a vehicle stepped by hand
"""

from __future__ import annotations

import hashlib
import pickle
import time as wall
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from struct import Struct
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import zstandard
from numpy.typing import NDArray

from boebot.devices.readings import Readings
from boebot.link.delivery import BoardEvent
from boebot.record.blocks import EMPTY, Block, Group, Row, Rows, chain, group_of, joined, merged

if TYPE_CHECKING:
    from boebot.record.record_file import RecordWriter

Append = Callable[[str, float, bytes], None]

EACH_S = 1.0  # wall time that a group spans at most
STEPS_AT_MOST = 5_000  # steps of the brain in a group: a fast run takes no more memory than a slow one
PLAIN = 8  # groups in memory that are not packed
WORLD = ("waits", "shifts")  # streams of a world, not of one of its robots
KINDS = ("stop", "signal", "speed")  # of commands
_STAMP = Struct("<dd")
COMMAND = np.dtype([("kind", "u1"), ("left", "<f8"), ("right", "<f8")])
LINE_FRAME = np.dtype(
    [("bit_time", "<u8"), ("bits", "u1"), ("byte", "u1")]
)  # cycles of 62.5 ns / 65536; with start, stop
LOW, HIGH, RELEASED, PULLED_UP = range(4)  # what is done to a pin
_COMMAND = Struct("<Bdd")
_EVENT = Struct("<BIB")
_CLOCK = Struct("<d")
_READINGS = Struct("<IHdd")


def net_level(board: int, outside: int, line_out: int = HIGH) -> int:
    """Of a pin to which they do that, LOW or HIGH, or RELEASED where it floats: what the board does; where it
    has let go of the pin, what the outside does, and else HIGH by its pull-up. `line_out`: what the transmitter does to
    its pin."""
    if board in (LOW, HIGH):
        return min(board, line_out)
    return outside if outside in (LOW, HIGH) else HIGH if board == PULLED_UP else RELEASED


def readings_row(count: int) -> np.dtype[np.void]:
    """Of a robot without a board that has `count` readings."""
    numbers = [("left", "<f8"), ("right", "<f8"), ("ages", "<f8", (count,)), ("values", "<f8", (count,))]
    return np.dtype([("tick", "<u4"), ("status", "<u2"), *numbers])


class Keeper(Protocol):
    """Has the groups of a record."""

    def groups(self) -> Iterator[Group]:
        """All of them, oldest first."""


class InMemory:
    """In this process: the newest groups as they are. What is `written` goes to a file, too: of that older groups are
    read again; else they are packed."""

    def __init__(self) -> None:
        self.written: RecordWriter | None = None
        self._groups: list[Group | bytes | None] = []  # None: only written

    def write(self, rows: Rows, time_s: float) -> None:
        """Keeps rows that end at that time of the run (s), as a group.

        Raises:
            RecordError: they cannot be written.
        """
        group = group_of(rows)
        self._groups.append(group)
        if self.written is not None:
            self.written.write(group, time_s)
        if len(self._groups) > PLAIN:
            oldest = self._groups[-PLAIN - 1]
            self._groups[-PLAIN - 1] = None if self.written else zstandard.compress(pickle.dumps(oldest))

    def groups(self) -> Iterator[Group]:
        """See `Keeper`. What could not be written is missing; the run has ended by that.

        Raises:
            RecordError: what was written cannot be read.
        """
        on_disk = self.written.groups() if self.written and None in self._groups else iter(())
        for group in self._groups.copy():
            read = next(on_disk, None)
            found = pickle.loads(zstandard.decompress(group)) if isinstance(group, bytes) else group or read
            if found is not None:
                yield found


class Record:
    """A record: written row by row while the run goes on, read by stream afterwards."""

    def __init__(self, kept: Keeper | None = None, prefix: str = "") -> None:
        """Kept there; None: in memory. `prefix`: of the names of its streams there, as "robot-2/" of one of several
        robots; those of the world have none, and are every robot's."""
        self._kept = InMemory() if kept is None else kept
        self._prefix = prefix
        self._rows: defaultdict[str, list[Row]] = defaultdict(list)
        self._waiting: list[Group] = []  # to be kept, before those rows
        self._room = STEPS_AT_MOST  # steps of the brain until rows are due
        self._news: list[Group] | None = None  # that `news` has not given yet; None: nobody asks
        self._counts = None if kept else Counter[str]()  # of the rows that are kept; None: not known
        self._due_s = wall.perf_counter() + EACH_S

    @classmethod
    def of(cls, group: Group) -> Record:
        """In memory, of these rows alone."""
        record = cls()
        record.put(group)
        return record

    def __repr__(self) -> str:
        names = ("telemetry", "readings", "event", "command", "vehicle")
        return "<Record: " + ", ".join(f"{count} {name}" for name in names if (count := self.count(name))) + ">"

    # ---- writing -----------------------------------------------------------------------------------------------------

    def append(self, stream: str, time_s: float, data: bytes) -> None:
        """A row at the end of a stream."""
        self._rows[stream].append((time_s, data))

    def is_due(self) -> bool:
        """A second of the wall clock has passed since rows were last handed over to be kept, or there are many."""
        return wall.perf_counter() >= self._due_s or len(self._rows["command"]) >= self._room

    def keep(self, time_s: float) -> None:
        """Hands over the rows so far to be kept, as a group; `time_s`: of the run.

        Raises:
            RecordError: they cannot be kept.
        """
        self._due_s = wall.perf_counter() + EACH_S
        self._settle()
        group, self._waiting, self._room = merged(self._waiting), [], STEPS_AT_MOST
        if group:
            self._counted(group)
            assert isinstance(self._kept, InMemory)
            named = {name if name in WORLD else self._prefix + name: block for name, block in group.items()}
            self._kept.write(named, time_s)

    def put(self, group: Group) -> None:
        """Rows of streams that come in blocks: they wait to be kept with the others."""
        self._settle()
        self._add(group)

    def news(self) -> Group:
        """The rows that came since this was last asked; of the first time only those that are not kept yet."""
        self._settle()
        new, self._news = self._waiting if self._news is None else self._news, []
        return merged(new)

    def _settle(self) -> None:
        """Makes blocks of the rows so far."""
        self._room -= len(self._rows["command"])
        self._add(group_of(self._rows))
        self._rows = defaultdict(list)

    def _add(self, group: Group) -> None:
        if group:
            self._waiting.append(group)
            if self._news is not None:
                self._news.append(group)

    def _counted(self, group: Group) -> None:
        if self._counts is not None:
            self._counts.update({stream: len(block) for stream, block in group.items()})

    def append_telemetry(self, time_s: float, payload: bytes, host_s: float, bound_s: float) -> None:
        """One tick of a board."""
        self.append("telemetry", time_s, payload + _STAMP.pack(host_s, bound_s))

    def append_readings(self, time_s: float, sample: Readings, left: float, right: float) -> None:
        """One step of a robot without a board, and the motor signals in force."""
        numbers = Struct(f"<{len(sample.ages)}d{len(sample.values)}d").pack(*sample.ages, *sample.values)
        self.append("readings", time_s, _READINGS.pack(sample.tick, sample.status, left, right) + numbers)

    def append_command(self, time_s: float, kind: str, left: float, right: float) -> None:
        """What the brain asked for in one step."""
        self.append("command", time_s, _COMMAND.pack(KINDS.index(kind), left, right))

    def append_clock(self, offset_s: float) -> None:
        """The transport's clock (s) at the run's time 0."""
        self.append("clock", 0.0, _CLOCK.pack(offset_s))

    def append_event(self, event: BoardEvent) -> None:
        """What the board sends exactly once."""
        self.append("event", event.time, _EVENT.pack(event.kind, event.value, event.earlier))

    # ---- reading -----------------------------------------------------------------------------------------------------

    def groups(self) -> Iterator[Group]:
        """What is kept, and what waits to be, oldest first; each group by itself is small."""
        self._settle()
        yield from self._kept_groups()
        yield from self._waiting

    def _kept_groups(self) -> Iterator[Group]:
        for group in self._kept.groups():
            own = [name for name in group if name in WORLD or name.startswith(self._prefix)]
            if own:
                yield {name.removeprefix(self._prefix): group[name] for name in own}

    def count(self, stream: str) -> int:
        """Rows of a stream."""
        if self._counts is None:
            self._counts = Counter()
            for group in self._kept_groups():
                self._counted(group)
        waiting = sum(len(block) for block in chain(self._waiting, stream))
        return self._counts[stream] + waiting + len(self._rows.get(stream, ()))

    def rows(self, stream: str) -> list[Row]:
        """The rows of a stream, oldest first."""
        return list(self.each_row(stream))

    def each_row(self, stream: str) -> Iterator[Row]:
        """The same one by one: never all of them in memory."""
        for block in self.blocks(stream):
            yield from block.rows()

    def streams(self) -> set[str]:
        """Names of those that have rows."""
        return {name for group in self.groups() for name in group}

    def table(self, stream: str, dtype: np.dtype[Any]) -> NDArray[Any]:
        """The rows of a stream whose rows all have this form, shape (rows,)."""
        return self.block(stream).table(dtype)

    def times_of(self, stream: str) -> NDArray[np.float64]:
        """Of each row of a stream (s), shape (rows,)."""
        blocks = [block.times for block in self.blocks(stream)]
        return np.concatenate(blocks) if blocks else np.empty(0)

    def digest(self, *streams: str) -> str:
        """SHA-256 of these streams, whose rows have a fixed size, in hexadecimal digits: that of the digests of each
        one's times (doubles) and of its rows' bytes. However the rows came in groups, it is the same."""
        sums = [(stream, hashlib.sha256(), hashlib.sha256()) for stream in streams]
        for group in self.groups():
            for stream, times, rows in sums:
                if stream in group:
                    times.update(group[stream].times.astype("<f8").tobytes())
                    rows.update(group[stream].data)
        return hashlib.sha256(b"".join(times.digest() + rows.digest() for _, times, rows in sums)).hexdigest()

    def span(self, stream: str) -> tuple[float, float]:
        """Times of the first and the last row of a stream (s); 0 where it has none."""
        begin_s = end_s = None
        for block in self.blocks(stream):
            begin_s = float(block.times[0]) if begin_s is None else begin_s
            end_s = float(block.times[-1])
        return begin_s or 0.0, end_s or 0.0

    @property
    def ticks(self) -> int:
        """How many ticks or steps there are."""
        return self.count(self.tick_stream)

    @property
    def clock_offset(self) -> float:
        """The transport's clock (s) at the run's time 0; 0 where that is not known."""
        rows = self.rows("clock")
        return float(_CLOCK.unpack(rows[-1][1])[0]) if rows else 0.0

    @property
    def events(self) -> list[BoardEvent]:
        """What the board sent exactly once."""
        return [event_of(row) for row in self.each_row("event")]

    @property
    def steps(self) -> list[tuple[int, str, float, float]]:
        """(index of the tick of the observation, command kind, left, right), one per step of the brain."""
        block = self.block("command")
        ticks = np.searchsorted(self.times_of(self.tick_stream), block.times, side="right") - 1
        rows = zip(ticks.tolist(), block.table(COMMAND).tolist(), strict=True)
        return [(tick, KINDS[kind], left, right) for tick, (kind, left, right) in rows]

    @property
    def tick_stream(self) -> str:
        """That of the ticks: telemetry of a board, or readings of a robot without one."""
        return "telemetry" if self.count("telemetry") else "readings"

    def blocks(self, stream: str) -> Iterator[Block]:
        """The rows of a stream in blocks, each small."""
        return chain(self.groups(), stream)

    def block(self, stream: str) -> Block:
        """All of them in one block."""
        blocks = list(self.blocks(stream))
        return joined(*blocks) if blocks else EMPTY


class Unrecorded(Record):
    """The record of a run that is not recorded: it stays empty, and counts the steps of the brain."""

    _steps = 0

    def append_command(self, time_s: float, kind: str, left: float, right: float) -> None:
        """It is counted."""
        self._steps += 1

    def count(self, stream: str) -> int:
        """Of commands, how many there were; of other streams 0: they are not counted."""
        return self._steps if stream == "command" else 0

    def append(self, stream: str, time_s: float, data: bytes) -> None:
        """Nothing is kept."""

    def put(self, group: Group) -> None:
        """Nothing is kept."""

    def keep(self, time_s: float) -> None:
        """Nothing is kept."""
        self._due_s = wall.perf_counter() + EACH_S


def event_of(row: Row) -> BoardEvent:
    """A row of the stream "event"."""
    kind, value, earlier = _EVENT.unpack(row[1])
    return BoardEvent(kind, value, row[0], bool(earlier))
