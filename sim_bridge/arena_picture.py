"""Draws an arena: `python -m sim_bridge.arena_picture NAME_OR_FILE PICTURE` (the picture's ending says its format)."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from boebot.errors import BoebotError
from sim_bridge.arena import Arena, Floats, load_arena

SEEN_BELOW_M = 0.06  # what is lower than the infrared sensors is drawn lighter
ROBOT_RADIUS_M = 0.07
FLOOR, SOLID, LOW, EDGE = "#f4f5f8", "#c9ced9", "#e4dccb", "#39415a"
ROUGH, SMOOTH, MOVING, LAMP, CHARGER = "#d9c9a8", "#bfdcec", "#c98a2b", "#f0b429", "#3a8f5c"
PLAIN_GRIP = 0.6  # more than that is drawn as carpet, less as slippery
GHOST_TIMES = 12  # places at which a moving shape is shown along its path


def draw(arena: Arena, path: Path) -> Path:
    """Writes a picture of the arena, with its start, and its moving shapes at the start and along their way."""
    figure = Figure(figsize=(5.0, 4.2), dpi=110, layout="constrained")
    axes = figure.subplots()
    draw_arena(axes, arena)
    _draw_start(axes, arena)
    axes.set_aspect("equal")
    if not arena.outlines:
        axes.set(xlim=(-1, 1), ylim=(-1, 1))
    axes.autoscale_view()
    axes.set(xlabel="x (m)", ylabel="y (m)", title=f"{arena.name}: {arena.description.title}")
    axes.grid(color="#dfe2ea", linewidth=0.6)
    axes.set_axisbelow(True)
    # The same bytes each time: no date, no random names.
    with mpl.rc_context({"svg.hashsalt": arena.name}):
        figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    return path


def draw_arena(axes: Axes, arena: Arena) -> None:
    """Draws what is in an arena, moving shapes at the start and along their way."""
    _draw_floor(axes, arena)
    _draw_shapes(axes, arena)
    _draw_moving(axes, arena)


def _draw_floor(axes: Axes, arena: Arena) -> None:
    for outline in arena.description.outline:
        axes.add_patch(Polygon(outline.corners_m, closed=True, facecolor=FLOOR, edgecolor="none", zorder=0.2))
        axes.add_patch(Polygon(outline.corners_m, closed=True, fill=False, edgecolor=EDGE, lw=2.5, zorder=2))
    for patch in arena.description.patch:
        colour = ROUGH if patch.grip > PLAIN_GRIP else SMOOTH
        axes.add_patch(Polygon(patch.corners_m, closed=True, facecolor=colour, edgecolor="none", zorder=0.6))
        _label(axes, np.mean(patch.corners_m, axis=0), f"grip {patch.grip:g}")
    if (charger := arena.description.charger) is not None:
        axes.add_patch(Circle((charger.x_m, charger.y_m), charger.radius_m, facecolor=CHARGER, alpha=0.35, zorder=0.8))
        _label(axes, np.array((charger.x_m, charger.y_m - charger.radius_m - 0.06)), "charger")
    for light in arena.description.light:
        axes.plot(light.x_m, light.y_m, marker="*", ms=14, color=LAMP, mec=EDGE, mew=0.6, zorder=5)


def _draw_shapes(axes: Axes, arena: Arena) -> None:
    said = arena.description
    for shape in said.obstacle:
        style = {"facecolor": _solid(shape.height_m), "edgecolor": EDGE, "lw": 1.4}
        axes.add_patch(Polygon(shape.corners_m, closed=True, zorder=2, **style))
        if shape.height_m is not None:
            _label(axes, np.mean(shape.corners_m, axis=0) + np.array((0, 0.12)), f"{shape.height_m:g} m high")
    for disc in said.disc:
        style = {"facecolor": _solid(disc.height_m), "edgecolor": EDGE, "lw": 1.4}
        axes.add_patch(Circle((disc.x_m, disc.y_m), disc.radius_m, zorder=2, **style))
    for wall in said.wall:
        axes.plot(*np.array(wall.points_m).T, color=EDGE, lw=2.0, solid_capstyle="round", zorder=2)


def _draw_moving(axes: Axes, arena: Arena) -> None:
    for number, moving in enumerate(arena.description.moving):
        way = np.array([(point.x_m, point.y_m) for point in moving.path])
        axes.plot(*way.T, color=MOVING, lw=1.0, ls=(0, (4, 2)), zorder=3)
        for time in np.linspace(0, moving.path[-1].time_s, GHOST_TIMES)[1:]:
            ghost = arena.moving_outlines(float(time))[number]
            axes.add_patch(Polygon(ghost, closed=True, facecolor="none", edgecolor=MOVING, lw=0.6, alpha=0.6, zorder=3))
        now = arena.moving_outlines(0.0)[number]
        axes.add_patch(Polygon(now, closed=True, facecolor=MOVING, edgecolor=EDGE, lw=1.2, zorder=4))


def _draw_start(axes: Axes, arena: Arena) -> None:
    x, y, heading = arena.start
    axes.add_patch(Circle((x, y), ROBOT_RADIUS_M, facecolor="#4c6fb1", edgecolor=EDGE, lw=1.0, zorder=6))
    nose = 2.2 * ROBOT_RADIUS_M
    axes.arrow(x, y, nose * np.cos(heading), nose * np.sin(heading), head_width=0.06, color="#4c6fb1", zorder=6)


def _solid(height: float | None) -> str:
    return LOW if height is not None and height < SEEN_BELOW_M else SOLID


def _label(axes: Axes, place: Floats, text: str) -> None:
    axes.text(float(place[0]), float(place[1]), text, ha="center", va="center", fontsize=7, color=EDGE, zorder=7)


def main() -> None:
    """Draws the arena named first into the file named second."""
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        print(draw(load_arena(sys.argv[1]), Path(sys.argv[2])))
    except BoebotError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
