"""`boebot arena NAME`: an arena as a picture, and as a table: its size, where a robot starts, what stands there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from boebot.cli import completion, options, output

if TYPE_CHECKING:
    from boebot.arenas.description import Moving
    from boebot.arenas.floor_plan import FloorPlan, Solid

HEADER = ("shape", "name", "x", "y", "width", "depth", "height", "remarks")
_DIGITS = 6  # of lengths in JSON: micrometres


def arena(
    arena: Annotated[
        str,
        typer.Argument(
            metavar="ARENA",
            autocompletion=completion.arenas,
            help="Bundled arena, as `boebot list arenas` names them, or .toml file.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Picture to write, .png or .svg. Else arena-NAME.png here; with --json none."
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Show an arena: a picture, its size, where a robot starts, and its shapes. Lengths in m, x to the right, y up."""
    # here, as numpy and matplotlib take a while: no other command should wait for them
    from boebot.arenas import load_arena
    from boebot.arenas.floor_plan import floor_plan, path_end
    from boebot.view import arena_picture

    loaded = load_arena(arena)
    plan = floor_plan(loaded, 0.0, path_end(loaded))
    if out is None and not json:
        out = Path(f"arena-{Path(arena).stem}.png")
    picture = None if out is None else arena_picture.write(loaded, out)
    x, y, heading = loaded.start
    shapes = list(_shapes(plan, loaded.description.moving))
    size = _size(plan)
    if json:
        output.print_json(
            {
                "name": loaded.name,
                "title": plan.title,
                "size_m": size,
                "start": {"x_m": x, "y_m": y, "heading_rad": heading},
                "floor_reflectance": loaded.description.floor_reflectance,
                "shapes": shapes,
                "picture": None if picture is None else str(picture),
            }
        )
        return
    output.print_table(
        {
            "name": loaded.name,
            "title": plan.title or None,
            "size": "open field" if size is None else f"{size[0]:g} m x {size[1]:g} m",
            "start": f"x {x:g} m, y {y:g} m, heading {math.degrees(heading):.0f}°",
            "picture": str(picture),
        }
    )
    if shapes:
        table = output.empty_table()
        for title in HEADER:
            table.add_column(title, justify="left" if title in ("shape", "name", "remarks") else "right")
        for row in shapes:
            table.add_row(*(_cell(value) for value in row.values()))
        output.console().print(table)


def _size(plan: FloorPlan) -> list[float] | None:
    """Width and depth (m) of the box about all outlines; None: an open field."""
    boxes = [outline.box for outline in plan.outlines]
    if not boxes:
        return None
    return [
        round(float(max(high[axis] for _, high in boxes) - min(low[axis] for low, _ in boxes)), _DIGITS)
        for axis in (0, 1)
    ]


def _shapes(plan: FloorPlan, described_moving: Sequence[Moving]) -> Iterator[dict[str, Any]]:
    """A row for each thing in the arena: kind, name, middle and size of the box about it (m), height (m), remarks."""
    for solid in plan.solids:
        yield _solid(solid.kind, solid)
    for moving, described in zip(plan.moving, described_moving, strict=True):
        way = f"moves: {described.path[-1].time_s:g} s, {described.repeat.replace('_', ' ')}; here at its start"
        yield _solid(f"moving {moving.solid.kind}", moving.at(0.0), way)
    for patch in plan.patches:
        yield _row(
            "patch", patch.name, patch.corners.min(axis=0), patch.corners.max(axis=0), None, [f"grip {patch.grip:g}"]
        )
    for line in plan.lines:
        half = line.width / 2
        said = f"{'dark' if line.is_dark else 'bright'}, {line.width * 100:g} cm wide"
        yield _row("line", "", line.points.min(axis=0) - half, line.points.max(axis=0) + half, None, [said])
    for lamp in plan.lamps:
        place = (lamp.x_m, lamp.y_m)
        yield _row("lamp", lamp.name, place, place, lamp.height_m, [f"{lamp.power_w:g} W"])
    if (charger := plan.charger) is not None:
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
