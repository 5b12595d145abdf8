"""The calibration's table: what the data sheet says beside what the emulator and the board measured."""

from __future__ import annotations

from dataclasses import dataclass

from tools.tests.calibration.emulator import Measured
from tools.tests.calibration.program import ROWS
from tools.tests.calibration.rows import Row
from tools.tests.printed import markdown

COLUMNS = ("what", "data sheet", "where", "emulator")  # and "board" where there is one
NOT_REACHED = "–"
WRONG = (": wrong", ": differs")


@dataclass(frozen=True)
class Calibration:
    """What was measured; `board` is None where there was none."""

    emulator: Measured
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
    """The emulator's cell."""
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
    emulator = _both(row, result.emulator.by_program[index], result.emulator.by_pin[index])
    emulator += f"; known: {row.difference}" if row.difference else ""
    board = [] if result.board is None else [_of_board(row, result.board[index])]
    return [row.what, f"{row.expected_text} {row.unit}", row.source, emulator, *board]


def summary(result: Calibration) -> str:
    """How many rows are right."""
    parts = [f"emulator {sum(right_rows(result.emulator))}"]
    if result.board is not None:
        judged = [(row, value) for row, value in zip(ROWS, result.board, strict=True) if not row.board_only_shown]
        right = sum(value is not None and row.is_right(value) for row, value in judged)
        parts.append(f"board {right} (of {len(judged)} that are judged)")
    return f"As the data sheet says, of {len(ROWS)} rows: {', '.join(parts)}."


def printed(result: Calibration) -> str:
    """The table; of instructions only what is wrong somewhere."""
    shown = [(row.group, cells(result, index)) for index, row in enumerate(ROWS)]
    rows = [text for group, text in shown if group != "Instructions" or any(cell.endswith(WRONG) for cell in text)]
    head = COLUMNS if result.board is None else (*COLUMNS, "board")
    return f"{summary(result)}\n\n{markdown(head, rows)}"
