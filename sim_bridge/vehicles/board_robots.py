"""Robots with boards in worlds without boards: the same servos and sensors, and the firmware's map from motor signal to
pulse. What firmware, line and supply do besides is left out: docs/how-to/thousands-of-runs.md has the differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from boebot.description.robots import RobotDescription
from boebot.devices.servo import PULSE_SCALE_US, ContinuousServo
from boebot.errors import BoardError, RobotError
from boebot.imperfections import imperfections
from boebot.running.driver import TICK_S
from sim_bridge.compiled import ffi
from sim_bridge.devices.catalogue import add_to, has_part
from sim_bridge.devices.servo import servo_parameters
from sim_bridge.robots.imperfections import Draw

if TYPE_CHECKING:
    from sim_bridge.vehicles.model import VehicleModel

BOARD_STEP_S: Final = TICK_S / 2  # of the world, unless wished otherwise
NUMBER: Final = 0  # of the first robot of a run: there the same seed is the same unit


def join_board(model: VehicleModel, robot: RobotDescription, given: Mapping[str, float], *, noise: bool) -> None:
    """Adds servos and sensors of a robot with a board to its model. `given`: imperfections that were asked for.

    Raises:
        RobotError: it has a device that is modelled at its board only, or the step does not divide the control tick.
        BoardError: one of its imperfections would change nothing.
        CallError: nothing of the kit's runs on its board.
    """
    robot.expect_kit()
    who = f"robot {robot.name!r}"
    if not (TICK_S / model.dt).is_integer():
        raise RobotError(f"{who}: dt = {model.dt:g} s; expected a whole part of its control tick, {TICK_S:g} s")
    if robot.supply is not None and robot.supply.servos == "pack":
        raise RobotError(
            f"{who}: its servos run on the pack, which is modelled at its board only; expected 'regulated'"
        )
    for name, device in robot.device.items():
        if device.on and (not device.plugged or device.has_messages(robot.device) or not _add(model, name, device)):
            kind = device.__struct_config__.tag
            raise RobotError(f"device.{name} of {who} ({kind}) is modelled at its board only; expected boebot.run")
    servos = [device for device in robot.device.values() if device.on and isinstance(device, ContinuousServo)]
    if len(servos) != len(ContinuousServo.NAMES):
        raise RobotError(f"{who} has {len(servos)} servos that are on; expected {' and '.join(ContinuousServo.NAMES)}")
    servos.sort(key=lambda servo: servo is robot.device["servo_right"])

    def servos_of(draw: Draw) -> list[Any]:
        return [servo_parameters(servo, robot.body, side, draw) for side, servo in enumerate(servos)]

    def unit(seed: int) -> list[Any]:
        return servos_of(Draw(seed, noise, NUMBER, robot.unit, robot.imperfections))

    model.board_servos(servos_of(model.draw), unit, [_motion_map(servo) for servo in servos])
    for name, value in (robot.imperfections | dict(given)).items():
        row = imperfections()[name]
        is_used = name in model.draw.used or (row.key and "supply" not in row.of)
        if not is_used and not (row.switch and value == row.neutral):
            raise BoardError(f"imperfections: {name} changes nothing of {who} without its board; expected boebot.run")


def _add(model: VehicleModel, name: str, device: Any) -> bool:
    """Whether there is a model of it, or no need of one."""
    if isinstance(device, ContinuousServo):
        return True
    return add_to(model, name, device) or not (has_part(device) or device.READING)


def _motion_map(servo: ContinuousServo) -> Any:
    """As the board's parameters have it."""
    return ffi.new("motion_map *", [round(servo.centre_us / PULSE_SCALE_US), round(servo.gain_us / PULSE_SCALE_US)])
