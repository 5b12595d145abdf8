"""Paints display lists (boebot.devices.drawing) with matplotlib, and what a run adds to them: sketches, swept areas.

It knows no device and nothing of an arena but its items; the page's painter is page/arena.js, Foxglove's is
foxglove_scene.py.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from boebot.devices.drawing import SIGHTS, Item
from boebot.showing import OCCUPIED, UNKNOWN
from boebot.view import scene, style

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform
    from numpy.typing import NDArray

    from boebot.arenas.arena import Floats
    from boebot.arenas.floor_plan import FloorPlan
    from boebot.description.robots import RobotDescription
    from boebot.showing import GridCells, Sketch
    from boebot.view.scene import Swept, View

HATCH = "////"
LABEL_SIZE, INSIDE_SIZE = 7.5, 6.3
SWEPT_SHADE, SWEPT_EDGE = 0.10, 0.45  # opacity of the area of a sweep, and of its outline


def paint(
    axes: Axes,
    items: Iterable[Item],
    colour: str = style.END,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    turning: Transform | None = None,
    within: Path | None = None,
) -> None:
    """Paints items as they are without signs or measurements.

    Args:
        axes, items: where, and what.
        colour: of the robot that they belong to.
        pose: of their frame on the axes: m, m, rad.
        turning: of what sits on a turret, in that frame.
        within: cuts off what sensors see.
    """
    x, y, heading = pose
    placed = Affine2D().rotate(heading).translate(x, y) + axes.transData
    for item in items:
        if item.when or item.reach_by:
            continue
        on_axes = turning + placed if item.turns and turning is not None else placed
        artist = _painted(axes, item, colour, on_axes)
        if within is not None and item.layer == SIGHTS:
            artist.set_clip_path(within, axes.transData)


def _painted(axes: Axes, item: Item, colour: str, on_axes: Transform) -> Artist:
    ink, fill = (style.paint(name, colour) if name else "none" for name in (item.ink, item.fill))
    if item.text:
        return axes.annotate(
            item.text, item.points[0], xytext=(0, 3 * item.side), textcoords="offset points", ha="center",
            va={1: "bottom", -1: "top"}.get(item.side, "center"), color=style.EDGE, zorder=item.layer,
            fontsize=INSIDE_SIZE if "\n" in item.text else LABEL_SIZE, annotation_clip=True, clip_on=True,
        )  # fmt: skip
    if item.wide_m:
        return axes.add_patch(PathPatch(_ribbon(item), fc=ink, ec="none", zorder=item.layer, transform=on_axes))
    dashes: Any = (0, item.dashes) if item.dashes else "-"
    if not item.closed:
        look: dict[str, Any] = {} if item.dashes else {"solid_capstyle": "round"}
        x, y = zip(*item.points, strict=True)
        return axes.plot(x, y, color=ink, lw=item.width, ls=dashes, zorder=item.layer, transform=on_axes, **look)[0]
    return axes.add_patch(
        Polygon(
            item.points, closed=True, fc=to_rgba(fill, item.alpha) if item.fill else "none", ec=ink, lw=item.width,
            ls=dashes, hatch=HATCH if item.hatch else None, zorder=item.layer, transform=on_axes,
        )
    )  # fmt: skip


def _ribbon(item: Item) -> Path:
    """A line that is wide in m: its segments as rectangles, round where it bends and ends."""
    shapes = []
    points, half = np.array(item.points), item.wide_m / 2
    for a, b in pairwise(points):
        along = (b - a) / np.hypot(*(b - a)) * half
        across = np.array((-along[1], along[0]))
        shapes.append(Path(np.array((a - across, b - across, b + across, a + across, a - across)), closed=True))
    shapes += [Path.circle(tuple(point), half) for point in points]
    return Path.make_compound_path(*shapes)


def frame(axes: Axes, low: Floats, high: Floats) -> None:
    """Axes of equal scale over that box, with their units, on a light grid."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.locator_params(nbins=9)
    quiet(axes, "x (m)", "y (m)")


def quiet(axes: Axes, x: str, y: str) -> None:
    """The look of all axes: words for both, a light grid, no spines."""
    axes.set_xlabel(x, color=style.INK, fontsize=9)
    axes.set_ylabel(y, color=style.INK, fontsize=9)
    axes.tick_params(labelsize=8.5, colors=style.FAINT, labelcolor=style.INK, length=3)
    axes.grid(color=style.GRID, lw=0.7)
    axes.set_axisbelow(True)
    for side in axes.spines.values():
        side.set_visible(False)


# ---- an arena, a robot -----------------------------------------------------------------------------------------------


def draw_arena(axes: Axes, plan: FloorPlan) -> None:
    """Draws all that a plan has; moving shapes where they begin, and their way."""
    if not plan.outlines:
        axes.set_facecolor(style.FLOOR)
    paint(axes, scene.arena_items(plan))
    for moving in plan.moving:
        axes.plot(moving.x, moving.y, color=style.MOVING, lw=1.0, ls=(0, (4, 2)), zorder=2.5)
        begun = moving.at(float(moving.time[0]))
        paint(axes, [scene.moving_item(begun), *scene.remarks(begun, plan)])


def legend_entries(plan: FloorPlan) -> list[Artist]:
    """What the plan has that wants a word: entries for a legend."""
    items = [*scene.arena_items(plan), *(scene.moving_item(moving.solid) for moving in plan.moving)]
    found = {item.says: item for item in items if item.says}
    entries: list[Artist] = []
    for says, item in found.items():
        fill = style.paint(item.fill)
        if says in scene.STARS:
            entries.append(Line2D([], [], ls="", marker="*", mfc=fill, mec=style.EDGE, mew=0.8, ms=11, label=says))
        else:
            entries.append(Patch(fc=fill, ec=style.EDGE, lw=0.8, hatch=HATCH if item.hatch else None, label=says))
    return entries


def draw_robot(
    axes: Axes,
    robot: RobotDescription,
    pose: tuple[float, float, float],
    colour: str,
    *,
    plan: FloorPlan | None = None,
    turret: float = 0.0,
) -> None:
    """The robot at a pose (m, m, rad), its turret at an angle (rad); the plan's outlines cut off what its sensors see,
    and obstacles cover it."""
    within = None
    if plan is not None and plan.outlines:
        within = Path.make_compound_path(
            *(Path(np.vstack((one.points, one.points[:1])), closed=True) for one in plan.outlines)
        )
    pivot = scene.pivot(robot)
    turning = None if pivot is None else Affine2D().rotate_around(*pivot, turret)
    paint(axes, scene.robot_items(robot), colour, pose, turning=turning, within=within)


# ---- what a run adds -------------------------------------------------------------------------------------------------


def draw_swept(axes: Axes, swept: Sequence[Swept], index: int, colour: str) -> None:
    """The area that the sweep of that index covers, of each such sensor of a robot."""
    for one in swept:
        if len(one.time):
            fill, edge = to_rgba(colour, SWEPT_SHADE), to_rgba(colour, SWEPT_EDGE)
            axes.add_patch(Polygon(one.area(index), facecolor=fill, edgecolor=edge, lw=0.7, zorder=1.4))


def draw_layers(axes: Axes, view: View, colour: str | None = None) -> None:
    """The last sketch of each layer of a brain, in the layer's colour or in that one: grids below the path, lines and
    points above it."""
    for index, layer in enumerate(view.layers):
        last = layer.sketches[-1]
        _draw_sketch(axes, last, view.origin(last), colour or style.layer(index))


def layer_entries(view: View) -> list[Artist]:
    """Their entries in the legend."""
    entries: list[Artist] = []
    for index, layer in enumerate(view.layers):
        last = layer.sketches[-1]
        marker = "" if last.lines else "s" if last.grid is not None else "."
        colour = style.layer(index)
        entries.append(
            Line2D([], [], color=colour, lw=1.6, ls="-" if last.lines else "", marker=marker, ms=6, label=layer.name)
        )
    return entries


def _draw_sketch(axes: Axes, sketch: Sketch, origin: tuple[float, float, float], colour: str) -> None:
    x, y, heading = origin
    placed = Affine2D().rotate(heading).translate(x, y) + axes.transData
    if (grid := sketch.grid) is not None:
        extent = (grid.x, grid.x + grid.columns * grid.cell, grid.y, grid.y + grid.rows * grid.cell)
        bounds = axes.get_xlim(), axes.get_ylim()
        axes.imshow(
            rgba(grid, colour), extent=extent, origin="lower", interpolation="nearest", transform=placed, zorder=2.5
        )
        axes.set_xlim(*bounds[0])
        axes.set_ylim(*bounds[1])
    for line in sketch.lines:
        axes.plot(*pairs(line).T, color=colour, lw=1.5, transform=placed, zorder=7.5, solid_capstyle="round")
    if sketch.points:
        axes.plot(*pairs(sketch.points).T, ls="", marker=".", ms=4, color=colour, transform=placed, zorder=7.6)


def rgba(grid: GridCells, colour: str) -> NDArray[np.float64]:
    """Colour and opacity of each cell, shape (rows, columns, 4)."""
    cells = np.frombuffer(grid.cells, dtype=np.uint8).reshape(grid.rows, grid.columns)
    free, occupied = style.CELL
    picture = np.empty((*cells.shape, 4))
    picture[..., :3] = to_rgb(colour)
    picture[..., 3] = np.where(cells == UNKNOWN, 0.0, free + (occupied - free) * cells / OCCUPIED)
    return picture


def pairs(points: bytes) -> NDArray[np.float64]:
    """Points as they are kept, shape (n, 2), in m."""
    return np.frombuffer(points, dtype="<f4").reshape(-1, 2).astype(np.float64)
