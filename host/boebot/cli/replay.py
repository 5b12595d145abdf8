"""`boebot replay DIR --brain B`: runs a brain on what was sensed in a run, and names the first command that differs.

Exit codes: 0 all commands are the same; 1 one differs; 2 it cannot be replayed.
"""

from __future__ import annotations

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
    run: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run, with its record.mcap.")],
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
) -> None:
    """Run a brain on what was sensed in a run, and name the first command that differs."""
    try:
        robots = robots_of(read_run(run), robot)
        if len(robots) > 1:
            raise BoebotError(f"{run} is a run of {len(robots)} robots; expected --robot 1 to {len(robots)}")
        (result,) = robots.values()
        commands = replayed(result, brain)
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
