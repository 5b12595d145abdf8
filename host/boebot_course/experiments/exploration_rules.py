"""Nodes of an exploration by sensory area coverage: section 6.1 of the notes, Figs. 6.1 and 6.2; E36 and E37.

Both are replayed with the kit's `ExplorationGraph` and `Placement`; nodes have the notes' numbers, from 1.
"""

from __future__ import annotations

import itertools
import math
import operator
from dataclasses import dataclass

import numpy as np

from boebot.navigation import Scan
from boebot.navigation.exploration_graph import ExplorationGraph, Placement
from boebot.view import style
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, about, exactly, experiment

Point = tuple[float, float]

# ---- E36: the walk of Fig. 6.2 ---------------------------------------------------------------------------------------

LEAST_DISTANCE = 0.75  # d_min (m)
RADIUS = 0.15  # m
ROOM = ((-0.6, -1.35), (2.4, 2.35))  # two corners (m)
LOW_BLOCK = ((-0.35, 1.45), (0.3, 1.8))  # the laser looks over it
PLACES: dict[int, Point] = {
    1: (0.0, 0.0),
    2: (0.50, -0.866),
    3: (1.0, 0.0),
    4: (0.49, 0.849),  # 2 cm nearer than 2 and 3: of equals the notes take any, the kit the first
    5: (1.356, 1.349),
    6: (0.0, 1.698),  # 2 cm nearer than 5
    7: (1.856, 0.483),
}
NEAR_3 = (1.13, 0.375)  # 0.4 m from node 3
PATHS: dict[int, dict[int, tuple[int, ...]]] = {
    4: {2: (4, 1, 2), 3: (4, 1, 3), 5: (4, 5), 6: (4, 6)},
    6: {2: (6, 4, 1, 2), 3: (6, 4, 1, 3), 5: (6, 4, 5)},
    5: {2: (5, 4, 1, 2), 3: (5, 4, 1, 3), 7: (5, 7)},
    7: {2: (7, 5, 4, 1, 2), 3: (7, 5, 4, 1, 3)},
}
"""Active node -> pending node -> path, by hand: back to where the two part, and on from there."""


@dataclass(frozen=True)
class Panel:
    """The graph at one moment: numbers of nodes."""

    active: int
    robot: Point
    target: int
    status: dict[int, str]
    paths: dict[int, tuple[int, ...]]
    placed: int = 0
    """how many of the places that it tried last became nodes"""


class Walk:
    """A robot that walks as in Fig. 6.2."""

    def __init__(self) -> None:
        self.graph = ExplorationGraph(PLACES[1], LEAST_DISTANCE)
        self.robot = PLACES[1]
        self.panels: list[Panel] = []

    def place(self, *places: Point) -> None:
        """New nodes there, and a look at the graph."""
        placed = sum(self.graph.place(place) is not None for place in places)
        target = self.graph.target()
        self.panels.append(
            Panel(
                self.graph.active + 1,
                self.robot,
                0 if target is None else target.number + 1,
                {node.number + 1: node.status for node in self.graph.nodes},
                {node.number + 1: tuple(number + 1 for number in node.path) for node in self.graph.pending},
                placed,
            )
        )

    def go(self, *places: Point) -> None:
        """To the target, and new nodes there."""
        target = self.graph.target()
        if target is not None:
            self.robot = target.place
            self.graph.reached(target.number)
        self.place(*places)

    def fail(self, stopped_at: Point) -> None:
        """The way to the target is blocked there."""
        target = self.graph.target()
        if target is not None:
            self.robot = stopped_at
            self.graph.blocked(target.number)
        self.place()


def walked() -> list[Panel]:
    """From node 1 to 4; 6 is behind the low block; to 5, and to 7."""
    walk = Walk()
    walk.place(PLACES[2], PLACES[3], PLACES[4])
    walk.go(PLACES[5], PLACES[6])
    walk.fail((0.24, 1.283))
    walk.go(NEAR_3, PLACES[7])
    walk.go()
    return walk.panels


def _wrong_paths(panel: Panel) -> int:
    """How many of the paths are not as they are by hand."""
    expected = PATHS.get(panel.active, {})
    return sum(panel.paths.get(node) != expected.get(node) for node in panel.paths | expected)


@experiment("E36")
def moving_on(seed: int) -> Outcome:
    """Paths to pending nodes when the robot moves on

    In the notes: section 6.1, Fig. 6.2

    Figure: Thin circle: the robot. Double circle: target; circle: pending; disc: completed; square: unreachable.
    Hatched: a low block that the laser does not see. Lines: paths from the robot's node.

    Expected: Worked out by hand by the notes' rule: from the new node back to the one where both paths part, and on
    from there.
    """
    panels = walked()
    first, *later = panels
    after = {panel.active: panel for panel in later}
    targets = [panel.target for panel in panels]
    measured = [
        exactly("targets other than 4, 6, 5 and 7, in turn", sum(map(operator.ne, targets, (4, 6, 5, 7))), 0),
        *(
            exactly(f"wrong paths when {active} is active", _wrong_paths(after[active]) if active in after else 9, 0)
            for active in PATHS
        ),
        exactly("nodes when 1 is active", first.placed, 3),
        exactly("new nodes at 5, one of two places is too near to 3", after[5].placed if 5 in after else 0, 1),
        exactly("nodes that end unreachable", sum(s == "unreachable" for s in panels[-1].status.values()), 1),
    ]
    rows = [(panel.active, node, path) for panel in panels for node, path in panel.paths.items()]
    data = {
        "active": [active for active, _, _ in rows],
        "pending": [node for _, node, _ in rows],
        "path": [" ".join(map(str, path)) for _, _, path in rows],
    }

    def draw(figure: Figure) -> None:
        figure.set_figheight(8.6)
        for axes, panel in zip(figure.subplots(2, 2).flat, panels, strict=False):
            _draw_panel(axes, panel)

    return Outcome(measured, data, draw)


def _draw_panel(axes: Axes, panel: Panel) -> None:
    from matplotlib.patches import Circle, Rectangle

    from boebot.view.painter import HATCH, frame

    low, high = np.array(ROOM)
    frame(axes, low - 0.1, high + 0.1)
    axes.add_patch(Rectangle(low, *(high - low), fill=False, edgecolor=style.EDGE, lw=2.8))
    block = np.array(LOW_BLOCK)
    size = block[1] - block[0]
    axes.add_patch(Rectangle(block[0], *size, facecolor=style.LOW, edgecolor=style.EDGE, hatch=HATCH, lw=0.8))
    for path in panel.paths.values():
        axes.plot(*np.array([PLACES[node] for node in path]).T, color="#0072b2", lw=1.0, zorder=3)
    for node, status in panel.status.items():
        x, y = PLACES[node]
        if status == "unreachable":
            axes.add_patch(Rectangle((x - 0.06, y - 0.06), 0.12, 0.12, color=style.ESTIMATE, zorder=5))
        else:
            filled = status == "completed"
            axes.add_patch(
                Circle((x, y), 0.07, fc=style.INK if filled else style.FLOOR, ec=style.INK, lw=1.6, zorder=5)
            )
        if node == panel.target:
            axes.add_patch(Circle((x, y), 0.115, fill=False, edgecolor=style.INK, lw=1.6, zorder=5))
        label = {"facecolor": style.FLOOR, "edgecolor": "none", "pad": 0.8}
        axes.annotate(str(node), (x, y), (12, 4), textcoords="offset points", fontsize=9, bbox=label, zorder=4)
    axes.add_patch(Circle(panel.robot, RADIUS, fill=False, edgecolor=style.START, lw=1.0, zorder=6))
    axes.set_title(f"{panel.active} is active, {panel.target} is the target", fontsize=10)


# ---- E37: nodes from a scan, Fig. 6.1 --------------------------------------------------------------------------------

PLACEMENT = Placement(distance=1.0, margin=0.3, least_angle=0.35, least_distance=0.75)
FREE = ((-70, -31, 2.0), (-10, 84, 1.6), (88, 89, 3.0))  # first and last ray (degrees), and how far they go (m)
NEAR = 0.8  # m, in all other directions


def scan_of(wide: float = FREE[1][2]) -> Scan:
    """181 rays from -90 to 90 degrees; `wide`: how far those of the wide interval go (m)."""
    degrees = np.arange(-90, 91)
    distances = np.full(181, NEAR)
    for (first, last, _), far in zip(FREE, (FREE[0][2], wide, FREE[2][2]), strict=True):
        distances[(degrees >= first) & (degrees <= last)] = far
    return Scan(distances, (-math.pi / 2, math.pi / 2), 4.0)


@experiment("E37")
def placed(seed: int) -> Outcome:
    """Nodes where the way is free

    In the notes: section 6.1, Fig. 6.1

    Figure: Left: distances of a scan over half a turn, with circles of D and D + Δ. Right: intervals that are free
    up to D + Δ and wide enough, with their nodes; the wide one has two, the narrow one at 88 degrees none.

    Expected: The nodes' directions are the middles of the intervals, or of their halves. Nodes of one interval are
    at least d_min apart. Where the wide interval is free for 1.2 m only, less than D + Δ, it has none.
    """
    scan = scan_of()
    bearings = sorted(np.degrees(PLACEMENT.bearings(scan)).tolist())
    found = (*bearings, math.nan, math.nan, math.nan)
    apart = [2 * PLACEMENT.distance * math.sin(math.radians(b - a) / 2) for a, b in itertools.pairwise(bearings)]
    measured = [
        exactly("free intervals", len(PLACEMENT.intervals(scan)), 3),
        exactly("nodes", len(bearings), 3),
        about("first node", found[0], -50.5, 1e-6, "degrees"),
        about("second node", found[1], 13.5, 1e-6, "degrees"),
        about("third node", found[2], 60.5, 1e-6, "degrees"),
        Measured("least distance of two nodes", min(apart, default=0.0), "m", least=PLACEMENT.least_distance),
        exactly("nodes where the wide interval is free for 1.2 m", len(PLACEMENT.bearings(scan_of(1.2))), 1),
    ]
    angles = np.linspace(*scan.bearings, len(scan.distances))
    free = [np.any([a <= angle <= b for a, b in PLACEMENT.intervals(scan)]) for angle in angles]

    def draw(figure: Figure) -> None:
        figure.set_figheight(3.2)
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        _draw_scan(left, angles, scan.distances)
        _draw_scan(right, angles, scan.distances, faint=True)
        _draw_nodes(right, scan)

    data = {"bearing_deg": np.degrees(angles), "distance_m": scan.distances, "is_free": free}
    return Outcome(measured, data, draw)


def _draw_scan(axes: Axes, angles: Floats, distances: Floats, *, faint: bool = False) -> None:
    """Seen from above, the robot heading up."""
    from matplotlib.patches import Circle, Polygon

    from boebot.view.painter import frame

    frame(axes, np.array((-2.1, -0.3)), np.array((2.1, 1.9)))
    corners = np.column_stack((-distances * np.sin(angles), distances * np.cos(angles)))
    inside, edge = ("#f3f5f9", style.FAINT) if faint else ("#cfe0ee", "#0072b2")
    axes.add_patch(Polygon(np.vstack(((0, 0), corners)), facecolor=inside, edgecolor=edge, lw=1.0, zorder=1))
    for radius, name in ((PLACEMENT.distance, "D"), (PLACEMENT.distance + PLACEMENT.margin, "D + Δ")):
        arc = radius * np.column_stack((-np.sin(angles), np.cos(angles)))
        axes.plot(*arc.T, color=style.INK, lw=1.0, ls=(0, (4, 2)), zorder=2)
        axes.annotate(name, arc[0], (3, 2), textcoords="offset points", fontsize=9)
    axes.add_patch(Circle((0, 0), RADIUS, fc=style.FLOOR, ec=style.START, lw=1.4, zorder=3))


def _draw_nodes(axes: Axes, scan: Scan) -> None:
    from matplotlib.patches import Wedge

    for begin, end in PLACEMENT.intervals(scan):
        if end - begin > PLACEMENT.least_angle:
            reach = PLACEMENT.distance + PLACEMENT.margin
            degrees = np.degrees((begin, end)) + 90
            axes.add_patch(Wedge((0, 0), reach, *degrees, fc="#cfe8dd", ec=style.START, lw=0.8, zorder=1.5))
    for bearing in PLACEMENT.bearings(scan):
        place = -PLACEMENT.distance * math.sin(bearing), PLACEMENT.distance * math.cos(bearing)
        axes.plot(*place, "o", color=style.INK, ms=9, zorder=4)
        axes.annotate(
            f"{math.degrees(bearing):.1f}°", place, (0, 9), textcoords="offset points", ha="center", fontsize=9
        )
