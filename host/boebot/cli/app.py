"""What the `boebot` command consists of. A sub-command's module is imported when it is asked for, so that the list
of all is there at once."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from boebot.cli.options import SETTINGS

COMMANDS = {
    "run": ("run.run", "Let a brain drive a robot, and say what happened."),
    "report": ("report.report", "Print a run's figures and write its files anew, from its record."),
    "plot": ("plot.plot", "Draw columns of a run over time, a panel for each."),
    "replay": ("replay.replay", "Run a brain on what was sensed in a run, and name the first command that differs."),
    "new": ("new.new", "Write a brain, NAME.py, to start from."),
    "list": ("names.list_names", "List what is bundled, by the names that other commands and Python understand."),
    "arena": ("arena.arena", "Show an arena: a picture, its size, where a robot starts, and its shapes."),
    "robot": (
        "robot.robot",
        "Show a robot: a picture from above with its wiring, its measures, and a table of its wires.",
    ),
    "experiment": ("experiment.experiment", "Run experiments of the notes: figures, measured against expected."),
    "serve": ("serve.serve", "Offer the emulated robot to other programs, until Ctrl-C."),
    "bridge": ("bridge.bridge", "Put a board on a CAN bus: every message both ways, until Ctrl-C."),
    "dbc": ("dbc.dbc", "Write the CAN database of a robot's messages, for CAN tools; or check one."),
    "doctor": (
        "doctor.doctor",
        "Examine port, firmware and each device of a robot that stands still; say what is not as it should be.",
    ),
    "info": ("info.info", "Say who is at a port: firmware, compiler, image, devices."),
    "teleop": ("teleop.teleop", "Drive by keyboard: arrows or W A S D, 1..9 for the speed, space to stop, Q to end."),
    "link": ("link.link", "Watch the link: counters of both ends, round trips, the board's clock."),
    "parameters": ("parameters.app", "List, read, set, save and reset the board's parameters."),
    "timing": ("timing.timing", "What the firmware may take, what it took, and whether that fits its budgets."),
}
"""Module and function in boebot.cli of each sub-command, and what the list of them says."""


class Commands(TyperGroup):
    """The sub-commands: only their lines, until one is asked for."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = {name: TyperCommand(name, help=line) for name, (_, line) in COMMANDS.items()}

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """All of them, with their lines."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Of these arguments the command, as it is."""
        if args[0] in COMMANDS:
            self.commands[args[0]] = command(args[0])
        return super().resolve_command(ctx, args)


def command(name: str) -> Any:
    """A sub-command with its options, imported."""
    module, _, attribute = COMMANDS[name][0].partition(".")
    work = getattr(import_module(f"boebot.cli.{module}"), attribute)
    if not isinstance(work, typer.Typer):
        function, work = work, typer.Typer(add_completion=False, **SETTINGS)
        work.command()(function)
    made = typer.main.get_command(work)
    made.name = name
    return made


app = typer.Typer(
    name="boebot",
    cls=Commands,
    help="Drive a Boe-Bot class robot, or its emulated twin, by a brain written in Python.",
    no_args_is_help=True,
    **SETTINGS,
)


def _version(wanted: bool) -> None:
    if wanted:
        import boebot
        from boebot.cli import output
        from boebot.link import messages, mismatch

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
