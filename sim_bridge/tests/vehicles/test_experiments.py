"""Experiments of the notes on the world without boards: E04, E05, E08-E13, E16, E18 and E69.

E01 to E07 stand with motors and body in test_motors.py, test_vehicle_motors.py and test_body.py, E12 to E15 and E70
with rays and sensors in test_rays.py, test_sensors*.py and test_reading_table.py, E11's other half in
test_numbers_noise.py. What stands here too is what those leave out: E04 as an identity, E05's rise at both signals, E12
by the function that readers of the notes call, E13 along the whole sweep.
"""

from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from boebot.arenas import load_arena
from boebot_course.rays import ray_segment
from boebot_course.recorder import Recorder
from sim_bridge.batch import WANDER, Batch
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, STAGES, Vehicle, VehicleModel, arsim, beam

pytestmark = pytest.mark.unsanitized


def odometer(**changes: Any) -> Any:
    usual = {"half_track": 0.2, "wheel_radius": 0.1, "factor_left": 1.0, "factor_right": 1.0}
    return ffi.new("odometer_parameters *", usual | changes)


# ---- E04: A and B as identities -------------------------------------------------------------------------------------


def solved(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction]:
    """By elimination in exact numbers."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for column in range(len(rows)):
        pivot = next(k for k in range(column, len(rows)) if rows[k][column] != 0)
        rows[column], rows[pivot] = rows[pivot], rows[column]
        rows[column] = [value / rows[column][column] for value in rows[column]]
        for k, row in enumerate(rows):
            if k != column:
                rows[k] = [value - row[column] * top for value, top in zip(row, rows[column], strict=True)]
    return [row[-1] for row in rows]


def eliminated(p: dict[str, Fraction]) -> tuple[Fraction, Fraction]:
    """A and B from (2.10)-(2.19): accelerations under 1 N m at the right wheel, times M and I.

    Unknown: accelerations of the wheels' rims, forces at the ground, reactions at the axle, acceleration and angular
    acceleration of the body.
    """
    r, half, m, i_w = p["wheel_radius"], p["half_track"], p["wheel_mass"], p["wheel_inertia"]
    zero, one = Fraction(0), Fraction(1)
    matrix = [
        [m, zero, -one, zero, one, zero, zero, zero],  # (2.10)
        [zero, m, zero, -one, zero, one, zero, zero],  # (2.11)
        [i_w / r, zero, r, zero, zero, zero, zero, zero],  # (2.12) with (2.16)
        [zero, i_w / r, zero, r, zero, zero, zero, zero],  # (2.13) with (2.17)
        [zero, zero, zero, zero, -one, -one, p["mass"], zero],  # (2.14)
        [zero, zero, zero, zero, half, -half, zero, p["inertia"]],  # (2.15)
        [one / 2, one / 2, zero, zero, zero, zero, -one, zero],  # (2.18)
        [-one / (2 * half), one / (2 * half), zero, zero, zero, zero, zero, -one],  # (2.19)
    ]
    found = solved(matrix, [zero, zero, zero, one, zero, zero, zero, zero])
    return p["mass"] * found[6], p["inertia"] * found[7]


def by_formula(p: dict[str, Fraction]) -> tuple[Fraction, Fraction]:
    """(2.26), (2.30)"""
    r, half, m, i_w = p["wheel_radius"], p["half_track"], p["wheel_mass"], p["wheel_inertia"]
    mass, inertia = p["mass"], p["inertia"]
    a = 1 / (r * (1 + 2 * (i_w / (mass * r * r) + m / mass)))
    return a, 1 / (r / half + 2 * (i_w * half / (inertia * r) + m * half * r / inertia))


def test_e04_a_and_b_are_identities() -> None:
    """Symbolically, by points: after clearing fractions both sides are polynomials of degree at most 8 in each of six
    parameters; two that differ agree at a random point of 10^9 values a parameter with a chance below 6 * 8 / 10^9
    (Schwartz and Zippel). In exact numbers, so that equal means equal. The world's own numbers are the nearest doubles.
    """
    draw = np.random.default_rng(4)
    names = ("mass", "inertia", "half_track", "wheel_radius", "wheel_mass", "wheel_inertia")
    for _ in range(8):
        p = {name: Fraction(int(draw.integers(1, 10**9)), 10**8) for name in names}
        assert eliminated(p) == by_formula(p)
        c = ffi.new("body_parameters *", {name: float(value) for name, value in p.items()})
        assert (lib.body_a(c), lib.body_b(c)) == pytest.approx(tuple(map(float, by_formula(p))), rel=1e-14)
    light = p | {"wheel_mass": Fraction(0), "wheel_inertia": Fraction(0)}
    assert eliminated(light) == (1 / p["wheel_radius"], p["half_track"] / p["wheel_radius"])  # (2.33), (2.34)


# ---- E05: steady speed and rise --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("signal", "steady"), [(0.5, 0.682), (1.0, 1.381)])
def test_e05_speed_and_rise_at_both_signals(signal: float, steady: float) -> None:
    """V_ss within 1 %; 63 % of it after 0.15 +- 0.02 s, between two steps by a straight line."""
    vehicle, speeds = Vehicle(arsim(), arena_of()), [0.0]
    for _ in range(500):
        vehicle.step(signal, signal)
        speeds.append(vehicle.body.speed)
    assert speeds[-1] == pytest.approx(steady, rel=0.01)
    rise = float(np.interp((1 - math.exp(-1)) * speeds[-1], speeds[:60], 0.01 * np.arange(60)))
    assert rise == pytest.approx(0.15, abs=0.02)


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
    for error in (rms, sideways):
        slope = np.polyfit(np.log(steps), np.log(error[steps - 1]), 1)[0]
        assert slope == pytest.approx(1.5, abs=0.1)
    # sideways: sum of n headings that walk by sigma sqrt(2) / (2 R) a step, each over 2 mm; four standard errors of rms
    walk = 1e-3 * math.sqrt(2) / 0.4
    assert sideways[-1] == pytest.approx(0.002 * walk * math.sqrt(2000**3 / 3), rel=4 / math.sqrt(2 * 300))


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


# ---- E12: one ray, one segment ---------------------------------------------------------------------------------------


def test_e12_ray_and_segment_agree_with_a_linear_solver() -> None:
    """(3.4)-(3.8): 20,000 random pairs, to 1e-9 where they cross; within 1e-9 of an end rounding may decide."""
    start, target, a, b = np.random.default_rng(12).uniform(-2, 2, (4, 20_000, 2))
    matrices = np.stack((target - start, a - b), axis=2)
    t, u = np.linalg.solve(matrices, (a - start)[..., None])[..., 0].T  # start + t (target - start) = a + u (b - a)
    length, angle = np.hypot(*(target - start).T), np.arctan2(*(target - start).T[::-1])
    borders = np.abs(np.stack((t, t - 1, u, u - 1))).min(axis=0) < 1e-9
    assert borders.sum() < 5
    worst, met = 0.0, 0
    for i in np.flatnonzero(~borders):
        ends = ((float(a[i, 0]), float(a[i, 1])), (float(b[i, 0]), float(b[i, 1])))
        found = ray_segment(float(start[i, 0]), float(start[i, 1]), float(angle[i]), *ends, reach=float(length[i]))
        assert (found is not None) == (0 < t[i] < 1 and 0 < u[i] < 1)
        if found is not None:
            worst, met = max(worst, abs(found - t[i] * length[i])), met + 1
    assert met > 4000 and worst < 1e-9


# ---- E13: the sweep of the notes' IR sensor --------------------------------------------------------------------------


def test_e13_wall_from_a_tenth_to_beyond_the_range() -> None:
    """0.1 to 1.05 m ahead of a vehicle's sensor: 1 below 0.15 m, 0 beyond D = 1 m, and (3.12)-(3.14) between."""
    around = arena_of([(5.0, -50), (6.0, -50), (6.0, 50), (5.0, 50)])
    model = VehicleModel(ARSIM_BODY | {"radius": 0.05})
    model.sensor("infrared_proximity", "ir", beam=beam(opening=0.5, rays=3), range=1.0, c1=0.03, c2=0.1)
    model.dc_motors()
    vehicle = Vehicle(model, around)
    for distance in np.linspace(0.1, 1.05, 191).tolist():
        vehicle.place((5.0 - distance, 0, 0))
        rays = [(distance / math.cos(kappa), kappa) for kappa in (-0.25, 0.0, 0.25)]
        if min(abs(d - 1.0) for d, _ in rays) < 1e-9:
            continue  # at D itself rounding decides
        truth = sum(min((0.03 / d**2 + 0.1) * math.cos(kappa), 1.0) if d <= 1.0 else 0.0 for d, kappa in rays) / 3
        assert vehicle["ir"] == pytest.approx(truth, abs=1e-3)
        assert vehicle["ir"] == 1.0 or distance >= 0.15
        assert (vehicle["ir"] == 0.0) == (distance > 1.0)


# ---- E16: the loop -------------------------------------------------------------------------------------------------


def test_e16_six_stages_in_order_in_each_step() -> None:
    """And each stage does its own: signals change at "send", the pose at "move", readings at "sense"."""
    seen: list[tuple[str, float, float, float]] = []

    def note(stage: str, vehicle: Vehicle) -> None:
        seen.append((stage, vehicle.true_pose[0], vehicle["odometer"][0], vehicle.time))

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
        lambda _: (1.0, 1.0), 1000, stage=lambda stage, v: poses.append(v.true_pose) if stage == "check" else None
    )
    assert vehicle.ended == "collision" and vehicle.collided and done == len(poses) < 1000
    assert poses[-1][0] == pytest.approx(0.8, abs=1e-9) and poses[-2][0] < 0.8 - 1e-6
    pose = vehicle.true_pose
    vehicle.step(1.0, 1.0)
    assert vehicle.true_pose == pose and vehicle.run(lambda _: (1.0, 1.0), 10) == 0


# ---- E18: the notes' test run --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("heading", "ends"), [(0.0, False), (0.5, False), (1.0, False), (2.0, True)])
def test_e18_testrun(heading: float, ends: bool) -> None:
    """1000 steps of 0.01 s in the notes' arena, 2 IR sensors of 3 rays: t = 10.00 s and 1000 rows of the log, or the
    first collision, and then no row more. The headings are such that both happen."""
    vehicle = Vehicle(arsim(), load_arena("arsim"), pose=(0, 0, heading), seed=1)
    log = Recorder(vehicle)

    def wander(vehicle: Vehicle) -> tuple[float, float]:
        near = vehicle["infrared_left"] + vehicle["infrared_right"]
        return (-0.7, 0.7) if near > 0.2 else (0.5, 0.5)

    done = vehicle.run(wander, 1000, stage=log)
    assert [look["rays"] for look, _ in vehicle.model.looks.values()] == [3, 3]
    assert log["time"] == pytest.approx(0.01 * np.arange(1, done + 1), abs=1e-9)
    if ends:
        assert vehicle.ended == "collision" and len(log) == done < 1000
        assert log["true_contact"][-1] == 1 and not log["true_contact"][:-1].any()
    else:
        assert len(log) == done == 1000 and vehicle.time == pytest.approx(10.0, abs=1e-9) and not vehicle.ended
    for side in ("left", "right"):
        assert ((log[f"infrared_{side}"] >= 0) & (log[f"infrared_{side}"] <= 1)).all()


def test_e18_with_the_wander_brain_many_seeds() -> None:
    """The notes' pose of the IR sensors leaves a frontal blind cone, so that 5 to 6 of 12 runs of 30 s collide; at
    +-0.3324 rad fewer do (docs/reference/notes.md). Bounds are three standard deviations of 64 runs."""

    def collided(angle: float) -> int:
        batch = Batch(arsim(infrared_rad=(angle, -angle)), load_arena("arsim"), np.zeros((64, 3)), np.arange(64))
        for index in range(64):
            batch.state(index, "vehicle_wander_state *").seed = index
        batch.run(WANDER, 3000)
        ended = batch.flags == lib.VEHICLE_COLLIDED
        assert (batch.steps[~ended] == 3000).all() and (batch.steps[ended] < 3000).all()
        return int(ended.sum())

    wide, narrow = collided(0.7854), collided(0.3324)
    assert abs(wide - 64 * 5.5 / 12) < 3 * math.sqrt(64 * 0.25)
    assert wide - narrow > 3 * math.sqrt(64 * 0.25)
