"""What readers of the notes call by itself: rays and bearings, the motor, placing, the recorder, the view."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from shapely.geometry import LineString, Point

from boebot.arenas import load_arena
from boebot.errors import ArenaError, RobotError
from boebot_course.motor import DCMotor
from boebot_course.rays import bearing_interval, ray_segment
from boebot_course.recorder import Recorder
from boebot_course.vehicle_view import View
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, arsim

coordinate = st.floats(-3, 3)
point = st.tuples(coordinate, coordinate)


@given(origin=point, angle=st.floats(-7, 7), p1=point, p2=point)
def test_ray_meets_a_segment_where_shapely_says(
    origin: tuple[float, float], angle: float, p1: tuple[float, float], p2: tuple[float, float]
) -> None:
    if math.dist(p1, p2) < 1e-3:
        return
    ray = LineString([origin, (origin[0] + 10 * math.cos(angle), origin[1] + 10 * math.sin(angle))])
    segment = LineString([p1, p2])
    found = ray_segment(*origin, angle, p1, p2)
    if found is None:
        inner = LineString([segment.interpolate(share, normalized=True) for share in (1e-6, 1 - 1e-6)])
        assert not ray.intersects(inner)
    else:
        hit = Point(origin[0] + found * math.cos(angle), origin[1] + found * math.sin(angle))
        assert segment.distance(hit) < 1e-9 and ray.distance(segment) < 1e-9


def test_ray_along_a_segment_meets_its_nearer_end() -> None:
    assert ray_segment(0, 0, 0, (2, 0), (1, 0)) == 1.0
    assert ray_segment(0, 0, math.pi, (2, 0), (1, 0)) is None
    assert ray_segment(0, 0, 0, (1, -1), (1, 1), reach=0.9) is None
    with pytest.raises(ArenaError, match="two points"):
        ray_segment(0, 0, 0, (1, 1), (1, 1))


@given(v1=point, v2=point, share=st.floats(0, 1))
def test_every_point_of_a_segment_is_seen_within_its_bearings(
    v1: tuple[float, float], v2: tuple[float, float], share: float
) -> None:
    if LineString([v1, v2]).distance(LineString([(0, 0), (0, 1e-9)])) < 1e-3:
        return
    first, last = bearing_interval(v1, v2)
    assert -math.pi <= first <= math.pi and 0 <= last - first < math.pi
    bearing = math.atan2(v1[1] + share * (v2[1] - v1[1]), v1[0] + share * (v2[0] - v1[0]))
    assert (bearing - first + 1e-9) % (2 * math.pi) <= last - first + 2e-9


def test_bearings_across_the_negative_axis_and_through_the_origin() -> None:
    assert bearing_interval((-1, -1), (-1, 1)) == pytest.approx((0.75 * math.pi, 1.25 * math.pi))
    with pytest.raises(ArenaError, match="through the origin"):
        bearing_interval((-1, 0), (2, 0))


def test_motor_by_itself() -> None:
    """Section 1.10: 6 V spin it freely at 14.42 rad/s; its torque is limited above 9.46 V at standstill."""
    motor = DCMotor()
    assert motor.voltage(0.5) == 6.0 and motor.voltage(-3) == -12.0
    free = 14.42 / 2  # of the wheel, behind the gear
    assert motor.torque(6.0, free) == pytest.approx(0.0, abs=2e-3)
    assert motor.torque(9.4, 0.0) < 1.0 == motor.torque(9.5, 0.0) and motor.torque(0.1, 0.0) == 0.0
    assert DCMotor(gear=4.0).torque(3.0, 0.0) == pytest.approx(4 * (0.0333 / 0.62 * 3.0 - 0.008))
    with pytest.raises(RobotError, match="there is no key 'gears'; expected torque_constant, "):
        DCMotor(gears=3)


def test_placed_at_a_speed_it_rolls_on() -> None:
    """Without volts the back-EMF and friction brake it, (2.31), (1.8)-(1.10): the first Euler step in closed form."""
    vehicle = Vehicle(arsim(), arena_of(outline=square(0, 0, 40)))
    for _ in range(50):
        vehicle.step(1.0, 0.5)
    vehicle.place((1.0, 2.0, 0.5), speed=1.0)
    assert vehicle.true_pose == (1.0, 2.0, 0.5) and vehicle.time == 0.0 and list(vehicle["odometer"]) == [1.0, 2.0, 0.5]
    vehicle.step(0.0, 0.0)
    motor_speed = 2 * 1.0 / 0.1
    torque = -2 * ((0.0333**2 / 0.62 + 0.02) * motor_speed + 0.008)
    gained = 0.01 * (vehicle.model.a * 2 * torque - 1.0 * 1.0) / 3.0
    assert vehicle.body.speed == pytest.approx(1.0 + gained, rel=1e-9)
    vehicle.place((0, 0, 0), turn_rate=2.0)
    assert vehicle.body.rim_right == -vehicle.body.rim_left == pytest.approx(2.0 * 0.2)
    with pytest.raises(RobotError, match=r"the speed is \(nan, 0\.0\)"):
        vehicle.place((0, 0, 0), speed=math.nan)
    with pytest.raises(ArenaError, match="no free space"):
        vehicle.place((19.9, 0, 0))


def test_placing_again_is_a_new_run() -> None:
    arena = load_arena("arsim")
    fresh, used = (Vehicle(arsim(odometer_sigma=1e-3), arena, seed=3) for _ in range(2))
    used.run(lambda _: (0.4, 0.6), 100)
    used.place(arena.start)
    for vehicle in (fresh, used):
        vehicle.run(lambda _: (0.5, 0.3), 150)
    assert fresh.hash() == used.hash()


def test_a_and_b_of_a_model() -> None:
    """(2.26) and (2.30) without wheel masses: 1/r and R/r."""
    model = arsim()
    assert model.a == pytest.approx(1 / ARSIM_BODY["wheel_radius"])
    assert model.b == pytest.approx(ARSIM_BODY["half_track"] / ARSIM_BODY["wheel_radius"])


def test_recorder_keeps_a_row_a_step(tmp_path: Path) -> None:
    vehicle = Vehicle(arsim(), load_arena("arsim"))
    log = Recorder(vehicle)
    assert log.table.shape == (0, 14)
    done = vehicle.run(lambda _: (0.3, 0.35), 60, stage=log)
    assert len(log) == done == 60 and log["time"] == pytest.approx(0.01 * np.arange(1, 61))
    assert (log["true_x"][-1], log["true_y"][-1], log["true_heading"][-1]) == vehicle.true_pose
    steps = np.hypot(np.diff(log["true_x"]), np.diff(log["true_y"]))
    assert np.diff(log["true_distance"]) == pytest.approx(steps) and log["odometer[0]"][-1] == pytest.approx(
        log["true_x"][-2], abs=1e-3
    )
    log.save(tmp_path / "log.csv")
    back = np.genfromtxt(tmp_path / "log.csv", delimiter=",", names=True, deletechars="")
    assert back["infrared_left"] == pytest.approx(log["infrared_left"], rel=1e-8) and len(back) == 60
    with pytest.raises(KeyError, match="no column 'nothing'; expected time, true_x"):
        log["nothing"]


@pytest.mark.unsanitized
def test_view_shows_the_body_where_it_is_and_rays_that_end_at_walls(tmp_path: Path) -> None:
    model = arsim(infrared_rad=(0.0, math.pi / 2))
    view = View(vehicle := Vehicle(model, load_arena("arsim"), pose=(1.2, 0.0, 0.0)))
    ends = np.array(view._ray_lines())
    assert np.nanmax(ends[0]) == pytest.approx(1.8) and ends.shape == (2, 18)
    picture = np.asarray(Image.open(view.save(tmp_path / "before.png")).convert("RGB")).astype(int)
    vehicle.run(lambda _: (-0.5, -0.4), 120)
    view.update()
    middle = (view._body.get_transform() - view._axes.transData).transform((0.0, 0.0))
    assert middle == pytest.approx(vehicle.true_pose[:2], abs=1e-12)
    later = np.asarray(Image.open(view.save(tmp_path / "after.png")).convert("RGB")).astype(int)
    assert (np.abs(picture - later).sum(axis=2) > 60).sum() > 500, "the body has moved"
