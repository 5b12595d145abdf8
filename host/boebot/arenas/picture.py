"""Draws an arena: `python -m boebot.arenas.picture NAME_OR_FILE PICTURE` (the picture's ending says its format)."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from boebot.arenas.arena import Arena, load_arena
from boebot.arenas.floor_plan import floor_plan, path_end
from boebot.errors import BoebotError
from boebot.view import style
from boebot.view.arena_drawing import draw_arena, frame
from boebot.view.scene import plan_bounds

ROBOT_RADIUS_M = 0.07
LONGER_IN = 5.0  # longer side of the field


def draw(arena: Arena, path: Path) -> Path:
    """Writes a picture of the arena, with its start, and its moving shapes at the start and along their way.

    Raises:
        BoebotError: the file's ending names no format of pictures, or it cannot be written.
    """
    plan = floor_plan(arena, 0.0, path_end(arena))
    low, high = plan_bounds(plan, [arena.start[:2]])
    width, height = LONGER_IN * (high - low) / float((high - low).max())
    figure = Figure(figsize=(width + 0.9, height + 0.9), dpi=style.DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw_arena(axes, plan)
    _draw_start(axes, arena)
    frame(axes, low, high)
    title = f"{plan.name}: {plan.title}" if plan.title else plan.name
    axes.set_title(title, fontsize=12, color=style.INK, parse_math=False)
    # The same bytes each time: no date, no random names.
    with mpl.rc_context({"svg.hashsalt": arena.name}):
        try:
            figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
        except OSError as error:
            raise BoebotError(f"the picture cannot be written to {path}: {error.strerror}") from None
        except ValueError as error:  # of matplotlib: a format that it does not know
            raise BoebotError(f"the picture cannot be written to {path}: {error}") from None
    return path


def _draw_start(axes: mpl.axes.Axes, arena: Arena) -> None:
    x, y, heading = arena.start
    axes.add_patch(Circle((x, y), ROBOT_RADIUS_M, facecolor=style.END, edgecolor=style.EDGE, lw=1.0, zorder=6))
    nose = 2.2 * ROBOT_RADIUS_M
    axes.arrow(x, y, nose * np.cos(heading), nose * np.sin(heading), head_width=0.06, color=style.END, zorder=6)


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
