"""How a run ends at the command line: its table, its files, its errors."""

from __future__ import annotations

from pathlib import Path

from boebot import interrupts
from boebot.cli import output
from boebot.errors import BoebotError
from boebot.report import IncompleteError
from boebot.result import RunResult


class InterruptedRunError(BoebotError):
    """Ctrl-C ended a run; its figures are printed and its files written."""


def end(result: RunResult, out: Path | None, as_json: bool) -> None:
    """Prints the run's figures, writes its files to `out`, and raises why it ended before its time.

    No error hides another: files are written even if nobody reads the table any more, and an error in writing them
    follows the run's own.
    """
    for notice in result.notices:
        output.say(notice)
    with interrupts.ignored():
        files: list[Path] = []
        unsaved: BoebotError | None = None
        try:
            if not as_json:
                output.print_table(result.table())
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
            print(f"files in {out}: {', '.join(path.name for path in files)}")
    interrupted = isinstance(result.error, KeyboardInterrupt)
    first = InterruptedRunError("interrupted") if interrupted else result.error
    if first is not None:
        if unsaved is not None:
            first.add_note(str(unsaved))
        raise first
    if unsaved is not None:
        raise unsaved
