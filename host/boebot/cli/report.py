"""`boebot report DIR`: the figures and files of a run, made anew from its record."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.can import log
from boebot.cli import ending, options, output
from boebot.cli.run_table import Detail, detail, print_run
from boebot.errors import BoebotError
from boebot.record.reading import CutError, mend
from boebot.record.run_folder import RECORD, RunFolder
from boebot.result import Result, read_run, robots_of
from boebot.view import IncompleteError


@ending.of_sensible_rows()
def report(
    run: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, with its record.mcap.")],
    csv: Annotated[
        bool, typer.Option("--csv", help="Also run.csv, the bytes of the line, and a brain's steps.")
    ] = False,
    foxglove: Annotated[
        bool, typer.Option("--foxglove", help="Also foxglove.mcap, which Foxglove draws without set-up.")
    ] = False,
    can: Annotated[
        str | None,
        typer.Option(
            "--can",
            metavar="blf|asc|log",
            help="Also can.blf, can.asc or can.log: the messages as CAN frames, for CAN tools.",
        ),
    ] = None,
    mended: Annotated[
        bool, typer.Option("--mend", help="Of a cut or damaged record: what is left of it, as record-mended.mcap.")
    ] = False,
    json: options.Json = False,
    verbose: options.Verbose = False,
    quiet: options.Quiet = False,
) -> None:
    """Print a run's figures and write its files anew, from its record. A record that is cut is read up to there; of one
    that is damaged, what is left is read and the exit code is 1."""
    if can is not None and can not in log.KINDS:
        raise typer.BadParameter(f"there is no format {can!r}; expected one of {', '.join(log.KINDS)}")
    wanted = detail(json=json, verbose=verbose, quiet=quiet)
    folder = run if run.is_dir() else run.parent
    result = read_run(run)
    files: list[Path] = []
    unsaved: BoebotError | None = None
    with RunFolder(folder):
        try:
            files += result.save(folder, csv=csv)
            if foxglove:
                from boebot.view import save_for_foxglove

                files.append(save_for_foxglove(result.robots, folder))
            if can is not None:
                files += _can_logs(result, folder, can)
            if mended and isinstance(result.error, CutError):
                files.append(mend(folder / RECORD if run.is_dir() else run, result.robots))
        except BoebotError as error:  # the figures are printed all the same
            unsaved = error
            files += error.files if isinstance(error, IncompleteError) else []
    with ending.of_record(result):
        if wanted is Detail.JSON:
            wall_clock = {"wall_clock": result.wall_clock()}
            output.print_json(result.table() | wall_clock | {"files": [str(path) for path in files]})
        elif wanted is not Detail.NOTHING:
            print_run(result, wanted)
            if files:
                output.line(ending.files_in(folder, files))
        if unsaved is not None:
            raise unsaved


def _can_logs(result: Result, folder: Path, kind: str) -> list[Path]:
    """Writes a log for each robot that has a board."""
    robots = robots_of(result)
    if len(robots) == 1:
        return [log.save_log(robots[1], folder / f"can.{kind}")]
    boards = {number: robot for number, robot in robots.items() if robot.layout is None}
    if not boards:
        raise BoebotError("no robot of the run has a board, so there are no CAN frames")
    return [
        log.save_log(robot, folder / f"robot-{number}" / f"can.{kind}", (number - 1) % 7 + 1)
        for number, robot in boards.items()
    ]
