"""A robot without a board has any number of sensors, of any kind, under any names."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.robot import Robot
from sim_bridge.batch import Batch
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import Vehicle
from sim_bridge.vehicles.model import VehicleModel, beam
from sim_bridge.vehicles.model_file import ARSIM_BODY

HALF = 1.8  # m, from the middle of the square to its walls


def to_the_wall(angle: float) -> float:
    """m from the middle of the square."""
    return HALF / max(abs(math.cos(angle)), abs(math.sin(angle)))


def proximity(distance: float) -> float:
    """(3.13) for one ray straight ahead, c1 = 0.03, c2 = 0.1."""
    return min(0.03 / distance**2 + 0.1, 1.0)


def devices(names: list[str], keys: str) -> str:
    """Tables of devices in the middle of the body, each looking its own way where it looks."""
    turn = 2 * math.pi / len(names)
    return "".join(f"[device.{name}]\n{keys.format(heading=turn * k)}\n" for k, name in enumerate(names))


@pytest.mark.parametrize("count", [24, 25, 40, 100])
def test_robots_file_with_that_many_infrared_sensors_and_others(tmp_path: Path, count: int) -> None:
    eyes = [f"eye_{k}" for k in range(count)]
    lasers, needles, ghosts = ["laser", "low", "high"], ["compass", "needle", "other"], ["odometer", "ghost"]
    robot = tmp_path / "many.toml"
    robot.write_text(
        'extends = "arsim"\nremove = ["infrared_left", "infrared_right", "odometer", "compass"]\n'
        + devices(
            eyes,
            'type = "infrared_proximity"\nposition_m = [0.0, 0.0]\nheading_rad = {heading!r}\n'
            "rays = 1\nrange_m = 5.0\nsigma = 0.0",
        )
        + devices(
            lasers,
            'type = "laser_range_finder"\nposition_m = [0.0, 0.0]\nheading_rad = {heading!r}\nrays = 1\nsigma = 0.0',
        )
        + devices(needles, 'type = "heading_compass"\nsigma_rad = 0.0')
        + devices(ghosts, 'type = "odometer"')
    )
    corners = [list(corner) for corner in square(0, 0, 2 * HALF)]
    arena = tmp_path / "square.toml"
    arena.write_text(f'name = "square"\n[[outline]]\nname = "walls"\ncorners_m = {corners}\n')
    seen: dict[str, float | None] = {}

    def step(robot: Robot) -> None:
        seen.update({name: getattr(robot, name).reading for name in eyes})
        seen.update({name: getattr(robot, name).distances[0] for name in lasers})
        seen.update({name: getattr(robot, name).heading for name in needles + ghosts})

    result = boebot.run(step, robot, arena=arena, seconds=0.1, pose=(0.0, 0.0, 0.0))
    assert result.error is None
    expected = {name: proximity(to_the_wall(2 * math.pi * k / count)) for k, name in enumerate(eyes)}
    expected |= {name: to_the_wall(2 * math.pi * k / 3) for k, name in enumerate(lasers)}
    assert seen == pytest.approx(expected | dict.fromkeys(needles + ghosts, 0.0), abs=1e-9)


def crowded() -> VehicleModel:
    model = VehicleModel(ARSIM_BODY, ends_at_collision=False)
    model.dc_motors()
    for k in range(90):
        angle = 2 * math.pi * k / 90
        model.sensor("infrared_proximity", f"eye_{k}", beam=beam(heading=angle), range=5.0, c1=0.03, c2=0.1, sigma=0.01)
    for k in range(70):
        model.sensor("compass", f"needle_{k}", sigma=0.05)
    model.sensor("odometer", "odometer", sigma_step=1e-3)
    for k in range(70):
        model.sensor("odometer", f"ghost_{k}", sigma_step=1e-3)
    for k in range(6):  # the kind after the compass
        model.sensor("accelerometer", f"push_{k}", mass=0.01, stiffness=10.0, damping=0.5, range=20.0, sigma=1.0)
    return model


def test_noise_of_each_of_them_is_its_own() -> None:
    """Also beyond the 64th of a kind, and between kinds: no two share a draw; mean and spread are those of (3.1)."""
    vehicle = Vehicle(crowded(), arena_of(outline=square(0, 0, 2 * HALF)), seed=5)
    vehicle.step(0.0, 0.0)
    eyes = [vehicle[f"eye_{k}"] / proximity(to_the_wall(2 * math.pi * k / 90)) - 1.0 for k in range(90)]
    turns = [vehicle[f"ghost_{k}"][2] * 0.4 / 1e-3 for k in range(70)]  # of two draws
    pushes = [vehicle[f"push_{k}"] for k in range(6)]  # at rest
    draws = [*(eye / 0.01 for eye in eyes), *(vehicle[f"needle_{k}"] / 0.05 for k in range(70)), *turns, *pushes]
    assert np.diff(np.sort(np.abs(draws))).min() > 1e-9
    for part, spread in ((draws[:90], 1.0), (draws[90:160], 1.0), (turns, math.sqrt(2))):
        assert abs(np.mean(part)) < 4 * spread / math.sqrt(len(part))
        assert np.std(part) == pytest.approx(spread, rel=0.35)


def test_worlds_side_by_side_read_what_one_alone_reads() -> None:
    room = arena_of(outline=square(0, 0, 2 * HALF))
    batch = Batch(crowded(), room, np.zeros((9, 3)), np.arange(9))
    batch.step(np.tile((0.3, 0.5), (9, 1)), 40)
    alone = Vehicle(crowded(), room, seed=6)
    for _ in range(40):
        alone.step(0.3, 0.5)
    assert np.array_equal(batch.readings[6], np.array(alone.readings)) and batch.hashes()[6] == alone.hash()
