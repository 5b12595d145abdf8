"""Models of vehicles from robots' files: one source of the notes' default robot, and the runner drives the same."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.arenas import load_arena
from boebot.description.robots import load_robot
from boebot.errors import BoardError, RobotError
from sim_bridge.tests.simulated import arena_of
from sim_bridge.vehicle import Vehicle
from sim_bridge.vehicles.model import beam
from sim_bridge.vehicles.model_file import ARSIM_BODY, arsim, vehicle_model


def signals(time: float) -> tuple[float, float]:
    return 0.4 + 0.3 * math.sin(3 * time), 0.5 - 0.2 * math.cos(time)


@pytest.mark.parametrize("source", ["file", "function"])
@pytest.mark.parametrize("seed", [1, 6])
def test_vehicle_is_the_run_of_boebot_run(source: str, seed: int) -> None:
    """Bit for bit: poses, wheel speeds and every reading, noise included, of 5 s in the notes' arena."""
    seen: list[tuple[float, ...]] = []

    def brain(robot: Any) -> None:
        seen.append(
            (robot.infrared_left.reading, robot.infrared_right.reading, robot.odometer.x, robot.compass.heading)
        )
        robot.drive(*signals(robot.time))

    result = boebot.run(brain, robot="arsim", arena="arsim", seconds=5, seed=seed, period=0.01)
    assert result.error is None and result.truth is not None and result.truth.left_speed is not None
    model = vehicle_model("arsim") if source == "file" else arsim(ends_at_collision=False)
    vehicle = Vehicle(model, load_arena("arsim"), seed=seed)
    rows, readings = [], []
    for step in range(500):
        readings.append((*(vehicle[f"infrared_{side}"] for side in ("left", "right")), *vehicle.readings[2:6:3]))
        vehicle.step(*signals(0.01 * step))
        rows.append((*vehicle.true_pose, vehicle.body.rim_left))
    x, y, heading, left = np.array(rows).T
    truth = result.truth
    assert len(truth.x) == 501 and len(seen) == 500
    for mine, theirs in ((x, truth.x), (y, truth.y), (heading, truth.heading), (left, truth.left_speed)):
        assert theirs is not None and np.array_equal(mine, theirs[1:])
    assert np.array_equal(np.array(readings), np.array(seen))


def test_default_robot_is_that_of_the_notes() -> None:
    """The values of ARSim 1.1.9 (docs/reference/notes.md) against the file that everybody reads."""
    assert ARSIM_BODY == {
        "mass": 3.0, "inertia": 0.2, "radius": 0.2, "half_track": 0.2, "wheel_radius": 0.1, "wheel_mass": 0.0,
        "wheel_inertia": 0.0, "linear_damping": 1.0, "angular_damping": 0.1, "grip": 0.7,
    }  # fmt: skip
    model = arsim()
    assert list(model.names) == ["infrared_left", "infrared_right", "odometer", "compass"]
    for side, angle in (("left", 0.7854), ("right", -0.7854)):
        look, reach = model.looks[f"infrared_{side}"]
        place = beam(0.2 * math.cos(angle), 0.2 * math.sin(angle), angle, 0.5, 3)
        assert dict(look) == place and reach == 1.0
    motor = load_robot("arsim").device["motor_left"]
    values = [getattr(motor, name) for name in motor.__struct_fields__ if name not in ("on", "plugged", "full")]
    assert values == [0.0333, 0.0333, 0.62, 0.0002, 0.008, 0.02, 2.0, 1.0, 1.0, 12.0]


def test_arsim_with_other_sensors() -> None:
    model = arsim(infrared_rad=(0.0, 1.0, -1.0), rays=5, odometer_sigma=1e-3, compass_sigma=0.0)
    assert list(model.names) == ["infrared_0", "infrared_1", "infrared_2", "odometer", "compass"]
    assert [look["rays"] for look, _ in model.looks.values()] == [5, 5, 5]
    assert model.looks["infrared_1"][0]["y"] == pytest.approx(0.2 * math.sin(1.0))
    vehicle = Vehicle(model, arena_of())
    vehicle.step(0.0, 0.0)
    assert vehicle["compass"] == 0.0 and vehicle["odometer"][0] != 0.0
    with pytest.raises(RobotError, match=r"infrared_rad\[1\] is nan; expected a finite number"):
        arsim(infrared_rad=(0.0, math.nan))
    with pytest.raises(RobotError, match="infrared_rad is 3; expected a list of angles"):
        arsim(infrared_rad=3)  # type: ignore[arg-type]
    with pytest.raises(RobotError, match="rays is 0; expected a whole number from 1 to 32"):
        arsim(rays=0)


def test_a_file_of_ones_own(tmp_path: Path) -> None:
    file = tmp_path / "heavy.toml"
    file.write_text('extends = "arsim"\nname = "heavy"\n[body]\nmass_kg = 6.0\n')
    assert vehicle_model(file).body["mass"] == 6.0 == vehicle_model(str(file)).body["mass"]
    assert vehicle_model(load_robot(file), without=("slip",)).body["grip"] == 10.0


def test_robots_that_are_no_vehicles_are_refused() -> None:
    with pytest.raises(RobotError, match="there is no robot 'nobody'"):
        vehicle_model("nobody")
    with pytest.raises(RobotError, match="robot is 3; expected a robot's name, file or description"):
        vehicle_model(3)  # type: ignore[arg-type]
    with pytest.raises(BoardError, match="no imperfection 'nothing'"):
        vehicle_model("arsim", without=("nothing",))
