"""How a run ends at the command line: its table, its files, its errors."""

from __future__ import annotations

import contextlib
import struct
import traceback
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import typer

from boebot.cli import output
from boebot.errors import BoebotError, InterruptedRunError
from boebot.record import figures
from boebot.record.reading import CutError
from boebot.record.record_file import NoRecordError
from boebot.record.run import Run
from boebot.record.run_folder import RECORD
from boebot.result import Result, RunResult
from boebot.view import IncompleteError

# ---- the run as a terminal shows it: five rows of what matters, and below them what should be zero and is not --------

ZERO = (
    "late_steps",
    "long_steps",
    "lost_frames",
    "bad_frames",
    "overruns",
    "dead_man_stops",
    "fallback_takeovers",
    "resets",
    "sessions_lost",
    "hung_at",
    "unrealisable",
)
"""Figures that should be zero, or nothing."""

_EARLY = "early, by an error"


class Detail(Enum):
    """How much is printed of a run."""

    FEW = "what matters"
    ALL = "all figures"
    NOTHING = "nothing but errors"
    JSON = "all figures as JSON"


def detail(*, json: bool, verbose: bool, quiet: bool) -> Detail:
    """By the options of that name; one of them at most."""
    chosen = [kind for kind, wanted in ((Detail.JSON, json), (Detail.ALL, verbose), (Detail.NOTHING, quiet)) if wanted]
    if len(chosen) > 1:
        raise typer.BadParameter("expected one of --json, --verbose and --quiet")
    return chosen[0] if chosen else Detail.FEW


def print_run(result: Result, wanted: Detail, *, is_said: bool = False) -> None:
    """The table of a run, if any time has passed in it. JSON is for the caller, who knows its files. `is_said`: the
    sentence of the error that has ended it follows, and is not printed here."""
    robots = result.robots
    if wanted not in (Detail.FEW, Detail.ALL) or (is_said and not any(robot.run_time for robot in robots)):
        return
    for number, robot in enumerate(robots, 1):
        if len(robots) > 1:
            output.line(f"robot {number}")
        if wanted is Detail.ALL:
            output.print_table(robot.table() | ({"ended": _EARLY} if is_said else {}))
            output.line("by this computer's clock:")
            output.print_table(robot.wall_clock())
            continue
        table = output.empty_table(show_header=False)
        table.add_column(style="dim")
        table.add_column(overflow="fold")
        for name, words in five_rows(robot):
            table.add_row(name, _EARLY if is_said and name == "ended" else words)
        output.console().print(table)
        if wrong := not_zero(robot):
            output.line(f"{', '.join(wrong)}; expected 0 of each")


def five_rows(result: RunResult) -> list[tuple[str, str]]:
    """Name and words of each."""
    table = result.table()
    where = f" in {table['arena']}" if table["arena"] else ""
    faster = f", {result.real_time_factor:.3g} times real time" if result.real_time_factor else ""
    way = result.way_in_words()
    if (error_m := result.odometry_error) is not None:
        way.append(f"odometry off by {error_m:.2f} m at the end")
    if (charge := result.battery_charge) is not None:
        way.append(f"battery {charge:.0%} full at the end")
    return [
        ("run", f"{result.brain} on {result.robot.name} ({result.board}){where}, seed {result.seed}{_changed(table)}"),
        ("time", f"{result.run_time:g} s{faster}"),
        ("way", ", ".join(way)),
        ("program", f"SHA-256 {result.program[:16]}...") if result.program else ("brain", _brain(result)),
        *([("faults", table["faults"])] if table["faults"] else []),
        ("ended", table["ended"] + _touched(result)),
    ]


def _changed(table: dict[str, Any]) -> str:
    """What the simulated robot was without, and what it and the brain had in other magnitudes than usual."""
    parts = ("without", table["without"]), ("with", table["imperfections"]), ("with", table["parameters"])
    return "".join(f", {word} {names}" for word, names in parts if names)


def _touched(result: RunResult) -> str:
    """That somebody interfered with the run, in words."""
    return f", touched {figures.counted(result.touched, 'time', 'times')} by hand" if result.touched else ""


def not_zero(result: RunResult) -> list[str]:
    """What should be zero and is not, in words."""
    table = result.table() | result.wall_clock()
    wrong = {name: table[name] for name in ZERO if table[name]}
    return [f"{name} {value}" for name, value, _ in figures.rows(wrong)]


def _brain(result: RunResult) -> str:
    parts = [f"{figures.counted(result.steps, 'step', 'steps')}, {result.period:g} s apart"]
    record = result.overview.brain
    if record is not None:
        shares = record.shares(result.run_time)
        parts.append(figures.counted(record.behavior_switches, "switch", "switches"))
        parts.append(", ".join(f"{name} {share:.0%}" for name, share in shares.items() if share > 0))
    return "; ".join(parts)


# ---- its end ---------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def of_sensible_rows() -> Iterator[None]:
    """A record whose checksums are right can still be none that a run has written, and whatever reads it may meet what
    cannot be: that is one sentence."""
    try:
        yield
    except (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, struct.error, MemoryError) as error:
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

    No error hides another: an error in writing the files follows the run's own.
    """
    if wanted is not Detail.NOTHING:
        for notice in result.notices:
            output.say(notice)
    interrupted = isinstance(result.error, KeyboardInterrupt)
    said = result.error is not None and not interrupted
    unsaved = show(result, wanted, out, () if out is None else _files(result, out), is_said=said)
    first = InterruptedRunError("interrupted") if interrupted else result.error
    if first is not None and unsaved is not None:
        first.add_note(str(unsaved))
    if (error := first or unsaved) is not None:
        raise error


def _files(result: Result, out: Path) -> Iterator[list[Path]]:
    yield [out / RECORD]
    yield result.save(out)


def show(
    result: Result, wanted: Detail, folder: Path | None, made: Iterable[list[Path]], *, is_said: bool = False
) -> BoebotError | None:
    """Prints a run's figures and the files in `folder` that `made` makes; a closed standard output
    stops no file. Returns why not all of them could be made. `is_said`: as of `print_run`."""
    files: list[Path] = []
    unsaved: BoebotError | None = None
    try:
        print_run(result, wanted, is_said=is_said)
    finally:
        try:
            for paths in made:
                files += paths
        except BoebotError as error:
            unsaved = error
            files += error.files if isinstance(error, IncompleteError) else []
    files = [path for path in files if path.exists()]  # a brain may have deleted them
    if wanted is Detail.JSON:
        output.print_json(result.table() | {"wall_clock": result.wall_clock(), "files": [str(path) for path in files]})
    elif files and folder is not None and wanted is not Detail.NOTHING:
        output.line(files_in(folder, files))
    return unsaved


def files_in(folder: Path, files: Sequence[Path]) -> str:
    """The files in words; of those in folders below only the folders."""
    here = [path.name for path in files if path.parent == folder]
    folders = sorted({f"{path.relative_to(folder).parts[0]}/" for path in files if path.parent != folder})
    return f"files in {folder}: {', '.join(here + folders)}"
