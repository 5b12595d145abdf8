"""All about an image's timing in one report: bounds, what was measured, budgets, and what is broken.

Bounds come from the machine code alone; they are compared with what the image's own table allows, and with what was
measured in the emulator or on the board, wherever somebody has. A measured figure above its bound means that the bound
is wrong, and counts like any broken budget. What a task or an interrupt takes by itself, and the stack, hold for every
scenario that was measured; what a tick takes is compared with the scenario of the report's own load alone.

What must end in time is the tick: tasks, interrupts, edges. Frames are worked off in what they leave, and never keep a
slot waiting longer than one of them takes. So what of them the bound can prove is a figure, and no budget: for each
kind of message whether a line full of it is worked off, and how many bytes wait meanwhile (full_line.py). The bytes of
`ring` are those that come between two polls alone; they are all that wait where the link was not behind before.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from boebot.timing.blocked import WAKE
from boebot.timing.changes import CHANGES_RING
from boebot.timing.changes import of_image as changes_of
from boebot.timing.costs import SLOT_BEGINS, Costs, costs
from boebot.timing.elf import read_image
from boebot.timing.frames import frame_costs
from boebot.timing.full_line import FullLines, full_lines
from boebot.timing.graph import program_of
from boebot.timing.loads import RECEIVE, Load
from boebot.timing.measured import Measurement, Spans, as_json
from boebot.timing.program import Program, Table
from boebot.timing.response import Responses, Schedule, Source, background, load, longest_gap, misses, responses
from boebot.timing.stack import Stack
from boebot.timing.table_check import check_table

RAM_START, RAM_END = 0x100, 0x900  # data memory of the ATmega328P
RAM_BYTES = RAM_END - RAM_START
FLASH_BYTES = 0x8000
RECEIVE_RING = "hal_receive_ring"  # the variable in which received bytes wait; one of them stays free
FOR_EVER = 1 << 20  # cycles, 65 ms: what waits so long has no bound
RATIO_MOST = 1.5  # bound to the longest measured; above it one of the two could be better
OF_ROWS = 0.4  # share of the work that tasks and interrupts are, where messages are bounded too
STAMP_ROLLS_OVER = 1 << 16  # cycles after which the stamp of an edge says nothing any more


@dataclass(frozen=True, slots=True)
class Row:
    """A task or an interrupt; cycles, None: not known."""

    name: str
    kind: str  # "task" or "interrupt"
    bound: int
    budget: int
    emulator: int | None = None
    board: int | None = None  # with the interrupts that came in between: a board cannot tell them apart
    response: int | None = None  # of a task: from the beginning of its slot to its end, interrupts included
    latency: int | None = None  # of an interrupt: from request to acceptance
    latency_limit: int | None = None

    @property
    def slack(self) -> int:
        """What is left of the budget above the bound."""
        return self.budget - self.bound

    @property
    def ratio(self) -> float | None:
        """The bound to the longest that was measured in the emulator; None: nothing was."""
        return self.bound / self.emulator if self.emulator else None


@dataclass(frozen=True, slots=True)
class Memory:
    """Bytes; `stack_seen` is the deepest that was measured."""

    static: int
    stack: int
    stack_seen: int | None
    flash: int

    @property
    def left(self) -> int:
        """For the stack."""
        return RAM_BYTES - self.static


@dataclass(frozen=True, slots=True)
class Report:
    """Of one image under one load. `responses`, `gap` and `ring`: None where there is overload."""

    path: str
    table: Table
    load: Load
    rows: tuple[Row, ...]
    costs: Costs
    schedule: Schedule
    sources: tuple[Source, ...]
    responses: Responses | None
    gap: int | None  # cycles between two polls of the link, while slots wait
    ring: int | None  # bytes that wait in the receive ring meanwhile, when the link was not behind before
    ring_holds: int | None  # bytes for which it has room; None: the image has no such ring
    changes: int | None  # of the encoders' lines, that wait in their ring at most; None also: no encoders
    changes_held: int | None  # for which it has room; None: the image has no such ring
    taken: int | None  # cycles from a frame's last byte to the end of what it asks for, likewise
    frames: Source  # that the host sends
    frames_proven: float  # of these in a tick, so many are worked off whatever they are, in the long run
    lines: FullLines  # a line full of each message
    memory: Memory
    measured: Measurement | None = None

    @property
    def tick_work(self) -> int:
        """Cycles of all tasks of the fullest tick, with the scheduler around them."""
        return max(map(self.schedule.tick_work, range(self.schedule.ticks)))

    @property
    def tick_cycles(self) -> int:
        """Length of a tick."""
        return self.schedule.tick_cycles

    @property
    def demand(self) -> int:
        """Cycles of all slots and interrupts that can come in one tick, whether they fit into it or not."""
        coming = sum(source.cycles * source.requests(self.tick_cycles) for source in self.sources)
        return self.schedule.blocking + self.tick_work + coming

    @property
    def executed(self) -> int:
        """Cycles of a tick in which instructions run at most: with frames, and a pass of the main loop for whatever
        wakes it."""
        names = {row.name for row in self.rows if row.kind == "interrupt"}
        wakes = sum(source.requests(self.tick_cycles) for source in self.sources if source.name in names)
        frames = self.frames.cycles * (self.frames.requests(self.tick_cycles) + 1)  # one may have waited
        return min(self.tick_cycles, self.demand + frames + wakes * (WAKE + self.costs.loop + self.costs.edges))

    @property
    def frames_coming(self) -> float:
        """The host's frames in a tick, in the long run."""
        return float(self.frames.load / self.frames.cycles * self.tick_cycles) if self.frames.cycles else 0.0

    @property
    def edge_age(self) -> int | None:
        """Cycles from an edge to the moment at which the time is told of it: each slot begins with that. None: there is
        overload, or no encoder."""
        if self.responses is None or not self.costs.change:
            return None
        return self.schedule.slot_cycles + self.responses.pieces[SLOT_BEGINS]

    @property
    def own(self) -> Measurement | None:
        """What was measured under the report's own load; None: nothing."""
        if self.measured is None:
            return None
        alone = self.measured if self.measured.scenarios == (self.load.name,) else None
        return self.measured.by_scenario.get(self.load.name, alone)

    @property
    def load_bound(self) -> float:
        """Share of all cycles that slots and interrupts take at most in the long run, 0..1; above 1: overload."""
        return float(load(self.sources) + self.schedule.mean_load)

    @property
    def faults(self) -> list[str]:
        """What is broken, each a sentence without its end."""
        return [*_rows_broken(self.rows), *_tick_broken(self), *_measured_broken(self), *_memory_broken(self.memory)]

    @property
    def notes(self) -> list[str]:
        """What is not broken: bounds far above what was measured, of which one could be better; what is not known."""
        found = [
            f"task {row.name}: its bound of {row.bound} cycles is {row.ratio:.2f} times the {row.emulator} measured"
            for row in self.rows
            if row.kind == "task" and row.ratio is not None and row.ratio > RATIO_MOST
        ]
        if self.ring and self.ring_holds is None:
            found.append(f"whether {self.ring} bytes fit its receive ring is not known: it has no {RECEIVE_RING}")
        if self.changes and self.changes_held is None:
            found.append(f"whether {self.changes} changes fit its ring of them is not known: it has no {CHANGES_RING}")
        return found + _frames_unproven(self)

    @property
    def is_met(self) -> bool:
        """Nothing is broken."""
        return not self.faults

    def as_dict(self) -> dict[str, Any]:
        """For programs; units in the keys."""
        found, measured, own, memory = self.responses, self.measured, self.own, self.memory
        return {
            "elf": self.path,
            "load": self.load.name,
            "load_says": self.load.says,
            "tasks": [_row_dict(row) for row in self.rows if row.kind == "task"],
            "interrupts": [_row_dict(row) for row in self.rows if row.kind == "interrupt"],
            "tick": {
                "length_cycles": self.tick_cycles,
                "work_bound_cycles": self.tick_work,
                "work_bound_percent": _percent(self.tick_work, self.tick_cycles),
                "response_bound_cycles": None if found is None else found.tick,
                "response_bound_percent": None if found is None else _percent(found.tick, self.tick_cycles),
                "demand_bound_cycles": self.demand,
                "demand_emulator_max_cycles": own.worst_tick if own else None,
                "executed_bound_cycles": self.executed,
                "executed_emulator_max_cycles": own.busiest_tick if own else None,
                "slot_response_bound_cycles": None if found is None else list(found.slots),
            },
            "load_bound_percent": round(100 * self.load_bound, 2),
            "load_emulator_percent": None if own is None else round(100 * own.load, 2),
            "interrupt_load_bound_percent": round(100 * float(load(self.sources)), 2),
            "poll_gap_bound_cycles": self.gap,
            "poll_gap_emulator_max_cycles": own.between_polls if own else None,
            "receive_ring_needed_bytes": self.ring,
            "receive_ring_bytes": self.ring_holds,
            "changes_ring_needed_entries": self.changes,
            "changes_ring_entries": self.changes_held,
            "frame_bound_cycles": self.frames.cycles,
            "frame_taken_bound_cycles": self.taken,
            "edge_age_bound_cycles": self.edge_age,
            "frames_coming_per_tick": round(self.frames_coming, 2),
            "frames_proven_per_tick": round(self.frames_proven, 2),
            "full_lines": self.lines.as_dict(self.ring_holds),
            "losses_in_emulator": None if own is None else own.losses,
            "ram_static_bytes": memory.static,
            "stack_bound_bytes": memory.stack,
            "stack_emulator_max_bytes": memory.stack_seen,
            "ram_bytes": RAM_BYTES,
            "flash_bytes": memory.flash,
            "measured": None if measured is None else as_json(measured),
            "faults": self.faults,
            "notes": self.notes,
        }


def prove(
    path: Path,
    asked: Load,
    measured: Measurement | None = None,
    board: Mapping[str, int] | None = None,
    program: Program | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Report:
    """The report of an image.

    Args:
        path: its ELF file.
        asked: the load.
        measured: in the emulator, if at all.
        board: largest spans that a board has measured of itself, cycles by task, interrupts in between counted.
        program: the image's, if it has been read already.
        progress: called with the share of its tasks, interrupts and messages that are bounded, 0 to 1.

    Raises:
        TimingError: the file is no image, carries no table, or its timing cannot be told.
    """
    image = read_image(path)
    program = program or program_of(image)
    check_table(path, program)
    of_rows = OF_ROWS if asked.is_full else 1.0
    found = costs(program, asked, lambda share: progress(of_rows * share))
    schedule, sources = found.schedule(program), tuple(found.sources(program, asked))
    deepest = Stack(program).image()
    seen = None if measured is None or not measured.lowest_stack else RAM_END - 1 - measured.lowest_stack
    answers = responses(schedule, sources)
    between = (*sources, *found.between(program, asked))
    frames = found.of_frames(asked)
    kinds = frame_costs(program, lambda share: progress(OF_ROWS + (1 - OF_ROWS) * share)) if asked.is_full else ()
    gap, ring, taken = _of_link(program, found, schedule, between, asked)
    return Report(
        path=str(path),
        table=program.table,
        load=asked,
        rows=tuple(_rows(program, found, answers, measured, board or {})),
        costs=found,
        schedule=schedule,
        sources=sources,
        responses=answers,
        gap=gap,
        ring=ring,
        ring_holds=image.variables[RECEIVE_RING] - 1 if RECEIVE_RING in image.variables else None,
        changes=None if answers is None else changes_of(program, found, schedule, asked),
        changes_held=image.variables[CHANGES_RING] // program.constants.change_bytes - 1
        if CHANGES_RING in image.variables
        else None,
        taken=taken,
        frames=frames,
        frames_proven=_proven(schedule, between, frames),
        lines=full_lines(program, found, schedule, asked, kinds),
        memory=Memory(image.ram_bytes, deepest.bytes, seen, image.flash_bytes),
        measured=measured,
    )


def _rows(
    program: Program, found: Costs, answers: Responses | None, measured: Measurement | None, board: Mapping[str, int]
) -> list[Row]:
    def largest(spans: Mapping[str, Spans], name: str) -> int | None:
        return spans[name].largest if name in spans and len(spans[name].net) else None

    rows = [
        Row(
            name=row.name,
            kind="task",
            bound=found.tasks[row.name],
            budget=row.budget,
            emulator=largest(measured.tasks, row.name) if measured else None,
            board=board.get(row.name),
            response=answers.pieces[row.name] if answers else None,
        )
        for row in program.table.tasks
    ]
    rows += [
        Row(
            name=row.name,
            kind="interrupt",
            bound=found.interrupts[row.name],
            budget=row.budget,
            emulator=largest(measured.interrupts, row.name) if measured else None,
            board=board.get(row.name),
            latency=found.latencies[row.name],
            latency_limit=row.latency,
        )
        for row in program.table.interrupts
    ]
    return rows


def _of_link(
    program: Program, found: Costs, schedule: Schedule, sources: tuple[Source, ...], asked: Load
) -> tuple[int | None, int | None, int | None]:
    """The longest time between two polls of the link, the bytes that wait in its ring then, and the longest time from a
    frame's last byte to its end; each None: overload.

    A poll takes a whole frame at its beginning: after it only what has come since waits. A main loop that was idle or
    at the encoders may have left some bytes of a frame that had not ended.
    """
    after = found.loop + found.edges + found.loop  # edges that are due go before
    gap = longest_gap(schedule, sources, found.blocking, after)
    taken = longest_gap(schedule, sources, found.blocking, after + found.frame)
    idle = longest_gap(schedule, sources, found.idle, after)
    row = next((row for row in program.table.interrupts if row.vector == RECEIVE), None)
    if row is None:
        return gap, 0, taken
    if gap is None or idle is None:
        return gap, None, taken
    bytes_ = asked.sources(row, found.interrupts[row.name])

    def come(window: int) -> int:
        return sum(source.requests(window + 1) for source in bytes_)

    return gap, max(come(gap), program.constants.receive_due - 1 + come(idle)), taken


def _proven(schedule: Schedule, sources: tuple[Source, ...], frames: Source) -> float:
    """Frames that slots and interrupts leave time for in a tick."""
    left = background(schedule, sources) * schedule.tick_cycles
    return float(left / frames.cycles) if frames.cycles else 0.0


def _rows_broken(rows: tuple[Row, ...]) -> list[str]:
    found = []
    for row in rows:
        who = f"{row.kind} {row.name}"
        if row.emulator is not None and row.emulator > row.bound:
            found.append(_above(f"{who} took {row.emulator} cycles in the emulator", row.emulator, "bound", row.bound))
        if row.board is not None and row.response is not None and row.board > row.response:
            found.append(
                _above(f"{who} took {row.board} cycles on the board", row.board, "bound with interrupts", row.response)
            )
        if row.bound > row.budget:
            found.append(_above(f"{who} may take {row.bound} cycles", row.bound, "budget", row.budget))
        if row.latency is not None and row.latency_limit is not None and row.latency > row.latency_limit:
            wait = "for ever" if row.latency >= FOR_EVER else f"{row.latency} cycles"
            found.append(_above(f"{who} may wait {wait}", row.latency, "latency limit", row.latency_limit))
    return found


def _above(says: str, number: int, what: str, limit: int) -> str:
    """By how much a figure is above what it may be."""
    more = "more than" if number >= FOR_EVER else f"{number - limit} above"
    return f"{says}, {more} its {what} of {limit}"


def _tick_broken(report: Report) -> list[str]:
    if report.responses is None:
        return [
            f"overload: under the load {report.load.name!r} the tick and interrupts may take "
            f"{100 * report.load_bound:.1f} % of all cycles"
        ]
    found = []
    if report.responses.tick > report.tick_cycles:
        says = f"the work of a tick and its interrupts may take {report.responses.tick} cycles"
        found.append(_above(says, report.responses.tick, "length", report.tick_cycles))
    for slot in misses(report.schedule, report.responses.slots):
        found.append(
            f"slot {slot} may end {report.responses.slots[slot]} cycles after it began, when the next tick has begun"
        )
    if report.ring is not None and report.ring_holds is not None and report.ring > report.ring_holds:
        found.append(f"{report.ring} bytes may wait for a poll of the link; the ring holds {report.ring_holds}")
    if report.changes is not None and report.changes_held is not None and report.changes > report.changes_held:
        found.append(
            f"ring of changes: {report.changes} may wait for a poll of the encoders; it holds {report.changes_held}"
        )
    if report.edge_age is not None and report.edge_age >= STAMP_ROLLS_OVER:
        found.append(f"the time of an edge may be asked for after {report.edge_age} cycles; its stamp has 16 bits")
    return found


def _measured_broken(report: Report) -> list[str]:
    """What the scenario of the report's own load took, against the bounds under that load."""
    own = report.own
    if own is None or report.responses is None:
        return []
    figures = [
        (f"tasks and interrupts of a tick took {own.worst_tick} cycles", own.worst_tick, report.demand),
        (f"instructions ran in {own.busiest_tick} cycles of a tick", own.busiest_tick, report.executed),
    ]
    if report.gap is not None:
        figures.append((f"{own.between_polls} cycles passed between two polls", own.between_polls, report.gap))
    return [_above(f"{says} in the emulator", took, "bound", most) for says, took, most in figures if took > most]


def _frames_unproven(report: Report) -> list[str]:
    """What is known of the frames that the bound leaves no time for."""
    proven, coming = round(report.frames_proven, 1), round(report.frames_coming, 1)
    if proven >= coming:
        return []
    says = f"frames: the bound proves {proven:g} of the {coming:g} that come per tick, if all are of the costliest; "
    if report.own is None:
        says += "that none of the others is lost is not proven, and nothing was measured"
    elif any(lost := [report.own.losses.get(kind, 0) for kind in ("frames", "bytes")]):
        says += f"the emulator lost {lost[0]} frames and {lost[1]} bytes"
    else:
        says += "that none of the others is lost is measured, not proven"
    found = [says if report.ring_holds is None else f"{says}; the receive ring holds {report.ring_holds} bytes"]
    return [*found, f"frames: {report.lines.says(report.ring_holds)}"] if report.lines.lines else found


def _memory_broken(memory: Memory) -> list[str]:
    found = []
    if memory.stack > memory.left:
        found.append(f"the stack may need {memory.stack} bytes; {memory.left} of {RAM_BYTES} are left for it")
    if memory.stack_seen is not None and memory.stack_seen > memory.stack:
        says = f"the stack took {memory.stack_seen} bytes in the emulator"
        found.append(_above(says, memory.stack_seen, "bound", memory.stack))
    if memory.flash > FLASH_BYTES:
        found.append(f"the image fills {memory.flash} bytes of flash; there are {FLASH_BYTES}")
    return found


def _row_dict(row: Row) -> dict[str, Any]:
    common = {
        "name": row.name,
        "bound_cycles": row.bound,
        "emulator_max_cycles": row.emulator,
        "ratio": None if row.ratio is None else round(row.ratio, 3),
        "board_max_cycles": row.board,
        "budget_cycles": row.budget,
        "slack_cycles": row.slack,
    }
    if row.kind == "task":
        return common | {"response_bound_cycles": row.response}
    return common | {"latency_bound_cycles": row.latency, "latency_limit_cycles": row.latency_limit}


def _percent(part: int, whole: int) -> float:
    return round(100 * part / whole, 2)
