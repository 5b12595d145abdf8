"""A regular grid of free and forbidden cells over a map: where a robot's centre may be (section 6.2 of the notes).

A cell is forbidden if its centre is nearer to a line than the robot's radius and a margin, or inside something solid,
or if no way leads there from the start. Of large cells those are forbidden, too, from whose centre a step to the next
one could bring the robot to a line.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import number
from boebot.errors import BrainError
from boebot.navigation.frames import Point
from boebot.showing import Grid

if TYPE_CHECKING:
    from boebot.navigation.line_map import Floats, LineMap

Cell = tuple[int, int]

STRAIGHT = ((0, 1), (1, 0), (0, -1), (-1, 0))
DIAGONAL = ((1, 1), (1, -1), (-1, -1), (-1, 1))
MOST_CELLS = 10_000_000


@dataclass(frozen=True)
class Lattice:
    """Cells of a regular grid, as (row, column); rows count upwards.

    Attributes:
        free: whether a robot's centre may be in a cell, shape (rows, columns).
        cell: side of a cell (m).
        x, y: lower left corner (m).
        diagonal: cells have eight neighbours; else four. No diagonal cuts the corner of a forbidden cell.
    """

    free: NDArray[np.bool_]
    cell: float = 1.0
    x: float = 0.0
    y: float = 0.0
    diagonal: bool = True

    def __post_init__(self) -> None:
        """Truths, also of what is given as numbers."""
        object.__setattr__(self, "free", np.asarray(self.free, dtype=np.bool_))

    @classmethod
    def of(
        cls, plan: LineMap, radius: float, margin: float = 0.05, cell: float = 0.1, *, diagonal: bool = True
    ) -> Lattice:
        """Of a map.

        Args:
            radius: of the robot (m). margin: that it keeps (m). cell: side of a cell (m).

        Raises:
            BrainError: cell, radius or margin is no length, or the map has too many cells of it.
        """
        radius, margin = lengths(radius, margin)
        shape, centres = cells_of(plan, cell)
        # No place of a step is farther from a centre than half of a cell's diagonal. By Pythagoras the step keeps the
        # radius where both of its ends keep this; and then no line is in a free cell at all.
        step = math.hypot(radius, cell * math.sqrt(0.5)) + 1e-9
        free = (plan.distance(centres) >= max(radius + margin, step)) & ~plan.is_solid(centres)
        x, y = plan.bounds[0].tolist()
        return cls(free.reshape(shape), cell, x, y, diagonal)

    @property
    def rows(self) -> int:
        """How many there are."""
        return int(self.free.shape[0])

    @property
    def columns(self) -> int:
        """How many there are."""
        return int(self.free.shape[1])

    def grid(self) -> Grid:
        """To draw it: `robot.sketch("lattice", grid=lattice.grid(), frame="arena")`. Forbidden cells are dark."""
        return Grid(~self.free, self.cell, self.x, self.y)

    def centre(self, cell: Cell) -> Point:
        """Of a cell (m)."""
        return self.x + (cell[1] + 0.5) * self.cell, self.y + (cell[0] + 0.5) * self.cell

    def cell_at(self, x: float, y: float) -> Cell:
        """The cell of a place (m); it may lie outside of the grid."""
        return math.floor((y - self.y) / self.cell), math.floor((x - self.x) / self.cell)

    def is_free(self, cell: Cell) -> bool:
        """Whether a robot's centre may be there."""
        row, column = cell
        return 0 <= row < self.rows and 0 <= column < self.columns and bool(self.free[row, column])

    def nearest_free(self, x: float, y: float, within: float) -> Cell | None:
        """The free cell whose centre is nearest to a place (m), at most that far (m); None: there is none."""
        row, column = np.nonzero(self.free)
        if not len(row):
            return None
        away = np.hypot(self.x + (column + 0.5) * self.cell - x, self.y + (row + 0.5) * self.cell - y)
        best = int(away.argmin())
        return (int(row[best]), int(column[best])) if away[best] <= within else None

    def reachable(self, start: Cell) -> Lattice:
        """The part to which a way leads from a cell: all others are forbidden (the black regions of Fig. 6.6)."""
        seen = np.zeros_like(self.free)
        waiting = deque([start] if self.is_free(start) else [])
        for cell in waiting:
            seen[cell] = True
        while waiting:
            for other, _ in self.neighbours(waiting.popleft()):
                if not seen[other]:
                    seen[other] = True
                    waiting.append(other)
        return Lattice(seen, self.cell, self.x, self.y, self.diagonal)

    def neighbours(self, cell: Cell) -> Iterator[tuple[Cell, float]]:
        """The free cells beside one, each with the way there (m); beside a forbidden one there is none."""
        if not self.is_free(cell):
            return
        row, column = cell
        for down, right in STRAIGHT:
            other = row + down, column + right
            if self.is_free(other):
                yield other, self.cell
        if self.diagonal:
            for down, right in DIAGONAL:
                other = row + down, column + right
                if self.is_free(other) and self.is_free((row, column + right)) and self.is_free((row + down, column)):
                    yield other, self.cell * math.sqrt(2.0)

    def distance(self, cell: Cell, other: Cell) -> float:
        """Straight from centre to centre (m)."""
        return self.cell * math.hypot(cell[0] - other[0], cell[1] - other[1])


def lengths(radius: float, margin: float) -> tuple[float, float]:
    """Both, as numbers (m). Raises BrainError: one is no length."""
    return (
        number("a lattice: radius", radius, BrainError, least=0.0),
        number("a lattice: margin", margin, BrainError, least=0.0),
    )


def cells_of(plan: LineMap, cell: float) -> tuple[tuple[int, int], Floats]:
    """How many rows and columns of cells of that side (m) a map has, one of each at least, and their centres (m), row
    by row, shape (cells, 2).

    Raises:
        BrainError: it is no length, or there are too many.
    """
    if not isinstance(cell, Real) or not 0 < cell < math.inf:
        raise BrainError(f"cells of {cell!r} m; expected a length above 0")
    low, high = plan.bounds
    columns, rows = (max(1, math.ceil(size / cell - 1e-9)) for size in (high - low).tolist())
    if rows * columns > MOST_CELLS:
        counts = f"{rows:,} x {columns:,} of them; expected {MOST_CELLS:,} at most"
        raise BrainError(f"cells of {cell!r} m: {plan.name} has {counts}")
    row, column = np.indices((rows, columns)).reshape(2, -1)
    return (rows, columns), low + np.column_stack((column + 0.5, row + 0.5)) * cell
