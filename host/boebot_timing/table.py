"""The timing table that an image carries, from its section `.boebot.timing` alone."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass, fields
from pathlib import Path

from boebot.errors import TimingError
from boebot.files import regular
from boebot.image import section_of

SECTION = ".boebot.timing"
MOST = 0xFFFFFFFF  # of any number in a row
VECTORS = 25  # interrupts of the ATmega328P (data sheet, table 12-6), the reset not counted
LONGEST_CYCLE = 4096  # slots until the schedule repeats: ten seconds
_DIGITS = 12  # of a number; longer ones are too large anyway


@dataclass(frozen=True, slots=True)
class TaskRow:
    """TASK of tasks.def: runs in each slot whose number mod `period` is `phase`; `budget` in cycles, net."""

    name: str
    period: int
    phase: int
    budget: int


@dataclass(frozen=True, slots=True)
class InterruptRow:
    """INTERRUPT of tasks.def: all numbers but `vector` in cycles.

    `budget` is its span from acceptance to the end of RETI, `latency` the longest from the request to acceptance,
    `interval` the least time between two requests in the long run.
    """

    name: str
    vector: int
    budget: int
    latency: int
    interval: int


@dataclass(frozen=True, slots=True)
class SensorRow:
    """SENSOR of tasks.def: a reading takes `conversion` us in hardware, comes every `period` ticks, and is at most
    `age` us old when telemetry takes it."""

    name: str
    conversion: int
    period: int
    age: int


@dataclass(frozen=True, slots=True)
class Constants:
    """What the program is built with and its bounds depend on.

    A control tick is `slots_per_tick` slots of `slot_cycles` cycles; when more than `slots_kept` wait, ticks are
    dropped. Between slots the main loop is at the link when a frame has ended, or the receive ring is full. The
    ring holds `receive_ring` bytes, and its interrupt is off while it is full; a poll of the link takes at most
    `poll_bytes`. Before the link the main loop is at the pin changes when `changes_due` of them wait, in a ring of
    `changes_ring` places, of which one stays free. Their interrupt masks itself when `changes_storm` come close one
    after another.
    """

    slot_cycles: int
    slots_per_tick: int
    slots_kept: int
    receive_ring: int
    poll_bytes: int
    changes_ring: int
    changes_due: int
    changes_storm: int


@dataclass(frozen=True, slots=True)
class Table:
    """The timing table of an image, in its order."""

    tasks: tuple[TaskRow, ...] = ()
    interrupts: tuple[InterruptRow, ...] = ()
    sensors: tuple[SensorRow, ...] = ()
    constants: Constants | None = None


CONSTANTS = tuple(field.name for field in fields(Constants))


@dataclass(frozen=True, slots=True)
class ConstantRow:
    """One of the constants."""

    name: str
    value: int


Row = TaskRow | InterruptRow | SensorRow | ConstantRow

ROWS: dict[str, tuple[type[Row], int]] = {
    "TASK": (TaskRow, 3),
    "INTERRUPT": (InterruptRow, 4),
    "SENSOR": (SensorRow, 3),
    "CONSTANT": (ConstantRow, 1),
}


def read_table(path: Path) -> Table:
    """The timing table of an ELF file; empty where it carries none.

    Raises:
        TimingError: it cannot be read, is no ELF file of 32 bits, or is damaged.
    """
    try:
        data = regular(path).read_bytes()
    except OSError as error:
        raise TimingError(f"{path} cannot be read: {error.strerror or error}") from error
    try:
        return table_of(path, section_of(data, SECTION))
    except struct.error as error:
        raise TimingError(f"{path} is not an ELF file, or is damaged: {error}") from error


def table_of(path: Path, data: bytes) -> Table:
    """The rows of `.boebot.timing`: lines as "TASK whisker 1 0 200", each ended by a zero byte.

    Raises:
        TimingError: a row is none, or contradicts itself or another.
    """
    rows = [_row(path, text) for text in data.split(b"\0") if text]
    # a sensor may be named as the task that reads it
    names = [(isinstance(row, SensorRow), row.name) for row in rows]
    double = next((name for sensor, name in names if names.count((sensor, name)) > 1), None)
    if double is not None:
        raise TimingError(f"{path}: its timing table has two rows of the name {double!r}; expected one")
    cycle = math.lcm(*(row.period for row in rows if isinstance(row, TaskRow)))
    if cycle > LONGEST_CYCLE:
        raise TimingError(
            f"{path}: the periods of its tasks repeat after {cycle} slots only; expected at most {LONGEST_CYCLE}"
        )
    return Table(
        tasks=tuple(row for row in rows if isinstance(row, TaskRow)),
        interrupts=tuple(row for row in rows if isinstance(row, InterruptRow)),
        sensors=tuple(row for row in rows if isinstance(row, SensorRow)),
        constants=_constants(path, {row.name: row.value for row in rows if isinstance(row, ConstantRow)}),
    )


def _constants(path: Path, found: dict[str, int]) -> Constants | None:
    """Those that are needed here, all of them or none at all."""
    if found and (missing := [name for name in CONSTANTS if name not in found]):
        raise TimingError(
            f"{path}: of the constants of its timing table {missing[0]!r} is missing; expected {', '.join(CONSTANTS)}"
        )
    return Constants(**{name: found[name] for name in CONSTANTS}) if found else None


def _row(path: Path, data: bytes) -> Row:
    text = data.decode("ascii", "backslashreplace")
    kind, *words = text.split() or [""]
    row, numbers = ROWS.get(kind, (None, 0))
    if row is None:
        raise TimingError(
            f"{path}: row {text!r} of its timing table is of no known kind: {', '.join(ROWS)} are expected"
        )
    if len(words) != 1 + numbers or not all(word.isascii() and word.isdigit() for word in words[1:]):
        raise TimingError(f"{path}: row {text!r} of its timing table: a name and {numbers} whole numbers are expected")
    numbers_of = [int(word[:_DIGITS]) for word in words[1:]]
    if wrong := _contradiction(row, numbers_of):
        raise TimingError(f"{path}: row {text!r} of its timing table: {wrong}")
    return row(words[0], *numbers_of)


def _contradiction(row: type[Row], numbers: list[int]) -> str | None:
    """What of a row cannot be; None: nothing."""
    if max(numbers) > MOST:
        return f"{max(numbers)} is too large; expected at most {MOST}"
    if row is TaskRow:
        period, phase, budget = numbers
        if not 0 <= phase < period:
            return f"phase {phase} of period {period}; expected a phase below its period"
        return None if budget else "a budget of 0 cycles; expected at least 1"
    if row is InterruptRow:
        vector, budget, _, interval = numbers
        if not 1 <= vector <= VECTORS:
            return f"vector {vector}; expected 1 to {VECTORS}, as the ATmega328P has"
        return None if budget and interval else "a budget or an interval of 0 cycles; expected at least 1"
    if row is ConstantRow:
        return None if numbers[0] else "a constant of 0; expected at least 1"
    return None if numbers[1] else "a period of 0 ticks; expected at least 1"
