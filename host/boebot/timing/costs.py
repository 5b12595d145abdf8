"""What the pieces of a board's schedule cost, from its image alone: tasks, polls between them, interrupts.

Polls are taken apart. What one costs when nothing waits comes after each task; what it takes more to work off bytes, a
frame or an edge comes as often as these do, and so is counted with the interrupts that bring them: otherwise each of
some forty polls in a tick would be taken to find its ring full. Where bytes or edges come more often than polls, what
does not grow with their number is counted with the polls: no more than each can find some.

For this some functions of the firmware must be functions of the image too (SCHEDULER is refused otherwise, the others
are then counted with all that they can find): they are kept from being in line where they are declared. What a compiler
appends to a name (`.lto_priv.3`) does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from boebot.errors import TimingError
from boebot.timing.blocked import ENTRY, Blocked
from boebot.timing.constants import Context
from boebot.timing.latency import Latencies
from boebot.timing.loads import ENCODERS, RECEIVE, TICK, Load
from boebot.timing.loops import Loop, natural_loops, reverse_postorder
from boebot.timing.paths import Graph, Way, longest
from boebot.timing.program import Function, Program
from boebot.timing.response import Piece, Schedule, Source
from boebot.timing.wcet import Bound, WorstCase

SLOT_CYCLES = 40_000
SLOTS_PER_TICK = 4
DROPS_FROM = 2 * SLOTS_PER_TICK * SLOT_CYCLES  # so late, the scheduler drops ticks (begin_tick of schedule.c)
SCHEDULER, LOOP = "schedule_poll", "firmware_poll"
AROUND_TASK = ("task_begins", "between_tasks")  # called once for each task that runs
ENCODER_POLL, LINK_POLL = "encoder_poll", "link_poll"
TAKE, DECODE, ROOM = "link_take_frame", "frame_decode_end", "hal_serial_room"  # parts of a poll of the link
CLOCK = "schedule_now"  # that a poll of the encoders reads, whatever waits
RARE, OTHER = ("mask_line",), "see_other"  # parts of a poll of the encoders
PIECES = 2  # passes of loops of TAKE that are not over bytes


class Given(WorstCase):
    """Bounds in which certain functions take so many cycles, whatever they do: the rest is accounted for elsewhere."""

    def __init__(self, program: Program, cycles: Mapping[int, int]) -> None:
        super().__init__(program)
        self._given = cycles

    def bound(self, entry: int, context: Context | None = None) -> Bound:
        """See `WorstCase`."""
        return Bound(self._given[entry], (), {}) if entry in self._given else super().bound(entry, context)


@dataclass(frozen=True, slots=True)
class Costs:
    """Cycles of each piece."""

    tasks: dict[str, int]
    alone: dict[str, int]  # the same when the polls that tasks call themselves find nothing
    interrupts: dict[str, int]  # from acceptance to the end of RETI
    latencies: dict[str, int]  # from request to acceptance, under this load
    round: int  # of the main loop and the scheduler around a slot's tasks
    around: int  # one task's share of the scheduler, and the polls after it
    poll: int  # both polls, with all that they take whenever they are called
    frames: dict[int, int]  # more, to work off one frame of so many bytes
    change: int  # more, to work off one edge
    other: int  # more, when the edge is the light sensor's
    storm: int  # more, to stop a line that comes too often; 0: under this load none does
    taken: int  # more, to take bytes of a frame that has not ended, for each byte; 0: each poll is taken to do it

    def sources(self, program: Program, load: Load) -> list[Source]:
        """The interrupts under a load, and what they leave to the polls."""
        found = [one for row in program.table.interrupts for one in load.sources(row, self.interrupts[row.name])]
        for row in program.table.interrupts:
            if row.vector == ENCODERS and self.change:
                found += [replace(one, name="edges worked off") for one in load.sources(row, self.change)]
                found += [Source("light's edge worked off", self.other, 2 * TICK)] if self.other else []
                found += [Source("line stopped", self.storm, TICK)] if self.storm else []
            if row.vector == RECEIVE and self.frame:
                found += [self._frames(load)]
                found += [replace(one, name="bytes taken") for one in load.sources(row, self.taken) if self.taken]
        return found

    @property
    def frame(self) -> int:
        """More, to work off one frame of any length."""
        return max(self.frames.values())

    def _frames(self, load: Load) -> Source:
        """Frames of the length that takes most time for each byte; of the first, all but its last byte has come."""
        length = max(self.frames, key=lambda length: self.frames[length] / length)
        interval = load.byte_interval * length
        burst, period = load.frame_burst
        return Source("frames", self.frames[length], interval, interval - 1, burst, period)

    def schedule(self, program: Program) -> Schedule:
        """The slots of a whole cycle."""
        rows = program.table.tasks
        slots = []
        for slot in range(_slots(program)):
            pieces = [Piece("scheduler", self.round, 1)]
            pieces += [
                Piece(row.name, self.alone[row.name] + self.around, 1) for row in rows if slot % row.period == row.phase
            ]
            slots.append(tuple(pieces))
        blocking = self.round + self.frame + self.change + self.other + self.storm
        return Schedule(tuple(slots), SLOT_CYCLES, SLOTS_PER_TICK, blocking, DROPS_FROM)


def costs(program: Program, load: Load) -> Costs:
    """Of an image; how long a frame is, and so how long it takes, is the load's.

    Raises:
        TimingError: a task or the scheduler is no function, or has no bound.
    """
    worst, table = WorstCase(program), program.table
    blocked = Blocked(program, worst)
    interrupts = {row.name: ENTRY + worst.bound(4 * row.vector).cycles for row in table.interrupts}
    latencies = Latencies(blocked, {row.vector: load.sources(row, 1) for row in table.interrupts})
    waits = {row.name: latencies.of(row.vector) for row in table.interrupts}
    storm = not load.is_calm(next((waits[row.name] for row in table.interrupts if row.vector == ENCODERS), 0))
    edges, (quiet, taking) = _edges(program, storm), _link_poll(program)
    often, always = (_comes_often(program, load, vector) for vector in (ENCODERS, RECEIVE))
    encoders = edges.nothing + (edges.found if often else 0)
    link = taking if always else quiet
    poll = encoders + link
    alone = Given(program, _given(program, {ENCODER_POLL: encoders, LINK_POLL: link}))
    around = Given(program, _given(program, {ENCODER_POLL: 0, LINK_POLL: 0}))
    return Costs(
        tasks={row.name: worst.bound(_task(program, row.name)).cycles for row in table.tasks},
        alone={row.name: alone.bound(_task(program, row.name)).cycles for row in table.tasks},
        interrupts=interrupts,
        latencies=waits,
        round=_round(program) + poll,
        around=sum(around.bound(entry).cycles for entry in _entries(program, AROUND_TASK)) + poll,
        poll=poll,
        frames={length: _frame(program, length) - quiet for length in {load.frame_least, load.frame_most}},
        change=edges.each + (0 if often else edges.found),
        other=edges.other,
        storm=edges.storm,
        taken=0 if always else taking - quiet,
    )


@dataclass(frozen=True, slots=True)
class _Edges:
    """A poll of the encoders: what it takes when nothing waits, more when anything does, more for each edge, for the
    light sensor's, and to stop a line. All 0 where there is none."""

    nothing: int = 0
    found: int = 0
    each: int = 0
    other: int = 0
    storm: int = 0


def _edges(program: Program, storm: bool) -> _Edges:
    """Lines are stopped in functions of its own, outside its loop or RARE; where none ever is, they are not called."""
    entry = _entry(program, ENCODER_POLL)
    if entry is None:
        return _Edges()
    blocks, inside = program.functions[entry].blocks, _in_loops(program.functions[entry])
    outside = {callee for start, block in blocks.items() if start not in inside for callee in block.calls}
    outside -= {clock for clock in (_entry(program, CLOCK),) if clock is not None}
    rare, other = _entries(program, RARE), _entries(program, (OTHER,))
    calm = dict.fromkeys((*outside, *rare, *other), 0)
    one, two = (Given(_passed(program, entry, passes), calm).bound(entry).cycles for passes in (1, 2))
    nothing = _nothing(program, entry, {})
    return _Edges(
        nothing=min(nothing, 2 * one - two),
        found=max(0, 2 * one - two - nothing),
        each=two - one,
        other=sum(WorstCase(program).bound(callee).cycles for callee in other),
        storm=Given(_passed(program, entry, 1), dict.fromkeys(other, 0)).bound(entry).cycles - one if storm else 0,
    )


def _comes_often(program: Program, load: Load, vector: int) -> bool:
    """More requests of an interrupt in a tick than polls: each poll is then taken to find one, rather than each request
    its own poll."""
    rows = [row for row in program.table.interrupts if row.vector == vector]
    requests = sum(one.requests(TICK) for row in rows for one in load.sources(row, 1))
    count = _slots(program)
    tasks = sum(slot % row.period == row.phase for row in program.table.tasks for slot in range(count))
    return requests > tasks * SLOTS_PER_TICK // count + SLOTS_PER_TICK


def _link_poll(program: Program) -> tuple[int, int]:
    """A poll of the link that takes no byte; one that takes some and finds no whole frame. 0: there is none.

    The time for each of those bytes is counted with its frame.
    """
    entry, take = _entry(program, LINK_POLL), _entry(program, TAKE)
    if entry is None:
        return 0, 0
    if take is None:  # in line: what finds no frame cannot be told from what finds one
        whole = WorstCase(program).bound(entry).cycles
        return whole, whole
    decode = dict.fromkeys(_entries(program, (DECODE,)), 0)
    room = {callee: WorstCase(program).bound(callee).cycles for callee in _entries(program, (ROOM,))}
    taken = Given(_passed(program, take, 1, above=PIECES), decode).bound(take).cycles
    return _nothing(program, entry, room), _nothing(program, entry, room | {take: taken})


def _frame(program: Program, frame_most: int) -> int:
    """What a poll of the link takes when no loop over bytes sees more of them than a frame has; 0: there is none."""
    entry = _entry(program, LINK_POLL)
    if entry is None:
        return 0
    bounds = [one if one.passes is None else replace(one, passes=min(one.passes, frame_most)) for one in program.bounds]
    return WorstCase(replace(program, bounds=tuple(bounds))).bound(entry).cycles


def _nothing(program: Program, entry: int, calls: Mapping[int, int]) -> int:
    """The longest way through a function that enters no loop and calls nothing but what takes so many cycles: what it
    takes when nothing waits. Where there is none: its bound."""
    worst = Given(program, calls)
    known = worst.inside(entry)
    function = known.function
    inside = _in_loops(function)
    open_ = {
        start for start, block in function.blocks.items() if start not in inside and calls.keys() >= set(block.calls)
    }
    ways: dict[int, list[Way[int]]] = {}
    for start in open_:
        found = worst.ways(function.blocks[start], known)
        ways[start] = [way for way in found if way.to is None or way.to in open_]
    walk = longest(Graph(entry, ways, program.where)) if entry in open_ else None
    return walk.cycles if walk is not None else WorstCase(program).bound(entry).cycles


def _round(program: Program) -> int:
    """One pass of the main loop at most, with the scheduler, without tasks and polls: of the scheduler its longest way,
    of the loop around it every block once.

    The scheduler's own loop drops ticks when it has fallen behind (DROPS_FROM): that is overload. Till then it is
    passed at most once.
    """
    scheduler = _entry(program, SCHEDULER)
    if scheduler is None:
        raise TimingError(
            f"{program.path} has no function {SCHEDULER}; expected the scheduler as a function of its own, not in line"
        )
    names = (*(f"{row.name}_task" for row in program.table.tasks), *AROUND_TASK, ENCODER_POLL, LINK_POLL)
    elsewhere = dict.fromkeys(_entries(program, names), 0)
    cycles = Given(_passed(program, scheduler, 1), elsewhere).bound(scheduler).cycles
    elsewhere[scheduler] = 0
    loop = _entry(program, LOOP)
    if loop is not None:
        cycles += Given(program, elsewhere).bound(loop).cycles
        elsewhere[loop] = 0
    return cycles + _main_loop(program, elsewhere, scheduler if loop is None else loop)


def _main_loop(program: Program, elsewhere: Mapping[int, int], called: int) -> int:
    """All blocks once of the loops of `main` from which that is called."""
    main = _entry(program, "main")
    if main is None:
        return 0
    given = Given(program, elsewhere)
    known = given.inside(main)
    function = known.function
    loops = [loop for loop in _loops(function) if any(called in function.blocks[node].calls for node in loop.nodes)]
    cycles = 0
    for start in frozenset[int]().union(*(loop.nodes for loop in loops)):
        cycles += max(way.cycles for way in given.ways(function.blocks[start], known))
    return cycles


def _loops(function: Function) -> list[Loop[int]]:
    def successors(start: int) -> list[int]:
        return [edge.to for edge in function.blocks[start].edges]

    return natural_loops(reverse_postorder(function.entry, successors), successors)


def _in_loops(function: Function) -> set[int]:
    return {node for loop in _loops(function) for node in loop.nodes}


def _passed(program: Program, entry: int, passes: int, above: int = 0) -> Program:
    """The program with each loop of a function passed so often at most, if it is bounded by more than `above`."""
    blocks = program.functions[entry].blocks.values()
    own = {instruction.address for block in blocks for instruction in block.instructions}
    bounds = [
        replace(one, passes=min(one.passes, passes))
        if one.address in own and one.passes is not None and one.passes > above
        else one
        for one in program.bounds
    ]
    return replace(program, bounds=tuple(bounds))


def _slots(program: Program) -> int:
    """Slots of a whole cycle of the schedule."""
    return math.lcm(SLOTS_PER_TICK, *(row.period for row in program.table.tasks))


def _entry(program: Program, name: str) -> int | None:
    """Of a function of the source; the compiler may have added to its name. None: there is none, or not one only."""
    if name in program.by_name:
        return program.by_name[name]
    found = [entry for other, entry in program.by_name.items() if other.startswith(f"{name}.")]
    return found[0] if len(found) == 1 else None


def _task(program: Program, name: str) -> int:
    entry = _entry(program, f"{name}_task")
    if entry is None:
        raise TimingError(f"{program.path} has no function {name}_task")
    return entry


def _entries(program: Program, names: Collection[str]) -> list[int]:
    return [entry for entry in (_entry(program, name) for name in names) if entry is not None]


def _given(program: Program, cycles: Mapping[str, int]) -> dict[int, int]:
    found = {_entry(program, name): each for name, each in cycles.items()}
    return {entry: each for entry, each in found.items() if entry is not None}
