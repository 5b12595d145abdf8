"""Draws a floor plan with matplotlib: the only place where an arena is drawn, whether in the picture of a run, of an
arena file or of a vehicle under way (the replay page draws the same plan in its own language).

Filled by kind: solid grey, dull ones darker, low ones hatched; patches by grip; what moves with its way in dashes.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Polygon
from matplotlib.path import Path

from boebot.view import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.arenas.arena import Floats
    from boebot.arenas.floor_plan import FloorPlan, Line, Moving, Solid

GHOSTS_MAXIMUM = 30  # places at which a moving shape is shown along its way
HATCH = "////"
LABEL_SIZE, INSIDE_SIZE = 7.5, 6.3
ROOMY_SHARE = 0.09  # of the arena's width: what is as large has its label inside
TOP_SHARE = 0.07  # what reaches higher within the outline has its label below
_LABEL_Z = 5.5  # above the arena, below paths' marks and robots


def draw_arena(axes: Axes, plan: FloorPlan) -> None:
    """Draws all that a plan has; moving shapes where they begin, and along their way. What cannot be seen from above
    (grip, a low height, reflectances) is written beside it.
    """
    _draw_floor(axes, plan)
    for solid in plan.obstacles:
        _draw_solid(axes, solid)
    for lamp in plan.lamps:
        axes.plot(lamp.x_m, lamp.y_m, marker="*", ms=13, color=style.LAMP, mec=style.EDGE, mew=0.8, ls="", zorder=4.5)
    for moving in plan.moving:
        _draw_moving(axes, moving)
    _draw_labels(axes, plan)


def frame(axes: Axes, low: Floats, high: Floats) -> None:
    """Axes of equal scale over that box, with their units, on a light grid."""
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)", color=style.INK, fontsize=9)
    axes.set_ylabel("y (m)", color=style.INK, fontsize=9)
    axes.tick_params(labelsize=8.5, colors=style.FAINT, labelcolor=style.INK, length=3)
    axes.locator_params(nbins=9)
    axes.grid(color=style.GRID, lw=0.7)
    axes.set_axisbelow(True)
    for side in axes.spines.values():
        side.set_visible(False)


def legend_entries(plan: FloorPlan) -> list[Artist]:
    """What the plan has that wants a word: entries for a legend."""
    entries: list[Artist] = []
    solids = [*plan.obstacles, *(moving.solid for moving in plan.moving)]
    if any(solid.is_low for solid in solids):
        look: dict[str, Any] = {"facecolor": style.LOW, "edgecolor": style.EDGE, "hatch": HATCH, "lw": 0.8}
        entries.append(Patch(label="low: some sensors look over it", **look))
    if any(solid.is_dull for solid in solids):
        entries.append(Patch(facecolor=style.DULL, edgecolor=style.EDGE, lw=0.8, label="throws back less"))
    if plan.moving:
        entries.append(Patch(facecolor=style.MOVING, edgecolor=style.EDGE, lw=0.8, label="moves, shown at the start"))
    if plan.lamps:
        entries.append(
            Line2D([], [], ls="", marker="*", color=style.LAMP, mec=style.EDGE, mew=0.8, ms=10, label="lamp")
        )
    return entries


def _draw_floor(axes: Axes, plan: FloorPlan) -> None:
    outlines = plan.outlines
    if not outlines:
        axes.set_facecolor(style.FLOOR)
    for outline in outlines:
        axes.add_patch(Polygon(outline.points, closed=True, fc=style.FLOOR, ec="none", zorder=0.2))
        edge: dict[str, Any] = {"ls": (0, (4, 1.5))} if outline.is_low else {}
        axes.add_patch(Polygon(outline.points, closed=True, fill=False, ec=style.EDGE, lw=2.8, zorder=2, **edge))
    for patch in plan.patches:
        colour = style.ROUGH if patch.grip > plan.grip else style.SMOOTH
        axes.add_patch(Polygon(patch.corners, closed=True, fc=colour, ec=style.FAINT, lw=0.5, ls=":", zorder=0.6))
    for line in plan.lines:
        axes.add_patch(_ribbon(line))
    if (charger := plan.charger) is not None:
        axes.add_patch(
            Circle(
                (charger.x_m, charger.y_m), charger.radius_m, fc=style.CHARGER, ec=style.CHARGER, alpha=0.35, zorder=0.7
            )
        )
        axes.add_patch(
            Circle((charger.x_m, charger.y_m), charger.radius_m, fill=False, ec=style.CHARGER, lw=1.2, zorder=0.7)
        )


def _ribbon(line: Line) -> PathPatch:
    """A painted line: its segments as rectangles, round where it bends and ends."""
    shapes = []
    half = line.width / 2
    for a, b in pairwise(line.points):
        along = (b - a) / np.hypot(*(b - a)) * half
        across = np.array((-along[1], along[0]))
        shapes.append(Path(np.array((a - across, b - across, b + across, a + across, a - across)), closed=True))
    shapes += [Path.circle(tuple(point), half) for point in line.points]
    colour = style.PAINT_DARK if line.is_dark else style.PAINT_BRIGHT
    return PathPatch(Path.make_compound_path(*shapes), facecolor=colour, edgecolor="none", zorder=0.65)


def _draw_solid(axes: Axes, solid: Solid, **changed: Any) -> None:
    if solid.kind == "wall":
        look: dict[str, Any] = {"lw": 1.4, "ls": (0, (3, 1.2))} if solid.is_low else {"lw": 2.2}
        colour = style.DULL if solid.is_dull else style.EDGE
        axes.plot(*solid.points.T, color=colour, solid_capstyle="round", zorder=3, **look)
        return
    look = {"facecolor": style.SOLID, "edgecolor": style.EDGE, "lw": 1.3, "zorder": 3}
    if solid.is_dull:
        look["facecolor"] = style.DULL
    if solid.is_low:
        look |= {"facecolor": style.LOW, "hatch": HATCH, "lw": 0.9}
    look |= changed
    if solid.kind == "disc":
        axes.add_patch(Circle(tuple(solid.points[0]), solid.radius, **look))
    else:
        axes.add_patch(Polygon(solid.points, closed=True, **look))


def _draw_moving(axes: Axes, moving: Moving) -> None:
    axes.plot(moving.x, moving.y, color=style.MOVING, lw=1.0, ls=(0, (4, 2)), zorder=2.5)
    faint = {"facecolor": "none", "edgecolor": style.MOVING, "lw": 0.7, "alpha": 0.75, "hatch": None, "zorder": 2.5}
    for time in ghost_times(moving):
        _draw_solid(axes, moving.at(time), **faint)
    start = moving.at(float(moving.time[0]))
    _draw_solid(axes, start, zorder=4, facecolor=style.MOVING)


def ghost_times(moving: Moving) -> list[float]:
    """Times (s) at which a moving shape stands where it covers little of what it has covered before."""
    low, high = moving.solid.box
    size = float((high - low).max())
    reach = float(np.hypot(*moving.solid.points.T).max())  # of its corners from the point that it turns about
    way = np.column_stack((moving.x, moving.y, moving.heading * reach))
    shown = [0]
    for index in range(1, len(way)):
        if len(shown) > GHOSTS_MAXIMUM:
            break
        if np.linalg.norm(way[shown] - way[index], axis=1).min() > size:
            shown.append(index)
    return [float(moving.time[index]) for index in shown[1:]]


def _draw_labels(axes: Axes, plan: FloorPlan) -> None:
    walls = [outline.box for outline in plan.outlines]
    width = max((float(high[0] - low[0]) for low, high in walls), default=4.0)
    top = max((high[1] - TOP_SHARE * (high[1] - low[1]) for low, high in walls), default=np.inf)
    for patch in plan.patches:
        _label(axes, _middle(patch.corners), f"grip {patch.grip:g}", "center")
    if (charger := plan.charger) is not None:
        _label(axes, (charger.x_m, charger.y_m - charger.radius_m), "charger", "below")
    for solid in (*plan.obstacles, *(moving.at(float(moving.time[0])) for moving in plan.moving)):
        if not (said := solid.remarks):
            continue
        low, high = solid.box
        middle = (float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2)
        if not solid.is_low and (high - low).min() > ROOMY_SHARE * width:
            _label(axes, middle, "\n".join(said), "inside")
        elif high[1] > top:
            _label(axes, (middle[0], float(low[1])), ", ".join(said), "below")
        else:
            _label(axes, (middle[0], float(high[1])), ", ".join(said), "above")


def _middle(corners: Floats) -> tuple[float, float]:
    x, y = (corners.min(axis=0) + corners.max(axis=0)) / 2
    return float(x), float(y)


def _label(axes: Axes, place: tuple[float, float], text: str, where: str) -> None:
    shift, align = {"above": (3, "bottom"), "below": (-3, "top")}.get(where, (0, "center"))
    size = INSIDE_SIZE if where == "inside" else LABEL_SIZE
    axes.annotate(
        text, place, xytext=(0, shift), textcoords="offset points", ha="center", va=align, fontsize=size,
        color=style.EDGE, zorder=_LABEL_Z, annotation_clip=True, clip_on=True,
    )  # fmt: skip
