"""Homing by a snapshot: section 4.4.4 of the notes, what Cataglyphis does near its nest. The law is the kit's own.

The robot has once looked round at home with its laser; that is all the map it has. Wherever it is now, it tries poses
about the one where it last believed to be, by the notes' random search, for the one from which what it sees agrees best
with the snapshot by (6.8); and drives from there to where the snapshot was taken. A compass says how it is turned.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boebot.arenas import load_arena
from boebot.brain import Brain
from boebot.description.robots import RobotDescription
from boebot.devices.compass import HeadingCompass
from boebot.navigation import LineMap, Scan, laser_scan
from boebot.navigation.frames import Pose
from boebot.navigation.match import search_pose
from boebot.navigation.steering import SteeredBehavior
from boebot.robot import Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, exactly, experiment
from boebot_course.experiments.scan_matching import ARENA, poses_in, taken_at
from boebot_course.paths import floor
from boebot_course.trials import Trial, trial_seeds, try_once
from boebot_course.variants import varied

RAYS, STARTS = 240, 20
AWAY, NEAR_HOME = 0.4, 0.1  # m: as far off as the home vector may be (E33), and as near as it has to come
SECONDS = 15.0
GAP = 0.3  # m between neighbouring points of the snapshot, from which on no surface joins them
BOX, TRIES = (0.3, 0.3, 0.2), 120  # of the search at each step (m, m, rad)
ROOM = 0.3  # m about home and about the start that are free
THERE = 0.02  # m from home, at which it stands
DOUBTFUL = 0.2  # share of the rays that do not count: what they see was hidden from home, or now is


def lines_of(snapshot: Scan) -> LineMap:
    """What stands about home, as far as it has been seen: neighbouring points joined (m, home's frame)."""
    angles = np.linspace(*snapshot.bearings, len(snapshot.distances))
    points = snapshot.distances[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))
    pairs = np.stack((points, np.roll(points, -1, axis=0)), axis=1)
    known = snapshot.known & np.roll(snapshot.known, -1)
    return LineMap.from_lines(pairs[known & (np.hypot(*(pairs[:, 1] - pairs[:, 0]).T) < GAP)])


@dataclass(kw_only=True)
class ToSnapshot(SteeredBehavior):
    """Drives to where the snapshot was taken."""

    NEEDS = ("laser", "compass")

    snapshot: Scan
    speed: float = 0.1

    def enter(self, robot: Robot) -> None:
        self._x = self._y = 0.0
        self._plan = lines_of(self.snapshot)

    def step(self, robot: Robot) -> None:
        scan = laser_scan(robot, doubtful=DOUBTFUL)
        if scan is None or robot.compass.heading is None:
            self.stand(robot)
            return
        start = self._x, self._y, robot.compass.heading
        self._x, self._y, heading = search_pose(scan, self._plan, start, self.random, box=BOX, tries=TRIES).pose
        if math.hypot(self._x, self._y) < THERE:
            self.stand(robot)
        else:
            self.steer(robot, math.atan2(-self._y, -self._x) - heading)


def ring() -> RobotDescription:
    """roller with a laser that looks all round, and with the notes' compass."""
    laser = {"rays": RAYS, "step_rad": 2 * math.pi / RAYS}
    return varied("roller", "roller-ring", laser=laser, compass=HeadingCompass())


def home_and_start(seed: int) -> tuple[Pose, Pose]:
    """By chance: home, where the robot looks along the x axis as it takes its snapshot, and a start beside it."""
    chance, arena, plan = np.random.default_rng([seed, 33]), load_arena(ARENA), LineMap.of(ARENA)
    while True:
        ((x, y, aside),) = poses_in(plan, chance, 1, ROOM)
        start = x + AWAY * math.cos(aside), y + AWAY * math.sin(aside), float(chance.uniform(-math.pi, math.pi))
        if arena.is_free(start[0], start[1], ROOM):
            return (x, y, 0.0), start


def way_home(home: Pose, start: Pose, seed: int) -> tuple[Trial, Floats]:
    """A run, and how far from home it was (m) at each time."""
    snapshot = taken_at(home, seed, laser_scan, robot=ring(), arena=ARENA, seconds=0.3)
    trial = try_once(Brain([ToSnapshot(snapshot=snapshot)], period=0.2), ring(), ARENA, SECONDS, pose=start, seed=seed)
    return trial, np.hypot(*(trial.path - home[:2]).T)


@experiment("snapshot", robot="roller (laser all round, compass 0.05 rad)", slow=True)
def snapshot_homing(seed: int) -> Outcome:
    """A robot finds the place from which a snapshot was taken

    In the notes: section 4.4.4, Cataglyphis

    Figure: Left: ways home (stars) by a snapshot of the laser, from 20 starts (dots) 0.4 m away. Right: how far they
    are from home; dashed: as near as they are to come.

    Expected: As near as the search of E33 has to pass the nest, 0.1 m, from as far as its home vector may err, 0.4 m:
    from all of 20 starts, without a contact.
    """
    ways = [way_home(*home_and_start(one), one) for one in trial_seeds(seed, STARTS)]
    ends = np.array([distance[-1] for _, distance in ways])
    measured = [
        exactly("starts from which it is home within 0.1 m", int((ends <= NEAR_HOME).sum()), STARTS),
        Measured("farthest from home at the end", ends.max(), "m", most=NEAR_HOME),
        Measured("from home at the end, median", float(np.median(ends)), "m"),
        exactly("runs with a contact", sum(trial.has_collided for trial, _ in ways), 0),
    ]
    times = ways[0][0].time

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        floor(left, ways[0][0].plan)
        for one, (trial, distance) in zip(trial_seeds(seed, STARTS), ways, strict=True):
            left.plot(*trial.path.T, linewidth=1)
            left.plot(*trial.path[0], ".", color="0.4")
            left.plot(*home_and_start(one)[0][:2], "*", color="#009e73", markersize=9)
            right.plot(times, distance, linewidth=0.8)
        right.axhline(NEAR_HOME, linestyle="--", color="0.5", linewidth=0.8)
        right.set(xlabel="time (s)", ylabel="from home (m)", ylim=(0, None))

    return Outcome(measured, {"time_s": times} | {f"run_{n}_m": d for n, (_, d) in enumerate(ways, 1)}, draw)
