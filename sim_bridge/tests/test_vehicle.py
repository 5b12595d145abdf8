"""Vehicles without boards: one world at a time. Dynamics against closed forms, state as bytes, bad input."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from boebot.arenas import Arena, load_arena
from boebot.errors import ArenaError, BoebotError, BrainError, RobotError
from sim_bridge.compiled import ffi, lib
from sim_bridge.reading_table import ReadingTable
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim, beam

FIELD = square(0, 0, 40)


def run(vehicle: Vehicle, steps: int, left: float, right: float) -> None:
    for _ in range(steps):
        vehicle.step(left, right)


@pytest.mark.parametrize(("signal", "speed"), [(0.5, 0.682), (1.0, 1.381)])
def test_default_robot_reaches_its_speed(signal: float, speed: float) -> None:
    """Section 2.4: V_ss within 1 %; at s = 0.5, where no torque is limited, 63 % of it after 0.15 s within 0.02 s."""
    vehicle, speeds = Vehicle(arsim(), arena_of(outline=FIELD)), []
    for _ in range(300):
        vehicle.step(signal, signal)
        speeds.append(vehicle.body.speed)
    assert speeds[-1] == pytest.approx(speed, rel=0.01)
    if signal == 1.0:
        return
    rise = 0.01 * (1 + int(np.argmax(np.array(speeds) > (1 - math.exp(-1)) * speeds[-1])))
    assert rise == pytest.approx(0.15, abs=0.02)


def test_default_robot_turns_in_place() -> None:
    vehicle = Vehicle(arsim(), arena_of(outline=FIELD))
    run(vehicle, 400, -0.7, 0.7)
    assert vehicle.body.turn_rate == pytest.approx(4.447, rel=0.01)
    assert math.hypot(*vehicle.true_pose[:2]) < 1e-9


def test_euler_limit_is_that_of_the_linearised_rates() -> None:
    """6.14 1/s of V in section 2.4 make 0.33 s; a step at the limit is refused, one below is stable."""
    assert arsim().euler_limit == pytest.approx(2 / 6.14, rel=1e-3)
    with pytest.raises(RobotError, match=r"dt = 0\.33 s; expected less than 0\.3255 s"):
        arsim(dt=0.33)
    vehicle = Vehicle(arsim(dt=0.3), arena_of(outline=square(0, 0, 900)))
    run(vehicle, 300, 0.5, 0.5)
    assert vehicle.body.speed == pytest.approx(0.682, rel=0.01)


def test_readings_have_names_and_perfect_ones_are_the_truth() -> None:
    model = arsim(noise=False)
    model.sensor("odometer", "exact", half_track=0.2, wheel_radius=0.1, rule=lib.ODOMETER_NEW_HEADING)
    vehicle = Vehicle(model, arena_of(outline=FIELD), pose=(1, -2, 0.5))
    assert list(vehicle["odometer"]) == [1, -2, 0.5] and vehicle["compass"] == 0.5
    for step in range(500):
        vehicle.step(0.5 + 0.4 * math.sin(step / 30), 0.5)
    assert list(vehicle["exact"]) == pytest.approx(list(vehicle.true_pose), abs=1e-9), (
        "the world's own rule (3.18)-(3.22)"
    )
    assert list(vehicle["odometer"]) == pytest.approx(list(vehicle.true_pose), abs=0.01), "half a step's turn apart"
    assert vehicle["compass"] == vehicle.true_pose[2] and vehicle.time == pytest.approx(5.0)
    with pytest.raises(RobotError, match="no sensor 'nothing'; expected infrared_left, infrared_right, odometer"):
        vehicle["nothing"]
    with pytest.raises(TypeError):
        vehicle.readings[0] = 1.0


def test_noise_can_be_switched_off_and_a_sensor_more_changes_no_draw() -> None:
    quiet = Vehicle(arsim(noise=False), arena_of(outline=FIELD))
    run(quiet, 10, 0, 0)
    assert quiet["compass"] == 0.0
    plain, more = arsim(), arsim()
    more.sensor("sonar", "sonar", beam=beam(rays=3, opening=0.3), range_minimum=0.02, range_maximum=3.0, sigma=0.01)
    a, b = (Vehicle(model, load_arena("arsim"), seed=9) for model in (plain, more))
    for _ in range(100):
        a.step(0.3, 0.4)
        b.step(0.3, 0.4)
        assert list(a.readings) == list(b.readings)[: len(a.readings)]


def test_slow_sensors_hold_their_reading() -> None:
    """Rule S4: a compass of 25 Hz in a world of 100 Hz changes at every fourth step."""
    model = VehicleModel(ARSIM_BODY)
    model.dc_motors()
    model.sensor("compass", "compass", period=0.04, sigma=0.05)
    vehicle = Vehicle(model, arena_of(outline=FIELD))
    readings = [vehicle["compass"]]
    for _ in range(40):
        vehicle.step(0.0, 0.0)
        readings.append(vehicle["compass"])
    changes = [k for k in range(1, 41) if readings[k] != readings[k - 1]]
    assert changes == list(range(4, 41, 4))


def test_accelerometer_feels_the_start() -> None:
    """Acceleration of the body, straight on, by the spring's steady state (Fig. 1.10)."""
    model = VehicleModel(ARSIM_BODY)
    model.dc_motors()
    model.sensor("accelerometer", "a", mass=1e-3, stiffness=1e4, damping=1.0, range=50.0)
    vehicle = Vehicle(model, arena_of(outline=FIELD))
    speeds = [0.0]
    for _ in range(30):
        vehicle.step(0.5, 0.5)
        speeds.append(vehicle.body.speed)
        assert vehicle["a"] == pytest.approx((speeds[-1] - speeds[-2]) / 0.01, rel=0.05, abs=1e-3)


def test_a_lasers_rays_go_counter_clockwise_from_the_first() -> None:
    """A wall on the left alone: ray i looks along heading + first + i step."""
    model = VehicleModel(ARSIM_BODY, noise=False)
    model.dc_motors()
    model.sensor("laser", "laser", heading=0.2, first=0.5, step=0.3, rays=4, range=9.0, height=0.1)
    vehicle = Vehicle(model, arena_of([(-50, 1), (50, 1), (50, 2), (-50, 2)]))
    assert list(vehicle["laser"]) == pytest.approx([1 / math.sin(0.2 + 0.5 + 0.3 * i) for i in range(4)])
    one = VehicleModel(ARSIM_BODY, noise=False)
    one.dc_motors()
    one.sensor("laser", "laser", first=0.5, rays=1, range=9.0, height=0.1)
    assert list(np.atleast_1d(Vehicle(one, vehicle.arena)["laser"])) == pytest.approx([1 / math.sin(0.5)])


def test_whiskers_table_battery_laser_and_light_in_one_model() -> None:
    table = ReadingTable([0.1, 1.1], [0.0], [[[5.0]], [[1.0]]])
    model = VehicleModel(ARSIM_BODY, noise=False, ends_at_collision=False)
    model.dc_motors()
    model.sensor("touch", "whisker", root_x=0.2, root_y=0.0, tip_x=0.3, tip_y=0.0)
    model.sensor("table", "table", table=table, beam=beam(x=0.2), reach=1.1, none=-7.0)
    model.battery("battery", empty=5.0, full=8.0, idle_per_s=0.1, signal_per_s=0.0, charger_per_s=0.0)
    model.sensor("laser", "laser", first=-1.0, step=1.0, rays=3, range=5.0, height=0.1)
    wall = arena_of([(1.0, -5), (2.0, -5), (2.0, 5), (1.0, 5)])
    vehicle = Vehicle(model, wall)
    assert vehicle["whisker"] == 0.0 and vehicle["battery"] == 8.0
    assert vehicle["table"] == pytest.approx(5.0 - 4.0 * 0.7), "0.8 m to the wall, between bins 0.1 and 1.1"
    assert list(vehicle["laser"]) == pytest.approx([1 / math.cos(1), 1.0, 1 / math.cos(1)])
    run(vehicle, 500, 1.0, 1.0)
    assert vehicle["whisker"] == 1.0 and vehicle.collided and vehicle.time == pytest.approx(5.0), "it goes on"
    assert vehicle["battery"] == pytest.approx(5 + 3 * (1 - 0.1 * 5.0)) and vehicle.energy == pytest.approx(0.5)
    run(vehicle, 600, 0.0, 0.0)
    assert vehicle.ended == "battery empty" and vehicle.energy == 0.0


def test_servo_driven_by_signal_follows_its_curve() -> None:
    body = {"mass": 0.6, "inertia": 1.2e-3, "radius": 0.07, "half_track": 0.0525, "wheel_radius": 0.0331}
    body |= {"wheel_mass": 0.03, "wheel_inertia": 1.7e-5, "angular_damping": 0.004, "grip": 0.7}
    model = VehicleModel(body, dt=0.001)
    model.servos()
    for signal in (-0.6, 0.3, 1.0):
        vehicle = Vehicle(model, arena_of(outline=FIELD))
        run(vehicle, 2000, signal, signal)
        truth = 0.0331 * 51.25 * 2 * math.pi / 60 * math.tanh(200 * signal / 78.5)
        assert vehicle.body.speed == pytest.approx(truth, rel=0.01)
        assert abs(vehicle.true_pose[2]) < 1e-6


def test_a_moving_shape_is_seen_and_bumps_and_the_charger_charges() -> None:
    arena = Arena(arena_of(outline=FIELD).description)
    handle = lib.arena_new()
    arena.handle = ffi.gc(handle, lib.arena_destroy)
    way = ffi.new("path_waypoint[]", [(0.0, 3.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0)])
    assert lib.arena_add_moving(handle, ffi.NULL, 0, 0.3, ffi.NULL, way, 2, lib.PATH_ONCE) == 0
    lib.arena_set_charger(handle, 0.0, 0.0, 0.5)
    lib.arena_build(handle)
    model = VehicleModel(ARSIM_BODY, noise=False)
    model.dc_motors()
    model.sensor("sonar", "sonar", beam=beam(x=0.2), range_minimum=0.0, range_maximum=3.0)
    model.battery("battery", empty=5.0, full=8.0, idle_per_s=0.05, signal_per_s=0.0, charger_per_s=0.1)
    vehicle, distances = Vehicle(model, arena), []
    while not vehicle.ended:
        distances.append(vehicle["sonar"])
        vehicle.step(0, 0)
    assert distances == pytest.approx([2.5 - 0.01 * step for step in range(len(distances))], abs=1e-9)
    assert vehicle.ended == "collision" and vehicle.time == pytest.approx(2.5, abs=0.011)
    assert vehicle.energy > 0.99, "the charger acts: without it 0.05 x 2.5 would be gone"


def lively(seed: int = 3) -> Vehicle:
    model = arsim(odometer_sigma=1e-3, ends_at_collision=False)
    model.sensor(
        "sharp_infrared", "sharp", beam=beam(x=0.2), reach=1.5, gain=1.0, period=0.0383, late=0.0076, sigma=0.01
    )
    model.sensor("accelerometer", "acceleration", mass=1e-3, stiffness=1.0, damping=0.01, range=50.0, sigma=0.01)
    model.sensor("sonar", "sonar", period=0.05, beam=beam(rays=3, opening=0.3), range_maximum=3.0, miss=0.1, sigma=0.01)
    return Vehicle(model, load_arena("arsim"), seed=seed)


def brain(vehicle: Vehicle) -> tuple[float, float]:
    return (0.7, -0.4) if vehicle["infrared_left"] > 0.2 else (0.6, 0.5 + 0.1 * vehicle["compass"])


def test_the_same_seed_gives_the_same_run() -> None:
    one, other = lively(), lively()
    for vehicle in (one, other):
        vehicle.run(brain, 637)
    assert one.hash() == other.hash() and list(one.readings) == list(other.readings)
    assert lively(4).hash() != lively(3).hash()


@pytest.mark.parametrize("signal", [math.nan, math.inf, -math.inf])
def test_a_signal_that_is_no_number_is_refused_and_moves_nothing(signal: float) -> None:
    vehicle = lively()
    before = vehicle.hash()
    for left, right in ((signal, 0.0), (0.0, signal)):
        with pytest.raises(BrainError, match="two finite numbers"):
            vehicle.step(left, right)
        with pytest.raises(BrainError):
            vehicle.run(lambda _, a=left, b=right: (a, b), 3)  # type: ignore[misc]
    assert vehicle.hash() == before


def test_signals_are_limited() -> None:
    a, b = lively(), lively()
    run(a, 20, 1.0, -1.0)
    run(b, 20, 1e300, -5.0)
    assert a.hash() == b.hash()


@pytest.mark.parametrize(
    ("pose", "error", "text"),
    [
        ((5, 5, 0), ArenaError, "no free space"),
        ((-0.8, 0.8, 0), ArenaError, "no free space"),
        ((1.65, 0, 0), ArenaError, "no free space"),
        ((math.nan, 0, 0), RobotError, "finite"),
        ((0, 0, math.inf), RobotError, "finite"),
    ],
)
def test_bad_starts_are_refused(pose: Any, error: type[BoebotError], text: str) -> None:
    with pytest.raises(error, match=text):
        Vehicle(arsim(), load_arena("arsim"), pose=pose)


def test_bad_models_are_refused() -> None:
    for changes, what in (
        ({"mass": 0}, "mass is 0; expected a number more than 0"),
        ({"inertia": math.nan}, "inertia is nan; expected a number more than 0"),
        ({"wheel_radius": -1.0}, "wheel_radius is -1.0; expected a number more than 0"),
        ({"linear_damping": -1.0}, "linear_damping is -1.0; expected a number of at least 0"),
        ({"linear_damping": math.inf}, "linear_damping is inf; expected a number of at least 0"),
    ):
        with pytest.raises(RobotError, match=f"vehicle: body: {what}"):
            VehicleModel(ARSIM_BODY | changes)
    for dt in (0.0, -0.01, math.nan, math.inf):
        with pytest.raises(RobotError, match=f"dt is {dt!r}; expected a number more than 0"):
            arsim(dt=dt)
    with pytest.raises(RobotError, match="no drive"):
        Vehicle(VehicleModel(ARSIM_BODY), load_arena("arsim"))
    model = VehicleModel(ARSIM_BODY)
    with pytest.raises(RobotError, match=r"left motor: resistance_ohm is 0\.0; expected a number more than 0"):
        model.dc_motors({"resistance_ohm": 0.0})
    model.dc_motors()
    with pytest.raises(RobotError, match="it has a drive already"):
        model.dc_motors()
    with pytest.raises(RobotError, match=r"'a': range_minimum is 1; expected less than range_maximum, 0\.5"):
        model.sensor("sonar", "a", beam=beam(), range_minimum=1.0, range_maximum=0.5)
    with pytest.raises(RobotError, match=r"'a': period is -1\.0; expected a number of at least 0"):
        model.sensor("compass", "a", period=-1.0)
    model.sensor("compass", "b")
    with pytest.raises(RobotError, match="two sensors named 'b'"):
        model.sensor("compass", "b")
