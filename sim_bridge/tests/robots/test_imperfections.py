"""What a robot's parts are like: drawn by seed, or kept by the unit's serial number."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boebot.description import robots
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.light import LightSensor
from boebot.devices.servo import ContinuousServo
from boebot.devices.turret import PositionServo
from boebot.errors import RobotError
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.compiled import ffi
from sim_bridge.devices import analog_infrared as analog_infrared_model
from sim_bridge.devices import compass as compass_model
from sim_bridge.devices import light as light_model
from sim_bridge.devices import servo as servo_model
from sim_bridge.devices import turret as turret_model
from sim_bridge.robots.imperfections import Draw

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

SHIELDBOT = robots.load_robot("shieldbot")
SHARP = robots.load_robot("boebot").device["analog_infrared"]


def parts(draw: Draw) -> list[bytes]:
    """All that is drawn of a robot, as the C structs have it."""
    servo = SHIELDBOT.device["servo_left"]
    turret = SHIELDBOT.device["turret"]
    light = SHIELDBOT.device["light_right"]
    assert isinstance(servo, ContinuousServo) and isinstance(turret, PositionServo)
    assert isinstance(light, LightSensor) and isinstance(SHARP, SharpSensor)
    made: list[Any] = [
        servo_model.servo_parameters(servo, SHIELDBOT.body, 0, draw),
        analog_infrared_model.analog_infrared_parameters(SHARP, draw),
        light_model.light_parameters(light, 1, draw),
        compass_model.compass_parameters(draw),
        turret_model.turret_parameters(turret, draw),
    ]
    return [bytes(ffi.buffer(each)) for each in made]


def test_a_unit_is_the_same_under_every_seed_and_number() -> None:
    first = parts(Draw(1, True, robot=0, unit=7))
    assert first == parts(Draw(99, True, robot=3, unit=7))
    assert all(one != other for one, other in zip(first, parts(Draw(1, True, unit=8)), strict=True))
    assert all(one != other for one, other in zip(first, parts(Draw(1, True)), strict=True))


def test_without_a_unit_the_seed_and_the_number_draw() -> None:
    assert parts(Draw(1, True)) == parts(Draw(1, True))
    for other in (Draw(2, True), Draw(1, True, robot=1)):
        assert all(one != two for one, two in zip(parts(Draw(1, True)), parts(other), strict=True))


def test_unit_zero_is_nominal() -> None:
    """As without noise, where only the draws are meant: the servo and the turret have no noise of their own."""
    nominal, ideal = parts(Draw(5, True, unit=0)), parts(Draw(5, False))
    assert nominal[0] == ideal[0] and nominal[4] == ideal[4]


def test_units_are_spread_as_their_figures_say() -> None:
    draws = np.array([Draw(1, True, unit=unit)(66, 0) for unit in range(1, 4001)])
    assert abs(draws.mean()) < 4 / np.sqrt(4000) and abs(draws.std() - 1) < 4 / np.sqrt(8000)


def test_a_run_of_a_unit_differs_by_its_noise_only(tmp_path: Path) -> None:
    """Straight ahead the unit's own servos pull to the same side and by the same amount, whatever the seed."""

    def bend(unit: str, seed: int) -> float:
        path = tmp_path / f"unit{len(unit)}.toml"
        path.write_text(f'extends = "shieldbot"\nname = "one"\n{unit}\n')
        result = execute(
            Request.single(lambda robot: robot.drive(0.8, 0.8), robot=path, arena="empty", seconds=3, seed=seed)
        )
        assert result.error is None and result.truth is not None
        return float(result.truth.heading[-1] - result.truth.heading[0])

    kept = [bend("unit = 3", seed) for seed in (1, 2, 3)]
    drawn = [bend("", seed) for seed in (1, 2, 3)]
    assert np.ptp(kept) < 0.2 * np.ptp(drawn), (kept, drawn)


@pytest.mark.parametrize("unit", ["-1", "1.5", '"seven"', str(1 << 32)])
def test_wrong_units_get_a_sentence(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "wrong.toml"
    path.write_text(f'extends = "shieldbot"\nname = "wrong"\nunit = {unit}\n')
    with pytest.raises(RobotError, match="unit: expected"):
        robots.load_robot(path)
