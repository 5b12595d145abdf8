"""What the pieces of a board's work cost, from its image alone: tasks, what is around them, interrupts, edges, frames.

The main loop does in each pass a slot's tasks; or, if no slot waits, it works off pin changes and then one received
frame. So frames are background work. A slot waits for one of them at most, which the main loop was at when the slot
began; how many can be worked off is a question of what slots and interrupts leave.

A slot begins with the pin changes. What looking for them costs when there are none is the slot's; what each takes more
is counted with the interrupt that brings it: otherwise each slot would be taken to find the ring full.

A task that has no bound (it calls a library routine that has none) is taken to need its budget; `unbounded` says why it
has none. Nobody has proven that it keeps its budget: the emulator looks whether it does.

For this some functions of the firmware must be functions of the image too (SCHEDULER is refused otherwise, the others
are then counted with all that they can find): they are kept from being in line where they are declared. What a compiler
appends to a name (`.lto_priv.3`) does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

from avr_timing.bounds.loop_bounds import sleeps
from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.constants import Known
from avr_timing.flow.loops import Loop, loops_of
from avr_timing.flow.paths import Graph, Way, longest
from avr_timing.interrupts.byte_reads import RECEIVE
from avr_timing.interrupts.interrupts_off import ENTRY
from avr_timing.interrupts.response import Piece, Schedule, Source
from avr_timing.program import Program
from boebot.errors import AnalysisError, TimingError
from boebot_timing.firmware import Firmware
from boebot_timing.loads import BYTE, ENCODERS, SEND, SENT_WHILE_BUSY, Load
from boebot_timing.table import TaskRow

SCHEDULER, LOOP = "schedule_poll", "firmware_poll"
AROUND_TASK = ("task_begins", "task_has_ended")  # called once for each task that runs
CHANGES_POLL, LINK_POLL = "pin_changes_poll", "link_poll"
WHEEL = "encoder_edge"  # called for each edge of a change
SLOT_BEGINS = "scheduler"  # the piece before a slot's tasks, with all that the scheduler does


@dataclass(frozen=True, slots=True)
class Costs:
    """Cycles of each piece."""

    tasks: dict[str, int]  # the bound; where there is none, the budget
    unbounded: dict[str, str]  # tasks without a bound, and why they have none
    interrupts: dict[str, int]  # from acceptance to the end of RETI
    charged: dict[str, int]  # the same less the received bytes that they take, of which each is charged to its own
    heeding: frozenset[str]  # interrupts that take no byte while the receive interrupt is off
    latencies: dict[str, int | None]  # from request to acceptance, under this load; None: of a byte that may be lost
    loop: int  # a pass of the main loop, without what it does in it
    round: int  # such a pass, with the scheduler around a slot's tasks
    around: int  # one task's share of the scheduler
    frame: int  # to work off one frame
    edges: int  # to look for pin changes
    change: int  # more, to work off one
    changes_due: int  # changes from which on the main loop works them off between slots; fewer wait

    def busy(self, firmware: Firmware, load: Load) -> list[Source]:
        """What comes while slots keep the main loop busy: of an overload no more bytes than the receive ring has room
        for and one poll takes from it. One byte more finds it full.

        Others may read bytes even then, but for those that look whether the interrupt is on (`heeding`). So each of
        their runs is charged with all that it takes.

        And no more bytes leave than the send ring held, than that poll may have answered, and than the tasks of each
        tick send.
        """
        found = self.sources(firmware, load)
        if not load.is_overload:
            return found
        said = firmware.constants
        rows = {row.name: row for row in firmware.table.interrupts}
        most = said.receive_ring + 1 + said.poll_bytes

        def busy(one: Source) -> Source:
            if one.name not in rows:
                return one
            if rows[one.name].vector == SEND:
                return replace(one, parts=SENT_WHILE_BUSY)
            if rows[one.name].vector == RECEIVE:
                return replace(one, most=most)
            return one if one.name in self.heeding else replace(one, cycles=self.interrupts[one.name])

        return [busy(one) for one in found]

    def requested(self, firmware: Firmware, load: Load) -> list[Source]:
        """The interrupts under a load."""
        return [one for row in firmware.table.interrupts for one in load.sources(row, self.charged[row.name])]

    def sources(self, firmware: Firmware, load: Load) -> list[Source]:
        """The interrupts under a load, and the edges that they leave to the main loop."""
        found = self.requested(firmware, load)
        if self.change:
            found += [replace(one, name="changes worked off") for one in self._changes(firmware, load, self.change)]
        return found

    def between(self, firmware: Firmware, load: Load) -> list[Source]:
        """What the main loop does besides when no slot waits: it looks for changes when enough are due."""
        return [
            replace(one, name="looks for changes")
            for one in self._changes(firmware, load, -(-(self.loop + self.edges) // self.changes_due))
        ]

    @staticmethod
    def _changes(firmware: Firmware, load: Load, cycles: int) -> list[Source]:
        rows = [row for row in firmware.table.interrupts if row.vector == ENCODERS]
        return [one for row in rows for one in load.sources(row, cycles)] if cycles else []

    def of_frames(self, load: Load) -> Source:
        """Frames, the shortest. The link is looked at twice for each: at one of its two delimiters in vain."""
        return Source("frames", 2 * (self.loop + self.frame), BYTE * load.frame_least, bursts=load.frame_bursts)

    @property
    def idle(self) -> int:
        """What a slot may find when there is no frame: the main loop works off changes that have just become due."""
        return self.loop + self.edges + self.changes_due * self.change

    @property
    def blocking(self) -> int:
        """The most that a slot may find: the main loop works off changes that have just become due, and then a
        frame."""
        return self.idle + self.frame

    def schedule(self, firmware: Firmware) -> Schedule:
        """The slots of a whole cycle."""
        rows, said = firmware.table.tasks, firmware.constants
        slots = []
        for slot in range(_slots(firmware)):
            pieces = [Piece(SLOT_BEGINS, self.round)]
            pieces += [Piece(row.name, self.tasks[row.name] + self.around) for row in rows if _is_due(row, slot)]
            slots.append(tuple(pieces))
        return Schedule(
            tuple(slots), said.slot_cycles, said.slots_per_tick, self.blocking, said.slots_kept * said.slot_cycles
        )


def _is_due(row: TaskRow, slot: int) -> bool:
    return slot % row.period == row.phase


def costs(firmware: Firmware, load: Load, progress: Callable[[float], None] = lambda _: None) -> Costs:
    """Of an image under a load.

    Args:
        firmware: the image.
        load: how often its interrupts come.
        progress: called with the share of tasks and interrupts that are done, 0 to 1.

    Raises:
        TimingError: an interrupt, the scheduler or a poll of the main loop has no bound.
    """
    table, worst = firmware.table, firmware.worst
    tasks, interrupts = {}, {}
    unbounded: dict[str, str] = {}
    rows = len(table.tasks) + len(table.interrupts)
    for done, task in enumerate(table.tasks, 1):
        entry = firmware.entry_of(f"{task.name}_task")
        if entry is None and unbounded:  # behind one that never returns
            raise TimingError(next(iter(unbounded.values())))
        try:
            # One that does nothing on this board may be left out by the compiler. One put in line is in the
            # scheduler's own cycles.
            tasks[task.name] = 0 if entry is None else worst.bound(entry).cycles
        except AnalysisError as error:
            tasks[task.name], unbounded[task.name] = task.budget, str(error)
        progress(done / rows)
    for done, row in enumerate(table.interrupts, len(table.tasks) + 1):
        interrupts[row.name] = ENTRY + worst.bound(4 * row.vector).cycles
        progress(done / rows)
    charged, heeding = _charged(firmware, interrupts)
    edges, change = _edges(firmware)
    loop, scheduler = _rounds(firmware, edges)
    return Costs(
        tasks=tasks,
        unbounded=unbounded,
        interrupts=interrupts,
        charged=charged,
        heeding=heeding,
        latencies=_latencies(firmware, load),
        loop=loop,
        round=loop + scheduler,
        around=sum(worst.bound(entry).cycles for entry in firmware.entries_of(AROUND_TASK)),
        frame=sum(worst.bound(entry).cycles for entry in firmware.entries_of((LINK_POLL,))),
        edges=edges,
        change=change,
        changes_due=firmware.constants.changes_due,
    )


def _latencies(firmware: Firmware, load: Load) -> dict[str, int | None]:
    """Of a byte none, where bytes may be lost."""
    rows = firmware.table.interrupts
    requests = {row.vector: load.requests(row, firmware.constants) for row in rows}
    return {
        row.name: None if load.is_overload and row.vector == RECEIVE else firmware.latencies.of(row.vector, requests)
        for row in rows
    }


def _charged(firmware: Firmware, interrupts: Mapping[str, int]) -> tuple[dict[str, int], frozenset[str]]:
    """See `Costs.charged` and `Costs.heeding`."""
    rows = firmware.table.interrupts
    each = next((interrupts[row.name] for row in rows if row.vector == RECEIVE), 0)
    found = {row.name: firmware.latencies.taken(row.vector) for row in rows if row.vector != RECEIVE}
    taking = {name: taken for name, taken in found.items() if taken.takes}
    charged = {name: taken.charged(each) for name, taken in taking.items()}
    return {**interrupts, **charged}, frozenset(name for name, taken in taking.items() if taken.heeds_switch)


def _edges(firmware: Firmware) -> tuple[int, int]:
    """A poll of the pin changes: what it takes when nothing waits, and more for each change. 0: there is none.

    A change that is an edge of one wheel calls WHEEL once. In one that is an edge of both, each of them has been
    charged a whole change.
    """
    program, entry = firmware.program, firmware.entry_of(CHANGES_POLL)
    if entry is None:
        return 0, 0
    wheel = firmware.entries_of((WHEEL,))
    once = dict.fromkeys(wheel, 0)
    none, one, two = (WorstCase(_passed(program, entry, passes), once).bound(entry).cycles for passes in (0, 1, 2))
    return none, max(one - none, two - one) + sum(firmware.worst.bound(callee).cycles for callee in wheel)


def _rounds(firmware: Firmware, edges: int) -> tuple[int, int]:
    """One pass of the main loop at most, and the scheduler in it around a slot's tasks, with some cycles to look for
    edges: of the scheduler its longest way, of the loop around it every block once.

    The scheduler's only loop drops ticks when it has fallen behind. Where it has not, it is not passed.
    """
    program, scheduler = firmware.program, firmware.entry_of(SCHEDULER)
    if scheduler is None:
        raise TimingError(
            f"{program.path} has no function {SCHEDULER}; expected the scheduler as a function, not in line"
        )
    names = (*(f"{row.name}_task" for row in firmware.table.tasks), *AROUND_TASK)
    elsewhere = dict.fromkeys(firmware.entries_of(names), 0)
    polls = dict.fromkeys(firmware.entries_of((CHANGES_POLL, LINK_POLL)), edges)
    alone = len(loops_of(program.functions[scheduler])) == 1  # else which of them drops ticks is not known
    cycles = WorstCase(_passed(program, scheduler, 0) if alone else program, elsewhere | polls).bound(scheduler).cycles
    done = dict.fromkeys((scheduler, *polls), 0)
    loop = firmware.entry_of(LOOP)
    if loop is None:
        return _main_loop(firmware, done, scheduler), cycles
    return WorstCase(program, done).bound(loop).cycles + _main_loop(firmware, {loop: 0}, loop), cycles


def _main_loop(firmware: Firmware, elsewhere: Mapping[int, int], called: int) -> int:
    """All blocks once of the loops of `main` from which that is called."""
    main = firmware.entry_of("main")
    if main is None:
        return 0
    given = WorstCase(firmware.program, elsewhere)
    known = given.inside(main)
    function = known.function
    loops = [loop for loop in loops_of(function) if any(called == function.blocks[node].callee for node in loop.nodes)]
    return sum(_once(loop, given, known) for loop in loops)


def _once(loop: Loop[int], given: WorstCase, known: Known) -> int:
    """Every block of a loop once. A loop within it that sleeps waits for work, and so counts once too; others with all
    their passes.

    Raises:
        TimingError: one of these has no bound.
    """
    ways = {node: given.ways(known.function.blocks[node], known) for node in loop.nodes}
    cycles = 0
    for inner in loop.inner:
        if any(sleeps(known.function.blocks[node]) for node in inner.nodes):
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


def _passed(program: Program, entry: int, passes: int) -> Program:
    """The program with each loop of a function that has a bound in the source passed so often at most."""
    blocks = program.functions[entry].blocks.values()
    own = {instruction.address for block in blocks for instruction in block.instructions}
    bounds = [
        replace(one, passes=min(one.passes, passes)) if one.address in own and one.passes is not None else one
        for one in program.bounds
    ]
    return replace(program, bounds=tuple(bounds))


def _slots(firmware: Firmware) -> int:
    """Slots of a whole cycle of the schedule."""
    return math.lcm(firmware.constants.slots_per_tick, *(row.period for row in firmware.table.tasks))
