"""Search for a path on a grid, grids of nodes and of cells, and tightened paths: section 6.2 of the notes, Figs. 6.5 to
6.10; E41 to E46.

The notes' best-first search is the kit's "greedy"; "walk" is its box (Fig. 6.7) word for word, which goes back from a
dead end.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from boebot.navigation import Found, Lattice, LineMap, search, tightened
from boebot.navigation.lattice import Cell
from boebot.navigation.search import Method
from boebot.navigation.tighten import length
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, about, exactly, experiment

Point = tuple[float, float]
START, TARGET = (5, 3), (6, 17)  # row, column
DIAGONAL = math.sqrt(2.0)
NEIGHBOURS = {4: False, 8: True}  # number of neighbours -> with diagonals

# ---- E41 to E43: two maps --------------------------------------------------------------------------------------------


def open_map() -> NDArray[np.bool_]:
    """Free cells of the map of 20 by 12."""
    return np.ones((12, 20), dtype=np.bool_)


def c_wall() -> NDArray[np.bool_]:
    """The same with a wall like a C between start and target that is open towards the start."""
    free = open_map()
    free[3, 9:15] = free[8, 9:15] = False
    free[3:9, 14] = False
    return free


Searches = dict[tuple[Method, int], Found[Cell]]


def searched(free: NDArray[np.bool_], *methods: Method) -> Searches:
    """With each method, and 4 and 8 neighbours."""
    return {
        (method, neighbours): search(Lattice(free, diagonal=diagonal), START, TARGET, method)
        for neighbours, diagonal in NEIGHBOURS.items()
        for method in methods
    }


def _outcome(measured: list[Measured], free: NDArray[np.bool_], found: Searches, shown: Sequence[Method]) -> Outcome:
    """Data: the order in which cells were expanded. Figure: with 4 and 8 neighbours."""
    rows = [
        (method, neighbours, number, *cell)
        for (method, neighbours), one in found.items()
        for number, cell in enumerate(one.expanded)
    ]
    columns = zip(*rows, strict=True)
    data = dict(zip(("method", "neighbours", "expanded_as", "row", "column"), map(list, columns), strict=True))

    def draw(figure: Figure) -> None:
        figure.set_figheight(0.9 + 2.7 * len(shown))
        panels = figure.subplots(len(shown), 2, squeeze=False)
        for line, method in zip(panels, shown, strict=True):
            for axes, neighbours in zip(line, NEIGHBOURS, strict=True):
                one = found[method, neighbours]
                _draw_search(axes, free, one)
                axes.set_title(f"{method}, {neighbours} neighbours: cost {one.cost:.4g}, {len(one.expanded)} expanded")
                axes.title.set_fontsize(9.5)
        _legend(figure, with_wall=not free.all())

    return Outcome(measured, data, draw)


EXPANDED, PATH, WALL, FROM = "#bfe3c6", "#0b6b3a", "#39415a", "#f0e442"


def _draw_search(axes: Axes, free: NDArray[np.bool_], found: Found[Cell]) -> None:
    """As Figs. 6.8 and 6.10: checked cells light green, the path dark green."""
    from matplotlib.colors import to_rgb

    rows, columns = free.shape
    picture = np.ones((rows, columns, 3))
    picture[~free] = to_rgb(WALL)
    for colour, cells in ((EXPANDED, found.expanded), (FROM, [START])):
        for cell in cells:
            picture[cell] = to_rgb(colour)
    axes.imshow(picture, origin="lower", extent=(0, columns, 0, rows))
    axes.plot(*(np.array([(column, row) for row, column in found.path]) + 0.5).T, color=PATH, lw=2.2)
    axes.plot(TARGET[1] + 0.5, TARGET[0] + 0.5, "s", mfc="white", mec=PATH, ms=7)
    axes.set_xticks(range(columns + 1), minor=True)
    axes.set_yticks(range(rows + 1), minor=True)
    axes.grid(which="minor", color="#e3e5ea", lw=0.5)
    axes.grid(which="major", visible=False)
    axes.tick_params(which="minor", length=0)
    axes.set(xlabel="column", ylabel="row", xticks=range(0, 21, 5), yticks=(0, 4, 8, 12))


def _legend(figure: Figure, *, with_wall: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure.legend(
        handles=[
            Patch(fc=FROM, ec="0.6", label="start"),
            Line2D([], [], ls="", marker="s", mfc="white", mec=PATH, ms=7, label="target"),
            Patch(fc=EXPANDED, ec="0.6", label="expanded"),
            Line2D([], [], color=PATH, lw=2.2, label="path"),
            *([Patch(fc=WALL, label="wall")] if with_wall else []),
        ],
        loc="outside lower center", ncols=5, fontsize=9, frameon=False,
    )  # fmt: skip


@experiment("E41")
def in_the_open(seed: int) -> Outcome:
    """Greedy search in the open

    In the notes: section 6.2, Figs. 6.7 and 6.8 (left)

    Figure: Paths from start to target on an open map: above greedy (the notes' best-first search), below
    Dijkstra's.

    Expected: By hand: the target lies 14 columns and one row from the start: 15 with 4 neighbours, 13 + √2 with 8.
    Greedy expands at most 1/8 as many cells as Dijkstra's.
    """
    found = searched(open_map(), "greedy", "dijkstra")
    measured = []
    for neighbours, best in ((4, 15.0), (8, 13 + DIAGONAL)):
        greedy, dijkstra = found["greedy", neighbours], found["dijkstra", neighbours]
        measured += [
            about(f"cost of the greedy path, {neighbours} neighbours", greedy.cost, best, 1e-9, "cells"),
            Measured(
                f"cells that greedy expands against Dijkstra's, {neighbours} neighbours",
                len(greedy.expanded) / len(dijkstra.expanded), most=1 / 8,
            ),
        ]  # fmt: skip
    return _outcome(measured, open_map(), found, ("greedy", "dijkstra"))


BEST = {4: 21.0, 8: 9 + 6 * DIAGONAL}


@experiment("E42")
def detour(seed: int) -> Outcome:
    """Greedy search makes a detour round an extended obstacle

    In the notes: section 6.2, Figs. 6.7 and 6.8 (right)

    Figure: Paths past a wall like a C: above greedy, which runs into it first, below the notes' box word for word
    (walk).

    Expected: By hand: the target lies 14 columns and one row from the start, and the way round the C-shaped wall is
    6 rows longer: 21 with 4 neighbours; with 8 neighbours six of its steps are diagonal, 9 + 6 √2. The greedy path
    is at least 1.4 times as long with 4 neighbours, 1.05 times with 8, and it does arrive.
    """
    found = searched(c_wall(), "greedy", "walk")
    least = {4: 1.4, 8: 1.05}
    measured = [
        Measured(
            f"cost of {method} against the shortest, {neighbours} neighbours",
            one.cost / BEST[neighbours], least=least[neighbours], most=3.0,
        )
        for (method, neighbours), one in found.items()
    ]  # fmt: skip
    return _outcome(measured, c_wall(), found, ("greedy", "walk"))


@experiment("E43")
def everywhere(seed: int) -> Outcome:
    """Dijkstra's search finds the shortest path and looks everywhere

    In the notes: section 6.2, Figs. 6.9 and 6.10

    Figure: Paths past a wall like a C by Dijkstra's algorithm.

    Expected: By hand: the target lies 14 columns and one row from the start, and the way round the C-shaped wall is
    6 rows longer: 21 with 4 neighbours; with 8 neighbours six of its steps are diagonal, 9 + 6 √2. It expands at
    least 85 % of the free cells.
    """
    free = c_wall()
    found = searched(free, "dijkstra")
    measured = []
    for neighbours, best in BEST.items():
        one = found["dijkstra", neighbours]
        share = len(one.expanded) / float(free.sum())
        measured += [
            about(f"cost of the path, {neighbours} neighbours", one.cost, best, 1e-9, "cells"),
            Measured(f"share of the free cells that it expands, {neighbours} neighbours", share, least=0.85, most=1.0),
        ]
    return _outcome(measured, free, found, ("dijkstra",))


# ---- E44: random maps ------------------------------------------------------------------------------------------------

MAPS = 200
BLOCKED = 0.28  # share of the cells


def random_maps(seed: int) -> Iterator[NDArray[np.bool_]]:
    """Free cells of maps of 20 by 12 on which there is a way from start to target."""
    chance = np.random.default_rng(seed)
    while True:
        free = chance.random((12, 20)) >= BLOCKED
        free[START] = free[TARGET] = True
        if Lattice(free).reachable(START).free[TARGET]:
            yield free


@experiment("E44")
def star(seed: int) -> Outcome:
    """A* finds the shortest path, and looks at fewer cells

    In the notes: section 6.2, Dijkstra's algorithm

    Figure: 200 random maps, 28 % of the cells blocked. Left: cells that A* and Dijkstra's expand; right: cost of
    the greedy path against the shortest one.

    Expected: A*'s path is as long as Dijkstra's, and it is more efficient, the notes say. An earlier computation,
    with other maps and code, had 0.61 of the cells and greedy paths 1.072 times as long. Single maps differ by 0.20
    and 0.10 (1 σ), two means of 200 maps by 0.02 and 0.01; three times that is allowed: at most 0.67, and 1.072 ±
    0.03.
    """
    maps = list(itertools.islice(random_maps(seed), MAPS))
    rows = []
    for free in maps:
        greedy, dijkstra, astar = (search(Lattice(free), START, TARGET, m) for m in ("greedy", "dijkstra", "astar"))
        rows.append((dijkstra.cost, astar.cost, greedy.cost, *(len(one.expanded) for one in (dijkstra, astar, greedy))))
    best, star_cost, greedy_cost, by_dijkstra, by_star, by_greedy = np.array(rows).T
    longer = greedy_cost / best
    measured = [
        Measured("largest difference of A*'s cost from Dijkstra's", float(np.abs(star_cost - best).max()), most=1e-9),
        exactly("maps on which A* expands more cells", int((by_star > by_dijkstra).sum()), 0),
        exactly("maps on which greedy is shorter", int((greedy_cost < best - 1e-9).sum()), 0),
        Measured("cells that A* expands against Dijkstra's, mean", float((by_star / by_dijkstra).mean()), most=0.67),
        about("greedy cost against the shortest, mean", float(longer.mean()), 1.072, 0.03),
    ]
    data = {
        "cost_dijkstra": best,
        "cost_astar": star_cost,
        "cost_greedy": greedy_cost,
        "expanded_dijkstra": by_dijkstra,
        "expanded_astar": by_star,
        "expanded_greedy": by_greedy,
    }

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        most = 10 * math.ceil(float(by_dijkstra.max()) / 10)
        left.plot((0, most), (0, most), color="0.6", lw=1.0, label="as many")
        left.plot(by_dijkstra, by_star, "o", ms=3.5, alpha=0.6)
        left.set(xlabel="cells expanded by Dijkstra's", ylabel="cells expanded by A*", aspect="equal")
        left.legend(loc="upper left")
        right.set_box_aspect(1)
        right.hist(longer, bins=np.arange(1.0, float(longer.max()) + 0.05, 0.025), color="#0072b2")
        right.set(xlabel="greedy cost / shortest cost", ylabel="maps")

    return Outcome(measured, data, draw)


# ---- E45: grids of nodes and of cells --------------------------------------------------------------------------------


@dataclass(frozen=True)
class Nodes:
    """A grid of nodes joined by edges, as in the left and the middle panel of Fig. 6.5; nodes are numbers.

    Attributes:
        places: of the nodes (m).
        edges: of each node, to others.
    """

    places: Sequence[Point]
    edges: Mapping[int, Sequence[int]]

    def neighbours(self, node: int) -> Iterator[tuple[int, float]]:
        """Each with the straight way there (m)."""
        for other in self.edges[node]:
            yield other, self.distance(node, other)

    def distance(self, node: int, other: int) -> float:
        """Straight (m)."""
        return math.dist(self.places[node], self.places[other])

    @cached_property
    def shortest(self) -> Floats:
        """Between each two nodes (m), by Floyd's algorithm: not the search's own."""
        count = len(self.places)
        ways = np.full((count, count), np.inf)
        np.fill_diagonal(ways, 0.0)
        for node, others in self.edges.items():
            for other in others:
                ways[node, other] = math.dist(self.places[node], self.places[other])
        for middle in range(count):
            np.minimum(ways, ways[:, middle, None] + ways[None, middle], out=ways)
        return ways


def nodes_of(free: NDArray[np.bool_]) -> tuple[Nodes, dict[Cell, int]]:
    """A node in the middle of each free cell, with edges to those around it, the nearest first, then
    counter-clockwise; none across the corner of a cell that is not free. Also the number of each cell's node."""
    number = {(int(row), int(column)): index for index, (row, column) in enumerate(np.argwhere(free))}
    around = sorted(
        (cell for cell in itertools.product((-1, 0, 1), repeat=2) if any(cell)),
        key=lambda cell: (abs(cell[0]) + abs(cell[1]), math.atan2(*cell) % (2 * math.pi)),
    )
    edges = {
        index: [
            number[row + up, column + right]
            for up, right in around
            if {(row + up, column + right), (row + up, column), (row, column + right)} <= number.keys()
        ]
        for (row, column), index in number.items()
    }
    return Nodes([(column + 0.5, row + 0.5) for row, column in number], edges), number


UNEVEN = 60  # nodes of the left panel
BETWEEN = 20  # pairs of them


def uneven_nodes(chance: np.random.Generator) -> Nodes:
    """Nodes anywhere in 5 m by 3 m, each joined to all within 1 m."""
    places = [(float(x), float(y)) for x, y in chance.uniform((0, 0), (5, 3), (UNEVEN, 2))]
    near = {
        node: [other for other, there in enumerate(places) if other != node and math.dist(here, there) < 1.0]
        for node, here in enumerate(places)
    }
    return Nodes(places, near)


def way(nodes: Nodes, path: Sequence[int]) -> float:
    """Its length (m), by the places alone."""
    return length([nodes.places[node] for node in path])


@experiment("E45")
def representations(seed: int) -> Outcome:
    """Grids of nodes and of cells

    In the notes: section 6.2, Fig. 6.5

    Figure: Left: nodes that are not equidistant, with the shortest path. Middle: a regular lattice of nodes; right:
    the same as cells, with the same path.

    Expected: The middle and the right grid of the figure are equivalent. Where nodes are not equidistant the cost
    varies: the shortest ways between all nodes, by Floyd's algorithm, are what the search has to find.
    """
    free = c_wall()
    regular, number = nodes_of(free)
    by_cells = search(Lattice(free), START, TARGET)
    by_nodes = search(regular, number[START], number[TARGET])
    same = [number[cell] for cell in by_cells.path]
    chance = np.random.default_rng(seed)
    uneven = uneven_nodes(chance)
    pairs = [(int(a), int(b)) for a, b in chance.integers(UNEVEN, size=(BETWEEN * 20, 2))]
    joined = [(a, b) for a, b in pairs if a != b and np.isfinite(uneven.shortest[a, b])][:BETWEEN]
    found = [search(uneven, a, b) for a, b in joined]
    lengths = [way(uneven, one.path) for one in found]
    best = [float(uneven.shortest[pair]) for pair in joined]
    measured = [
        about("cost by cells less cost by nodes", by_cells.cost - by_nodes.cost, 0.0, 1e-9),
        exactly("nodes in which the two paths differ", len(set(same) ^ set(by_nodes.path)), 0),
        Measured("pairs of nodes that are not equidistant", len(joined), least=BETWEEN),
        Measured(
            "longest of their paths less the shortest way",
            max(np.subtract(lengths, best), default=math.nan), "m", least=-1e-9, most=1e-9,
        ),
    ]  # fmt: skip
    data = {
        "start": [a for a, _ in joined],
        "target": [b for _, b in joined],
        "length_m": lengths,
        "shortest_m": best,
        "nodes": [len(one.path) for one in found],
    }

    def draw(figure: Figure) -> None:
        figure.set_figheight(2.7)
        left, middle, right = figure.subplots(1, 3)
        longest = max(found, key=lambda one: one.cost)
        _draw_nodes(left, uneven, longest.path)
        left.set(xlabel="x (m)", ylabel="y (m)", title="not equidistant", xlim=(0, 5), ylim=(0, 3))
        _draw_nodes(middle, regular, by_nodes.path)
        middle.set(xlabel="column", ylabel="row", title="regular lattice", xlim=(0, 20), ylim=(0, 12))
        _draw_search(right, free, Found(by_cells.path, by_cells.cost, []))
        right.set(title="as cells")
        for axes in (left, middle, right):
            axes.set_aspect("equal")
            axes.title.set_fontsize(10)

    return Outcome(measured, data, draw)


def _draw_nodes(axes: Axes, nodes: Nodes, path: Sequence[int]) -> None:
    from matplotlib.collections import LineCollection

    ends = [(nodes.places[a], nodes.places[b]) for a, others in nodes.edges.items() for b in others if a < b]
    axes.add_collection(LineCollection(ends, colors="#b8bfcd", linewidths=0.6))
    axes.plot(*np.array(nodes.places).T, "o", color="#39415a", ms=2.2)
    axes.plot(*np.array([nodes.places[node] for node in path]).T, color=PATH, lw=2.2)
    axes.plot(*nodes.places[path[0]], "o", mfc=FROM, mec=PATH, ms=7)
    axes.plot(*nodes.places[path[-1]], "s", mfc="white", mec=PATH, ms=7)
    axes.grid(visible=False)


# ---- E46: a path tightened -------------------------------------------------------------------------------------------

ARENA = "office"
RADIUS, MARGIN = 0.07, 0.05  # m
CELL = 0.05  # m
WAYS = 10
DIP = 0.006  # m; of a lattice for paths that keep 0.12 m: halfway to a diagonal neighbour √(0.126² - 0.035²) is left
APART = 2.0  # m


def ways(lattice: Lattice, seed: int) -> Iterator[tuple[Cell, Cell]]:
    """Cells to begin and to end in, two metres apart at least; the first pair is the figure's."""
    chance = np.random.default_rng(seed)
    ends = (lattice.nearest_free(*place, within=0.2) for place in ((-2.5, -1.5), (2.2, 1.2)))
    begin, end = ends
    if begin is not None and end is not None:
        yield begin, end
    cells = np.argwhere(lattice.free)
    while True:
        one, other = (tuple(cell.tolist()) for cell in cells[chance.integers(len(cells), size=2)])
        if lattice.distance(one, other) >= APART:
            yield one, other


def clearance(plan: LineMap, path: Sequence[Point]) -> float:
    """The least distance of places every 2 mm along a path from a line (m)."""
    points = [
        np.linspace(begin, end, 2 + int(math.dist(begin, end) / 0.002)) for begin, end in itertools.pairwise(path)
    ]
    return float(plan.distance(np.vstack(points)).min())


Box = tuple[int, int, int, int]
"""First and one beyond the last row, first and one beyond the last column."""


def rectangles_of(free: NDArray[np.bool_]) -> list[Box]:
    """Free cells merged into rectangles, which are convex: any straight way inside one is free. The greatest is taken
    first, then the greatest of what is left, and so on."""
    left, found = free.copy(), []
    while left.any():
        found.append(greatest_rectangle(left))
        top, bottom, begin, end = found[-1]
        left[top:bottom, begin:end] = False
    return found


def greatest_rectangle(free: NDArray[np.bool_]) -> Box:
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


@experiment("E46")
def tightening(seed: int) -> Outcome:
    """A grid made from a map, and a path tightened in it

    In the notes: section 6.2, Fig. 6.6

    Figure: Left: forbidden parts (black), where a robot of 0.07 m with a margin of 0.05 m cannot be, and the cells
    into which the rest is merged. Right: a path from cell to cell of a lattice (grey), and tightened (blue).

    Expected: On a lattice of 8 neighbours a way is longer than the straight one by |cos| + (√2 - 1) |sin| of its
    direction within 45 degrees, 5.5 % in the mean: a tightened path is at least 2 % shorter in the mean, and keeps
    radius and margin everywhere.
    """
    plan = LineMap.of(ARENA)
    whole = Lattice.of(plan, RADIUS, MARGIN + DIP, CELL)
    first, _ = next(ways(whole, seed))
    lattice = whole.reachable(first)
    raw, tight = [], []
    for begin, end in itertools.islice(ways(lattice, seed), WAYS):
        raw.append([lattice.centre(cell) for cell in search(lattice, begin, end, "dijkstra").path])
        tight.append(tightened(raw[-1], plan, RADIUS + MARGIN))
    shares = [length(after) / length(before) for before, after in zip(raw, tight, strict=True)]
    clear = [clearance(plan, path) for path in tight]
    cells = rectangles_of(lattice.free)
    inside = sum((bottom - top) * (right - left) for top, bottom, left, right in cells)
    measured = [
        Measured("longest of the tightened paths against its path on the lattice", max(shares), most=1.0),
        Measured("the same, mean", float(np.mean(shares)), most=0.98),
        Measured("least distance of a tightened path from a line", min(clear), "m", least=RADIUS + MARGIN - 1e-9),
        exactly("free cells of the lattice less those within convex cells", float(lattice.free.sum() - inside), 0),
    ]
    data = {
        "raw_m": [length(path) for path in raw],
        "tightened_m": [length(path) for path in tight],
        "raw_waypoints": [len(path) for path in raw],
        "tightened_waypoints": [len(path) for path in tight],
        "clearance_m": clear,
    }

    def draw(figure: Figure) -> None:
        figure.set_figheight(3.3)
        left, right = figure.subplots(1, 2)
        _draw_grid(left, plan, lattice, cells)
        _draw_grid(right, plan, lattice, [])
        right.plot(*np.array(raw[0]).T, color="#8a93a6", lw=1.6, label="as searched")
        right.plot(*np.array(tight[0]).T, "o-", color="#0072b2", lw=1.8, ms=4, label="tightened")
        figure.legend(loc="outside lower center", ncols=3, fontsize=9)

    return Outcome(measured, data, draw)


def _draw_grid(axes: Axes, plan: LineMap, lattice: Lattice, cells: list[Box]) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Rectangle

    from boebot.view.painter import frame

    low, high = plan.bounds
    frame(axes, low, high)
    reach = (lattice.x, lattice.x + lattice.columns * CELL, lattice.y, lattice.y + lattice.rows * CELL)
    axes.imshow(np.where(lattice.free, 1.0, 0.12), cmap="gray", vmin=0, vmax=1, origin="lower", extent=reach)
    axes.add_collection(LineCollection(list(plan.segments), colors="#35b36b", linewidths=1.0))
    for top, bottom, begin, end in cells:
        corner = lattice.x + begin * CELL, lattice.y + top * CELL
        axes.add_patch(
            Rectangle(corner, (end - begin) * CELL, (bottom - top) * CELL, fill=False, edgecolor="#d1a800", lw=1.2)
        )
    axes.grid(visible=False)
