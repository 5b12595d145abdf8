"""`boebot replay DIR --brain B`: runs a brain on what was sensed in a run, and names the first command that differs.
In place of a run's folder it takes a log of CAN frames, whoever has recorded it.

Exit codes: 0 all commands are the same; 1 one differs; 2 it cannot be replayed.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import completion, options, output
from boebot.errors import BoebotError
from boebot.record.compare import replayed
from boebot.record.reading import read_run, robots_of
from boebot.robot import Command

EXIT_DIFFERS, EXIT_USAGE = 1, 2


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
        int | None, typer.Option("--node", metavar="N", min=1, max=7, help="Of a CAN log: which board, if several.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="N", help="Of a CAN log: seed of the brain's chance.")] = 1,
) -> None:
    """Run a brain on what was sensed in a run, and name the first command that differs."""
    carried: Callable[[Command], Command] = lambda command: command  # noqa: E731
    try:
        if run.suffix in (".blf", ".asc", ".log"):
            from boebot.can.log import as_on_the_wire, read_log

            result, carried = read_log(run, kind, node, seed), as_on_the_wire
        else:
            robots = robots_of(read_run(run), robot)
            if len(robots) > 1:
                raise BoebotError(f"{run} is a run of {len(robots)} robots; expected --robot 1 to {len(robots)}")
            (result,) = robots.values()
        commands = [carried(command) for command in replayed(result, brain)]
    except BoebotError as error:
        output.say(str(error))
        raise typer.Exit(EXIT_USAGE) from None
    steps, times = result.record.steps, result.record.times
    for number, (step, command) in enumerate(zip(steps, commands, strict=False)):
        recorded = Command(*step[1:])
        if recorded != command:
            where = f"step {number} ({times[step[0]]:.2f} s)"
            output.line(f"{where} differs: {recorded} in the run, {command} in the replay")
            raise typer.Exit(EXIT_DIFFERS)
    if len(commands) < len(steps):
        output.line(f"the brain was over after {len(commands)} steps; the run has {len(steps)}")
        raise typer.Exit(EXIT_DIFFERS)
    output.line(f"all {len(steps)} commands are the same")
