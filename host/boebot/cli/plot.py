"""`boebot plot DIR COLUMN...`: columns of run.csv over time, as a picture, from the record of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import ending, options, output
from boebot.result import read_run, robots_of


@ending.of_sensible_rows()
def plot(
    run: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, with its record.mcap.")],
    columns: Annotated[
        list[str], typer.Argument(metavar="COLUMN...", help="Names as in run.csv: ping_distance_m, command_left.")
    ],
    robot: options.RobotNumber = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Picture to write, .png or .svg. Else plot.png here.")
    ] = None,
) -> None:
    """Draw columns of a run over time, a panel for each, with a curve for each robot. Their names are those of
    run.csv."""
    # here, as matplotlib takes a while: no other command should wait for it
    from boebot.view import column_plot

    result = read_run(run)
    robots = robots_of(result, robot)
    with ending.of_record(result):
        output.line(f"picture: {column_plot.write(robots, columns, out or Path('plot.png'))}")
