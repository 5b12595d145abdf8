"""A firmware image of the kit: its program, and the timing table that it carries, checked to belong together."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from avr_timing.bounds.stack import VECTORS
from avr_timing.bounds.wcet import WorstCase
from avr_timing.flow.graph import program_of
from avr_timing.interrupts.interrupts_off import InterruptsOff
from avr_timing.interrupts.latency import Latencies
from avr_timing.program import Program
from boebot.errors import AnalysisError, TimingError
from boebot.image.elf import Image, read_image
from boebot.image.places import is_of
from boebot_timing.loads import APART, NEVER_NEAR, SLOT, TICK
from boebot_timing.table import Constants, Table, read_table


@dataclass(frozen=True)
class Firmware:
    """An image with its program and its timing table."""

    image: Image
    program: Program
    table: Table

    @cached_property
    def worst(self) -> WorstCase:
        """Of its functions."""
        return WorstCase(self.program)

    @cached_property
    def latencies(self) -> Latencies:
        """Of its interrupts, under whatever load."""
        return Latencies(InterruptsOff(self.program, self.worst), apart=APART, never_near=NEVER_NEAR)

    @property
    def constants(self) -> Constants:
        """Of the table. Raises TimingError where it has none."""
        if self.table.constants is None:
            raise TimingError(
                f"{self.image.path} carries no constants; expected CONSTANT rows in its section .boebot.timing"
            )
        return self.table.constants

    def entry_of(self, name: str) -> int | None:
        """Of a function of the source; the compiler may have added to its name. None: there is none, or several."""
        found = {other: entry for other, entry in self.program.by_name.items() if is_of(other, name)}
        return found.get(name, next(iter(found.values())) if len(found) == 1 else None)

    def entries_of(self, names: Collection[str]) -> list[int]:
        """Of those of these functions that the image has."""
        return [entry for entry in map(self.entry_of, names) if entry is not None]

    def task_entry(self, name: str) -> int:
        """Of the function of a task. Raises TimingError where it is no function."""
        entry = self.entry_of(f"{name}_task")
        if entry is None:
            raise TimingError(f"{self.image.path} has no function {name}_task")
        return entry


def load_firmware(path: Path) -> Firmware:
    """The firmware in an ELF file.

    Raises:
        AnalysisError: it is no image, or its code cannot be followed.
        TimingError: its timing table is damaged.
    """
    image = read_image(path)
    return Firmware(image, program_of(image), read_table(path))


def bounds_of(path: Path, entries: Collection[int]) -> dict[int, int | str]:
    """Of any program: the entry point `boebot.bounds` (boebot.guests.BoundsOf)."""
    try:
        worst = WorstCase(program_of(read_image(path)))
    except AnalysisError as error:
        return dict.fromkeys(entries, str(error))
    return {entry: _bound_of(worst, entry) for entry in entries}


def _bound_of(worst: WorstCase, entry: int) -> int | str:
    if entry not in worst.program.functions:
        return f"the function at 0x{entry:04X} is called by no address that stands in the program"
    try:
        return worst.bound(entry).cycles
    except AnalysisError as error:
        return str(error)


def check(firmware: Firmware) -> None:
    """Raises TimingError: it is not a program with a schedule, or its table not that of this program, or promises what
    no program can keep."""
    path, program, table = firmware.image.path, firmware.program, firmware.table
    if not table.tasks:
        raise TimingError(f"{path} carries no timing table; expected TASK rows in its section .boebot.timing")
    said = firmware.constants
    if said.slot_cycles * said.slots_per_tick != TICK:
        raise TimingError(
            f"{path}: by its constants a tick is {said.slots_per_tick} slots of {said.slot_cycles} cycles; expected "
            f"{TICK} cycles in all, 10 ms"
        )
    if wrong := _impossible(table, said):
        raise TimingError(f"{path}: {wrong}")
    if "main" not in program.by_name:
        raise TimingError(f"{path} has no function main; expected an image with its symbols (not stripped)")
    for row in table.interrupts:
        if 4 * row.vector not in program.functions:
            raise TimingError(
                f"{path}: row {row.name!r} of its timing table is of interrupt {row.vector}; expected one that is used"
            )
        if row.vector == SLOT and row.interval != said.slot_cycles:
            raise TimingError(
                f"{path}: by row {row.name!r} of its timing table a slot has {row.interval} cycles; "
                f"expected {said.slot_cycles}, as its constants say"
            )
    named = {row.vector for row in table.interrupts}
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
