"""`boebot run BRAIN`: a brain drives a robot, emulated or real."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot import report
from boebot.cli import options, output
from boebot.cli.ending import end
from boebot.runner import execute


def run(
    brain: Annotated[str, typer.Argument(metavar="BRAIN", help="Bundled brain (wander) or Python file.")],
    on: options.RunOn = None,
    robot: options.RobotName = "shieldbot",
    arena: options.ArenaName = None,
    seconds: Annotated[float, typer.Option(metavar="S", help="Length of the run by the board's clock.")] = 60.0,
    seed: options.Seed = 1,
    period: options.Period = None,
    realtime: Annotated[bool, typer.Option("--realtime", help="Slow a simulated run down to the wall clock.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Where to write run.csv, run.png, replay.html and raw bytes."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Let a brain drive a robot, and say what happened."""
    if out is not None:
        report.make_folder(out)
    with (
        output.progress_bar(brain if on is None else f"{brain} on {on}", seconds) as bar,
        output.step_watch(bar) as progress,
    ):
        result = execute(
            brain,
            robot=robot,
            arena=arena,
            on=on,
            seconds=seconds,
            seed=seed,
            realtime=realtime,
            period=None if period is None else period / 1000,
            progress=progress,
        )
    end(result, out, json)
