"""Search on grids: random maps against scipy's Dijkstra. The notes' maps: experiments E41 to E43."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from boebot.errors import BrainError
from boebot.navigation import Lattice, search
from boebot.navigation.search import METHODS

START, TARGET = (5, 3), (6, 17)


def open_map() -> np.ndarray:
    """Of 20 x 12 cells."""
    return np.ones((12, 20), dtype=np.bool_)


def costs(lattice: Lattice, start: tuple[int, int]) -> np.ndarray:
    """Of the shortest ways to all cells, by scipy; infinite: there is none."""
    number = np.arange(lattice.free.size).reshape(lattice.free.shape)
    rows, columns, lengths = [], [], []
    padded = np.pad(lattice.free, 1)
    for row, column in np.argwhere(lattice.free).tolist():
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                beside = padded[row + 1 + down, column + 1] and padded[row + 1, column + 1 + right]
                if (down or right) and padded[row + 1 + down, column + 1 + right] and beside:
                    if down and right and not lattice.diagonal:
                        continue
                    rows.append(number[row, column])
                    columns.append(number[row + down, column + right])
                    lengths.append(math.hypot(down, right) * lattice.cell)
    graph = csr_array((lengths, (rows, columns)), shape=(lattice.free.size,) * 2)
    found: np.ndarray = dijkstra(graph, indices=number[start]).reshape(lattice.free.shape)
    return found


@given(
    arrays.arrays(np.bool_, st.tuples(st.integers(2, 14), st.integers(2, 14)), elements=st.booleans()),
    st.booleans(),
    st.data(),
)
def test_random_maps_agree_with_scipy(blocked: np.ndarray, diagonal: bool, data: st.DataObject) -> None:
    free = ~(blocked & np.roll(blocked, 1))  # some 3 of 4 cells
    lattice = Lattice(free, 0.1, diagonal=diagonal)
    cell = st.tuples(st.integers(0, free.shape[0] - 1), st.integers(0, free.shape[1] - 1))
    start, target = data.draw(cell), data.draw(cell)
    free[start] = free[target] = True
    best = costs(lattice, start)[target]
    for method in METHODS:
        found = search(lattice, start, target, method)
        assert (found.cost < math.inf) == bool(found.path) == (best < math.inf)
        if not found.path:
            continue
        assert found.path[0] == start and found.path[-1] == target and len(set(found.path)) == len(found.path)
        steps = [dict(lattice.neighbours(one))[other] for one, other in zip(found.path, found.path[1:], strict=False)]
        assert sum(steps) == pytest.approx(found.cost)
        assert found.cost >= best - 1e-9
        if method in ("dijkstra", "astar"):
            assert found.cost == pytest.approx(best, abs=1e-9)
    dijkstras, stars = (search(lattice, start, target, method) for method in ("dijkstra", "astar"))
    assert len(set(stars.expanded)) == len(stars.expanded) <= max(len(dijkstras.expanded), 1)


def test_there_is_no_path_and_no_such_search() -> None:
    free = open_map()
    free[:, 10] = False
    found = search(Lattice(free), START, TARGET)
    assert (found.path, found.cost) == ([], math.inf)
    assert len(found.expanded) == 120
    with pytest.raises(BrainError, match="there is no search 'best'; expected one of walk, greedy, dijkstra, astar"):
        search(Lattice(free), START, TARGET, "best")  # type: ignore[arg-type]
