"""`boebot replay DIR --brain B`: runs a brain on what was sensed in a run, and names the first command that differs.
In place of a run's folder it takes a log of CAN frames, whoever has recorded it.

Exit codes: 0 all commands are the same; 1 one differs, or record or log lack a part inside; 2 it cannot be replayed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.can.log import as_on_the_wire, is_log, read_log
from boebot.cli import completion, ending, options, output, streams
from boebot.errors import BoebotError
from boebot.record.reading import CutError
from boebot.record.run import Run
from boebot.result import read_run, robots_of
from boebot.robot import Command
from boebot.running.replayed import replayed

EXIT_DIFFERS, EXIT_USAGE = 1, 2


@ending.of_sensible_rows()
def replay(
    run: Annotated[
        Path, typer.Argument(metavar="DIR|LOG", help="Folder of a run, or a log of CAN frames (.blf, .asc, .log).")
    ],
    brain: Annotated[
        str,
        typer.Option(
            "--brain",
            metavar="BRAIN",
            autocompletion=completion.brains,
            help="Bundled brain, or a Python or TOML file, as of boebot run.",
        ),
    ],
    robot: options.RobotNumber = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="R",
            autocompletion=completion.robots,
            help="Of a CAN log: bundled robot or .toml file; else the one that its board names.",
        ),
    ] = None,
    node: Annotated[
        str | None, typer.Option("--node", metavar="[BUS:]N", help="Of a CAN log: which board, if several.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="N", help="Of a CAN log: seed of the brain's chance; else 1.")
    ] = None,
) -> None:
    """Run a brain on what was sensed in a run, and name the first command that differs."""
    try:
        if is_log(run):
            if robot is not None:
                raise BoebotError(f"{run} is a log of CAN frames; expected --node in place of --robot")
            result = read_log(run, kind, node, 1 if seed is None else seed)
        elif (kind, node, seed) != (None, None, None):
            raise BoebotError(f"{run} is no log of CAN frames; expected no --kind, --node or --seed")
        else:
            result = _recorded(run, robot)
        with streams.kept():
            commands = replayed(result, brain)
    except BoebotError as error:
        output.say(str(error))
        raise typer.Exit(EXIT_DIFFERS if isinstance(error, CutError) else EXIT_USAGE) from None
    with ending.of_record(result):
        _compare(result, [as_on_the_wire(command) for command in commands] if is_log(run) else commands)


def _compare(result: Run, commands: list[Command]) -> None:
    """Prints what came of it; where something differs, it ends the command with its exit code."""
    steps = result.record.steps
    for number, (step, command) in enumerate(zip(steps, commands, strict=False)):
        recorded = Command(*step[1:])
        if recorded != command:
            output.line(f"{_place(result, number)} differs: {recorded} in the run, {command} in the replay")
            raise typer.Exit(EXIT_DIFFERS)
    if len(commands) < len(steps):
        output.line(f"the brain was over after {len(commands)} steps; the run has {len(steps)}")
        raise typer.Exit(EXIT_DIFFERS)
    part = ", as far as it goes" if isinstance(result.error, CutError) else ""
    output.line(f"all {len(steps)} commands are the same{part}")


def _recorded(run: Path, number: int | None) -> Run:
    """The run in a folder, of one robot; what a brain did after something that is lost cannot be replayed."""
    robots = robots_of(read_run(run, up_to_damage=True), number)
    if len(robots) > 1:
        raise BoebotError(f"{run} is a run of {len(robots)} robots; expected --robot 1 to {len(robots)}")
    (result,) = robots.values()
    if isinstance(result.error, CutError) and result.error.lost and not result.record.count("command"):
        raise result.error
    return result


def _place(result: Run, step: int) -> str:
    """A step of the brain in words, with the board's tick that it answered, if there is a board."""
    series, index = result.series, result.series.steps[step]
    tick = f"tick {series.raw['tick'][index]}, " if result.layout is None else ""
    return f"step {step} ({tick}{series.time[index]:.2f} s)"
