"""Options that several sub-commands share."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from boebot.boards import imperfections
from boebot.cli import quantity

On = Annotated[
    str,
    typer.Option(
        "--on", metavar="BOARD", help="avr, native, or a port: /dev/ttyACM0, serial:PORT, socket://HOST:PORT."
    ),
]
RunOn = Annotated[
    str | None,
    typer.Option(
        "--on",
        metavar="BOARD",
        help="avr, native, or a port: /dev/ttyACM0, serial:PORT, socket://HOST:PORT; direct for a robot without a "
        "board. Else native, or direct.",
    ),
]
RobotName = Annotated[str, typer.Option("--robot", metavar="R", help="Bundled robot or .toml file.")]
ArenaName = Annotated[
    str | None, typer.Option("--arena", metavar="A", help="Bundled arena or .toml file (simulated runs).")
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the brain's chance and of the world's noise.")]
Period = Annotated[
    float | None,
    typer.Option(
        "--period",
        metavar="TIME",
        parser=quantity.parser("s"),
        help="From step to step, as in 0.05 or 50ms; a multiple of the 10 ms tick.",
    ),
]
Without = Annotated[
    str | None,
    typer.Option("--without", metavar="NAME,...", help="Switch off imperfections of simulated robots, named below."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in place of the table.")]


def names(text: str | None) -> tuple[str, ...]:
    """Of "NAME,NAME"."""
    return () if text is None else tuple(name.strip() for name in text.split(","))


class Command(TyperCommand):
    """A sub-command with `--without`, whose help ends with the imperfections that can be switched off."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Name and line of each; they are the simulator's to say."""
        with formatter.section("Imperfections, and how it is --without them"):
            formatter.write_dl(list(imperfections().items()))
