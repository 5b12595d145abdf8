"""The record of a run as files for other programs: run.csv, brain.csv, summary.json, the raw bytes and their stamps."""

from __future__ import annotations

import csv
import heapq
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot.record.brain_record import each_part, each_switch, names_in, shown_in
from boebot.record.columns import Columns, ProgramColumns
from boebot.record.columns import columns as pieces
from boebot.record.record import KINDS
from boebot.record.run_folder import FORMAT
from boebot.showing import VALUES

if TYPE_CHECKING:
    from boebot.record.brain_record import BrainNames, BrainRecord
    from boebot.record.record import Record
    from boebot.record.run import Run


def columns(result: Run) -> dict[str, list[str]]:
    """The columns of run.csv: heading (unit in its name) -> cells; a cell is empty where nothing is known."""
    return _columns(result.series, names_in(result.record.each_row(VALUES)))


def _columns(part: Columns, names: Mapping[str, bool]) -> dict[str, list[str]]:
    table: dict[str, list[str]] = {
        "time_s": _cells(part.time, 4),
        "tick": _cells(part.raw["tick"]),
        **{name: _cells(values, digits) for name, (values, digits) in part.columns().items()},
    }
    if not isinstance(part, ProgramColumns):  # there a brain commands
        table["command"] = [KINDS[kind] for kind in part.command["kind"].tolist()]
        table["command_left"], table["command_right"] = (_cells(part.command[side], 4) for side in ("left", "right"))
    shown = shown_in(part.showing.rows(), names).at(part.time)
    table |= {f"shown_{name}": _cells(values, 6) for name, values in shown.numbers.items()}
    table |= {f"shown_{name}": texts for name, texts in shown.texts.items()}
    for name, pose in (("odometry", part.odometry), ("true", part.true_pose)):
        if pose is not None:
            table[f"{name}_x_m"], table[f"{name}_y_m"] = _cells(pose.x, 5), _cells(pose.y, 5)
            table[f"{name}_heading_rad"] = _cells(pose.heading, 5)
    if part.contact is not None:
        table["true_contact"] = _cells(part.contact)
    return table


def write_run(result: Run, path: Path) -> None:
    """run.csv, part by part."""
    names = names_in(result.record.each_row(VALUES))
    _write(path, _rows((_columns(part, names), part.first) for part in pieces(result)))


def _rows(tables: Iterable[tuple[dict[str, list[str]], int]]) -> Iterator[Iterable[str]]:
    """The heading, and the rows of each table from that one on."""
    for number, (table, first) in enumerate(tables):
        if number == 0:
            yield table
        yield from islice(zip(*table.values(), strict=True), first, None)


def _write(path: Path, rows: Iterable[Iterable[Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(rows)


def write_bytes(result: Run, stream: str, path: Path) -> None:
    """to_board.bin and to_host.bin: every byte of that stream."""
    with path.open("wb") as file:
        file.writelines(data for _, data in result.record.each_row(stream))


def brain_columns(part: BrainRecord) -> dict[str, list[str]]:
    """The columns of brain.csv: heading -> cells, one per step of the brain."""
    names = part.names
    table = {"time_s": _cells(part.time, 4), "active": [names.behaviors[index] for index in part.motor]}
    table |= {f"z_{name}": _cells(part.values[:, k], 6) for k, name in enumerate(names.variables)}
    table |= {f"u_{name}": _cells(part.utilities[:, i], 6) for i, name in enumerate(names.processes)}
    table |= {f"gamma_{name}": _cells(part.gammas[:, i], 6) for i, name in enumerate(names.processes)}
    table |= {f"active_{name}": _cells(part.active[:, names.processes.index(name)]) for name in names.cognitive}
    return table


def write_steps(record: Record, names: BrainNames, path: Path) -> None:
    """brain.csv"""
    _write(path, _rows((brain_columns(part), 0) for part in each_part(record, names)))


def write_switches(record: Record, path: Path) -> None:
    """switches.csv"""
    rows = ((f"{one.time:.4f}", one.off, one.on, one.reason) for one in each_switch(record))
    _write(path, chain([("time_s", "off", "on", "reason")], rows))


def write_summary(result: Run, path: Path) -> None:
    """summary.json"""
    summary: dict[str, Any] = {"format": FORMAT} | result.table() | {"counters": result.counters}
    summary["watchdog_resets"] = [
        asdict(reset) | {"time_s": round(reset.time_s - result.clock_offset, 6)} for reset in result.watchdog_resets
    ]
    summary["wall_clock"] = result.wall_clock()
    path.write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")


def write_wire(result: Run, path: Path) -> None:
    """wire.csv: when which bytes of to_board.bin and to_host.bin were sent or read (transport's clock)."""
    rows = heapq.merge(*(_crossings(result, name) for name in ("to_board", "to_host")), key=lambda row: row[0])
    stamped = ((f"{stamp:.6f}", name, first, count) for stamp, name, first, count in rows)
    _write(path, chain([("time_s", "file", "first_byte", "bytes")], stamped))


def _crossings(result: Run, stream: str) -> Iterator[tuple[float, str, int, int]]:
    """Stamp, stream, first byte and bytes of each of its rows."""
    first = 0
    for stamp, data in result.record.each_row(stream):
        yield stamp, stream, first, len(data)
        first += len(data)


def _cells(values: Any, digits: int | None = None) -> list[str]:
    """Array to text: numbers with that many digits, flags as 0 and 1, not-a-number as nothing."""
    if digits is None:
        return [str(int(value)) for value in values.tolist()]
    form = f"%.{digits}f"
    return ["" if value != value else form % value for value in values.tolist()]
