"""`boebot test`: the kit's own tests of a board."""

from __future__ import annotations

from typing import Annotated

import typer

from boebot.cli import options
from sim_bridge.bench.suite import run_suite

test = typer.Typer(add_completion=False, **options.SETTINGS)


@test.command(context_settings={**options.SETTINGS["context_settings"], "ignore_unknown_options": True})
def prove(
    arguments: Annotated[
        list[str] | None, typer.Argument(metavar="ARGUMENT", help="Arguments of pytest's, such as -k hello or --lf.")
    ] = None,
    on: Annotated[
        list[str] | None,
        typer.Option("--on", metavar="BOARD", help="native, avr or a port; may be given again. Else native and avr."),
    ] = None,
    motors: Annotated[
        bool, typer.Option("--motors", help="The motors of a real robot may turn: it stands on blocks, or has room.")
    ] = False,
) -> None:
    """Prove a board, emulated or at a port: what the protocol promises, one test each.

    On a port motors turn with --motors only.

    Exit code: 0 all passed; 1 a test failed; 2 bad input, or no test ran; 130 after Ctrl-C."""
    raise typer.Exit(run_suite(on or ["native", "avr"], arguments or (), motors=motors))
