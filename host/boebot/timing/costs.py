"""What the pieces of a board's schedule cost, from its image alone: tasks, polls between them, interrupts.

Polls are taken apart. What one costs when nothing waits comes after each task; what it costs to work off a frame or an
encoder's edge comes as often as these do, and so is counted with the interrupts that bring them: otherwise each of some
twenty polls in a tick would be taken to find its ring full.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from boebot.timing.blocked import ENTRY, Blocked
from boebot.timing.constants import Context
from boebot.timing.loads import ENCODERS, RECEIVE, TICK, Load
from boebot.timing.loops import natural_loops, reverse_postorder
from boebot.timing.paths import Graph, Way, longest
from boebot.timing.program import Function, Program
from boebot.timing.response import Piece, Schedule, Source
from boebot.timing.wcet import Bound, WorstCase

SLOT_CYCLES = 40_000
SLOTS_PER_TICK = 4
SCHEDULER = "schedule_poll"
ENCODER_POLL, LINK_POLL = "encoder_poll", "link_poll"
LOOP = "firmware_poll"
CLOCK = "schedule_now"  # that a poll of the encoders reads, whatever waits


class WithoutCallees(WorstCase):
    """Bounds that leave out what certain functions take: those are accounted for elsewhere."""

    def __init__(self, program: Program, names: Collection[str]) -> None:
        super().__init__(program)
        self._free = {program.by_name[name] for name in names if name in program.by_name}

    def bound(self, entry: int, context: Context | None = None) -> Bound:
        """See `WorstCase`."""
        return Bound(0, (), {}) if entry in self._free else super().bound(entry, context)


@dataclass(frozen=True, slots=True)
class Costs:
    """Cycles of each piece."""

    tasks: dict[str, int]
    alone: dict[str, int]  # the same without the polls that tasks call themselves
    interrupts: dict[str, int]  # from acceptance to the end of RETI
    latencies: dict[str, int]  # from request to acceptance
    round: int  # of the main loop and the scheduler around a slot's tasks
    quiet_poll: int  # both polls, when nothing waits
    frames: dict[int, int]  # to work off one frame of so many bytes
    change: int  # to work off one edge
    storm: int  # to stop a line that comes too often

    def sources(self, program: Program, load: Load) -> list[Source]:
        """The interrupts under a load, and what they leave to the polls."""
        found = [one for row in program.table.interrupts for one in load.sources(row, self.interrupts[row.name])]
        for row in program.table.interrupts:
            if row.vector == ENCODERS and self.change:
                found += [replace(one, name="edges worked off") for one in load.sources(row, self.change)]
                found.append(Source("line stopped", self.storm, TICK))
            if row.vector == RECEIVE and self.frame:
                found.append(self._frames(load))
        return found

    @property
    def frame(self) -> int:
        """To work off one frame of any length."""
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
        count = max((row.period for row in rows), default=SLOTS_PER_TICK)
        count += -count % SLOTS_PER_TICK
        slots = []
        for slot in range(count):
            pieces = [Piece("scheduler", self.round, 1)]
            pieces += [
                Piece(row.name, self.alone[row.name] + self.quiet_poll, 1)
                for row in rows
                if slot % row.period == row.phase
            ]
            slots.append(tuple(pieces))
        return Schedule(
            tuple(slots), SLOT_CYCLES, SLOTS_PER_TICK, max(self.frame, self.change + self.storm) + self.round
        )


def costs(program: Program, load: Load) -> Costs:
    """Of an image; how long a frame is, and so how long it takes, is the load's.

    Raises:
        TimingError: a task is no function, or has no bound.
    """
    worst = WorstCase(program)
    blocked = Blocked(program, worst)
    table = program.table
    tasks = {row.name: worst.of(f"{row.name}_task").cycles for row in table.tasks}
    polls = [name for name in (ENCODER_POLL, LINK_POLL) if name in program.by_name]
    without_polls = WithoutCallees(program, polls)
    # Its only loop drops ticks when it has fallen behind by more than two; where no slot is late none is dropped.
    around = WithoutCallees(_once(program, SCHEDULER), [*(f"{name}_task" for name in tasks), *polls])
    quiet = sum(_quiet(program, name) for name in polls)
    change, storm = _changes(program)
    scheduler = around.of(SCHEDULER).cycles if SCHEDULER in program.by_name else 0
    return Costs(
        tasks=tasks,
        alone={name: without_polls.of(f"{name}_task").cycles + quiet for name in tasks},
        interrupts={row.name: ENTRY + worst.bound(4 * row.vector).cycles for row in table.interrupts},
        latencies={row.name: blocked.latency(row.vector) for row in table.interrupts},
        round=scheduler + 2 * quiet + _loop(program, [*polls, SCHEDULER]),
        quiet_poll=quiet,
        frames={length: _frame(program, length) for length in {load.frame_least, load.frame_most}},
        change=change,
        storm=storm,
    )


def _quiet(program: Program, name: str) -> int:
    """The longest way through a function that enters no loop and calls nothing: what it takes when nothing waits."""
    function = program.functions[program.by_name[name]]
    inside = _in_loops(function)
    open_ = {start for start, block in function.blocks.items() if start not in inside and not block.calls}
    ways: dict[int, list[Way[int]]] = {}
    for start in open_:
        block = function.blocks[start]
        if block.edges:
            ways[start] = [
                Way(start, edge.to, block.body_cycles + edge.cycles) for edge in block.edges if edge.to in open_
            ]
        else:
            ways[start] = [Way(start, None, block.body_cycles + block.last_cycles)]
    walk = longest(Graph(function.entry, ways, program.where)) if function.entry in open_ else None
    return walk.cycles if walk is not None else WorstCase(program).of(name).cycles


def _in_loops(function: Function) -> set[int]:
    def successors(start: int) -> list[int]:
        return [edge.to for edge in function.blocks[start].edges]

    loops = natural_loops(reverse_postorder(function.entry, successors), successors)
    return {node for loop in loops for node in loop.nodes}


def _loop(program: Program, known: Collection[str]) -> int:
    """One pass of the main loop, at most: all its blocks once, without what it calls of `known`."""
    around = WithoutCallees(program, known)
    if LOOP in program.by_name:
        cycles = around.of(LOOP).cycles
        around = WithoutCallees(program, [*known, LOOP])
    else:
        cycles = 0
    if "main" not in program.by_name:
        return cycles
    function = program.functions[program.by_name["main"]]
    for start in _in_loops(function):
        block = function.blocks[start]
        cycles += block.body_cycles + max((edge.cycles for edge in block.edges), default=block.last_cycles)
        cycles += max((around.bound(entry).cycles for entry in block.calls), default=0)
    return cycles


def _frame(program: Program, frame_most: int) -> int:
    """What a poll of the link takes when no loop over bytes sees more of them than a frame has; 0: there is none."""
    if LINK_POLL not in program.by_name:
        return 0
    bounds = [one if one.passes is None else replace(one, passes=min(one.passes, frame_most)) for one in program.bounds]
    return WorstCase(replace(program, bounds=tuple(bounds))).of(LINK_POLL).cycles


def _changes(program: Program) -> tuple[int, int]:
    """What a poll of the encoders takes when one edge waits, and what it takes more when a line was stopped for coming
    too often: that is done by functions that it calls outside its loop. 0: there is no such poll."""
    if ENCODER_POLL not in program.by_name:
        return 0, 0
    function = program.functions[program.by_name[ENCODER_POLL]]
    blocks = function.blocks
    once = _once(program, ENCODER_POLL)
    inside = _in_loops(function)
    outside = {entry for start, block in blocks.items() if start not in inside for entry in block.calls}
    names = [program.functions[entry].name for entry in outside]
    calm = WithoutCallees(once, [name for name in names if name != CLOCK]).of(ENCODER_POLL).cycles
    return calm, WorstCase(once).of(ENCODER_POLL).cycles - calm


def _once(program: Program, name: str) -> Program:
    """The program with each bounded loop of that function passed once."""
    if name not in program.by_name:
        return program
    blocks = program.functions[program.by_name[name]].blocks.values()
    own = {instruction.address for block in blocks for instruction in block.instructions}
    bounds = [
        replace(one, passes=1) if one.address in own and one.passes is not None else one for one in program.bounds
    ]
    return replace(program, bounds=tuple(bounds))
