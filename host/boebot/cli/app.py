"""What the `boebot` command consists of. A sub-command's module is imported when it is asked for, so that the list
of all is there at once."""

from __future__ import annotations

import gc
import sys
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from boebot.cli.options import SETTINGS
from boebot.errors import BoebotError
from boebot.guests import COMMANDS as GUESTS
from boebot.guests import Command, Guest, guests

COMMANDS = {
    "run": Command("Let a brain drive a robot, and say what happened.", "boebot.cli.run:run"),
    "report": Command(
        "Print a run's figures and write its files anew, from its record; or draw columns of it.",
        "boebot.cli.report:report",
    ),
    "replay": Command(
        "Run a brain on what was sensed in a run, and name the first command that differs; or repeat the run.",
        "boebot.cli.replay:replay",
    ),
    "new": Command("Write a brain, NAME.py, or a sketch for the Uno, to start from.", "boebot.cli.new:new"),
    "list": Command(
        "List what is bundled, by the names that other commands and Python understand.", "boebot.cli.names:list_names"
    ),
    "show": Command(
        "Show an arena or a robot: a picture, its measures, what stands there or how it is wired.",
        "boebot.cli.show:app",
    ),
    "faults": Command(
        "List what can fail in a run of a robot: boebot run --fault NAME[=VALUE]@START[..END].",
        "boebot.cli.faults:faults",
    ),
    "serve": Command("Offer the emulated robot to other programs, until Ctrl-C.", "boebot.cli.serve:serve"),
    "flash": Command(
        "Write the kit's firmware or a program of your own into a board, and say what answers.",
        "boebot.cli.flash:flash",
    ),
    "doctor": Command(
        "Examine port, firmware and each device of a robot that stands still; say what is not as it should be.",
        "boebot.cli.doctor:doctor",
    ),
    "teleop": Command(
        "Drive by keyboard: arrows or W A S D, 1..9 for the speed, space to stop, Q to end.", "boebot.cli.teleop:teleop"
    ),
    "parameters": Command("List, read, set, save and reset the board's parameters.", "boebot.cli.parameters:app"),
}
"""Those of the core; guests add theirs (boebot.guests)."""


class Commands(TyperGroup):
    """The sub-commands of the core and of its guests: only their lines, until one is asked for."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = dict.fromkeys(all_commands(), TyperCommand(None))  # for its "Did you mean"

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command that has only its line."""
        return TyperCommand(cmd_name, help=_line(cmd_name)) if cmd_name in self.commands else None

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """All of them, with their lines."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, _line(name)) for name in self.commands])

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Of these arguments the command, as it is."""
        name, found, rest = super().resolve_command(ctx, args)
        return name, found and command(args[0]), rest


def all_commands() -> list[str]:
    """Their names."""
    return [*COMMANDS, *guests(GUESTS)]


def described(name: str) -> Command:
    """The command of that name.

    Raises:
        BoebotError: it is a guest's, and broken.
    """
    if name in COMMANDS:
        return COMMANDS[name]
    found = (guest := guests(GUESTS)[name]).load()
    if not isinstance(found, Command):
        raise BoebotError(f"{name!r} of an installed package is no command: {guest.place}; expected a guests.Command")
    return found


def _line(name: str) -> str:
    """Of the list of all; a broken guest leaves the others usable."""
    try:
        return described(name).line
    except BoebotError as error:
        return str(error)


def command(name: str) -> Any:
    """A sub-command with its options, imported."""
    place = described(name).work
    module, _, attribute = place.partition(":")
    work = getattr(import_module(module), attribute) if name in COMMANDS else Guest(name, place).load()
    if not isinstance(work, typer.Typer):
        function, work = work, typer.Typer(add_completion=False, **SETTINGS)
        work.command()(function)
    made = typer.main.get_command(work)
    made.name = name
    # What is loaded stays, and is no garbage: to look for some in it takes a fifth of a short run's time.
    if not gc.get_freeze_count():
        gc.freeze()
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
        from boebot.link import finding, messages

        output.line(
            f"boebot {boebot.__version__} (protocol {finding.version_name()}, schema {messages.SCHEMA_HASH:08x}, "
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
