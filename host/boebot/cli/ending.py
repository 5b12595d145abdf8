"""How a run ends at the command line: its table, its files, its errors."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from boebot.cli import output
from boebot.errors import BoebotError
from boebot.record.result import RunResult, TogetherResult
from boebot.running import interrupts
from boebot.view import IncompleteError

HEADER = ("robot", "true distance (m)", "true contacts", "whisker touches", "late steps", "resets", "brain")


class InterruptedRunError(BoebotError):
    """Ctrl-C ended a run; its figures are printed and its files written."""


def end(result: RunResult, out: Path | None, as_json: bool) -> None:
    """Prints the run's figures, writes its files to `out`, and raises why it ended before its time.

    No error hides another: files are written even if nobody reads the table any more, and an error in writing them
    follows the run's own.
    """
    for notice in result.notices:
        output.say(notice)
    _end(result, lambda: output.print_table(result.table()), out, as_json)


def end_together(result: TogetherResult, out: Path | None, as_json: bool) -> None:
    """The same for a run of several robots: a row for each."""
    for number, robot in enumerate(result.robots, 1):
        for notice in robot.notices:
            output.say(f"robot {number}: {notice}")
    _end(result, lambda: output.print_rows(HEADER, _rows(result)), out, as_json)


def _rows(result: TogetherResult) -> list[tuple[str, ...]]:
    rows = []
    for number, robot in enumerate(result.robots, 1):
        table = robot.table()
        figures = (
            table[name] for name in ("true_distance_m", "true_contacts", "whisker_touches", "late_steps", "resets")
        )
        ended = "complete" if robot.error is None else "ended early"
        rows.append((f"{number}  {robot.robot.name}", *map(str, figures), f"{robot.brain}, {ended}"))
    return rows


def _end(result: RunResult | TogetherResult, show: Callable[[], None], out: Path | None, as_json: bool) -> None:
    with interrupts.ignored():
        files: list[Path] = []
        unsaved: BoebotError | None = None
        try:
            if not as_json:
                show()
        finally:
            if out is not None:
                try:
                    files = result.save(out)
                except BoebotError as error:
                    unsaved = error
                    files = error.files if isinstance(error, IncompleteError) else []
        if as_json:
            output.print_json(result.table() | {"files": [str(path) for path in files]})
        elif files:
            assert out is not None
            here = [path.name for path in files if path.parent == out]
            folders = sorted({f"{path.relative_to(out).parts[0]}/" for path in files if path.parent != out})
            output.line(f"files in {out}: {', '.join(here + folders)}")
    interrupted = isinstance(result.error, KeyboardInterrupt)
    first = InterruptedRunError("interrupted") if interrupted else result.error
    if first is not None:
        if unsaved is not None:
            first.add_note(str(unsaved))
        raise first
    if unsaved is not None:
        raise unsaved
