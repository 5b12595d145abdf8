"""`boebot plot DIR COLUMN...`: columns of run.csv over time, as a picture, from the record of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import output
from boebot.errors import BoebotError
from boebot.record.reading import CutError, read_run
from boebot.record.result import RunResult


def plot(
    run: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a run, with its record.mcap; of one robot's run.")
    ],
    columns: Annotated[
        list[str], typer.Argument(metavar="COLUMN...", help="Names as in run.csv: ping_distance_m, command_left.")
    ],
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Picture to write, .png or .svg. Else plot.png here.")
    ] = None,
) -> None:
    """Draw columns of a run over time, a panel for each. Their names are those of run.csv."""
    # here, as matplotlib takes a while: no other command should wait for it
    from boebot.view import column_plot

    result = read_run(run)
    if not isinstance(result, RunResult):
        raise BoebotError(f"{run} is a run of {len(result.robots)} robots; expected one of a single robot")
    if isinstance(result.error, CutError):
        output.say(str(result.error))
    output.line(f"picture: {column_plot.write(result, columns, out or Path('plot.png'))}")
