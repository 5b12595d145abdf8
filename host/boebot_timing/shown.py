"""What `boebot timing` shows to people: tables that fit 80 columns, and in words the broken limits."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from boebot.cli import output
from boebot_timing.budget import FOR_EVER

if TYPE_CHECKING:
    from boebot_timing.budget import Report, Row
    from boebot_timing.realisable import Verdict
    from boebot_timing.worst_path import WorstPath

_UNKNOWN = "–"
_BROKEN, _FINE, _ASIDE = "bold red", "green", "dim"


def show_report(report: Report) -> None:
    """Two tables, the sums, and the broken limits."""
    console = output.console()
    console.print(Text.assemble((Path(report.path).name, "bold"), f"  under the load {report.load.name!r}"))
    console.print(Text(report.load.says, style=_ASIDE))
    measured, board = report.measured is not None, any(row.board is not None for row in report.rows)
    console.print(_rows(report, "task", measured, board))
    console.print(_rows(report, "interrupt", measured, False))
    console.print(output.table(_sums(report)))
    for note in report.notes:
        console.print(Text(f"note: {note}", style=_ASIDE))
    for fault in report.faults:
        console.print(Text(f"broken: {fault}", style=_BROKEN))
    if not report.faults:
        console.print(Text("all budgets are met", style=_FINE))


def _rows(report: Report, kind: str, measured: bool, board: bool) -> Table:
    """Tasks or interrupts; columns of which nothing is known are left out."""
    shown = _table(f"{kind} (cycles)")
    titles = ["bound", *(["emulator", "ratio"] if measured else []), *(["board"] if board else []), "budget", "slack"]
    titles += ["response"] if kind == "task" else ["latency", "limit"]
    for title in titles:
        shown.add_column(title, justify="right", no_wrap=True)
    for row in (row for row in report.rows if row.kind == kind):
        shown.add_row(row.name, *_cells(row, titles), style=_BROKEN if _is_broken(row) else None)
    return shown


def _cells(row: Row, titles: Iterable[str]) -> list[str]:
    numbers = {
        "bound": row.bound if row.unbounded is None else None,
        "emulator": row.emulator,
        "board": row.board,
        "budget": row.budget,
        "slack": row.slack if row.unbounded is None else None,
        "response": row.response,
        "latency": row.latency,
        "limit": row.latency_limit,
    }
    cells = {title: _cell(number) for title, number in numbers.items()}
    cells["ratio"] = _UNKNOWN if row.ratio is None else f"{row.ratio:.2f}"
    return [cells[title] for title in titles]


def _is_broken(row: Row) -> bool:
    late = row.latency is not None and row.latency_limit is not None and row.latency > row.latency_limit
    slow = row.board is not None and row.response is not None and row.board > row.response
    return row.slack < 0 or (row.emulator or 0) > row.bound or late or slow


def _cell(number: int | None) -> str:
    if number is None:
        return _UNKNOWN
    return "∞" if number >= FOR_EVER else f"{number:,}"


def _sums(report: Report) -> dict[str, Any]:
    """Names with units, values."""
    found, own, memory, tick = report.responses, report.own, report.memory, report.tick_cycles

    def percent(cycles: int | None) -> float | None:
        return None if cycles is None else round(100 * cycles / tick, 1)

    return {
        "work_of_the_fullest_tick_bound_percent": percent(report.tick_work),
        "response_of_the_tick_bound_percent": percent(None if found is None else found.tick),
        "tasks_and_interrupts_of_a_tick_bound_percent": percent(report.demand),
        "tasks_and_interrupts_of_a_tick_in_emulator_percent": percent(own.worst_tick if own else None),
        "busiest_tick_in_emulator_percent": percent(own.busiest_tick if own else None),
        "load_of_slots_and_interrupts_bound_percent": round(100 * report.load_bound, 1),
        "load_with_frames_in_emulator_percent": None if own is None else round(100 * own.load, 1),
        "poll_gap_bound_(bytes_wait_in_the_ring)_cycles": report.gap,
        "poll_gap_in_emulator_cycles": own.between_polls if own else None,
        "receive_ring_needed_bytes": _of(report.ring, report.ring_holds),
        "changes_ring_needed": _of(report.changes, report.changes_held),
        "bound_to_emulator_of_the_ticks_tasks": None if report.ratio is None else round(report.ratio, 2),
        "stack_bound_bytes": memory.stack,
        "stack_in_emulator_bytes": memory.stack_seen,
        "static_ram_bytes": memory.static,
        "ram_and_stack_bytes": memory.static + memory.stack,
        "flash_bytes": memory.flash,
    }


def _of(number: int | None, most: int | None) -> str | None:
    """A figure beside what there is."""
    if number is None or most is None:
        return None if number is None else f"{number:,}"
    return f"{number:,} of {most:,}"


def show_path(path: WorstPath) -> None:
    """The lines of a worst path; their cycles in sum are the bound."""
    shown = _table("function")
    shown.add_column("line")
    for title in ("cycles", "runs", "passes"):
        shown.add_column(title, justify="right", no_wrap=True)
    for row in path.rows:
        passes = ", ".join(f"{passes:,}" for passes in row.passes)
        shown.add_row(row.function, row.line or _UNKNOWN, f"{row.cycles:,}", f"{row.runs:,}", passes)
    console = output.console()
    console.print(Text(f"the worst path of {path.kind} {path.name}: {path.cycles:,} cycles", style="bold"))
    console.print(shown)


def show_verdict(verdict: Verdict) -> None:
    """The events of a time step, and the answer."""
    console = output.console()
    if verdict.events:
        shown = _table(f"{verdict.robot}, one step")
        for title in ("takes (ms)", "ends (ms)", "own period (ms)"):
            shown.add_column(title, justify="right")
        for event in verdict.events:
            end, own = (_UNKNOWN, f"{event.every * 1000:g}") if event.beside else (f"{event.end * 1000:.3f}", "")
            shown.add_row(event.name, f"{event.seconds * 1000:.3f}", end, own)
        console.print(shown)
    console.print(Text(verdict.sentence, style=_FINE if verdict.is_realisable else _BROKEN))
    for note in verdict.notes:
        console.print(Text(f"note: {note}", style=_ASIDE))


def _table(title: str) -> Table:
    shown = output.empty_table(padding=(0, 1, 0, 0))
    shown.add_column(title)
    return shown
