"""Whether an image's timing table is that of its program: before anything is worked out by it."""

from __future__ import annotations

from pathlib import Path

from boebot.errors import TimingError
from boebot.timing.loads import SLOT, TICK
from boebot.timing.program import Constants, Program, Table
from boebot.timing.stack import VECTORS


def check_table(path: Path, program: Program) -> None:
    """Raises TimingError: it is not a program with a schedule, or its table not that of this program, or promises what
    no program can keep."""
    if not program.table.tasks:
        raise TimingError(f"{path} carries no timing table; expected TASK rows in its section .boebot.timing")
    said = program.constants
    if said.slot_cycles * said.slots_per_tick != TICK:
        raise TimingError(
            f"{path}: by its constants a tick is {said.slots_per_tick} slots of {said.slot_cycles} cycles; expected "
            f"{TICK} cycles in all, 10 ms"
        )
    if wrong := _impossible(program.table, said):
        raise TimingError(f"{path}: {wrong}")
    if "main" not in program.by_name:
        raise TimingError(f"{path} has no function main; expected an image with its symbols (not stripped)")
    for row in program.table.interrupts:
        if 4 * row.vector not in program.functions:
            raise TimingError(
                f"{path}: row {row.name!r} of its timing table is of interrupt {row.vector}; expected one that is used"
            )
        if row.vector == SLOT and row.interval != said.slot_cycles:
            raise TimingError(
                f"{path}: by row {row.name!r} of its timing table a slot has {row.interval} cycles; "
                f"expected {said.slot_cycles}, as its constants say"
            )
    named = {row.vector for row in program.table.interrupts}
    unsaid = [number for number in VECTORS if 4 * number in program.functions and number not in named]
    if unsaid:
        raise TimingError(
            f"{path} uses interrupt {unsaid[0]} at {program.where(4 * unsaid[0])}, of which its timing table does not "
            "say how often it comes; expected an INTERRUPT row of it"
        )


def _impossible(table: Table, said: Constants) -> str | None:
    """What of the budgets cannot be kept together with how often they are due; None: nothing.

    A latency may be above the interval: a request may wait for the next one, or be left out, as the row's owner says.
    """
    for name, budget, every in (
        *((row.name, row.budget, row.period * said.slot_cycles) for row in table.tasks),
        *((row.name, row.budget, row.interval) for row in table.interrupts),
    ):
        if budget > every:
            return (
                f"row {name!r} of its timing table has a budget of {budget} cycles and is due each {every}; expected a "
                "budget of at most these"
            )
    early = next((row for row in table.sensors if row.age < row.conversion), None)
    if early is not None:
        return (
            f"row {early.name!r} of its timing table: a reading of {early.conversion} us is at most {early.age} "
            "us old; expected at least what it takes"
        )
    return None
