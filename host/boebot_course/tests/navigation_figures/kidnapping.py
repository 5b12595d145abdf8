"""Robots that were carried away (section 6.3 of the notes): whether an estimator says that it is lost, how often places
look alike, and how the error of each estimator runs over time.

No robot drives here. Estimators get scans of a range finder with 1 % noise, as Localization takes them, and odometry
with the noise of robot `roller`: 1 mm for each wheel in 0.05 s.
"""

from __future__ import annotations

import itertools
import math
import random
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from boebot.navigation import Estimator, Lattice, LineMap, ParticleFilter, RandomSearch, Scan, search, tightened
from boebot.navigation.frames import Point, Pose, composed, inverse
from boebot_course.experiments.scan_matching import poses_in, scan_at

Floats = NDArray[np.float64]
Outcome = Literal["lost", "right", "wrong"]

ESTIMATORS: dict[str, Callable[[], Estimator]] = {"random search": RandomSearch, "particle filter": ParticleFilter}
SEED = 1
DOUBTFUL = 0.1  # share of the rays, as Localization takes them
FITS = 3 * RandomSearch.enough  # ε
RIGHT_M = 0.15


def scan(plan: LineMap, pose: Pose, chance: np.random.Generator) -> Scan:
    """What a range finder of 120 rays over half a turn sees there."""
    return replace(scan_at(plan, pose, chance), doubtful=DOUBTFUL)


def outcome(estimator: Estimator, scans: list[Scan], there: Pose) -> Outcome:
    """Of scans at one place: the last two fitted nowhere, or the newest that fitted did so there, or elsewhere."""
    estimates = [estimator.correct(one) for one in scans][-2:]
    fitting = [one for one in estimates if one.found]
    if not fitting:
        return "lost"
    return "right" if math.dist(fitting[-1].pose[:2], there[:2]) < RIGHT_M else "wrong"


# ---- carried to anywhere in the office -------------------------------------------------------------------------------

KIDNAPPINGS = 100
PAIRS = 10_000
BELIEVED_M = 0.02  # from where the robot was


def pairs(plan: LineMap) -> list[tuple[Pose, Pose, float]]:
    """Random poses, and others to which robots are carried from there; with the ε that a scan at the second one has at
    the first."""
    chance = np.random.default_rng(SEED)
    poses = poses_in(plan, chance, 2 * PAIRS)
    return [
        (here, there, float(scan(plan, there, chance).errors(plan, [here])[0]))
        for here, there in zip(poses[::2], poses[1::2], strict=True)
    ]


def kidnapped(kind: str, found: list[tuple[Pose, Pose, float]]) -> Counter[Outcome]:
    """After two scans, of the first pairs that do not look alike."""
    plan = LineMap.of("office")
    different = ((here, there) for here, there, error in found if error > FITS)
    outcomes: Counter[Outcome] = Counter()
    for number, (here, there) in enumerate(itertools.islice(different, KIDNAPPINGS)):
        chance = np.random.default_rng((SEED, number))
        angle, away = chance.uniform(-math.pi, math.pi), BELIEVED_M * math.sqrt(chance.uniform())
        believed = here[0] + away * math.cos(angle), here[1] + away * math.sin(angle), here[2]
        estimator = ESTIMATORS[kind]()
        estimator.begin(plan, believed, random.Random(number))
        outcomes[outcome(estimator, [scan(plan, there, chance) for _ in range(2)], there)] += 1
    return outcomes


# ---- rooms that look alike -------------------------------------------------------------------------------------------

ROOM_M = 3.0  # side of each of two rooms
DESK = ((1.9, 1.6), (2.25, 1.95))  # lower left and upper right corner, in a room; no robot has room in it
TURN = 0.5  # rad from scan to scan
SCANS = 10
FROM = ("same place in the other room", "corridor")


def twins() -> LineMap:
    """Two rooms of 3 m that are the same, side by side, with doors of 0.6 m to one corridor."""
    wide = 2 * ROOM_M
    walls = [_line((0, -1), (wide, -1), (wide, ROOM_M), (0, ROOM_M), (0, -1)), _line((ROOM_M, 0), (ROOM_M, ROOM_M))]
    for left in (0.0, ROOM_M):
        (low_x, low_y), (high_x, high_y) = DESK
        walls.append(_line((left, 0), (left + 1.2, 0)))
        walls.append(_line((left + 1.8, 0), (left + ROOM_M, 0)))
        low_x, high_x = low_x + left, high_x + left
        walls.append(_line((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y), (low_x, low_y)))
    return LineMap.from_lines([segment for wall in walls for segment in wall], "twins")


def _line(*corners: Point) -> list[tuple[Point, Point]]:
    return list(itertools.pairwise(corners))


def carried(case: tuple[str, str]) -> Counter[Outcome]:
    """Into one of the twins, where robots turn on the spot from scan to scan.

    Args:
        case: of ESTIMATORS; and of FROM.
    """
    kind, start = case
    plan, outcomes = twins(), Counter[Outcome]()
    poses = poses_in(plan, np.random.default_rng(SEED), 40 * KIDNAPPINGS)
    rooms = [pose for pose in poses if pose[1] > 0.3]
    corridor = [pose for pose in poses if pose[1] < 0.0]
    for number, (there, outside) in enumerate(itertools.islice(zip(rooms, corridor, strict=False), KIDNAPPINGS)):
        chance = np.random.default_rng((SEED, number))
        twin = there[0] + (ROOM_M if there[0] < ROOM_M else -ROOM_M), there[1], there[2]
        here = twin if start == FROM[0] else outside
        estimator = ESTIMATORS[kind]()
        estimator.begin(plan, here, random.Random(number))
        estimator.correct(scan(plan, here, chance))
        result: Outcome = "lost"
        for _ in range(SCANS):
            result = outcome(estimator, [scan(plan, there, chance)], there)
            there = composed(there, (0.0, 0.0, TURN))
            estimator.move((0.0, 0.0, TURN))
        outcomes[result] += 1
    return outcomes


# ---- error over time -------------------------------------------------------------------------------------------------

RUNS = 20
SECONDS, STEP_S, SCAN_S, CARRIED_S = 60.0, 0.05, 4.0, 20.0
SPEED, TURN_SPEED = 0.2, 1.0  # m/s, rad/s
WHEEL_M, TRACK_M = 0.001, 0.24  # noise of each wheel's way in a step; from wheel to wheel
CLEARANCE_M = 0.2  # of the robot's middle to all lines
Course = list[tuple[Pose, Pose]]  # at each step: the true pose, and how the robot has moved by its odometry


def course(plan: LineMap, chance: np.random.Generator, *, is_carried: bool) -> Course:
    """From a random place to the next and the next; after 20 s it may be carried to some other place, unnoticed."""
    whole = Lattice.of(plan, CLEARANCE_M, 0.0, 0.05)
    middle = whole.nearest_free(1.0, 1.0, within=0.5)
    assert middle is not None
    lattice = whole.reachable(middle)
    begin, end = (_place(lattice, chance) for _ in range(2))
    heading = float(chance.uniform(-math.pi, math.pi))
    steps, until = round(SECONDS / STEP_S), round((CARRIED_S if is_carried else SECONDS) / STEP_S)
    first = _driven(plan, lattice, (*begin, heading), chance, until)
    second = _driven(plan, lattice, (*end, heading), chance, steps - until)
    return first + second


def _place(lattice: Lattice, chance: np.random.Generator) -> Point:
    cells = np.argwhere(lattice.free)
    row, column = cells[chance.integers(len(cells))].tolist()
    return lattice.centre((row, column))


def _driven(plan: LineMap, lattice: Lattice, pose: Pose, chance: np.random.Generator, steps: int) -> Course:
    way: list[Point] = []
    done: Course = [(pose, (0.0, 0.0, 0.0))] if steps else []
    while len(done) < steps:
        if not way:
            here, there = lattice.cell_at(*pose[:2]), lattice.cell_at(*_place(lattice, chance))
            way = tightened([lattice.centre(cell) for cell in search(lattice, here, there).path], plan, CLEARANCE_M)
        before, pose = pose, _step_towards(way[0], pose)
        if math.dist(pose[:2], way[0]) < 1e-9:
            del way[0]
        right, left = WHEEL_M * chance.standard_normal(2)
        x, y, turn = composed(inverse(before), pose)
        done.append((pose, (x + (right + left) / 2, y, turn + (right - left) / TRACK_M)))
    return done


def _step_towards(place: Point, pose: Pose) -> Pose:
    """Turns on the spot, then goes straight."""
    to_x, to_y = place[0] - pose[0], place[1] - pose[1]
    away = math.hypot(to_x, to_y)
    if away < 1e-9:
        return pose
    turn = math.remainder(math.atan2(to_y, to_x) - pose[2], 2 * math.pi)
    if abs(turn) > 1e-9:
        return *pose[:2], pose[2] + math.copysign(min(abs(turn), TURN_SPEED * STEP_S), turn)
    share = min(1.0, SPEED * STEP_S / away)
    return pose[0] + share * to_x, pose[1] + share * to_y, pose[2]


def errors(plan: LineMap, number: int, *, is_carried: bool) -> dict[str, list[float]]:
    """One run: how far the pose of each estimator, and that of odometry alone, is from the true one after each step
    (m); it begins with the true pose, and scans every 4 s."""
    chance = np.random.default_rng((SEED, number))
    way = course(plan, chance, is_carried=is_carried)
    known = {kind: make() for kind, make in ESTIMATORS.items()}
    for estimator in known.values():
        estimator.begin(plan, way[0][0], random.Random(number))
    alone = way[0][0]
    away: dict[str, list[float]] = {kind: [] for kind in (*known, "odometry alone")}
    for step, (true, moved) in enumerate(way, 1):
        alone = composed(alone, moved)
        seen = scan(plan, true, chance) if step % round(SCAN_S / STEP_S) == 0 else None
        for kind, estimator in known.items():
            estimator.move(moved)
            if seen is not None:
                estimator.correct(seen)
            away[kind].append(math.dist(estimator.pose[:2], true[:2]))
        away["odometry alone"].append(math.dist(alone[:2], true[:2]))
    return away
