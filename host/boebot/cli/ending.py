"""How a run ends at the command line: its table, its files, its errors."""

from __future__ import annotations

import contextlib
import struct
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path

import typer

from boebot.cli import output
from boebot.cli.run_table import Detail, print_run
from boebot.errors import BoebotError, InterruptedRunError
from boebot.record.reading import CutError
from boebot.record.record_file import NoRecordError
from boebot.record.run import Run
from boebot.record.run_folder import RECORD
from boebot.result import Result
from boebot.view import IncompleteError


@contextlib.contextmanager
def of_sensible_rows() -> Iterator[None]:
    """A record whose checksums are right can still be none that a run has written, and whatever reads it may meet what
    cannot be: that is one sentence."""
    try:
        yield
    except (ValueError, LookupError, TypeError, ArithmeticError, struct.error, MemoryError) as error:
        *_, last = traceback.extract_tb(error.__traceback__)  # in case that the fault is the kit's
        what = f"{type(error).__name__}: {error}; {Path(last.filename).name}, line {last.lineno}"
        raise NoRecordError(f"the record makes no sense ({what}); expected one that a run has written") from error


@contextlib.contextmanager
def of_record(result: Run | Result) -> Iterator[None]:
    """Says what the record of a result lacks; where it is damaged inside, the command ends with exit code 1."""
    error = result.error
    if not isinstance(error, CutError):
        yield
        return
    output.say(str(error))
    yield
    if error.exit_code:
        raise typer.Exit(error.exit_code)


def end(result: Result, out: Path | None, wanted: Detail) -> None:
    """Prints the run's figures, writes its files to `out`, and raises why it ended before its time.

    No error hides another: files are written even if nobody reads the table any more, and an error in writing them
    follows the run's own.
    """
    if wanted is not Detail.NOTHING:
        for notice in result.notices:
            output.say(notice)
    interrupted = isinstance(result.error, KeyboardInterrupt)
    files: list[Path] = []
    unsaved: BoebotError | None = None
    try:
        print_run(result, wanted, is_said=result.error is not None and not interrupted)
    finally:
        if out is not None:
            try:
                files = [out / RECORD, *result.save(out)]
            except BoebotError as error:
                unsaved = error
                files = [out / RECORD, *error.files] if isinstance(error, IncompleteError) else []
            files = [path for path in files if path.exists()]  # a brain may have deleted them
    if wanted is Detail.JSON:
        output.print_json(result.table() | {"wall_clock": result.wall_clock(), "files": [str(path) for path in files]})
    elif files and wanted is not Detail.NOTHING:
        assert out is not None
        output.line(files_in(out, files))
    first = InterruptedRunError("interrupted") if interrupted else result.error
    if first is not None:
        if unsaved is not None:
            first.add_note(str(unsaved))
        raise first
    if unsaved is not None:
        raise unsaved


def files_in(folder: Path, files: Sequence[Path]) -> str:
    """The files in words; of those in folders below only the folders."""
    here = [path.name for path in files if path.parent == folder]
    folders = sorted({f"{path.relative_to(folder).parts[0]}/" for path in files if path.parent != folder})
    return f"files in {folder}: {', '.join(here + folders)}"
