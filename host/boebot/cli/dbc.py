"""`boebot dbc`: the CAN database of the protocol's messages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.cli import options, output


def dbc(
    out: Annotated[
        Path | None, typer.Argument(metavar="FILE", help="Where to write it; without it: standard output.")
    ] = None,
    node: Annotated[int, typer.Option("--node", metavar="N", min=1, max=7, help="The board's number on the bus.")] = 1,
    check: Annotated[
        Path | None, typer.Option("--check", metavar="FILE", help="Write nothing; say whether this file fits.")
    ] = None,
    json: options.Json = False,
) -> None:
    """Write the CAN database of a robot's messages, for CAN tools; or check one."""
    from boebot.can import database

    if check is not None:
        frames = database.check(check)
        if json:
            output.print_json({"file": str(check), "frames": frames})
        else:
            output.line(f"{check} fits this version: {frames} frames")
        return
    text = database.of_node(node)
    if out is None:
        output.line(text.rstrip("\n"))
    else:
        database.write(out, text)
        if json:
            output.print_json({"file": str(out), "node": node})
        else:
            output.line(f"wrote {out}, for node {node}")
