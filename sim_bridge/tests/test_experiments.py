"""Experiments of the notes on the world without boards: rows E08-E11, E16, E18 and E69 of THEORY's table.

E13, E14, E15 and E70 stand with their sensors in test_sensors*.py, E11's other half in test_numbers_noise.py.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from sim_bridge._core import ffi, lib
from sim_bridge.arena import load_arena
from sim_bridge.batch import Batch
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import STAGES, Vehicle, arsim


def odometer(**changes: Any) -> Any:
    usual = {"half_track": 0.2, "wheel_radius": 0.1, "factor_left": 1.0, "factor_right": 1.0}
    parameters = ffi.new("odometer_parameters *", usual | changes)
    assert lib.odometer_check(parameters) == 0
    return parameters


# ---- E08: the rule of odometry -------------------------------------------------------------------------------------


def odometry_error(rule: int, dt: float, counts: bool) -> float:
    """Position error (m) after 20 s of wheel speeds 0.1 + 0.05 sin t, 0.1 + 0.05 cos 0.7 t, R = 0.0525.

    A step's travel is the integral of the speeds (`counts`), or the speed at its beginning times dt. Truth is
    (2.7)-(2.9) at steps of 0.1 ms.
    """

    def left(t: Any) -> Any:
        return 0.1 * t + 0.05 * (1 - np.cos(t))

    def right(t: Any) -> Any:
        return 0.1 * t + 0.05 * np.sin(0.7 * t) / 0.7

    def heading(t: Any) -> Any:
        return (right(t) - left(t)) / (2 * 0.0525)

    fine = (np.arange(200_000) + 0.5) * 1e-4
    speed = (0.2 + 0.05 * np.sin(fine) + 0.05 * np.cos(0.7 * fine)) / 2
    truth = np.array([(speed * np.cos(heading(fine))).sum(), (speed * np.sin(heading(fine))).sum()]) * 1e-4
    parameters, state = odometer(half_track=0.0525, rule=rule), ffi.new("odometer_state *")
    times = np.linspace(0, 20, round(20 / dt) + 1)
    begin = times[:-1]
    travel_left = np.diff(left(times)) if counts else (0.1 + 0.05 * np.sin(begin)) * dt
    travel_right = np.diff(right(times)) if counts else (0.1 + 0.05 * np.cos(0.7 * begin)) * dt
    for a, b in zip(travel_left, travel_right, strict=True):
        lib.odometer_advance(parameters, state, a, b)
    return math.hypot(state.x - truth[0], state.y - truth[1])


def test_e08_midpoint_rule() -> None:
    """The midpoint rule on counts, and what the notes' figures of the other two rules come from (section 2.2)."""
    assert odometry_error(lib.ODOMETER_MIDPOINT, 0.1, True) < 0.001
    assert odometry_error(lib.ODOMETER_MIDPOINT, 0.01, True) < 0.00001
    assert odometry_error(lib.ODOMETER_EULER, 0.1, False) == pytest.approx(0.0369, abs=0.0001)
    assert odometry_error(lib.ODOMETER_EULER, 0.01, False) == pytest.approx(0.0037, abs=0.0001)
    assert odometry_error(lib.ODOMETER_NEW_HEADING, 0.1, False) == pytest.approx(0.0410, abs=0.0001)
    assert odometry_error(lib.ODOMETER_NEW_HEADING, 0.01, False) == pytest.approx(0.0040, abs=0.0001)


# ---- E09, E69: noise of the odometer -------------------------------------------------------------------------------


def drift(sigma: float, runs: int, steps: int = 2000, dt: float = 0.01) -> Any:
    """Odometer errors (runs, steps, 3) of a robot that truly drives 4 m straight along x."""
    parameters = odometer(sigma_step=sigma)
    errors = np.empty((runs, steps, 3))
    turn = 4.0 / 0.1 / steps
    for run in range(runs):
        noise = ffi.new("noise_source *", {"seed": run, "device": 1, "on": 1})
        state = ffi.new("odometer_state *")
        for step in range(steps):
            lib.odometer_step(parameters, state, (step + 1) * turn, (step + 1) * turn, dt, noise)
            errors[run, step] = state.x - 4.0 * (step + 1) / steps, state.y, state.heading
    return errors


@pytest.mark.parametrize("sigma", [1e-4, 5e-4])
def test_e09_heading_drifts_by_sigma_root_2n_over_2r(sigma: float) -> None:
    heading = drift(sigma, 200)[:, -1, 2]
    assert np.sqrt((heading**2).mean()) == pytest.approx(sigma * math.sqrt(2 * 2000) / 0.4, rel=0.12)


def test_e69_position_error_grows_with_t_to_the_one_and_a_half() -> None:
    """Straight 4 m at sigma 1e-3: 0.34 m rms at the end; slope of error against time on double logarithmic scales."""
    errors = drift(1e-3, 300)
    rms = np.sqrt((errors[..., :2] ** 2).sum(axis=2).mean(axis=0))
    assert rms[-1] == pytest.approx(0.34, rel=0.12)
    steps = np.array([500, 700, 1000, 1400, 2000])
    sideways = np.sqrt((errors[..., 1] ** 2).mean(axis=0))
    slope = np.polyfit(np.log(steps), np.log(sideways[steps - 1]), 1)[0]
    assert slope == pytest.approx(1.5, abs=0.1)


def test_drift_does_not_depend_on_the_step() -> None:
    """ARSim's noise per step would make twice as many steps drift by the root of two more."""
    coarse = drift(5e-4, 200, 500, dt=0.04)[:, -1, 2]
    assert np.sqrt((coarse**2).mean()) == pytest.approx(5e-4 * math.sqrt(2 * 2000) / 0.4, rel=0.12)


def test_the_kits_odometer_noise() -> None:
    """Factor, whole edges and slips: each by its closed form, over 4 m straight."""
    edge = 2 * math.pi * 0.1 / 16
    quiet = ffi.new("noise_source *", {"on": 0})
    for changes, distance, tolerance in (
        ({"factor_left": 1.01, "factor_right": 1.01}, 4.04, 1e-9),
        ({"edges_per_turn": 16.0}, math.floor(4.0 / edge) * edge, 1e-9),
    ):
        state = ffi.new("odometer_state *")
        for step in range(2000):
            lib.odometer_step(odometer(**changes), state, (step + 1) * 0.02, (step + 1) * 0.02, 0.01, quiet)
        assert state.distance == pytest.approx(distance, abs=tolerance)
    spread = []
    for seed in range(200):
        noise, state = ffi.new("noise_source *", {"seed": seed, "on": 1}), ffi.new("odometer_state *")
        parameters = odometer(sigma_share=0.1, slips_per_s=1.0, slip_share=0.5)
        for step in range(400):
            lib.odometer_step(parameters, state, (step + 1) * 0.1, (step + 1) * 0.1, 0.01, noise)
        spread.append(state.x if state.x > state.distance else state.distance)
    # of 400 steps of 0.01 m each wheel loses half in 1 % on the average
    assert np.mean(spread) == pytest.approx(4.0 * (1 - 0.01 * 0.5), rel=1e-3)
    variance = 400 * 0.01**2 * (0.01 * 0.99 * 0.25 + 0.99 * 0.01 + 0.01 * 0.25 * 0.01) / 2
    assert np.std(spread) == pytest.approx(math.sqrt(variance), rel=0.2)


# ---- E10: quadrature -----------------------------------------------------------------------------------------------


def test_e10_random_walk_is_counted_exactly_and_a_glitch_is_illegal() -> None:
    draw, decoder, phase, truth = np.random.default_rng(5), ffi.new("quadrature *"), 0, 0
    levels = [(0, 0), (1, 0), (1, 1), (0, 1)]  # forward
    for step in draw.choice([-1, 1], 4000).tolist():
        phase = (phase + step) % 4
        truth += step
        lib.quadrature_decode(decoder, *levels[phase])
        assert decoder.count == truth
    assert decoder.illegal == 0
    lib.quadrature_decode(decoder, *levels[(phase + 2) % 4])
    assert decoder.illegal == 1 and decoder.count == truth


# ---- E11: noise of a reading ---------------------------------------------------------------------------------------


def test_e11_readings_of_a_sensor_have_the_moments_of_3_1() -> None:
    """S = 0.5 by the distance where the centre ray reads it, sigma 0.01, 10,000 draws."""
    distance = math.sqrt(0.03 / 0.4)
    wall = arena_of([(distance, -5), (distance + 1, -5), (distance + 1, 5), (distance, 5)])
    around = ffi.new("scene *", {"arena": wall.handle})
    view = ffi.new("viewpoint *", {"around": around, "cosine": 1.0})
    sensor = ffi.new("infrared_proximity *")
    place = {"rays": 1, "height": 0.06}
    parameters = {"beam": place, "range": 1.0, "c1": 0.03, "c2": 0.1, "sigma": 0.01}
    assert lib.infrared_proximity_init(sensor, ffi.new("infrared_proximity_parameters *", parameters)) == 0
    noise = ffi.new("noise_source *", {"seed": 11, "on": 1})
    reads = np.array([lib.infrared_proximity_read(sensor, view, noise) for _ in range(10_000)])
    assert reads.mean() == pytest.approx(0.5, abs=0.0002)
    assert reads.std() == pytest.approx(0.005, rel=0.03)


# ---- E16: the loop -------------------------------------------------------------------------------------------------


def test_e16_six_stages_in_order_in_each_step() -> None:
    """And each stage does its own: signals change at "send", the pose at "move", readings at "sense"."""
    seen: list[tuple[str, float, float, float]] = []

    def note(stage: str, vehicle: Vehicle) -> None:
        seen.append((stage, vehicle.pose[0], vehicle["odometer"][0], vehicle.time))

    vehicle = Vehicle(arsim(noise=False), arena_of(outline=square(0, 0, 20)))
    assert vehicle.run(lambda _: (0.5, 0.5), 30, stage=note) == 30
    assert [stage for stage, *_ in seen] == list(STAGES) * 30
    for before, after in pairwise(seen):
        assert (before[1] != after[1]) == (after[0] == "move"), "only moving changes the pose"
        assert before[2] == after[2] or after[0] == "sense", "only sensing changes a reading"
    stages = [entry for entry in seen if entry[0] == "sense"]
    assert [entry[2] for entry in stages] == pytest.approx([entry[1] for entry in stages], abs=1e-12)


def test_e16_stages_one_by_one_are_the_step() -> None:
    def brain(vehicle: Vehicle) -> tuple[float, float]:
        return 0.3 + 0.4 * vehicle["infrared_left"], 0.6 - 0.3 * vehicle["infrared_right"]

    whole, parted = (Vehicle(arsim(), load_arena("arsim"), seed=4) for _ in range(2))
    whole.run(brain, 150)
    parted.run(brain, 150, stage=lambda stage, vehicle: None)
    assert whole.hash() == parted.hash()


def test_e16_a_collision_ends_the_run_within_one_step() -> None:
    """The wall is 1 m ahead of the axle, the body's radius 0.2 m: the run ends in the step that reaches it."""
    arena = arena_of([(1.0, -5), (2.0, -5), (2.0, 5), (1.0, 5)])
    vehicle = Vehicle(arsim(noise=False), arena)
    poses = []
    done = vehicle.run(
        lambda _: (1.0, 1.0), 1000, stage=lambda stage, v: poses.append(v.pose) if stage == "check" else None
    )
    assert vehicle.ended == "collision" and vehicle.collided and done == len(poses) < 1000
    assert poses[-1][0] == pytest.approx(0.8, abs=1e-9) and poses[-2][0] < 0.8 - 1e-6
    pose = vehicle.pose
    vehicle.step(1.0, 1.0)
    assert vehicle.pose == pose and vehicle.run(lambda _: (1.0, 1.0), 10) == 0


# ---- E18: the notes' test run --------------------------------------------------------------------------------------


def test_e18_testrun() -> None:
    """1000 steps of 0.01 s in the notes' arena, 2 IR sensors of 3 rays: ends at t = 10.00 s or the first collision; a
    row of the log for each step."""
    arena, log = load_arena("arsim"), []
    vehicle = Vehicle(arsim(), arena, seed=1)

    def wander(vehicle: Vehicle) -> tuple[float, float]:
        near = vehicle["infrared_left"] + vehicle["infrared_right"]
        return (-0.7, 0.7) if near > 0.2 else (0.5, 0.5)

    def record(stage: str, vehicle: Vehicle) -> None:
        if stage == "check":
            log.append((vehicle.time, *vehicle.pose, vehicle["infrared_left"], vehicle["infrared_right"]))

    done = vehicle.run(wander, 1000, stage=record)
    assert len(log) == done
    assert log[-1][0] == pytest.approx(0.01 * done, abs=1e-9)
    assert (done == 1000 and not vehicle.ended) or vehicle.collided
    assert all(0 <= reading <= 1 for row in log for reading in row[4:])
    times = [row[0] for row in log]
    assert times == pytest.approx([0.01 * (step + 1) for step in range(done)], abs=1e-9)


def test_e18_with_the_wander_brain_many_seeds() -> None:
    """The notes' pose of the IR sensors leaves a frontal blind cone, so that 5 to 6 of 12 runs of 30 s collide; at
    +-0.3324 rad fewer do (THEORY section 1.5). Bounds are three standard deviations of 64 runs."""

    def collided(angle: float) -> int:
        batch = Batch(arsim(infrared_rad=(angle, -angle)), load_arena("arsim"), np.zeros((64, 3)), np.arange(64))
        for index in range(64):
            batch.state(index, "vehicle_wander_state *").seed = index
        batch.run(ffi.addressof(lib, "vehicle_wander"), 3000)
        ended = batch.flags == lib.VEHICLE_COLLIDED
        assert (batch.steps[~ended] == 3000).all() and (batch.steps[ended] < 3000).all()
        return int(ended.sum())

    wide, narrow = collided(0.7854), collided(0.3324)
    assert abs(wide - 64 * 5.5 / 12) < 3 * math.sqrt(64 * 0.25)
    assert wide - narrow > 3 * math.sqrt(64 * 0.25)
