"""Outline, grip and slip of a body as users say them: in a robot's file, and to a VehicleModel."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given
from hypothesis import strategies as st

import boebot
from boebot.description.outlines import polygon_fault
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, RobotError
from boebot_course.vehicle_view import View
from sim_bridge.robots import imperfections
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import arena_of, script_board, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel
from sim_bridge.vehicles.model_file import vehicle_model

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

BOX = [[-0.15, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.15, 0.1]]


def file_of(folder: Path, base: str, *lines: str) -> Path:
    path = folder / "mine.toml"
    path.write_text("\n".join([f"extends = '{base}'", "name = 'mine'", "[body]", *lines]))
    return path


@pytest.mark.parametrize(
    ("outline", "expected"),
    [
        ("[[0, 1], [1, 0]]", "mine.toml:4: body.outline_m has 2 corners; expected 3 to 32"),
        (str([[i, -1] for i in range(33)]), "mine.toml:4: body.outline_m has 33 corners; expected 3 to 32"),
        ("[[-1, -1], [1, nan], [0, 1]]", "mine.toml:4: body.outline_m[1][1]: expected a finite number"),
        ("[[-1, -1], [1, 'a'], [0, 1]]", "mine.toml:4: body.outline_m[1][1]: expected float, got str"),
        ("[[-1, -1], [1], [0, 1]]", "mine.toml:4: body.outline_m[1]: expected array of length 2, got 1"),
        ("[[-1, -1], [9, 0], [0, 1]]", "mine.toml:4: body.outline_m[1] is [9, 0]; expected numbers within ±5 m"),
        (
            "[[-1, -1], [1, 0], [1, 0], [0, 1]]",
            "mine.toml:4: body.outline_m[1] and the corner after it are the same; expected an edge",
        ),
        (
            "[[-1, -1], [1, 1], [1, -1], [-1, 1]]",
            "mine.toml:4: body.outline_m: edges 0 and 2 cross or touch; expected a polygon whose edges do not",
        ),
        (
            "[[-1, -1], [1, -1], [0, -1], [0, 1]]",
            "mine.toml:4: body.outline_m: edges 0 and 1 cross or touch; expected a polygon whose edges do not",
        ),
        (
            "[[1, -1], [2, -1], [2, 1]]",
            "mine.toml:4: body.outline_m: the middle of the axle, [0, 0], lies outside; expected an outline around it",
        ),
        (
            "[[-0.1, -0.02], [0.3, 0], [-0.1, 0.02]]",
            "mine.toml:4: body.outline_m[1] is a corner of 5.72°; "
            "expected at least 15°, or a short edge across its tip",
        ),
    ],
)
@pytest.mark.parametrize("base", ["shieldbot", "arsim"])
def test_a_wrong_outline_is_one_sentence(tmp_path: Path, base: str, outline: str, expected: str) -> None:
    with pytest.raises(RobotError) as error:
        load_robot(file_of(tmp_path, base, f"outline_m = {outline}"))
    assert str(error.value) == expected


def sharpest(corners: list[tuple[int, int]]) -> float:
    """The least angle within a counter-clockwise polygon, degrees, by complex numbers."""
    z = np.array([complex(*corner) for corner in corners])
    return float(min(np.degrees(np.angle((np.roll(z, 1) - z) / (np.roll(z, -1) - z))) % 360))


@given(st.lists(st.tuples(st.integers(-4, 4), st.integers(-4, 4)), min_size=3, max_size=7))
def test_what_is_a_polygon_shapely_says(corners: list[tuple[int, int]]) -> None:
    """On a lattice, where touching is exact."""
    fault = polygon_fault([(float(x), float(y)) for x, y in corners], 32)
    ring = shapely.LinearRing(corners)
    same = any(a == b for a, b in zip(corners, [*corners[1:], corners[0]], strict=True))
    if same or not ring.is_simple:
        assert fault
    elif not shapely.Polygon(corners).contains(shapely.Point(0, 0)):
        assert fault == "" or "outside" in fault or "is a corner" in fault  # the middle may lie on the edge
    elif sharpest(corners if ring.is_ccw else corners[::-1]) < 15:
        assert "is a corner of" in fault
    else:
        assert fault == ""


@pytest.mark.parametrize("slip", ["true", "false"])
def test_an_outline_from_a_file_meets_a_wall(tmp_path: Path, slip: str) -> None:
    """Straight ahead its front lies at the wall; backwards its rear does."""
    lines = f"outline_m = {BOX}", f"tyre_slip = {slip}", "tyre_grip = 0.4"
    robot = load_robot(file_of(tmp_path, "arsim", *lines))
    assert robot.body.reach_m == pytest.approx(math.hypot(0.15, 0.1))
    for signal, expected in ((0.3, 0.9), (-0.3, -0.85)):
        vehicle = Vehicle(vehicle_model(robot, noise=False), arena_of(outline=square(0, 0, 2)))
        for _ in range(1500):
            vehicle.step(signal, signal)
        assert vehicle.collided
        assert vehicle.true_pose[0] == pytest.approx(expected, abs=5e-5)  # a flat front that pushes rocks by 1e-4 rad
    fast = Vehicle(vehicle_model(robot, noise=False), arena_of(outline=square(0, 0, 99)))
    for _ in range(20):
        fast.step(1.0, 1.0)
    assert bool(fast.body.slipping) == (slip == "true" and fast.body.speed < fast.body.rim_left - 1e-9)


def test_a_robot_with_a_board_has_its_outline(tmp_path: Path) -> None:
    """It needs room for its farthest corner, stands where the circle would not, and touches with its front."""
    lines = f"outline_m = {BOX}", "tyre_grip = 0.3", "tyre_slip = false"
    robot = load_robot(file_of(tmp_path, "shieldbot", *lines))
    parameters = imperfections.body_parameters(robot.body)
    assert (parameters.grip, parameters.slip) == (0.3, 0)
    off = imperfections.applied(robot, ["slip"])
    assert imperfections.body_parameters(off.body).grip == 10.0
    plain = imperfections.body_parameters(load_robot("shieldbot").body)
    assert (plain.grip, plain.slip) == (0.7, 1)
    sim = Sim(arena_of(outline=square(0, 0, 2)), noise=False)
    with pytest.raises(ArenaError, match="no free space"):
        sim.add(script_board()[1], robot, pose=(0.83, 0.0, 0.0))
    sim.add(script_board()[1], robot, pose=(0.8, 0.0, 0.0))
    sim.add(script_board()[1], robot, pose=(-0.8, 0.0, 0.0))


@pytest.mark.parametrize("bad", [5, [], [[0, 1], [1, 0]], [[-1, -1], [1, math.nan], [0, 1]], "abc", [[1, 2, 3]] * 4])
def test_a_model_takes_an_outline_or_says_why_not(bad: Any) -> None:
    with pytest.raises(RobotError, match=r"vehicle: body: outline_m"):
        VehicleModel(ARSIM_BODY | {"outline_m": bad})


def test_a_narrow_outline_is_refused_and_an_array_accepted() -> None:
    with pytest.raises(RobotError, match=r"narrower than 0\.4 mm"):
        VehicleModel(ARSIM_BODY | {"outline_m": [(-1, -1e-4), (1, -1e-4), (1, 1e-4), (-1, 1e-4)]})
    model = VehicleModel(ARSIM_BODY | {"outline_m": np.array(BOX)}, ends_at_collision=False)
    model.dc_motors()
    vehicle = Vehicle(model, arena_of(outline=square(0, 0, 2)), pose=(0.0, 0.0, math.pi / 2))
    for _ in range(1000):
        vehicle.step(0.3, 0.3)
    assert vehicle.true_pose[1] == pytest.approx(0.9, abs=5e-5)


def test_a_view_draws_the_outline_where_the_vehicle_is() -> None:
    """Against shapely; the ghost is where the odometer has it."""
    model = VehicleModel(ARSIM_BODY | {"outline_m": BOX}, noise=False)
    model.dc_motors()
    model.sensor("odometer", "odometer")
    view = View(vehicle := Vehicle(model, arena_of(), pose=(0.3, -0.2, 0.4)))
    for _ in range(100):
        vehicle.step(0.3, 0.5)
    view.update()
    x, y, heading = vehicle.true_pose
    for patch, pose in ((view._body, vehicle.true_pose), (view._ghost, vehicle["odometer"])):
        corners = (patch.get_transform() - view._axes.transData).transform(patch.get_path().vertices)
        assert shapely.hausdorff_distance(shapely.Polygon(corners), placed(shapely.Polygon(BOX), *pose)) < 1e-9
    front = max(corner for corner, _ in BOX)
    tip = x + front * math.cos(heading), y + front * math.sin(heading)
    assert [row[1] for row in view._nose.get_data()] == pytest.approx(tip, abs=1e-9)  # type: ignore[index]


def placed(shape: Any, x: float, y: float, heading: float) -> Any:
    turned = shapely.affinity.rotate(shape, heading, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(turned, x, y)


# ---- the reference's example -----------------------------------------------------------------------------------------


@pytest.fixture
def angular(tmp_path: Path) -> Path:
    """The file in docs/reference/robots.md."""
    page = (Path(__file__).parents[3] / "docs/reference/robots.md").read_text("utf-8")
    text = next(block for block in page.split("```toml\n")[1:] if "outline_m = [" in block).partition("```")[0]
    (tmp_path / "angular.toml").write_text(text)
    return tmp_path / "angular.toml"


@pytest.mark.unsanitized
def test_the_example_of_the_reference_is_a_robot(angular: Path) -> None:
    """A chassis of 136 mm by 80 mm, mirror-symmetric, within the published 90 to 119 mm, the wheels within it."""
    body = load_robot(angular).body
    assert {(x, -y) for x, y in body.outline_m} == set(body.outline_m)
    assert max(x for x, _ in body.outline_m) - min(x for x, _ in body.outline_m) == pytest.approx(0.136)
    assert 0.090 <= body.reach_m <= 0.119
    wheel, middle = body.wheel_radius_m, body.track_width_m / 2
    tyres = shapely.box(-wheel, middle - 0.004, wheel, middle + 0.004)  # of 8 mm, as the page says
    assert tyres.difference(shapely.Polygon(body.outline_m)).area < 2e-6
    assert shapely.Polygon(body.outline_m).contains(shapely.box(-0.086, -0.04, 0.05, 0.04).buffer(-1e-9))


def blindly(robot: boebot.Robot) -> None:
    """Into walls, along them and away, turning."""
    robot.drive(*((1, 1), (0.3, 0.9), (1, 1), (-0.8, -0.7), (0.5, -0.4))[int(robot.time / 1.5) % 5])


def ahead(robot: boebot.Robot) -> None:
    robot.drive(1.0, 0.97)


@pytest.mark.unsanitized
@pytest.mark.parametrize("arena", ["maze", "room"])
@pytest.mark.parametrize("brain", ["wander", blindly, ahead])
def test_the_example_drives_and_gets_into_nothing(angular: Path, brain: Any, arena: str) -> None:
    """shapely's core of the polygon, 1 mm within it, stays 1 mm away from every wall."""
    result = boebot.run(brain, robot=angular, arena=arena, on="native", seconds=40, seed=2)
    truth = result.truth
    assert truth is not None and not result.error and (result.true_distance or 0.0) > 0.5
    assert brain is not ahead or (result.true_contacts and truth.contact.sum() > 100)
    core = shapely.Polygon(result.robot.body.outline_m).buffer(-1e-3, join_style="mitre")
    rings = {"outline": shapely.LinearRing, "obstacle": shapely.LinearRing, "wall": shapely.LineString}
    edges = shapely.union_all([rings[solid.kind](solid.points) for solid in truth.plan.solids])
    poses = zip(truth.x.tolist(), truth.y.tolist(), truth.heading.tolist(), strict=True)
    assert min(shapely.distance(placed(core, *pose), edges) for pose in poses) - 1e-3 > -1e-6
