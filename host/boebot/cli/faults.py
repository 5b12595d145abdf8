"""`boebot faults`: what can fail in a run of a robot, for `boebot run --fault`, with units."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from boebot.cli import options, output
from boebot.description.robots import load_robot
from boebot.devices.device import FaultKind
from boebot.errors import CallError
from boebot.running.faults import known


def faults(
    robot: Annotated[
        str, typer.Option("--robot", metavar="R", autocompletion=options.complete_robots, help="Whose.")
    ] = "shieldbot",
    json: options.Json = False,
) -> None:
    """List what can fail in a run of a robot: boebot run --fault NAME[=VALUE]@START[..END]."""
    there = known(load_robot(robot))
    if not there:
        raise CallError(f"robot {robot!r} has nothing that can be made to fail; expected a robot with a board")
    rows = [_row(name, kind, whose) for name, (kind, whose) in there.items()]
    if json:
        output.print_json({"robot": robot, "faults": rows})
        return
    whole = {one for row in rows if len(row["of"]) > 1 for one in row["of"]}
    shown = [row for row in rows if row["of"] != [row["name"].partition(".")[0]] or not whole.issuperset(row["of"])]
    output.print_columns(
        ["name", "value", "when", "what happens"],
        ([row["name"], _value(row), "a span" if row["lasts"] else "once", _what(row)] for row in shown),
        whole=1,
    )


def _row(name: str, kind: FaultKind, whose: tuple[str, ...]) -> dict[str, Any]:
    return {"name": name, "of": list(whose), **kind._asdict()}


def _value(row: dict[str, Any]) -> str:
    """Default and range."""
    if row["words"]:
        return ", ".join(row["words"])
    if row["default"] is None:
        return ""
    return f"{row['default']:g} {row['unit']}".rstrip() + f" ({row['least']:g} to {row['most']:g})"


def _what(row: dict[str, Any]) -> str:
    alone = f"; also of {' or '.join(row['of'])} alone" if len(row["of"]) > 1 else ""
    return str(row["does"]) + alone
