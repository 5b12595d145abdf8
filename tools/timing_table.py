"""The timing table of firmware/src/tasks.def: its rows, and the documentation's page of them.

python -m tools.timing_table --page docs/reference/timing-table.md
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

from avr_timing.closed_pipe import exit_as
from boebot_timing.table import InterruptRow, SensorRow, Table, TaskRow

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "firmware" / "src" / "tasks.def"
PAGE = ROOT / "docs" / "reference" / "timing-table.md"
SLOT_CYCLES = 40_000  # firmware/src/hal/hal.h
SLOTS_PER_TICK = 4
TICK_MS = 10
CYCLES_PER_US = 16

HEAD = """# Timing table

Made from `firmware/src/tasks.def` by `python -m tools.timing_table`; do not edit. Every task, interrupt and sensor
stands there once: schedule, code, tests and analysis read the same rows, and each image carries them in its section
`.boebot.timing`. The table's comments give the reasons of the numbers.

One cycle is 1/16 µs, a slot 2.5 ms (40,000 cycles), a control tick 4 slots (10 ms).
"""

TASKS = """
## Tasks

A task runs in each slot whose number modulo its period is its phase, within a slot in this order. Its budget is what it
may take itself, without the interrupts that come meanwhile.

| task | period (slots) | phase (slot) | budget (cycles) | budget (µs) | share of the CPU |
|---|---:|---:|---:|---:|---:|
"""

INTERRUPTS = """
## Interrupts

The vector is the N of `__vector_N`; lower ones go first. Its budget is the span from the end of the interrupted
instruction to the end of its RETI, its latency the longest that a request may wait before that, its interval the least
time between two requests in the long run.

| interrupt | vector | budget (cycles) | latency (cycles) | latency (µs) | interval (cycles) | interval (µs) | share |
|---|---:|---:|---:|---:|---:|---:|---:|
"""

SENSORS = """
## Sensors

The conversion is what one reading takes in hardware, the period the ticks between two readings with the robots' own
parameters, the age how old a reading is at most when telemetry takes it, counted from what was first measured of it.

| sensor | conversion (µs) | period (ticks) | period (ms) | age (µs) |
|---|---:|---:|---:|---:|
"""


def read_table(path: Path = TABLE) -> Table:
    """The rows in their order.

    Raises:
        ValueError: a line looks like a row and is none.
    """
    rows: dict[str, list[tuple[str, list[int]]]] = {"TASK": [], "INTERRUPT": [], "SENSOR": []}
    for line in path.read_text(encoding="utf-8").splitlines():
        if head := re.match(r"(TASK|INTERRUPT|SENSOR)\(", line):
            row = re.fullmatch(r"\w+\((\w+)((?:, \d+)+)\)", line)
            if row is None:
                raise ValueError(f"{path.name}: {line!r} is no row: a name and whole numbers are expected")
            rows[head[1]].append((row[1], [int(number) for number in re.findall(r"\d+", row[2])]))
    return Table(
        tuple(TaskRow(name, *numbers) for name, numbers in rows["TASK"]),
        tuple(InterruptRow(name, *numbers) for name, numbers in rows["INTERRUPT"]),
        tuple(SensorRow(name, *numbers) for name, numbers in rows["SENSOR"]),
    )


def fullest_slot(table: Table) -> int:
    """The largest sum of the budgets of one slot's tasks, in cycles."""
    return max(sum(t.budget for t in table.tasks if slot % t.period == t.phase) for slot in range(256))


def page(table: Table) -> str:
    """The documentation's page of a table, in Markdown."""
    tasks = "".join(
        f"| {t.name} | {t.period} | {t.phase} | {t.budget:,} | {t.budget / CYCLES_PER_US:,.1f} "
        f"| {t.budget / (t.period * SLOT_CYCLES):.2%} |\n"
        for t in table.tasks
    )
    tick = sum(t.budget * SLOTS_PER_TICK / t.period for t in table.tasks)
    sums = (
        f"\nAll tasks together: {tick:,.0f} cycles in a tick ({tick / (SLOTS_PER_TICK * SLOT_CYCLES):.1%} of it), "
        f"{fullest_slot(table):,} in the fullest slot.\n"
    )
    interrupts = "".join(
        f"| {i.name} | {i.vector} | {i.budget:,} | {i.latency:,} | {i.latency / CYCLES_PER_US:,.1f} "
        f"| {i.interval:,} | {i.interval / CYCLES_PER_US:,.1f} | {i.budget / i.interval:.2%} |\n"
        for i in table.interrupts
    )
    sensors = "".join(
        f"| {s.name} | {s.conversion:,} | {s.period} | {s.period * TICK_MS} | {s.age:,} |\n" for s in table.sensors
    )
    return HEAD + TASKS + tasks + sums + INTERRUPTS + interrupts + SENSORS + sensors


def main() -> None:
    """Prints the page, or writes it."""
    parser = argparse.ArgumentParser(prog="python -m tools.timing_table", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--page", type=Path, metavar="FILE", help="write it there")
    options = parser.parse_args()
    text = page(read_table())
    if options.page is None:
        print(text, end="")
    else:
        options.page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    exit_as(main)
