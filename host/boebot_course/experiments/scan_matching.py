"""Localization by scan matching: section 6.3 of the notes, Figs. 6.16 to 6.18, (6.8); E52 to E54.

    ε(p) = √( 1/ν Σ χ_i (1 - δ_i(p) / d_i)² )      (6.8)

Scans are those of a range finder of 120 rays over half a turn with a reach of 4 m and 1 % noise, at poses anywhere in
the bundled arena `blocks` where a robot of 0.15 m can be; E52 takes some of the simulated robot's own.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from boebot import run
from boebot.arenas import load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.navigation import Lattice, LineMap, Scan, TurretScan, laser_scan
from boebot.navigation.frames import Pose
from boebot.navigation.match import Match, search_pose
from boebot.robot import Robot
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, Variant, about, experiment
from boebot_course.paths import floor
from boebot_course.trials import trial_seeds
from boebot_course.variants import poses_on

ARENA = "blocks"
HALF_TURN = (-math.pi / 2, math.pi / 2)
RAYS, REACH = 120, 4.0  # reach in m
NOISE = 0.01  # of a range
POSES = 40
OFFSET = 0.1  # m, m, rad


def poses_in(plan: LineMap, chance: np.random.Generator, count: int = POSES, radius: float = 0.15) -> list[Pose]:
    """Where a robot of that radius (m) can be (m, m, rad)."""
    return poses_on(Lattice.of(plan, radius, 0.05, 0.05), chance, count)


def scan_at(plan: LineMap, pose: Pose, chance: np.random.Generator, noise: float = NOISE) -> Scan:
    """What a range finder would measure there."""
    (exact,) = plan.scans([pose], HALF_TURN, RAYS, REACH)
    return Scan(np.where(exact > 0, exact * (1 + noise * chance.standard_normal(RAYS)), -1.0), HALF_TURN, REACH)


def away(pose: Pose, chance: np.random.Generator, offset: float = OFFSET) -> Pose:
    """That much to either side, ahead or back, and turned (m, m, rad)."""
    signs = chance.choice((-1.0, 1.0), size=3)
    return pose[0] + offset * signs[0], pose[1] + offset * signs[1], pose[2] + offset * signs[2]


# ---- E52: the error at the true pose ---------------------------------------------------------------------------------

OWN = 5  # scans by the simulated robot
TURRET_ARENA, TURRET_POSES = "office", 8
TURRET_MOST = 0.03


def taken_at(pose: Pose, seed: int, look: Callable[[Robot], Scan | None], **terms: Any) -> Scan:
    """The first scan of a simulated robot that stands there; `look` takes it, `terms` as of `boebot.run`."""
    taken: list[Scan] = []

    def brain(robot: Robot) -> None:
        robot.stop()
        if not taken and (scan := look(robot)) is not None:
            taken.append(scan)

    run(brain, pose=pose, seed=seed, record=False, **terms)
    return taken[0]


def own_scan(pose: Pose, seed: int) -> Scan:
    """By the laser."""
    return taken_at(pose, seed, laser_scan, robot="roller", arena=ARENA, seconds=0.3)


def turret_scan(pose: Pose, seed: int) -> Scan:
    """By the Shield-Bot's sonar, through the AVR image and the line."""
    return taken_at(pose, seed, TurretScan(), robot="shieldbot-turret", arena=TURRET_ARENA, on="avr", seconds=5.0)


@experiment(
    "E52",
    on={"roller": Variant("roller", False), "avr": Variant("shieldbot-turret (avr)", True, slow=True)},
)
def at_the_true_pose(has_turret: bool, seed: int) -> Outcome:
    """A scan fits the map at the true pose

    In the notes: section 6.3, equation (6.8)

    Figure: Left: a scan in its map, by laser or in 19 directions by a sonar on a turret. Right: the scan error: by
    laser at 40 true poses with 1 % noise (dots) and at five by the robot's own (squares); by turret at true poses,
    and 0.1 m and 0.2 rad beside them.

    Expected: Without noise the error is none. With noise of 1 % it is the root mean square of up to 120 numbers of that
    deviation, known to 0.0006 or a little more; the mean of 40 is known to 0.0001, five of them are allowed. At most
    0.015 in each.

    Expected on avr: A Ping's echo is good to 0.5 %, the turret's centre to some 10 µs, 0.02 rad, which changes little
    in what a beam hears; a fifth of the directions, beside edges, does not count: 0.03 is allowed. Beside the pose the
    error is three times as large in the median.
    """
    if has_turret:
        return _by_turret(seed)
    plan, chance = LineMap.of(ARENA), np.random.default_rng(seed)
    poses = poses_in(plan, chance)
    scans = [scan_at(plan, pose, chance) for pose in poses]
    noisy = [float(scan.errors(plan, [pose])[0]) for scan, pose in zip(scans, poses, strict=True)]
    exact = [float(scan_at(plan, pose, chance, 0.0).errors(plan, [pose])[0]) for pose in poses]
    seeds = list(zip(poses, trial_seeds(seed, OWN), strict=False))
    own = [float(own_scan(pose, one).errors(plan, [pose])[0]) for pose, one in seeds]
    measured = [
        Measured("greatest error without noise", max(exact), most=1e-12),
        about("mean error with 1 % noise", float(np.mean(noisy)), 0.01, 0.0005),
        Measured("greatest with 1 % noise", max(noisy), most=0.015),
        Measured("least of the simulated robot's own scans", min(own), least=0.005),
        Measured("greatest of the simulated robot's own scans", max(own), most=0.015),
    ]

    def draw(figure: Figure) -> None:
        left, right = _beside_its_scan(figure, ARENA, scans[0], poses[0])
        right.plot(range(1, POSES + 1), noisy, "o", ms=4, label="1 % noise")
        right.plot(range(1, OWN + 1), own, "s", mfc="none", ms=6, label="the robot's own laser")
        right.axhline(NOISE, color="0.5", lw=1.0, label="share of noise")
        left.legend(loc="lower left", fontsize=9)
        right.set(ylim=(0, 0.016))
        right.legend(loc="lower right")

    x, y, heading = np.array(poses).T
    data = {"x_m": x, "y_m": y, "heading_rad": heading, "error": noisy, "error_without_noise": exact}
    return Outcome(measured, data, draw)


def _by_turret(seed: int) -> Outcome:
    plan, chance = LineMap.of(TURRET_ARENA), np.random.default_rng(seed)
    poses = poses_in(plan, chance, TURRET_POSES, 0.07)
    seeds = list(zip(poses, trial_seeds(seed, TURRET_POSES), strict=True))
    scans = [turret_scan(pose, one) for pose, one in seeds]
    there = [float(scan.errors(plan, [pose])[0]) for scan, pose in zip(scans, poses, strict=True)]
    beside = [
        float(scan.errors(plan, [(pose[0] + 0.1, pose[1] + 0.1, pose[2] + 0.2)])[0])
        for scan, pose in zip(scans, poses, strict=True)
    ]
    measured = [
        Measured("greatest error at the true pose", max(there), most=TURRET_MOST),
        Measured("median there", float(np.median(there)), least=1e-4),
        Measured("median beside it, times that there", float(np.median(beside) / np.median(there)), least=3.0),
    ]

    def draw(figure: Figure) -> None:
        left, right = _beside_its_scan(figure, TURRET_ARENA, scans[0], poses[0])
        numbers = range(1, TURRET_POSES + 1)
        left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), frameon=False, fontsize=9)
        right.plot(numbers, there, "o", ms=5, label="at the true pose")
        right.plot(numbers, beside, "s", mfc="none", ms=6, label="beside it")
        right.set(ylim=(0, None))
        right.legend(loc="best", frameon=False)

    return Outcome(measured, {"pose": range(1, TURRET_POSES + 1), "error": there, "error_beside": beside}, draw)


def _beside_its_scan(figure: Figure, arena: str, scan: Scan, pose: Pose) -> tuple[Axes, Axes]:
    """A scan in its arena, and axes for the errors at each pose."""
    figure.set_figheight(4.0)
    left, right = figure.subplots(1, 2)
    floor(left, floor_plan(load_arena(arena), 0.0, 0.0))
    _draw_scan(left, scan, pose, "#0072b2")
    _draw_pose(left, pose, "#0072b2")
    right.set(xlabel="pose", ylabel="scan error ε")
    return left, right


def _draw_scan(
    axes: Axes, scan: Scan, at: Pose, colour: str, *, rays: bool = True, dotted: bool = False, label: str = "scan"
) -> None:
    """Its ends, and a few of its rays, as they lie when the range finder is there."""
    from matplotlib.collections import LineCollection

    x, y, heading = at
    angles = heading + np.linspace(*scan.bearings, len(scan.distances))
    ends = np.column_stack((x + scan.distances * np.cos(angles), y + scan.distances * np.sin(angles)))[scan.known]
    if rays:
        lines = [((x, y), (end_x, end_y)) for end_x, end_y in ends[::4].tolist()]
        dashes = (0, (1.5, 2)) if dotted else "solid"
        axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.7, linestyles=[dashes], zorder=5))
    axes.plot(*ends.T, ".", color=colour, ms=3, zorder=6, label=label)


def _draw_pose(axes: Axes, pose: Pose, colour: str, length: float = 0.45) -> None:
    """As an arrow along its heading."""
    x, y, heading = pose
    tip = x + length * math.cos(heading), y + length * math.sin(heading)
    axes.annotate("", tip, (x, y), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 2.0}, zorder=8)
    axes.plot(x, y, "o", color=colour, ms=5, zorder=8)


# ---- E53: near and far -----------------------------------------------------------------------------------------------

NEARLY = 0.01  # m, m, rad: of the lower row of the figure


@experiment("E53")
def near_and_far(seed: int) -> Outcome:
    """A scan fits the map badly where the pose is wrong

    In the notes: section 6.3, Figs. 6.16 and 6.17

    Figure: Left: a scan, drawn at the true pose (blue). Middle: what the map lets expect at the pose of the
    odometry (red). Right: where the rays of both end, as the robot compares them. Above: odometry is 0.1 m, 0.1 m
    and 0.1 rad off; below: a tenth of that.

    Expected: 40 poses: the median error with odometry 0.1 m, 0.1 m and 0.1 rad off is more than ten times that at
    the true poses. With a tenth of the offset it is less than with all of it.
    """
    plan, chance = LineMap.of(ARENA), np.random.default_rng(seed)
    poses = poses_in(plan, chance)
    scans = [scan_at(plan, pose, chance) for pose in poses]
    far = [away(pose, chance) for pose in poses]
    near = [away(pose, chance, NEARLY) for pose in poses]
    exact, nearly, wrong = (
        np.array([float(scan.errors(plan, [pose])[0]) for scan, pose in zip(scans, at, strict=True)])
        for at in (poses, near, far)
    )
    at_exact, at_near, at_far = (float(np.median(errors)) for errors in (exact, nearly, wrong))
    measured = [
        Measured("median error 0.1 m, 0.1 m, 0.1 rad off against that at the true pose", at_far / at_exact, least=10.0),
        Measured("a tenth as far off, against all of it", at_near / at_far, most=1.0),
        Measured("median error at the true pose", at_exact, most=0.015),
        Measured("poses where the error is less at 0.1 m, 0.1 m, 0.1 rad off", float((wrong < exact).sum()), most=0),
    ]

    def draw(figure: Figure) -> None:
        figure.set_figheight(5.6)
        panels = figure.subplots(2, 3, sharex=True, sharey=True)
        for row, estimate in zip(panels, (far[0], near[0]), strict=True):
            expected = replace(scans[0], distances=scans[0].expected(plan, [estimate])[0])
            for axes, shown in zip(row, ((True, False), (False, True), (True, True)), strict=True):
                floor(axes, floor_plan(load_arena(ARENA), 0.0, 0.0))
                if shown[0]:
                    here = poses[0] if not shown[1] else estimate
                    _draw_scan(axes, scans[0], here, "#0072b2", rays=not shown[1])
                    _draw_pose(axes, here, "#0072b2")
                if shown[1]:
                    label = "expected by the map where odometry believes to be"
                    _draw_scan(axes, expected, estimate, "#d55e00", rays=not shown[0], dotted=True, label=label)
                    _draw_pose(axes, estimate, "#d55e00")
                axes.label_outer()
        figure.legend(*panels[0, 2].get_legend_handles_labels(), loc="outside lower center", ncols=2, markerscale=3)

    x, y, heading = np.array(poses).T
    data = {"x_m": x, "y_m": y, "heading_rad": heading}
    data |= {"error_at_pose": exact, "error_near": nearly, "error_far": wrong}
    return Outcome(measured, data, draw)


# ---- E54: the random search ------------------------------------------------------------------------------------------

BOX = (0.1, 0.1, 0.1)  # L_x, L_y (m), L_φ (rad)
TRIES = 200  # N
ENOUGH = 0.02  # T


@dataclass(frozen=True)
class Search:
    """One search, and how far its poses are from the true one."""

    true: Pose
    match: Match

    @property
    def way(self) -> Floats:
        """Of each accepted pose (m)."""
        return np.array([math.dist(pose[:2], self.true[:2]) for pose, _ in self.match.steps])

    @property
    def turn(self) -> Floats:
        """Of each accepted heading (rad)."""
        return np.array([abs(math.remainder(pose[2] - self.true[2], 2 * math.pi)) for pose, _ in self.match.steps])

    @property
    def errors(self) -> Floats:
        """ε of each accepted pose."""
        return np.array([error for _, error in self.match.steps])

    @property
    def largest_step(self) -> float:
        """Of all coordinates, in half widths of the box."""
        poses = np.array([pose for pose, _ in self.match.steps])
        return float((np.abs(np.diff(poses, axis=0)) / (np.array(BOX) / 2)).max(initial=0.0))

    @property
    def heading_first(self) -> bool:
        """The heading is within 0.02 rad before the place is within 0.03 m."""
        turned, there = self.turn < 0.02, self.way < 0.03
        return bool(turned.any()) and (not there.any() or int(turned.argmax()) < int(there.argmax()))


@experiment("E54")
def found_by_chance(seed: int) -> Outcome:
    """A random search finds the pose

    In the notes: section 6.3, Fig. 6.18

    Figure: Left and middle: poses that two searches accept one after another, with their numbers: from where the
    robot believes to be (disc) to what is found (open square); filled square: where it is. Right: error of 40 poses
    before (orange) and after the search.

    Expected: From 0.1 m, 0.1 m and 0.1 rad off, with 200 tries in a box of 0.1 m, 0.1 m and 0.1 rad, the median
    error is below 0.02 m and 0.01 rad; the scan error falls below 0.02, twice that of 1 % noise. The box goes with
    what is better, and only there.
    """
    plan, chance = LineMap.of(ARENA), np.random.default_rng(seed)
    poses = poses_in(plan, chance)
    source = random.Random(seed)
    searches = []
    for pose in poses:
        scan, start = scan_at(plan, pose, chance), away(pose, chance)
        match = search_pose(scan, plan, start, source, box=BOX, tries=TRIES, enough=ENOUGH)
        searches.append(Search(pose, match))
    ways, turns = np.array([(one.way[-1], one.turn[-1]) for one in searches]).T
    before = np.array([(one.way[0], one.turn[0]) for one in searches]).T
    errors = [one.match.error for one in searches]
    grown = sum(int((np.diff(one.errors) >= 0).sum()) for one in searches)
    first = sum(one.heading_first for one in searches)
    measured = [
        Measured("median error of the place", float(np.median(ways)), "m", most=0.02),
        Measured("median error of the heading", float(np.median(turns)), "rad", most=0.01),
        Measured("median scan error after the search", float(np.median(errors)), most=ENOUGH),
        Measured("accepted poses whose scan error is not less than before", float(grown), most=0),
        Measured("largest step, in half widths of the box", max(one.largest_step for one in searches), most=1 + 1e-9),
        Measured("share of the searches that find the heading before the place", first / POSES, least=0.5),
    ]

    def draw(figure: Figure) -> None:
        figure.set_figheight(3.6)
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.1))
        for axes, one in zip((left, middle), searches, strict=False):
            _draw_search(axes, one)
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=9)
        right.plot(*before, "x", color="#d55e00", ms=7, label="before")
        right.plot(ways, turns, "o", ms=4, label="after")
        right.set(xlabel="error of the place (m)", ylabel="error of the heading (rad)", xscale="log", yscale="log")
        right.margins(0.12)
        right.legend(loc="upper left")

    data = {
        "way_before_m": before[0],
        "turn_before_rad": before[1],
        "error_before": [float(one.errors[0]) for one in searches],
        "way_m": ways,
        "turn_rad": turns,
        "error": errors,
        "accepted": [len(one.match.steps) - 1 for one in searches],
    }
    return Outcome(measured, data, draw)


def _draw_search(axes: Axes, one: Search) -> None:
    """As Fig. 6.18, about the true place."""
    poses = np.array([pose for pose, _ in one.match.steps])
    x, y, heading = poses.T
    axes.plot(x, y, "-", color="#b8bfcd", lw=0.8)
    axes.quiver(x, y, np.cos(heading), np.sin(heading), angles="xy", color="#0072b2", width=0.006, scale=9, zorder=3)
    axes.plot(x[1:-1], y[1:-1], "o", mfc="white", mec="#0072b2", ms=5, zorder=4, label="accepted")
    axes.plot(x[0], y[0], "o", color="#d55e00", ms=8, zorder=5, label="believed before")
    axes.plot(x[-1], y[-1], "s", mfc="none", mec="#0072b2", mew=1.6, ms=11, zorder=6, label="found")
    axes.plot(*one.true[:2], "s", color="#009e73", ms=7, zorder=5, label="truth")
    axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
    axes.set_adjustable("datalim")
    axes.locator_params(nbins=5)
    axes.margins(0.18)
    for number, (at_x, at_y) in enumerate(poses[:, :2]):
        axes.annotate(str(number), (at_x, at_y), (4, 5), textcoords="offset points", fontsize=8, zorder=7)
