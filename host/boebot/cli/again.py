"""`boebot run --again DIR`: repeats a simulated run from its record, and says where the repetition differs.

Exit codes: 0 it is bit-equal; 1 it differs, or the record is damaged; 2 it cannot be repeated.
"""

from __future__ import annotations

import sys
from pathlib import Path

import typer

from boebot.cli import ending, output, streams
from boebot.errors import BoebotError
from boebot.record.reading import CutError
from boebot.running.again import Repetition, again, recorded

EXIT_DIFFERS, EXIT_USAGE = 1, 2


@ending.of_sensible_rows()
def run_again(folder: Path, as_json: bool, trust: bool) -> None:
    """Repeats the run, prints what came of it, and ends the command with its exit code. `trust`: without asking."""
    try:
        run = recorded(folder)
        if run.foreign and not trust and sys.stdin is not None and sys.stdin.isatty():
            output.say(run.warning)
            trust = typer.confirm("run it?", err=True)
        with (
            streams.kept(for_the_answer=True),
            output.progress_bar(f"{folder} again", run.seconds) as bar,
            output.step_watch(bar) as progress,
        ):
            repetition = again(run, progress, trust=trust)
    except BoebotError as error:
        output.say(str(error))
        raise typer.Exit(EXIT_DIFFERS if isinstance(error, CutError) else EXIT_USAGE) from None
    if repetition.part is not None:
        output.say(repetition.part)
    if as_json:
        output.print_json(_values(repetition))
    else:
        output.line(_sentence(folder, repetition))
    if not repetition.is_equal:
        raise typer.Exit(EXIT_DIFFERS)


def _sentence(folder: Path, repetition: Repetition) -> str:
    if repetition.difference is not None:
        where = f"robot {repetition.robot}, {repetition.difference}"
        return f"differs from {folder} first at {where}"
    if repetition.ends is not None:
        return f"differs from {folder}: robot {repetition.robot} ended by {' and by '.join(map(repr, repetition.ends))}"
    part = "" if repetition.part is None else ", as far as it goes"
    return f"bit-equal to {folder}{part}: {repetition.steps} steps"


def _values(repetition: Repetition) -> dict[str, object]:
    first = repetition.difference
    return {
        "equal": repetition.is_equal,
        "whole": repetition.part is None,
        "steps": repetition.steps,
        "robot": None if repetition.is_equal else repetition.robot,
        "stream": None if first is None else first.stream,
        "time_s": None if first is None else first.time,
        "row": None if first is None else first.row,
        "difference": None if first is None else first.what,
        "ends": None if repetition.ends is None else list(repetition.ends),
    }
