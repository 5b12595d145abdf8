"""Measures of a robot's true path: how much of its arena it visits, and whether it keeps moving."""

from __future__ import annotations

import numpy as np

from boebot.boards import Truth


def cells_visited(truth: Truth, cell: float = 0.20) -> tuple[int, int]:
    """How many of the arena's free cells the robot's centre visited, and how many there are.

    A cell is free if its centre lies inside the arena and outside every obstacle.
    """
    from matplotlib.path import Path

    (outer,) = (Path(solid.points) for solid in truth.plan.outlines)
    obstacles = [Path(solid.points) for solid in truth.plan.obstacles if solid.kind == "obstacle"]
    corners = np.asarray(outer.vertices)
    low, high = corners.min(axis=0), corners.max(axis=0)
    columns, rows = (np.floor((high - low) / cell + 1e-9)).astype(int)
    centres = [
        (i, j)
        for i in range(columns)
        for j in range(rows)
        if outer.contains_point(point := low + cell * (np.array([i, j]) + 0.5))
        and not any(obstacle.contains_point(point) for obstacle in obstacles)
    ]
    seen = {(int(i), int(j)) for i, j in zip((truth.x - low[0]) // cell, (truth.y - low[1]) // cell, strict=True)}
    return len(seen & set(centres)), len(centres)


def windows_moved(truth: Truth, window_s: float = 5.0) -> np.ndarray:
    """The greatest distance between two places of the robot in each window of that length."""
    moved = []
    for start in np.arange(truth.time[0], truth.time[-1] - window_s, 1.0):
        inside = (truth.time >= start) & (truth.time <= start + window_s)
        x, y = truth.x[inside], truth.y[inside]
        moved.append(np.hypot(x - x[0], y - y[0]).max())
    return np.array(moved)
