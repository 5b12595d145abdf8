"""What a brain sketches, drawn with matplotlib: the last sketch of each layer, in the layer's colour."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D

from boebot.showing import OCCUPIED, UNKNOWN
from boebot.view import style

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from boebot.showing import GridCells, Sketch
    from boebot.view.scene import View


def draw_layers(axes: Axes, view: View, colour: str | None = None) -> None:
    """Draws them: grids below the path, lines and points above it. `colour`: of all layers; None: each has its own."""
    for index, layer in enumerate(view.layers):
        last = layer.sketches[-1]
        _draw(axes, last, view.origin(last), colour or style.layer(index))


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


def _draw(axes: Axes, sketch: Sketch, origin: tuple[float, float, float], colour: str) -> None:
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
