"""Exploration by sensory area coverage: section 6.1 of the notes, Figs. 6.2 to 6.4; E38 to E40.

A round robot of 0.15 m with a laser range finder of half a turn, and with odometry that does not drift, as the notes
assume it. Rules R1 to R15 are those of docs/reference/navigation.md; nodes lie 1 m from where they were placed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boebot.brain import Brain
from boebot.cognition import Odometry
from boebot.navigation import Explore, Lattice, LineMap, Placement
from boebot_course.coverage import Coverage
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, exactly, experiment
from boebot_course.paths import floor
from boebot_course.trials import Log, Trial, trial_seeds, try_once
from boebot_course.variants import arena_file, exact_roller, poses_on

Pose = tuple[float, float, float]

RADIUS = 0.15  # m
HALF_TURN = (-math.pi / 2, math.pi / 2)  # that the laser sees
RAYS, REACH = 120, 4.0  # reach in m
LEAST = 0.995  # coverage, of Fig. 6.4
SECONDS = 600.0
STATUS_COLOURS = {"pending": "#999999", "completed": "#009e73", "unreachable": "#d55e00"}


def explorer(*, second_pass: bool = True) -> Explore:
    """D = 1 m, Δ = 0.3 m, d_min = 0.75 m, L = 3 m."""
    return Explore(speed=0.25, turn_speed=0.1, placement=Placement(), near=0.08, second_pass=second_pass)


@dataclass(frozen=True)
class Exploration:
    """One of them, and what came of it.

    Attributes:
        share: coverage, 0 to 1.
        is_complete: no node was left pending.
    """

    trial: Trial
    explore: Explore
    share: float

    @property
    def is_complete(self) -> bool:
        """No node is pending, and it has said that it has ended."""
        assert self.explore.graph is not None
        return self.explore.complete and not self.explore.graph.pending

    def count(self, status: str) -> int:
        """Nodes of that status."""
        assert self.explore.graph is not None
        return sum(node.status == status for node in self.explore.graph.nodes)


def explored(arena: str | Path, seen: LineMap, pose: Pose, seed: int, explore: Explore) -> Exploration:
    """One exploration.

    Args:
        seen: what the laser can see of the arena: coverage is measured on it.
        pose: where it begins (m, m, rad).
    """
    trial = try_once(Brain([Odometry(), explore]), exact_roller(), arena, SECONDS, pose=pose, seed=seed)
    coverage = Coverage(seen)
    true = trial.result.true_pose
    assert true is not None
    coverage.add_path(np.column_stack((true.x, true.y, true.heading)), HALF_TURN, RAYS, REACH)
    assert len(trial.time)  # is kept, with the path
    del trial.result.series  # all that the laser saw, which takes much memory
    return Exploration(trial, explore, coverage.share)


def starts(arena: str, seed: int, count: int) -> list[Pose]:
    """Poses at which a robot can stand in the part of an arena that can be reached (m, m, rad)."""
    plan = LineMap.of(arena)
    lattice = Lattice.of(plan, RADIUS, 0.1, 0.05)
    first = lattice.nearest_free(1.0, 1.0, within=0.5)
    assert first is not None
    return poses_on(lattice.reachable(first), np.random.default_rng(seed), count)


# ---- E38: a low obstacle ---------------------------------------------------------------------------------------------

LOW = """
[[outline]]
corners_m = [[0, 0], [4, 0], [4, 3], [0, 3]]
[[obstacle]]
name = "low block"
corners_m = [[1.7, 1.65], [2.15, 1.65], [2.15, 2.1], [1.7, 2.1]]
height_m = 0.06
"""
LOW_START = (1.0, 1.5, 0.0)  # m, m, rad: its second node is then at 22.5 degrees, in the block


@experiment("E38", robot="roller, with odometry that does not drift", slow=True)
def low_obstacle(seed: int) -> Outcome:
    """A node that cannot be reached

    In the notes: section 6.1, Fig. 6.2

    Figure: Exploration of a room with a block that lies below the laser's plane. Left: nodes, legs along which they
    were placed, path. Right: nodes of each status over time.

    Expected: The block takes up the place of one node (4 nodes in half a turn at 1 m: at ±22.5 and ±67.5 degrees),
    and no other node is nearer than d_min / 3 to it: one node is unreachable, all others are completed.
    """
    explore = explorer(second_pass=False)
    log = Log(read=lambda _, robot: (robot.time, {} if explore.graph is None else _statuses(explore)))
    with arena_file("low", LOW) as arena:
        brain = Brain([Odometry(), log, explore])
        trial = try_once(brain, exact_roller(), arena, 250.0, pose=LOW_START, seed=seed)
    changes = [after for before, after in itertools.pairwise([(0.0, {}), *log.rows]) if after[1] != before[1]]
    statuses = _statuses(explore)
    unreachable = [number for number, status in statuses.items() if status == "unreachable"]
    was = [now[number] for number in unreachable[:1] for _, now in changes if number in now]
    measured = [
        exactly("unreachable nodes", len(unreachable), 1),
        exactly("completed nodes among the others", list(statuses.values()).count("completed"), len(statuses) - 1),
        exactly(
            "it was pending, then unreachable",
            [key for key, _ in itertools.groupby(was)] == ["pending", "unreachable"],
            1,
        ),
        exactly("the exploration is complete", explore.complete, 1),
    ]
    times = [*(time for time, _ in changes), float(trial.time[-1])]
    counts = {
        status: [list(now.values()).count(status) for _, now in [*changes, changes[-1]]] for status in STATUS_COLOURS
    }

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
        _draw_exploration(left, trial, explore)
        for status, colour in STATUS_COLOURS.items():
            right.step(times, counts[status], where="post", color=colour, label=status)
        right.set(xlabel="time (s)", ylabel="nodes (1)")
        right.legend(fontsize=9, frameon=False)

    return Outcome(measured, {"time_s": times, **counts}, draw)


def _statuses(explore: Explore) -> dict[int, str]:
    """Of its nodes, by number."""
    assert explore.graph is not None
    return {node.number: node.status for node in explore.graph.nodes}


# ---- E39, E40: coverage ----------------------------------------------------------------------------------------------

STARTS, BLOCK_STARTS = 12, 24


def all_explored(arena: str, seed: int, count: int, *, second_pass: bool = True) -> list[Exploration]:
    """Explorations from as many starts."""
    seen = LineMap.of("exploration")
    given = list(zip(starts(arena, seed, count), trial_seeds(seed, count), strict=True))
    return [explored(arena, seen, pose, number, explorer(second_pass=second_pass)) for pose, number in given]


def data_of(runs: list[Exploration]) -> dict[str, list[float]]:
    """A row for each start."""
    return {
        "start_x_m": [run.trial.start[0] for run in runs],
        "start_y_m": [run.trial.start[1] for run in runs],
        "coverage": [run.share for run in runs],
        "way_m": [run.trial.way for run in runs],
        "completed": [run.count("completed") for run in runs],
        "unreachable": [run.count("unreachable") for run in runs],
    }


@experiment("E39", robot="roller, with odometry that does not drift", slow=True)
def coverage(seed: int) -> Outcome:
    """Sensory area coverage

    In the notes: section 6.1, Fig. 6.4

    Figure: Exploration of three rooms. Left: the first start, nodes, legs along which they were placed, path.
    Right: coverage and way of each of twelve starts.

    Expected: Fig. 6.4 says better than 99.5 %; the way is at most 45 m.
    """
    runs = all_explored("exploration", seed, STARTS)
    measured = [
        exactly("starts with a coverage of 99.5 %", sum(run.share >= LEAST for run in runs), STARTS),
        exactly("explorations that are complete", sum(run.is_complete for run in runs), STARTS),
        Measured("longest way", max(run.trial.way for run in runs), "m", most=45.0),
        Measured("true contacts", sum(run.trial.result.true_contacts or 0 for run in runs)),
    ]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
        _draw_exploration(left, runs[0].trial, runs[0].explore)
        _draw_shares(right, runs, "#0072b2", "each start")

    return Outcome(measured, data_of(runs), draw)


@experiment("E40", robot="roller, with odometry that does not drift", slow=True)
def deadlocks(seed: int) -> Outcome:
    """A block that the laser does not see

    In the notes: section 6.1, Fig. 6.3

    Figure: Exploration of the same rooms with a low block behind a door. Left: the first start. Right: coverage and
    way of each of 24 starts, with the rules for deadlocks and without.

    Expected: The notes have a method for deadlocks but do not say which; with R14, the kit's, all starts come to
    99.5 %, without it some do not.
    """
    runs = all_explored("exploration-block", seed, BLOCK_STARTS)
    plain = all_explored("exploration-block", seed, BLOCK_STARTS, second_pass=False)
    measured = [
        exactly("starts with a coverage of 99.5 %", sum(run.share >= LEAST for run in runs), BLOCK_STARTS),
        Measured("explorations that have ended after 600 s", sum(run.is_complete for run in runs)),
        Measured("starts with 99.5 % without R14", sum(run.share >= LEAST for run in plain), most=BLOCK_STARTS - 1),
        Measured("least coverage without R14", 100 * min(run.share for run in plain), "%"),
        Measured("mean way", float(np.mean([run.trial.way for run in runs])), "m"),
        Measured("nodes left unreachable, mean", float(np.mean([run.count("unreachable") for run in runs]))),
    ]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
        _draw_exploration(left, runs[0].trial, runs[0].explore)
        _draw_shares(right, plain, "#d55e00", "without R14")
        _draw_shares(right, runs, "#0072b2", "with R14")
        right.legend(loc="lower right", fontsize=9, frameon=False)

    return Outcome(measured, data_of(runs), draw)


# ---- pictures --------------------------------------------------------------------------------------------------------


def _draw_exploration(axes: Axes, trial: Trial, explore: Explore) -> None:
    """The nodes, the legs along which they were placed, and the true path."""
    assert explore.graph is not None
    floor(axes, trial.plan)
    axes.plot(*trial.path.T, color="#0072b2", lw=0.9, alpha=0.6, zorder=6, label="path")
    nodes = explore.graph.nodes
    for index, leg in enumerate(explore.graph.legs):
        ends: Floats = np.array([nodes[number].place for number in leg])
        axes.plot(*ends.T, color="#555555", lw=1.2, zorder=7, label="" if index else "leg")
    for status, colour in STATUS_COLOURS.items():
        places = [node.place for node in nodes if node.status == status]
        if places:
            axes.plot(*np.array(places).T, "o", ms=5, color=colour, label=status, zorder=8)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4, fontsize=9, frameon=False)


def _draw_shares(axes: Axes, runs: list[Exploration], colour: str, label: str) -> None:
    axes.plot(
        [run.trial.way for run in runs], [100 * run.share for run in runs], "o", color=colour, alpha=0.7, label=label
    )
    axes.axhline(100 * LEAST, color="0.6", lw=0.8, ls="--")
    least = 100 * min(run.share for run in runs)
    axes.set(xlabel="way (m)", ylabel="coverage (%)", ylim=(min(least - 5, 95, axes.get_ylim()[0]), 101))
