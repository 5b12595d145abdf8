"""What the pieces of a board's work cost, from its image alone: tasks, what is around them, interrupts, edges, frames.

The main loop does one thing in each pass: a slot's tasks; if no slot waits, the encoders' changes; if none of these do,
one received frame. So frames are background work. A slot waits for one of them at most, which the main loop was at when
the slot began; how many can be worked off is a question of what slots and interrupts leave.

A slot begins with the changes of the encoders. What looking for them costs when there are none is the slot's; what
each takes more is counted with the interrupt that brings it: otherwise each slot would be taken to find the ring full.

For this some functions of the firmware must be functions of the image too (SCHEDULER is refused otherwise, the others
are then counted with all that they can find): they are kept from being in line where they are declared. What a compiler
appends to a name (`.lto_priv.3`) does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

from boebot.errors import TimingError
from boebot.timing.blocked import ENTRY, Blocked
from boebot.timing.constants import Context, Known
from boebot.timing.latency import Latencies
from boebot.timing.loads import ENCODERS, RECEIVE, TICK, Load
from boebot.timing.loops import Loop, natural_loops, reverse_postorder
from boebot.timing.paths import Graph, Way, longest
from boebot.timing.program import Block, Function, Program, TaskRow
from boebot.timing.response import Piece, Schedule, Source
from boebot.timing.taken import Taken
from boebot.timing.wcet import Bound, WorstCase

SCHEDULER, LOOP = "schedule_poll", "firmware_poll"
AROUND_TASK = ("task_begins", "task_has_ended")  # called once for each task that runs
ENCODER_POLL, LINK_POLL = "encoder_poll", "link_poll"
TAKE, DECODE, ROOM = "link_take_frame", "frame_decode_end", "hal_serial_room"  # parts of a poll of the link
RARE, WHEEL, OTHER, BACK = "keep_limit", "see_wheel", "see_other", "take_back"  # parts of a poll of the encoders
SLOT_BEGINS = "scheduler"  # the piece before a slot's tasks, with all that the scheduler does
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
    interrupts: dict[str, int]  # from acceptance to the end of RETI
    charged: dict[str, int]  # the same less the received bytes that they take, of which each is charged to its own
    latencies: dict[str, int]  # from request to acceptance, under this load
    loop: int  # a pass of the main loop, without what it does in it
    round: int  # such a pass, with the scheduler around a slot's tasks
    around: int  # one task's share of the scheduler
    frame: int  # to work off one frame
    partial: int  # to take bytes and find no whole frame
    edges: int  # to look for edges
    change: int  # more, to work off one
    other: int  # more, when it is the light sensor's, and lines come back
    storm: int  # more, to stop a line that comes too often; 0: under this load none does
    changes_due: int  # so many changes the main loop works off between slots; fewer wait

    def requested(self, program: Program, load: Load) -> list[Source]:
        """The interrupts under a load."""
        return [one for row in program.table.interrupts for one in load.sources(row, self.charged[row.name])]

    def sources(self, program: Program, load: Load) -> list[Source]:
        """The interrupts under a load, and the edges that they leave to the main loop."""
        found = self.requested(program, load)
        if self.change:
            found += [replace(one, name="edges worked off") for one in self._changes(program, load, self.change)]
            found += [Source("light's edge worked off", self.other, 2 * TICK)] if self.other else []
            found += [Source("line stopped", self.storm, TICK)] if self.storm else []
        return found

    def between(self, program: Program, load: Load) -> list[Source]:
        """What the main loop does besides when no slot waits: it looks for edges when so many are due."""
        return [
            replace(one, name="looks for edges")
            for one in self._changes(program, load, -(-(self.loop + self.edges) // self.changes_due))
        ]

    @staticmethod
    def _changes(program: Program, load: Load, cycles: int) -> list[Source]:
        rows = [row for row in program.table.interrupts if row.vector == ENCODERS]
        return [one for row in rows for one in load.sources(row, cycles)] if cycles else []

    def of_frames(self, load: Load) -> Source:
        """Frames, the shortest. The link is looked at twice for each: at one of its two delimiters in vain."""
        interval = load.byte_interval * load.frame_least
        return Source("frames", 2 * self.loop + self.partial + self.frame, interval, bursts=load.frame_bursts)

    @property
    def idle(self) -> int:
        """What a slot may find when there is no frame: the main loop works off edges that have just become due."""
        return self.loop + self.edges + self.changes_due * self.change + self.other + self.storm

    @property
    def blocking(self) -> int:
        """The most that a slot may find: or the main loop is at a frame, and has left edges that were not due."""
        return max(self.idle, self.loop + self.frame + (self.changes_due - 1) * self.change + self.other + self.storm)

    def schedule(self, program: Program) -> Schedule:
        """The slots of a whole cycle."""
        rows, said = program.table.tasks, program.constants
        slots = []
        for slot in range(_slots(program)):
            pieces = [Piece(SLOT_BEGINS, self.round)]
            pieces += [Piece(row.name, self.tasks[row.name] + self.around) for row in rows if _is_due(row, slot)]
            slots.append(tuple(pieces))
        return Schedule(
            tuple(slots), said.slot_cycles, said.slots_per_tick, self.blocking, said.slots_kept * said.slot_cycles
        )


def _is_due(row: TaskRow, slot: int) -> bool:
    return slot % row.period == row.phase


def costs(program: Program, load: Load, progress: Callable[[float], None] = lambda _: None) -> Costs:
    """Of an image under a load.

    Args:
        program: the image's.
        load: how often its interrupts come.
        progress: called with the share of tasks and interrupts that are done, 0 to 1.

    Raises:
        TimingError: a task or the scheduler is no function, or has no bound.
    """
    worst, table = WorstCase(program), program.table
    tasks, interrupts, waits = {}, {}, {}
    rows = len(table.tasks) + len(table.interrupts)
    for done, task in enumerate(table.tasks, 1):
        tasks[task.name] = worst.bound(task_entry(program, task.name)).cycles
        progress(done / rows)
    latencies = Latencies(Blocked(program, worst), {row.vector: load.sources(row, 1) for row in table.interrupts})
    for done, row in enumerate(table.interrupts, len(table.tasks) + 1):
        interrupts[row.name] = ENTRY + worst.bound(4 * row.vector).cycles
        waits[row.name] = latencies.of(row.vector)
        progress(done / rows)
    waited = next((waits[row.name] for row in table.interrupts if row.vector == ENCODERS), 0)
    storm = not load.is_calm(waited, program.constants)
    edges = _edges(program, storm)
    loop, scheduler = _rounds(program, edges.nothing)
    return Costs(
        tasks=tasks,
        interrupts=interrupts,
        charged=_charged(worst, interrupts),
        latencies=waits,
        loop=loop,
        round=loop + scheduler,
        around=sum(worst.bound(entry).cycles for entry in entries_of(program, AROUND_TASK)),
        frame=sum(worst.bound(entry).cycles for entry in entries_of(program, (LINK_POLL,))),
        partial=_partial(program),
        edges=edges.nothing,
        change=edges.each,
        other=edges.other,
        storm=edges.storm,
        changes_due=program.constants.changes_due,
    )


def _charged(worst: WorstCase, interrupts: Mapping[str, int]) -> dict[str, int]:
    rows = worst.program.table.interrupts
    each = next((interrupts[row.name] for row in rows if row.vector == RECEIVE), 0)
    others = {row.name: Taken(worst, 4 * row.vector) for row in rows if row.vector != RECEIVE}
    taking = {name: taken.charged(each) for name, taken in others.items() if taken.takes}
    return {**interrupts, **taking}


@dataclass(frozen=True, slots=True)
class _Edges:
    """A poll of the encoders: what it takes when nothing waits, more for each edge, for the light sensor's, and to stop
    a line. All 0 where there is none."""

    nothing: int = 0
    each: int = 0
    other: int = 0
    storm: int = 0


def _edges(program: Program, storm: bool) -> _Edges:
    """Lines are stopped in functions of its own, outside its loop or RARE; where none ever is, they are not called.

    BACK is one of these: lines come back that were stopped or switched off. The task that switches them on calls it
    itself, and leaves it to the next poll only where a change waits. A line that was off brings none: it is the light
    sensor's edge, with which it is counted.

    A change that is one edge calls WHEEL once. In one that is several, each of them has been charged a whole change.
    """
    entry = entry_of(program, ENCODER_POLL)
    if entry is None:
        return _Edges()
    blocks, inside = program.functions[entry].blocks, _in_loops(program.functions[entry])
    outside = {callee for start, block in blocks.items() if start not in inside for callee in block.calls}
    rare, wheel, other, back = (entries_of(program, (name,)) for name in (RARE, WHEEL, OTHER, BACK))
    calm = dict.fromkeys((*outside, *rare, *wheel, *other), 0)
    none, one, two = (Given(passed(program, entry, passes), calm).bound(entry).cycles for passes in (0, 1, 2))
    each = Given(program, dict.fromkeys(rare, 0))
    return _Edges(
        nothing=none,
        each=max(one - none, two - one) + sum(each.bound(callee).cycles for callee in wheel),
        other=sum(WorstCase(program).bound(callee).cycles for callee in (*other, *(back if other else ()))),
        storm=sum(WorstCase(program).bound(callee).cycles for callee in (*outside, *rare)) if storm else 0,
    )


def _partial(program: Program) -> int:
    """A poll of the link that takes some bytes and finds no whole frame. 0: there is none.

    The time for each of those bytes is counted with its frame.
    """
    entry, take = entry_of(program, LINK_POLL), entry_of(program, TAKE)
    if entry is None:
        return 0
    if take is None:  # in line: what finds no frame cannot be told from what finds one
        return WorstCase(program).bound(entry).cycles
    decode = dict.fromkeys(entries_of(program, (DECODE,)), 0)
    room = {callee: WorstCase(program).bound(callee).cycles for callee in entries_of(program, (ROOM,))}
    taken = Given(passed(program, take, 1, above=PIECES), decode).bound(take).cycles
    return _nothing(program, entry, room | {take: taken})


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


def _rounds(program: Program, edges: int) -> tuple[int, int]:
    """One pass of the main loop at most, and the scheduler in it around a slot's tasks, with so many cycles to look for
    edges: of the scheduler its longest way, of the loop around it every block once.

    The scheduler's only loop drops ticks when it has fallen behind. Where it has not, it is not passed.
    """
    scheduler = entry_of(program, SCHEDULER)
    if scheduler is None:
        raise TimingError(
            f"{program.path} has no function {SCHEDULER}; expected the scheduler as a function of its own, not in line"
        )
    names = (*(f"{row.name}_task" for row in program.table.tasks), *AROUND_TASK)
    elsewhere = dict.fromkeys(entries_of(program, names), 0)
    polls = dict.fromkeys(entries_of(program, (ENCODER_POLL, LINK_POLL)), edges)
    alone = len(_loops(program.functions[scheduler])) == 1  # else which of them drops ticks is not known
    cycles = Given(passed(program, scheduler, 0) if alone else program, elsewhere | polls).bound(scheduler).cycles
    done = dict.fromkeys((scheduler, *polls), 0)
    loop = entry_of(program, LOOP)
    if loop is None:
        return _main_loop(program, done, scheduler), cycles
    return Given(program, done).bound(loop).cycles + _main_loop(program, {loop: 0}, loop), cycles


def _main_loop(program: Program, elsewhere: Mapping[int, int], called: int) -> int:
    """All blocks once of the loops of `main` from which that is called."""
    main = entry_of(program, "main")
    if main is None:
        return 0
    given = Given(program, elsewhere)
    known = given.inside(main)
    function = known.function
    loops = [loop for loop in _loops(function) if any(called in function.blocks[node].calls for node in loop.nodes)]
    return sum(_once(loop, given, known) for loop in loops)


def _once(loop: Loop[int], given: Given, known: Known) -> int:
    """Every block of a loop once. A loop within it that sleeps waits for work, and so counts once too; others with all
    their passes.

    Raises:
        TimingError: one of these has no bound.
    """
    ways = {node: given.ways(known.function.blocks[node], known) for node in loop.nodes}
    cycles = 0
    for inner in loop.inner:
        if any(_sleeps(known.function.blocks[node]) for node in inner.nodes):
            cycles += _once(inner, given, known)
        else:
            inside = {node: [_within(way, inner.nodes) for way in ways[node]] for node in inner.nodes}
            walk = longest(Graph(inner.header, inside, given.program.where, given.marks(known.function.entry)))
            if walk is None:
                raise TimingError(f"the loop at {given.program.where(inner.header)} in the main loop never ends")
            cycles += walk.cycles
    own = loop.nodes.difference(*(inner.nodes for inner in loop.inner))
    return cycles + sum(max(way.cycles for way in ways[node]) for node in own)


def _within(way: Way[int], nodes: Collection[int]) -> Way[int]:
    """A way that leaves the graph where it leaves these nodes."""
    return way if way.to in nodes else replace(way, to=None)


def _sleeps(block: Block) -> bool:
    return any(instruction.mnemonic == "sleep" for instruction in block.instructions)


def _loops(function: Function) -> list[Loop[int]]:
    def successors(start: int) -> list[int]:
        return [edge.to for edge in function.blocks[start].edges]

    return natural_loops(reverse_postorder(function.entry, successors), successors)


def _in_loops(function: Function) -> set[int]:
    return {node for loop in _loops(function) for node in loop.nodes}


def passed(program: Program, entry: int, passes: int, above: int = 0) -> Program:
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
    return math.lcm(program.constants.slots_per_tick, *(row.period for row in program.table.tasks))


def entry_of(program: Program, name: str) -> int | None:
    """Of a function of the source; the compiler may have added to its name. None: there is none, or not one only."""
    if name in program.by_name:
        return program.by_name[name]
    found = [entry for other, entry in program.by_name.items() if other.startswith(f"{name}.")]
    return found[0] if len(found) == 1 else None


def task_entry(program: Program, name: str) -> int:
    """Of the function of a task.

    Raises:
        TimingError: it is no function.
    """
    entry = entry_of(program, f"{name}_task")
    if entry is None:
        raise TimingError(f"{program.path} has no function {name}_task")
    return entry


def entries_of(program: Program, names: Collection[str]) -> list[int]:
    return [entry for entry in (entry_of(program, name) for name in names) if entry is not None]
