"""The calibration's table: what the data sheet says beside what each emulator and the board measured."""

from __future__ import annotations

from dataclasses import dataclass

from rich.table import Table

from tools.printed import markdown
from tools.tests.calibration.emulator import Measured
from tools.tests.calibration.program import ROWS
from tools.tests.calibration.rows import Row

COLUMNS = ("what", "unit", "data sheet", "where", "emulator", "avr8js", "board")
NOT_CONNECTED, NOT_INSTALLED, NOT_REACHED = "not connected", "not installed", "–"
PAGE_COLUMNS = ("what", "data sheet", "where", "emulator", "avr8js")


@dataclass(frozen=True)
class Calibration:
    """What was measured. `avr8js` and `board` are None where there was none."""

    emulator: Measured
    avr8js: Measured | None = None
    board: list[int | None] | None = None


def is_right(row: Row, by_program: int | None, by_pin: int | None) -> bool:
    """Whether both ways of measuring say what the data sheet says; the pin says nothing of some rows."""
    values = [by_program] if row.is_number else [by_program, by_pin]
    return all(value is not None and row.is_right(value) for value in values)


def right_rows(measured: Measured) -> list[bool]:
    """Row by row."""
    pairs = zip(measured.by_program, measured.by_pin, strict=True)
    return [is_right(row, *pair) for row, pair in zip(ROWS, pairs, strict=True)]


def wrong_rows(result: Calibration) -> list[str]:
    """What is not as the data sheet says, and not known to be so; nor known to be so and right."""
    wrong = [
        f"emulator: {row.group}: {row.what}"
        for row, right in zip(ROWS, right_rows(result.emulator), strict=True)
        if right == bool(row.difference)
    ]
    if result.board is not None:
        wrong += [
            f"board: {row.group}: {row.what}"
            for row, value in zip(ROWS, result.board, strict=True)
            if not row.board_only_shown and (value is None or not row.is_right(value))
        ]
    return wrong


def _both(row: Row, by_program: int | None, by_pin: int | None) -> str:
    """One emulator's cell."""
    if by_program is None:
        return NOT_REACHED
    text = str(by_program)
    if not row.is_number and by_pin != by_program:
        text += f", at the pin {NOT_REACHED if by_pin is None else by_pin}"
    return text if is_right(row, by_program, by_pin) else f"{text}: wrong"


def _of_board(row: Row, value: int | None) -> str:
    if value is None:
        return NOT_REACHED
    if row.board_only_shown:
        return f"{value} ({row.board_only_shown})"
    return str(value) if row.is_right(value) else f"{value}: differs"


def cells(result: Calibration, index: int) -> list[str]:
    """One row's text by COLUMNS."""
    row = ROWS[index]

    def measured(by: Measured | None) -> str:
        return NOT_INSTALLED if by is None else _both(row, by.by_program[index], by.by_pin[index])

    emulator = measured(result.emulator) + (f"; known: {row.difference}" if row.difference else "")
    board = NOT_CONNECTED if result.board is None else _of_board(row, result.board[index])
    return [row.what, row.unit, row.expected_text, row.source, emulator, measured(result.avr8js), board]


def summary(result: Calibration) -> str:
    """How many rows are right."""
    parts = [f"emulator {sum(right_rows(result.emulator))}"]
    if result.avr8js is not None:
        parts.append(f"avr8js {sum(right_rows(result.avr8js))}")
    if result.board is not None:
        judged = [(row, value) for row, value in zip(ROWS, result.board, strict=True) if not row.board_only_shown]
        right = sum(value is not None and row.is_right(value) for row, value in judged)
        parts.append(f"board {right} (of {len(judged)} that are judged)")
    return f"As the data sheet says, of {len(ROWS)} rows: {', '.join(parts)}."


def table(result: Calibration) -> Table:
    """For a terminal; group by group."""
    shown = Table(*COLUMNS, title="Calibration of the emulated board")
    group = ""
    for index, row in enumerate(ROWS):
        if row.group != group:
            group = row.group
            shown.add_section()
            shown.add_row(f"[bold]{group}[/]")
        shown.add_row(*cells(result, index))
    return shown


def printed(result: Calibration) -> str:
    """What stands on the documentation's page: the emulators; of instructions only what is wrong somewhere."""
    rows = []
    for index, row in enumerate(ROWS):
        what, unit, expected, where, *measured = cells(result, index)[:-1]
        if row.group != "Instructions" or any(cell.endswith(": wrong") for cell in measured):
            rows.append([what, f"{expected} {unit}", where, *measured])
    return f"{summary(result)}\n\n{markdown(PAGE_COLUMNS, rows)}"
