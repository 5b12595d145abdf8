"""`boebot report DIR`: the figures, files and pictures of a run, made anew from its record."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import ending, options, output
from boebot.cli.ending import detail
from boebot.errors import expected_one
from boebot.guests import FORMATS, Guest, folder_of, guests
from boebot.record.reading import CutError, mend
from boebot.record.run import Run
from boebot.record.run_folder import RECORD, RunFolder
from boebot.result import Result, read_run, robots_of
from boebot.view import save_for_foxglove, save_pins

CSV, FOXGLOVE, VCD = "csv", "foxglove", "vcd"
_KINDS = (CSV, FOXGLOVE, VCD, *guests(FORMATS))
_WHOLE = {FOXGLOVE: save_for_foxglove, VCD: save_pins}


@ending.of_sensible_rows()
def report(
    run: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, with its record.mcap.")],
    columns: Annotated[
        list[str] | None,
        typer.Argument(metavar="COLUMN", help="With --plot: names as in run.csv: ping_distance_m, command_left."),
    ] = None,
    formats: Annotated[
        list[str] | None,
        typer.Option(
            "--as",
            metavar="FORMAT",
            autocompletion=options.one_of(lambda: _KINDS),
            help=f"Write the run in a format for other programs, too: {', '.join(_KINDS)}; again for each further one.",
        ),
    ] = None,
    plot: Annotated[
        bool,
        typer.Option("--plot", help="In place of all else draw the COLUMNs over time; without a COLUMN name them all."),
    ] = False,
    robot: options.RobotNumber = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --plot: picture, .png or .svg. Else plot.png here.")
    ] = None,
    mended: Annotated[
        bool, typer.Option("--mend", help="Of a cut or damaged record: what is left of it, as record-mended.mcap.")
    ] = False,
    json: options.Json = False,
    verbose: options.Verbose = False,
    quiet: options.Quiet = False,
) -> None:
    """Print a run's figures and write its files anew, from its record; or draw columns of it. Of a folder of many runs,
    what came of them.

    A record that is cut is read up to there; of one that is damaged, what is left is read and the exit code is 1.
    --as csv writes run.csv, the bytes of the line, and the steps of a brain of processes; --as foxglove writes
    foxglove.mcap, which Foxglove draws without set-up; --as vcd of a run with --pins writes pins.vcd for GTKWave and
    PulseView.
    """
    for name in formats or []:
        if name not in _KINDS:
            raise typer.BadParameter(f"there is no format {name!r}; {expected_one(name, _KINDS)}")
    if not plot and (columns or robot is not None or out is not None):
        raise typer.BadParameter("COLUMN, --robot and --out go with --plot")
    wanted = detail(json=json, verbose=verbose, quiet=quiet)
    if (kind := folder_of(run)) is not None:
        if plot or formats or mended:
            raise typer.BadParameter("--plot, --as and --mend are of one run; this is a folder of many")
        Guest(run.name, kind.report).load()(run, wanted)
        return
    result = read_run(run)
    with ending.of_record(result):
        if plot:
            _plot(robots_of(result, robot), columns or [], out)
        else:
            folder = run if run.is_dir() else run.parent
            unsaved = ending.show(result, wanted, folder, _files(run, folder, result, formats or [], mended))
            if unsaved is not None:
                raise unsaved


def _plot(robots: Mapping[int, Run], columns: list[str], out: Path | None) -> None:
    # here, as matplotlib takes a while: no other command should wait for it
    from boebot.view import column_plot, tables

    if columns:
        output.line(f"picture: {column_plot.write(robots, columns, out or Path('plot.png'))}")
    else:
        for name in dict.fromkeys(name for result in robots.values() for name in tables.columns(result)):
            output.line(name)


def _files(run: Path, folder: Path, result: Result, formats: list[str], mended: bool) -> Iterator[list[Path]]:
    """Makes the files of a run anew, and those of further formats."""
    with RunFolder(folder):
        yield result.save(folder, csv=CSV in formats)
        for name in formats:
            if name in _WHOLE:
                yield [_WHOLE[name](result.robots, folder)]
            elif name != CSV:
                write: Callable[[Mapping[int, Run], Path], list[Path]] = guests(FORMATS)[name].load()
                yield write(robots_of(result), folder)
        if mended and isinstance(result.error, CutError):
            yield [mend(folder / RECORD if run.is_dir() else run, result.robots)]
