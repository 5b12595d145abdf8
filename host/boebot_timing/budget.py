"""All about an image's timing in one report: bounds, what was measured, budgets, and what is broken.

Bounds come from the machine code alone; they are compared with what the image's own table allows, and with what was
measured in the emulator or on the board, wherever somebody has. A measured figure above its bound means that the bound
is wrong, and counts like any broken budget. What a task or an interrupt takes by itself, and the stack, hold for every
scenario that was measured; what a tick takes is compared with the scenario of the report's own load alone.

What must end in time is the tick: tasks, interrupts, edges. Frames are worked off in what they leave, and never keep a
slot waiting longer than one of them takes. The bytes of `ring` are those that come between two polls of the link; they
are all that wait where the link was not behind before. Under an overload bytes and edges may be lost; judged are the
tick, and of the interrupts those on which the tick and the pulses of the servos depend.

A task without a bound is named, and counts with its budget; that it keeps it is for the emulator to show.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from avr_timing.bounds.stack import Stack
from avr_timing.interrupts.byte_reads import RECEIVE
from avr_timing.interrupts.interrupts_off import WAKE
from avr_timing.interrupts.response import Responses, Schedule, Source, load, longest_gap, misses, response, responses
from boebot.errors import AnalysisError, TimingError
from boebot_timing.changes import of_image as changes_of
from boebot_timing.costs import Costs, costs
from boebot_timing.firmware import Firmware, check, load_firmware
from boebot_timing.loads import SLOT, Load
from boebot_timing.measured import Measurement, Spans, as_json
from boebot_timing.realisable import CLOCK_HZ, BoardTimes
from boebot_timing.table import Table

RAM_START, RAM_END = 0x100, 0x900  # data memory of the ATmega328P
RAM_BYTES = RAM_END - RAM_START
FLASH_BYTES = 0x8000
FOR_EVER = 1 << 20  # cycles, 65 ms: what waits this long has no bound
STAMP_ROLLS_OVER = 1 << 16  # cycles after which the stamp of an edge says nothing any more


@dataclass(frozen=True, slots=True)
class Row:
    """A task or an interrupt; cycles, None: not known."""

    name: str
    kind: str  # "task" or "interrupt"
    bound: int  # of a task without one: its budget
    budget: int
    unbounded: str | None = None  # why it has no bound
    emulator: int | None = None
    board: int | None = None  # with the interrupts that came in between: a board cannot tell them apart
    response: int | None = None  # of a task: from the beginning of its slot to its end, interrupts included
    latency: int | None = None  # of an interrupt: from request to acceptance
    waited: int | None = None  # the longest that was measured of it under the report's load
    latency_limit: int | None = None

    @property
    def slack(self) -> int:
        """What is left of the budget above the bound."""
        return self.budget - self.bound

    @property
    def ratio(self) -> float | None:
        """The bound to the longest that was measured in the emulator; None: nothing was, or there is none."""
        return self.bound / self.emulator if self.emulator and self.unbounded is None else None


@dataclass(frozen=True, slots=True)
class Memory:
    """Bytes; `stack_seen` is the deepest that was measured. `stack` is the bound, but for tasks of which it is not
    known how deep they go (`unknown`): with these it is what was measured, if that is more."""

    static: int
    stack: int
    stack_seen: int | None
    flash: int
    unknown: tuple[str, ...] = ()

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
    ring_holds: int  # bytes for which it has room
    changes: int | None  # of the encoders' lines, that wait in their ring at most; None also: no encoders
    changes_held: int  # for which it has room
    taken: int | None  # cycles from a frame's last byte to the end of what it asks for, likewise
    frames: Source  # that the host sends
    memory: Memory
    measured: Measurement | None = None
    assumed_chip: str = ""  # a sentence, where the image does not say for which chip it is

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
        wakes it. A tick is longer by what the slot's interrupt waits at its end."""
        names = {row.name for row in self.rows if row.kind == "interrupt"}
        wakes = sum(source.requests(self.tick_cycles) for source in self.sources if source.name in names)
        frames = self.frames.cycles * (self.frames.requests(self.tick_cycles) + 1)  # one may have waited
        slots = {row.name for row in self.table.interrupts if row.vector == SLOT}
        late = max((row.latency or 0 for row in self.rows if row.kind == "interrupt" and row.name in slots), default=0)
        return min(self.tick_cycles + late, self.demand + frames + wakes * (WAKE + self.costs.loop + self.costs.edges))

    @property
    def ratio(self) -> float | None:
        """Of the sum of the bounds of the fullest tick's tasks to that of the longest that were measured of each; None:
        one of them has not run, or has no bound."""
        rows = {row.name: row for row in self.rows if row.kind == "task"}
        tick = max(range(self.schedule.ticks), key=self.schedule.tick_work)
        slots = self.schedule.slots[tick * self.schedule.slots_per_tick :][: self.schedule.slots_per_tick]
        found = [rows[piece.name] for slot in slots for piece in slot if piece.name in rows and rows[piece.name].bound]
        measured = sum(row.emulator or 0 for row in found)
        if not measured or any(row.ratio is None for row in found):
            return None
        return sum(row.bound for row in found) / measured

    @property
    def edge_age(self) -> int | None:
        """Cycles from an edge to the moment at which its time is reported. None: there is overload, where the board
        notices if that is too late, or no encoder.

        Each slot begins with that, and so does each round of the main loop: it waits for no frame.
        """
        if self.responses is None or not self.costs.change or self.load.is_overload:
            return None
        begins = response(self.costs.loop + self.costs.round, self.sources)
        return None if begins is None else self.schedule.slot_cycles + begins

    @property
    def board_times(self) -> BoardTimes:
        """For a step of the brain: by bounds; under overload by budgets."""
        if self.responses is None:
            return BoardTimes.of(self.table)
        telemetry, frame = self.responses.pieces.get("telemetry", 0), self.taken or 0
        return BoardTimes(self.table.sensors, telemetry / CLOCK_HZ, frame / CLOCK_HZ)

    @property
    def own(self) -> Measurement | None:
        """What was measured under the report's own load; None: nothing."""
        return _own(self.measured, self.load)

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
        """What is not broken, and not known."""
        found = [self.assumed_chip] if self.assumed_chip else []
        found += [
            f"task {row.name} is not bounded ({row.unbounded}): its budget of {row.budget} cycles counts, "
            + ("and nothing was measured" if row.emulator is None else f"{row.emulator} were measured")
            for row in self.rows
            if row.unbounded is not None
        ]
        if self.memory.unknown:
            seen = self.memory.stack_seen
            found.append(
                f"the stack of task {', '.join(self.memory.unknown)} is not bounded: "
                + ("nothing was measured" if seen is None else f"{seen} bytes were measured of the whole image")
            )
        return found

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
                "work_bound_share": _share(self.tick_work, self.tick_cycles),
                "response_bound_cycles": None if found is None else found.tick,
                "response_bound_share": None if found is None else _share(found.tick, self.tick_cycles),
                "demand_bound_cycles": self.demand,
                "demand_emulator_max_cycles": own.worst_tick if own else None,
                "executed_bound_cycles": self.executed,
                "executed_emulator_max_cycles": own.busiest_tick if own else None,
                "slot_response_bound_cycles": None if found is None else list(found.slots),
            },
            "load_bound_share": round(self.load_bound, 4),
            "load_emulator_share": None if own is None else round(own.load, 4),
            "interrupt_load_bound_share": round(float(load(self.sources)), 4),
            "poll_gap_bound_cycles": self.gap,
            "poll_gap_emulator_max_cycles": own.between_polls if own else None,
            "receive_ring_needed_bytes": self.ring,
            "receive_ring_bytes": self.ring_holds,
            "changes_ring_needed_entries": self.changes,
            "changes_ring_entries": self.changes_held,
            "frame_bound_cycles": self.frames.cycles,
            "frame_taken_bound_cycles": self.taken,
            "edge_age_bound_cycles": self.edge_age,
            "bound_to_emulator_of_the_ticks_tasks": None if self.ratio is None else round(self.ratio, 3),
            "losses_in_emulator": None if own is None else own.losses,
            "ram_static_bytes": memory.static,
            "stack_bound_bytes": memory.stack,
            "stack_not_bounded_of": list(memory.unknown),
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
    firmware: Firmware | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Report:
    """The report of an image.

    Args:
        path: its ELF file.
        asked: the load.
        measured: in the emulator, if at all.
        board: largest spans that a board has measured of itself, cycles by task, interrupts in between counted.
        firmware: the image, if it has been read already: what does not depend on the load is worked out once.
        progress: called with the share of its tasks and interrupts that are bounded, 0 to 1.

    Raises:
        AnalysisError: the file is no image, or its code cannot be followed or has no bound where one is needed.
        TimingError: it carries no table, or one that is not that of its program.
    """
    firmware = firmware or load_firmware(path)
    check(firmware)
    found = costs(firmware, asked, progress)
    schedule, sources, busy = found.schedule(firmware), found.sources(firmware, asked), found.busy(firmware, asked)
    answers = responses(schedule, busy)
    gap, ring, taken = _of_link(firmware, found, schedule, (*busy, *found.between(firmware, asked)), asked)
    return Report(
        path=str(path),
        table=firmware.table,
        load=asked,
        rows=tuple(_rows(firmware, asked, found, answers, measured, board or {})),
        costs=found,
        schedule=schedule,
        sources=tuple(sources),
        responses=answers,
        gap=gap,
        ring=None if asked.is_overload else ring,
        ring_holds=firmware.constants.receive_ring,
        changes=None if answers is None or asked.is_overload else changes_of(firmware, found, schedule, asked),
        changes_held=firmware.constants.changes_ring - 1,
        taken=taken,
        frames=found.of_frames(asked),
        memory=_memory(firmware, found, measured),
        measured=measured,
        assumed_chip=firmware.image.assumed_chip,
    )


def _memory(firmware: Firmware, found: Costs, measured: Measurement | None) -> Memory:
    """A task whose depth is not known counts with what was measured of the image."""
    unknown, stack = [], Stack(firmware.program)
    for name in found.unbounded:
        try:
            stack.of(firmware.task_entry(name))
        except (AnalysisError, TimingError):
            unknown.append(name)
    deepest = Stack(firmware.program, [firmware.task_entry(name) for name in unknown]).image()
    seen = None if measured is None or not measured.lowest_stack else RAM_END - 1 - measured.lowest_stack
    most = max(deepest, seen) if unknown and seen is not None else deepest
    return Memory(firmware.image.ram_bytes, most, seen, firmware.image.flash_bytes, tuple(unknown))


def _rows(
    firmware: Firmware,
    asked: Load,
    found: Costs,
    answers: Responses | None,
    measured: Measurement | None,
    board: Mapping[str, int],
) -> list[Row]:
    def largest(spans: Mapping[str, Spans], name: str) -> int | None:
        return spans[name].largest if name in spans and len(spans[name].net) else None

    rows = [
        Row(
            name=row.name,
            kind="task",
            bound=found.tasks[row.name],
            budget=row.budget,
            unbounded=found.unbounded.get(row.name),
            emulator=largest(measured.tasks, row.name) if measured else None,
            board=board.get(row.name),
            response=answers.pieces[row.name] if answers else None,
        )
        for row in firmware.table.tasks
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
            waited=_waited(measured, asked, row.name),
            latency_limit=row.latency if row.vector not in asked.may_be_late else None,
        )
        for row in firmware.table.interrupts
    ]
    return rows


def _own(measured: Measurement | None, asked: Load) -> Measurement | None:
    """What was measured under that load; None: nothing."""
    if measured is None:
        return None
    return measured.by_scenario.get(asked.name, measured if measured.scenarios == (asked.name,) else None)


def _waited(measured: Measurement | None, asked: Load, name: str) -> int | None:
    own = _own(measured, asked)
    spans = None if own is None else own.interrupts.get(name)
    return int(spans.latency.max()) if spans is not None and len(spans.latency) else None


def _of_link(
    firmware: Firmware, found: Costs, schedule: Schedule, sources: tuple[Source, ...], asked: Load
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
    row = next((row for row in firmware.table.interrupts if row.vector == RECEIVE), None)
    if row is None:
        return gap, 0, taken
    if gap is None or idle is None:
        return gap, None, taken
    bytes_ = asked.sources(row, found.interrupts[row.name])

    def come(window: int) -> int:
        return sum(source.requests(window + 1) for source in bytes_)

    return gap, max(come(gap), firmware.constants.poll_bytes + come(idle)), taken


def _rows_broken(rows: tuple[Row, ...]) -> list[str]:
    found = []
    for row in rows:
        who = f"{row.kind} {row.name}"
        if row.emulator is not None and row.emulator > row.bound:
            what = "bound" if row.unbounded is None else "budget"
            found.append(_above(f"{who} took {row.emulator} cycles in the emulator", row.emulator, what, row.bound))
        if row.board is not None and row.response is not None and row.board > row.response:
            found.append(
                _above(f"{who} took {row.board} cycles on the board", row.board, "bound with interrupts", row.response)
            )
        if row.bound > row.budget:
            found.append(_above(f"{who} may take {row.bound} cycles", row.bound, "budget", row.budget))
        if row.waited is not None and row.latency is not None and row.waited > row.latency:
            found.append(_above(f"{who} waited {row.waited} cycles in the emulator", row.waited, "bound", row.latency))
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
    late = [] if report.load.is_overload else misses(report.schedule, report.responses.slots)
    for slot in late:
        found.append(
            f"slot {slot} may end {report.responses.slots[slot]} cycles after it began, when the next tick has begun"
        )
    if report.ring is not None and report.ring > report.ring_holds:
        found.append(f"{report.ring} bytes may wait for a poll of the link; the ring holds {report.ring_holds}")
    if report.changes is not None and report.changes > report.changes_held:
        found.append(f"ring of changes: {report.changes} may wait to be worked off; it holds {report.changes_held}")
    if not report.load.is_overload and report.edge_age is not None and report.edge_age >= STAMP_ROLLS_OVER:
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
        "bound_cycles": row.bound if row.unbounded is None else None,
        "not_bounded": row.unbounded,
        "emulator_max_cycles": row.emulator,
        "ratio": None if row.ratio is None else round(row.ratio, 3),
        "board_max_cycles": row.board,
        "budget_cycles": row.budget,
        "slack_cycles": row.slack,
    }
    if row.kind == "task":
        return common | {"response_bound_cycles": row.response}
    return common | {
        "latency_bound_cycles": row.latency,
        "latency_emulator_max_cycles": row.waited,
        "latency_limit_cycles": row.latency_limit,
    }


def _share(part: int, whole: int) -> float:
    return round(part / whole, 4)
