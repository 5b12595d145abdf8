"""Exploration and driving to places on a map, on the robot with a laser and on the Shield-Bot with a sonar on a turret.

The figures, hundreds of runs, are in test_navigation_figures.py.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import pytest

import boebot
from boebot.brain import Brain, CognitiveProcess, MotorBehavior, StateVariable, Utility
from boebot.brains import rounds
from boebot.cognition import Odometry
from boebot.errors import BrainError
from boebot.navigation import Explore, GoTo, LineMap, Localization, Scan, TurretScan
from boebot.navigation.corridor import is_clear
from boebot.navigation.explore import State
from boebot.navigation.frames import Pose
from boebot.navigation.scan_error import heard
from boebot_course.coverage import Coverage
from boebot_course.experiments import exploring
from boebot_course.experiments.exploring import explored, explorer, starts
from boebot_course.tests.navigation_figures.tasks import errand
from boebot_course.variants import exact_roller

HALF_TURN = (-math.pi / 2, math.pi / 2)


@pytest.fixture(scope="module")
def office() -> LineMap:
    return LineMap.of("office")


# ---- what is seen ----------------------------------------------------------------------------------------------------


def test_corridor_is_as_wide_and_as_long_as_it_says() -> None:
    """A wall 1 m ahead and a post 0.3 m to the left of the way."""
    angles = np.linspace(*HALF_TURN, 181)
    distances = np.where(np.abs(angles) < 0.05, 1.0, -1.0)
    distances[np.abs(angles - math.atan2(0.3, 0.5)).argmin()] = math.hypot(0.3, 0.5)
    scan = Scan(distances, HALF_TURN, 4.0)
    assert is_clear(scan, 0.0, 0.95, 0.25) and not is_clear(scan, 0.0, 1.05, 0.25)
    assert not is_clear(scan, 0.0, 0.95, 0.35) and is_clear(scan, 0.0, 0.45, 0.35)
    assert is_clear(scan, -1.0, 4.0, 0.2)


def test_coverage_is_the_part_of_the_floor_in_the_fan() -> None:
    """In the middle of a square of 2 m: half a turn sees one half, two of them all, short rays half a disc."""
    square = [[[-1, -1], [1, -1]], [[1, -1], [1, 1]], [[1, 1], [-1, 1]], [[-1, 1], [-1, -1]]]
    plan = LineMap.from_lines(square)
    half, near = Coverage(plan), Coverage(plan)
    half.add((0.0, 0.0, 0.0), HALF_TURN, 181, 4.0)
    assert half.share == pytest.approx(0.5, abs=0.02)
    half.add((0.0, 0.0, math.pi), HALF_TURN, 181, 4.0)
    assert half.share == 1.0
    near.add((0.0, 0.0, 1.0), HALF_TURN, 181, 0.5)
    assert near.share == pytest.approx(math.pi * 0.5**2 / 2 / 4, abs=0.01)


def test_what_a_wall_hides_is_not_covered() -> None:
    """A wall across a room of 2 m by 1 m: from the left half the right one is not seen."""
    outline = [[[0, 0], [2, 0]], [[2, 0], [2, 1]], [[2, 1], [0, 1]], [[0, 1], [0, 0]]]
    coverage = Coverage(LineMap.from_lines([*outline, [[1, 0], [1, 1]]]))
    coverage.add_path([(0.5, 0.5, heading) for heading in np.linspace(-math.pi, math.pi, 25)], HALF_TURN, 181, 4.0)
    assert coverage.share == pytest.approx(0.5, abs=0.03)


def test_sonar_hears_a_wall_up_to_the_grazing_angle() -> None:
    """Of a wall 1 m away a ray at ψ to its normal ends after 1 / cos ψ; beyond 45 degrees nothing comes back."""
    angles = np.radians(np.arange(-80, 81, 5))
    rays = heard(1 / np.cos(angles)[None, :], math.radians(5), math.radians(45))[0]
    silent = np.abs(np.degrees(angles)) > 48
    assert np.isinf(rays[silent]).all() and np.isfinite(rays[np.abs(np.degrees(angles)) < 42]).all()


def test_beam_hears_the_nearest_surface_in_it() -> None:
    """A beam of 40 degrees, 1 m from a wall: within 20 degrees of its normal it hears the foot of the normal."""
    plan = LineMap.from_lines([[[1, -5], [1, 5]]])
    scan = Scan(np.ones(19), HALF_TURN, 2.5, beam=math.radians(40), grazing=math.radians(45))
    (expected,) = scan.expected(plan, [(0.0, 0.0, 0.0)])
    for degrees, distance in zip(range(-90, 91, 10), expected, strict=True):
        nearest = max(0, abs(degrees) - 20)
        wanted = 1 / math.cos(math.radians(nearest)) if nearest <= 45 else -1.0
        assert distance == pytest.approx(wanted, rel=0.01), degrees


@pytest.mark.parametrize("on", ["native", pytest.param("avr", marks=pytest.mark.soak)])
def test_turret_scan_is_what_the_map_lets_expect(on: str, office: LineMap) -> None:
    """Through board, line and host, with the imperfections of a real Ping: the directions that fit, fit to some %."""
    pose = (-0.7, 1.2, 0.3)
    sweeps: list[Scan] = []
    scan = TurretScan()

    def step(robot: boebot.Robot) -> None:
        robot.stop()
        if (sweep := scan(robot)) is not None:
            sweeps.append(sweep)

    boebot.run(step, robot="shieldbot-turret", arena="office", pose=pose, on=on, seconds=4.5, record=False)
    assert len(sweeps) == 1
    there, beside = sweeps[0].errors(office, [pose, (pose[0] + 0.1, pose[1] + 0.1, pose[2] + 0.2)])
    assert there < 0.03 and beside > 3 * there


def test_robot_without_range_finder_is_one_sentence() -> None:
    brain = Brain([Odometry(), Explore()])
    with pytest.raises(BrainError, match="neither a laser nor a turret"):
        boebot.run(brain, robot="arsim", arena="room", seconds=2, record=False)


# ---- exploration -----------------------------------------------------------------------------------------------------


@dataclass(kw_only=True)
class Poses(CognitiveProcess):
    """Writes down where the robot believes to be: of this robot the odometry has no error."""

    def forget(self) -> None:
        self.seen: list[Pose] = []

    def step(self, robot: boebot.Robot) -> None:
        self.seen.append(self.other(Odometry).pose)


def unrecorded(arena: str, start: Pose, seed: int, seconds: float) -> tuple[Explore, float, float]:
    """As `explored`, in half the time: the exploration, its coverage, its way (m)."""
    explore, poses = explorer(), Poses()
    brain = Brain([Odometry(), explore, poses])
    boebot.run(brain, robot=exact_roller(), arena=arena, pose=start, seed=seed, seconds=seconds, record=False)
    coverage = Coverage(LineMap.of("exploration"))
    coverage.add_path(poses.seen, HALF_TURN, exploring.RAYS, exploring.REACH)
    return explore, coverage.share, float(np.hypot(*np.diff(np.array(poses.seen)[:, :2], axis=0).T).sum())


def test_rooms_are_explored() -> None:
    (start,) = starts("exploration", 5, 1)
    explore, share, way = unrecorded("exploration", start, 1, exploring.SECONDS)
    assert explore.complete and share >= 0.995 and way <= 45


@pytest.mark.soak
def test_way_and_coverage_by_an_exact_odometry_are_the_true_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exploring, "SECONDS", 120.0)
    (start,) = starts("exploration", 5, 1)
    run = explored("exploration", LineMap.of("exploration"), start, 1, explorer())
    explore, share, way = unrecorded("exploration", start, 1, 120.0)
    assert explore.state is run.explore.state and not run.trial.has_collided
    assert share == pytest.approx(run.share, abs=0.002) and way == pytest.approx(run.trial.way, rel=0.01)


@pytest.mark.soak
def test_any_start_comes_to_see_all_in_spite_of_a_low_block() -> None:
    """Of E40's 24, at another seed."""
    given = enumerate(starts("exploration-block", 20, 10), 1)
    shares = [unrecorded("exploration-block", pose, seed, 420.0)[1] for seed, pose in given]
    assert min(shares) >= 0.995


def test_way_back_that_is_blocked_is_not_the_end() -> None:
    """Fig. 6.3: it passes the end of a wall, comes to the low block, and on its way back feels the wall."""
    start = starts("exploration-block", 3, 24)[4]
    explore, share, _ = unrecorded("exploration-block", start, 3004, exploring.SECONDS)
    assert explore.state is not State.FAILED and share >= 0.995


def test_node_that_sweeps_show_to_be_in_a_wall_is_left() -> None:
    """From a place in its line a wall without thickness is not seen; a node in it is tried once, and from nowhere where
    the wall is seen. It tried for 150 s, and a way of 20 m."""
    start = starts("exploration", 10, 12)[11]
    explore, _, way = unrecorded("exploration", start, 10011, exploring.SECONDS)
    assert explore.graph is not None
    assert explore.complete and sum(n.status == "unreachable" for n in explore.graph.nodes) == 1 and way <= 45


def test_exploration_on_the_map_of_another_arena_is_lost_and_stands() -> None:
    start = (-2.5, 0.0, 0.0)
    due = Utility(b=-1.0, w={"due": 3.0}, tau=0.05)
    localization = Localization(plan=LineMap.of("maze"), start=start, every=4.0, utility=due)
    explore = Explore(localization=localization, utility=Utility(b=0.5))
    brain = Brain([Odometry(), localization, explore], [localization.due_variable])
    result = boebot.run(brain, robot="roller", arena="office", pose=start, seconds=15)
    assert result.true_pose is not None and result.shown.texts["explore_state"][-1] == "lost"
    assert np.ptp(result.true_pose.x[np.asarray(result.series.time) > 12.0]) < 0.005


def test_nodes_are_drawn_where_the_robot_is() -> None:
    """In the frame of the start, though the odometer of roller counts from the middle of the arena."""
    result = boebot.run(Brain([Odometry(), Explore()]), robot="roller", arena="office", seconds=2)
    (completed,) = [layer.sketches[-1] for layer in result.layers if layer.name == "completed"]
    assert completed.frame == "start"
    assert np.frombuffer(completed.points, dtype="<f4") == pytest.approx((0.0, 0.0), abs=0.01)


# ---- driving to places -----------------------------------------------------------------------------------------------


def test_way_leads_there_and_a_scan_says_so(office: LineMap) -> None:
    start, goal = (-2.5, 0.0, 0.0), (1.2, 1.3)
    brain, go = errand(office, start, goal)
    result = boebot.run(brain, robot="roller", arena="office", pose=start, seconds=45)
    assert result.true_pose is not None
    assert go.arrived and math.dist((result.true_pose.x[-1], result.true_pose.y[-1]), goal) < 0.12
    assert result.true_contacts == 0
    way = [begin + share * (end - begin) for begin, end in _legs(go.way) for share in np.linspace(0, 1, 50)]
    assert office.distance(way).min() >= 0.15 + go.margin - 1e-9


def _legs(way: list[tuple[float, float]]) -> list[tuple[np.ndarray, np.ndarray]]:
    return [(np.array(one), np.array(other)) for one, other in itertools.pairwise(way)]


@pytest.mark.parametrize(
    "goal",
    [(1.9, -1.35), (9.0, 0.0), (0.0, 0.5), (-1.0, 0.4), (math.nan, 0.0)],
    ids=["in a table", "outside", "in a wall", "too near to a wall", "nowhere"],
)
def test_no_path_is_said_and_the_robot_stands(goal: tuple[float, float], office: LineMap) -> None:
    start = (-2.5, 0.0, 0.0)
    brain, go = errand(office, start, goal)
    result = boebot.run(brain, robot="roller", arena="office", pose=start, seconds=3)
    assert (
        go.no_path and not go.arrived and go.state == "no path" and result.true_distance == pytest.approx(0.0, abs=0.01)
    )


def test_robot_that_believes_to_be_in_a_table_has_no_path(office: LineMap) -> None:
    """It believes to be there until a scan says otherwise; until then it stands."""
    brain, go = errand(office, (1.9, -1.35, 0.0), (-2.5, 0.0))
    result = boebot.run(brain, robot="roller", arena="office", pose=(-2.5, 0.0, 0.0), seconds=3)
    assert go.no_path and go.state == "no path" and result.true_distance == pytest.approx(0.0, abs=0.01)


def test_scans_of_nothing_make_it_lost_and_it_stands(office: LineMap) -> None:
    """In an arena without walls; the map has some."""
    brain, go = errand(office, (-2.5, 0.0, 0.0), (1.2, 1.3))
    result = boebot.run(brain, robot="roller", arena="empty", pose=(-2.5, 0.0, 0.0), seconds=20)
    estimates = go.localization.estimates
    assert go.lost and go.state == "lost" and len(estimates) >= 2
    assert all(math.isinf(one.error) and not one.found for _, one in estimates)
    assert result.true_pose is not None
    assert np.ptp(result.true_pose.x[np.asarray(result.series.time) > 18.0]) < 0.005


def test_brain_takes_another_goal_where_there_is_no_path(office: LineMap) -> None:
    class Errands(CognitiveProcess):
        """The table first; then, as there is no path, the room."""

        def step(self, robot: boebot.Robot) -> None:
            if go.goal is None:
                go.go((1.9, -1.35))
            elif go.no_path:
                go.go((-1.5, -1.2))

    start = (-2.5, 0.0, 0.0)
    _, go = errand(office, start, (0.0, 0.0))
    localization = go.localization
    brain = Brain([Odometry(), localization, Errands(), go], [localization.due_variable])
    result = boebot.run(brain, robot="roller", arena="office", pose=start, seconds=30)
    assert result.true_pose is not None
    assert go.arrived and math.dist((result.true_pose.x[-1], result.true_pose.y[-1]), (-1.5, -1.2)) < 0.15


def test_another_behavior_takes_over_where_the_robot_is_lost(office: LineMap) -> None:
    """By its utility: being lost is a state variable as any other."""

    @dataclass(kw_only=True)
    class Retreat(MotorBehavior):
        def step(self, robot: boebot.Robot) -> None:
            robot.drive_speed(-0.05, -0.05)

    start = (-2.5, 0.0, 0.0)
    _, go = errand(LineMap.of("maze"), start, (0.0, 0.0))
    localization = go.localization
    lost = StateVariable("lost", lambda robot: float(localization.lost))
    retreat = Retreat(utility=Utility(b=-1.0, w={"lost": 4.0}))
    brain = Brain([Odometry(), localization, go, retreat], [localization.due_variable, lost])
    boebot.run(brain, robot="roller", arena="office", pose=start, seconds=25, record=False)
    assert go.lost and brain.active == "retreat"


def test_what_is_no_map_start_or_goal_is_one_sentence(office: LineMap) -> None:
    with pytest.raises(BrainError, match="plan is 'office'; expected a LineMap"):
        Localization(plan="office")  # type: ignore[arg-type]
    with pytest.raises(BrainError, match=r"start is .*; expected x"):
        Localization(plan=office, start=(math.nan, 0.0, 0.0))
    with pytest.raises(BrainError, match="a goal of 'kitchen'; expected x and y"):
        GoTo(localization=Localization(plan=office)).go("kitchen")  # type: ignore[arg-type]


def test_map_of_another_arena_makes_it_lost() -> None:
    """Two scans that fit nowhere: it stops, and says so."""
    start = (-2.5, 0.0, 0.0)
    brain, go = errand(LineMap.of("maze"), start, (0.0, 0.0))
    result = boebot.run(brain, robot="roller", arena="office", pose=start, seconds=40)
    assert result.true_pose is not None
    last = np.asarray(result.series.time) >= 36.0
    assert (
        go.lost
        and not go.arrived
        and result.shown.texts["go_to_state"][-1] == "lost"
        and np.ptp(result.true_pose.x[last]) < 0.005
    )


# ---- whole brains ----------------------------------------------------------------------------------------------------


def test_rounds_visits_three_rooms_and_charges_when_low() -> None:
    result = boebot.run("rounds", robot="roller-charging", arena="office", seconds=170)
    assert visited(result, [*rounds.ROOMS.values(), rounds.CHARGER]) == [True] * 4
    brain = result.brain_record
    assert brain is not None
    low = brain.values[:, brain.names.variables.index("low")]
    emptiest = int(low.argmax())
    assert brain.names.behaviors[brain.motor[emptiest]] in ("recharge", "localize")
    assert 0.5 < low[emptiest] < 0.95 and low[emptiest:].min() < 0.1, "it was neither idle nor empty, and is full again"


@pytest.mark.soak
def test_turret_robot_makes_its_rounds_too() -> None:
    result = boebot.run("rounds", robot="shieldbot-turret", arena="office", seconds=80)
    assert visited(result, list(rounds.ROOMS.values())[:2]) == [True, True]


def visited(result: boebot.RunResult, places: list[tuple[float, float]]) -> list[bool]:
    assert result.true_pose is not None
    path = np.column_stack((result.true_pose.x, result.true_pose.y))
    return [float(np.hypot(*(path - place).T).min()) < 0.15 for place in places]


def test_robot_at_rest_does_not_creep_from_scan_to_scan(office: LineMap) -> None:
    """Some servos creep while they have pulses, also those of speed 0, as that of seed 3 does: motors that are off stay
    off when behaviors change."""
    start = (-2.5, 0.0, 0.0)
    localization = Localization(plan=office, start=start, every=1.0, utility=Utility(b=-1.0, w={"due": 3.0}, tau=0.05))
    go = GoTo(localization=localization, utility=Utility(b=0.5))
    brain = Brain([Odometry(), localization, go], [localization.due_variable])
    result = boebot.run(brain, robot="shieldbot-turret", arena="office", pose=start, seconds=40, seed=3)
    assert result.true_pose is not None
    assert len(localization.estimates) >= 5 and np.ptp(result.true_pose.heading) < 0.01
