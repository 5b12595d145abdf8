"""`boebot show arena NAME` and `boebot show robot NAME`: a picture, measures, and a table of what stands there, or of
how the robot's devices are wired."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from boebot.cli import options, output

if TYPE_CHECKING:
    from boebot.arenas.floor_plan import FloorPlan, Solid
    from boebot.description.wiring import Connection

SHAPES = ("shape", "name", "x", "y", "width", "depth", "height", "remarks")
WIRES = ("device", "pin", "wire", "through", "to", "plugged into")
_DIGITS = 6  # of lengths in JSON: micrometres


class _Kinds(TyperGroup):
    """Which of both a bundled name means need not be said."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """A name alone, which is no kind, is that of a robot or an arena."""
        from boebot.arenas import arena_names
        from boebot.description.robots import robot_names

        kinds = {"arena": arena_names, "robot": robot_names}
        kind = [kind for kind, names in kinds.items() if args[0] not in kinds and args[0] in names()]
        if len(kind) > 1:
            ctx.fail(
                f"{args[0]} is the name of an arena and of a robot; expected 'arena {args[0]}' or 'robot {args[0]}'"
            )
        return super().resolve_command(ctx, kind + args)


app = typer.Typer(
    cls=_Kinds,
    help="Show an arena or a robot: a picture, its measures, what stands there or how it is wired. A bundled one is "
    "named alone, too: boebot show rover.",
    no_args_is_help=True,
    add_completion=False,
    **options.SETTINGS,
)

Picture = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="FILE", help="Picture to write, .svg or .png. Else KIND-NAME here; with --json none."
    ),
]


@app.command("arena")
def show_arena(
    arena: Annotated[
        str,
        typer.Argument(
            metavar="ARENA",
            autocompletion=options.complete_arenas,
            help="Bundled arena, as `boebot list arenas` names them, or .toml file.",
        ),
    ],
    out: Picture = None,
    json: options.Json = False,
) -> None:
    """Show an arena: a picture, its size, where a robot starts, and its shapes. Lengths in m, x to the right, y up."""
    # here, as numpy takes a while: no other command should wait for it, nor --json for matplotlib
    from boebot.arenas import load_arena
    from boebot.arenas.floor_plan import floor_plan, path_end

    loaded = load_arena(arena)
    plan = floor_plan(loaded, 0.0, path_end(loaded))
    if out is None and not json:
        out = Path(f"arena-{Path(arena).stem}.png")
    picture = None
    if out is not None:
        from boebot.view import arena_picture

        picture = str(arena_picture.write(loaded, out))
    x, y, heading = loaded.start
    shapes = list(_shapes(plan))
    size = _size(plan)
    named = {"name": loaded.name, "title": plan.described.title}
    if json:
        start = {"x_m": x, "y_m": y, "heading_rad": heading}
        reflectance = {"floor_reflectance": loaded.description.floor_reflectance}
        output.print_json(
            named | {"size_m": size, "start": start} | reflectance | {"shapes": shapes, "picture": picture}
        )
        return
    output.print_table(
        {name: value or None for name, value in named.items()}
        | {
            "size": "open field" if size is None else f"{size[0]:g} m x {size[1]:g} m",
            "start": f"x {x:g} m, y {y:g} m, heading {math.degrees(heading):.0f}°",
            "picture": picture,
        }
    )
    if shapes:
        output.line("what is in it, lengths in m:")
    output.print_columns(SHAPES, ([_cell(value) for value in row.values()] for row in shapes), numbers=range(2, 7))


@app.command("robot")
def show_robot(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            autocompletion=options.complete_robots,
            help="Bundled robot, as `boebot list robots` names them, or .toml file.",
        ),
    ],
    out: Picture = None,
    json: options.Json = False,
) -> None:
    """Show a robot: a picture from above with its wiring, its measures, and a table of its wires.

    Wires without a colour are yours. A device that is off keeps its pins, and is not in the picture.
    """
    from boebot.description.robots import load_robot
    from boebot.description.wiring import connections, free_pins

    described = load_robot(robot)
    if out is None and not json:
        out = Path(f"robot-{Path(robot).name.removesuffix('.toml')}.svg")
    picture = None
    if out is not None:
        from boebot.view import robot_picture

        picture = robot_picture.write(described, out)
    body = described.body
    values: dict[str, Any] = {
        "name": described.name,
        "title": described.title,
        "board": described.board,
        "scheme": None if described.scheme == "kit" else described.scheme,
        "pin_map": (described.takes_brain and described.pin_map) or None,
        "firmware": None if described.takes_brain else "none of the kit's: programs of your own",
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
    output.print_columns(WIRES, _wire_rows(wires))


def _wire_rows(wires: Sequence[Connection]) -> Iterator[list[str]]:
    """A device is named once, at its first wire."""
    before = ""
    for wire in wires:
        first, before = wire.device != before, wire.device
        name = wire.device if wire.on else f"{wire.device} (off)"
        where = (name, wire.connector) if first else ("", "")
        yield [where[0], wire.pin, wire.colour, wire.part, wire.to, where[1]]


def _size(plan: FloorPlan) -> list[float] | None:
    """Width and depth (m) of the box about all outlines; None: an open field."""
    boxes = [outline.box for outline in plan.outlines]
    if not boxes:
        return None
    return [
        round(float(max(high[axis] for _, high in boxes) - min(low[axis] for low, _ in boxes)), _DIGITS)
        for axis in (0, 1)
    ]


def _shapes(plan: FloorPlan) -> Iterator[dict[str, Any]]:
    """A row for each thing in the arena: kind, name, middle and size of the box about it (m), height (m), remarks."""
    import numpy as np

    described = plan.described
    for solid in plan.solids:
        yield _solid(solid.kind, solid)
    for moving, shape in zip(plan.moving, described.moving, strict=True):
        way = f"moves: {shape.path[-1].time_s:g} s, {shape.repeat.replace('_', ' ')}; here at its start"
        yield _solid(f"moving {moving.solid.kind}", moving.at(0.0), way)
    for patch in described.patch:
        corners = np.array(patch.corners_m)
        yield _row("patch", patch.name, corners.min(axis=0), corners.max(axis=0), None, [f"grip {patch.grip:g}"])
    for line in described.line:
        points, half = np.array(line.points_m), line.width_m / 2
        is_dark = line.floor_reflectance < described.floor_reflectance
        said = f"{'dark' if is_dark else 'bright'}, {line.width_m * 100:g} cm wide"
        yield _row("line", "", points.min(axis=0) - half, points.max(axis=0) + half, None, [said])
    for lamp in described.light:
        yield _row("lamp", lamp.name, (at := (lamp.x_m, lamp.y_m)), at, lamp.height_m, [f"{lamp.power_w:g} W"])
    if (charger := described.charger) is not None:
        x, y, radius = charger.x_m, charger.y_m, charger.radius_m
        yield _row("charger", "", (x - radius, y - radius), (x + radius, y + radius), None, [])


def _solid(kind: str, solid: Solid, *said: str) -> dict[str, Any]:
    remarks = [remark for remark in solid.remarks if not remark.endswith("high")]
    return _row(kind, solid.name, *solid.box, solid.height if math.isfinite(solid.height) else None, [*remarks, *said])


def _row(kind: str, name: str, low: Any, high: Any, height: float | None, remarks: list[str]) -> dict[str, Any]:
    """`height`: of its top, or of a lamp, above the floor; None: as high as any sensor, or on the floor."""
    (left, lower), (right, upper) = ((float(x), float(y)) for x, y in (low, high))
    lengths = {
        "x_m": (left + right) / 2,
        "y_m": (lower + upper) / 2,
        "width_m": right - left,
        "depth_m": upper - lower,
    }
    return (
        {"kind": kind, "name": name}
        | {key: round(value, _DIGITS) + 0.0 for key, value in lengths.items()}
        | {"height_m": height, "remarks": ", ".join(remarks)}
    )


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return f"{value:.3f}".rstrip("0").rstrip(".") if isinstance(value, float) else str(value)
