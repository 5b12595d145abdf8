"""Free cells of a lattice merged into rectangles: convex, so that any straight way inside one is free, and few (section
6.2 of the notes).

The greatest rectangle of free cells is taken first, then the greatest of what is left, and so on. A node is the middle
of an edge that two rectangles share.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from boebot.navigation.frames import Point
from boebot.navigation.lattice import Lattice

Rectangle = tuple[int, int, int, int]
"""First and one beyond the last row, first and one beyond the last column."""


@dataclass(frozen=True)
class Cells:
    """Rectangles, and the doors between them; nodes are the numbers of doors.

    Attributes:
        lattice: what they were made of.
        rectangles: of free cells; no two overlap, and together they are all of them.
        doors: middle of each (m), and the two rectangles that it joins.
    """

    lattice: Lattice
    rectangles: list[Rectangle]
    doors: list[tuple[Point, int, int]]

    @classmethod
    def of(cls, lattice: Lattice) -> Cells:
        """Of the free cells of a lattice."""
        left = lattice.free.copy()
        rectangles: list[Rectangle] = []
        while left.any():
            found = greatest_rectangle(left)
            left[found[0] : found[1], found[2] : found[3]] = False
            rectangles.append(found)
        return cls(lattice, rectangles, list(_doors(lattice, rectangles)))

    def with_places(self, *places: Point) -> tuple[Cells, list[int]]:
        """The same with places as further nodes, and their numbers; a place in no free cell has -1."""
        doors, numbers = list(self.doors), []
        for place in places:
            inside = self.rectangle_at(*place)
            numbers.append(-1 if inside is None else len(doors))
            if inside is not None:
                doors.append((place, inside, inside))
        return Cells(self.lattice, self.rectangles, doors), numbers

    def rectangle_at(self, x: float, y: float) -> int | None:
        """The number of the rectangle in which a place (m) lies."""
        row, column = self.lattice.cell_at(x, y)
        for number, (top, bottom, left, right) in enumerate(self.rectangles):
            if top <= row < bottom and left <= column < right:
                return number
        return None

    @cached_property
    def _of_rectangle(self) -> dict[int, list[int]]:
        """The doors of each rectangle."""
        found: dict[int, list[int]] = {}
        for number, (_, one, other) in enumerate(self.doors):
            for rectangle in {one, other}:
                found.setdefault(rectangle, []).append(number)
        return found

    def centre(self, node: int) -> Point:
        """Where a node is (m)."""
        return self.doors[node][0]

    def neighbours(self, node: int) -> Iterator[tuple[int, float]]:
        """The doors of the rectangles on both sides, each with the straight way there (m); of -1 there are none."""
        if node < 0:
            return
        _, one, other = self.doors[node]
        for number in {number for side in (one, other) for number in self._of_rectangle[side]} - {node}:
            yield number, self.distance(node, number)

    def distance(self, node: int, other: int) -> float:
        """Straight from one to another (m)."""
        return math.dist(self.doors[node][0], self.doors[other][0])


def greatest_rectangle(free: NDArray[np.bool_]) -> Rectangle:
    """The rectangle of most free cells: under the histogram of free cells above each row, the greatest area."""
    best, most = (0, 0, 0, 0), 0
    heights = np.zeros(free.shape[1], dtype=np.intp)
    for row in range(free.shape[0]):
        heights = np.where(free[row], heights + 1, 0)
        waiting: list[tuple[int, int]] = []  # first column and height, growing
        for column, height in enumerate([*heights.tolist(), 0]):
            first = column
            while waiting and waiting[-1][1] >= height:
                first, tall = waiting.pop()
                if tall * (column - first) > most:
                    most, best = tall * (column - first), (row - tall + 1, row + 1, first, column)
            waiting.append((first, height))
    return best


def _doors(lattice: Lattice, rectangles: list[Rectangle]) -> Iterator[tuple[Point, int, int]]:
    """Where two rectangles touch along an edge."""
    for one, (top, bottom, left, right) in enumerate(rectangles):
        for other in range(one + 1, len(rectangles)):
            up, down, begin, end = rectangles[other]
            rows, columns = (max(top, up), min(bottom, down)), (max(left, begin), min(right, end))
            if (rows[0] < rows[1] and columns[0] == columns[1]) or (columns[0] < columns[1] and rows[0] == rows[1]):
                x = lattice.x + lattice.cell * (columns[0] + columns[1]) / 2
                y = lattice.y + lattice.cell * (rows[0] + rows[1]) / 2
                yield (x, y), one, other
