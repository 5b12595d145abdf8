"""What the `boebot` command consists of."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import boebot
from boebot.cli import (
    arena,
    doctor,
    experiment,
    info,
    link,
    names,
    new,
    options,
    output,
    parameters,
    plot,
    replay,
    report,
    robot,
    run,
    serve,
    teleop,
    timing,
)
from boebot.link import messages, mismatch

app = typer.Typer(
    name="boebot",
    help="Drive a Boe-Bot class robot, or its emulated twin, by a brain written in Python.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("run", cls=options.Command)(run.run)
app.command("serve", cls=options.Command)(serve.serve)
app.command("report")(report.report)
app.command("plot")(plot.plot)
app.command("replay")(replay.replay)
app.command("list")(names.list_names)
app.command("arena")(arena.arena)
app.command("robot")(robot.robot)
app.command("info")(info.info)
app.command("doctor")(doctor.doctor)
app.command("teleop", cls=options.Command)(teleop.teleop)
app.command("link")(link.link)
app.add_typer(parameters.app, name="parameters")
app.command("new")(new.new)
app.command("experiment")(experiment.experiment)
app.command("timing")(timing.timing)


def _version(wanted: bool) -> None:
    if wanted:
        output.line(
            f"boebot {boebot.__version__} (protocol {mismatch.version_name()}, schema {messages.SCHEMA_HASH:08x}, "
            f"Python {sys.version.split()[0]})"
        )
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and leave.")
    ] = False,
) -> None:
    del version
