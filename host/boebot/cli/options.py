"""Options that several sub-commands share."""

from __future__ import annotations

from typing import Annotated

import typer

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
    typer.Option("--period", metavar="MS", help="Milliseconds from step to step; a multiple of the 10 ms tick."),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in place of the table.")]
