"""How a run ends at the command line: its table, its files, its errors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from boebot.cli import output
from boebot.errors import BoebotError
from boebot.record.result import RunResult, TogetherResult
from boebot.record.run_folder import RECORD
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
    _end(result, lambda: output.print_rows(HEADER, rows(result)), out, as_json)


def rows(result: TogetherResult) -> list[tuple[str, ...]]:
    """A row for each robot, under `HEADER`."""
    found = []
    for number, robot in enumerate(result.robots, 1):
        table = robot.table()
        figures = (
            table[name] for name in ("true_distance_m", "true_contacts", "whisker_touches", "late_steps", "resets")
        )
        ended = "complete" if robot.error is None else "ended early"
        found.append((f"{number}  {robot.robot.name}", *map(str, figures), f"{robot.brain}, {ended}"))
    return found


def files_in(folder: Path, files: Sequence[Path]) -> str:
    """The files in words; of those in folders below only the folders."""
    here = [path.name for path in files if path.parent == folder]
    folders = sorted({f"{path.relative_to(folder).parts[0]}/" for path in files if path.parent != folder})
    return f"files in {folder}: {', '.join(here + folders)}"


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
                    files = [out / RECORD, *result.save(out)]
                except BoebotError as error:
                    unsaved = error
                    files = [out / RECORD, *error.files] if isinstance(error, IncompleteError) else []
        if as_json:
            output.print_json(result.table() | {"files": [str(path) for path in files]})
        elif files:
            assert out is not None
            output.line(files_in(out, files))
    interrupted = isinstance(result.error, KeyboardInterrupt)
    first = InterruptedRunError("interrupted") if interrupted else result.error
    if first is not None:
        if unsaved is not None:
            first.add_note(str(unsaved))
        raise first
    if unsaved is not None:
        raise unsaved
