"""`boebot robot NAME`: a robot as a picture, its measures, and how its devices are wired, drawn and as a table."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from boebot.cli import completion, options, output

HEADER = ("device", "pin", "wire", "through", "to", "plugged into")


def robot(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            autocompletion=completion.robots,
            help="Bundled robot, as `boebot list robots` names them, or .toml file.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Picture to write, .svg or .png. Else robot-NAME.svg here; with --json none."
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Show a robot: a picture from above with its wiring, its measures, and a table of its wires.

    Wires without a colour are yours. A device that is off keeps its pins, and is not in the picture.
    """
    # here, as matplotlib takes a while: no other command should wait for it
    from boebot.description.robots import load_robot
    from boebot.description.wiring import connections, free_pins
    from boebot.view import robot_picture

    described = load_robot(robot)
    if out is None and not json:
        out = Path(f"robot-{Path(robot).name.removesuffix('.toml')}.svg")
    picture = None if out is None else robot_picture.write(described, out)
    body = described.body
    values: dict[str, Any] = {
        "name": described.name,
        "title": described.title,
        "board": described.board,
        "scheme": None if described.scheme == "kit" else described.scheme,
        "pin_map": described.pin_map or None,
        "mass_kg": body.mass_kg,
        "radius_m": body.radius_m,
        "track_width_m": body.track_width_m,
        "wheel_radius_m": body.wheel_radius_m,
        "wheel_speed_maximum_m_s": body.wheel_speed_maximum_m_s,
        "free_pins": free_pins(described) if described.has_board else None,
        "picture": None if picture is None else str(picture),
    }
    wires = connections(described)
    if json:
        devices = [
            {"name": name, "type": device.__struct_config__.tag, "on": device.on}
            for name, device in described.device.items()
        ]
        output.print_json(values | {"devices": devices, "wiring": [wire._asdict() for wire in wires]})
        return
    output.print_table(values | {"free_pins": values["free_pins"] or None})
    if not wires:
        devices_on = [name for name, device in described.device.items() if device.on]
        output.line(f"devices: {', '.join(devices_on)}")
        return
    table = output.empty_table()
    for title in HEADER:
        table.add_column(title)
    before = ""
    for wire in wires:
        first = wire.device != before
        before = wire.device
        name = wire.device if wire.on else f"{wire.device} (off)"
        table.add_row(name if first else "", wire.pin, wire.colour, wire.part, wire.to, wire.connector if first else "")
    output.console().print(table)
