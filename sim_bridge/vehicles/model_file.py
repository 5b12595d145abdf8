"""Models of vehicles from robots' files: what `boebot run --robot arsim` drives, and what scripts drive by themselves.

protocol/robots/arsim.toml is the one source of the notes' default robot; `arsim()` builds it. Keys and defaults of the
devices are those in boebot/devices.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from boebot.arguments import shown
from boebot.description import robots
from boebot.devices.infrared import InfraredProximity
from boebot.devices.motor import DcMotor, Motor, RegulatedMotor
from boebot.errors import RobotError
from sim_bridge.devices.catalogue import add_to
from sim_bridge.devices.motor import dc_parameters, regulated_parameters
from sim_bridge.robots.imperfections import Draw, applied, body_numbers
from sim_bridge.vehicles import STEP_S
from sim_bridge.vehicles.board_robots import BOARD_STEP_S, join_board
from sim_bridge.vehicles.checked_structs import FINITE, number
from sim_bridge.vehicles.model import SIDES, VehicleModel


def vehicle_model(
    robot: str | Path | robots.RobotDescription,
    *,
    dt: float | None = None,
    noise: bool = True,
    ends_at_collision: bool = False,
    without: Sequence[str] = (),
    imperfections: Mapping[str, float] | None = None,
) -> VehicleModel:
    """The model of a robot: a bundled name, a .toml file, or its description. Of one with a board it is that of its
    servos and sensors, without the board (docs/how-to/thousands-of-runs.md).

    Touching something does not end a run, as with `boebot run`, unless `ends_at_collision`. `without` and
    `imperfections` as of `boebot.run`. `dt`: s, of a step; None: 0.01, with a board half of its control tick.

    Raises:
        RobotError: no such robot, a device that is modelled at its board only, or a parameter outside its range.
        BoardError: an imperfection is none, is out of its range, or changes nothing of this robot.
    """
    described = robot if isinstance(robot, robots.RobotDescription) else robots.load_robot(_file(robot))
    described = applied(described, without, imperfections, noise=noise)
    body: dict[str, Any] = body_numbers(described.body)
    if described.scheme == "arsim":
        body["axis_half_track"] = body["half_track"] / 2  # as its UpdateMotorAxisAngularSpeed has it
    draw = Draw(0, False, magnitudes=described.imperfections)
    slips = described.body.tyre_slip
    body["slip"] = int(described.has_board if slips is None else slips)
    if described.has_board:
        body["spin_inertia"] = draw["spin_inertia_kg_m2"]
        dt = BOARD_STEP_S if dt is None else dt
    if described.body.outline_m:
        body["outline_m"] = described.body.outline_m
    model = VehicleModel(body, dt=STEP_S if dt is None else dt, noise=noise, ends_at_collision=ends_at_collision)
    model.robot, model.draw = described, draw
    if described.has_board:
        join_board(model, described, imperfections or {}, noise=noise)
        return model
    _drive(model, described)
    for name, device in described.device.items():
        if device.on and not isinstance(device, Motor) and not add_to(model, name, device):
            raise RobotError(f"device.{name} is no device of a robot without a board")
    return model


def _file(robot: Any) -> str | Path:
    if not isinstance(robot, str | Path):
        raise RobotError(f"vehicle: robot is {shown(robot)}; expected a robot's name, file or description")
    return robot


def _drive(model: VehicleModel, robot: robots.RobotDescription) -> None:
    match tuple(robot.device[f"motor_{side}"] for side in SIDES):
        case (DcMotor() as left, DcMotor() as right):
            model.dc_motors(dc_parameters(left), dc_parameters(right), full=left.full or right.full)
        case (RegulatedMotor() as left, RegulatedMotor() as right):
            most = robot.body.wheel_speed_maximum_m_s
            model.regulated_motors(regulated_parameters(left, most), regulated_parameters(right, most))
        case motors:
            kinds = [motor.__struct_config__.tag for motor in motors]
            raise RobotError(f"robot {robot.name!r}: motors of types {kinds}; expected two of one type")


# ---- the notes' default robot ----------------------------------------------------------------------------------------

ARSIM: Final = robots.load_robot("arsim")
ARSIM_BODY: Final = body_numbers(ARSIM.body)
"""Its body, for models with other drives and sensors."""


def arsim(
    *,
    dt: float = STEP_S,
    noise: bool = True,
    ends_at_collision: bool = True,
    infrared_rad: Sequence[float] | None = None,
    rays: int | None = None,
    odometer_sigma: float | None = None,
    compass_sigma: float | None = None,
) -> VehicleModel:
    """The notes' default robot, by protocol/robots/arsim.toml (notes, sections 3.2.3, 3.2.4, Fig. 3.6, appendix A).

    3 kg, two 12 V DC motors, IR sensors of three rays on the body's circle at +-0.7854 rad, odometer, compass.
    Readings: infrared_left, infrared_right (infrared_0 ... where there are not two), odometer (x, y, heading), compass.

    Args:
        dt: s, of a step.
        noise: False switches all of it off.
        ends_at_collision: whether touching something ends a run, as in ARSim.
        infrared_rad: other angles of the IR sensors, from straight ahead to the left.
        rays: of each of them.
        odometer_sigma: m, ARSim's noise of the odometer.
        compass_sigma: rad, noise of the compass.

    Raises:
        RobotError: a number outside its range.
    """
    device = dict(ARSIM.device)
    sensors = {name: kind for name, kind in device.items() if isinstance(kind, InfraredProximity)}
    if infrared_rad is not None:
        sensors = _turned(next(iter(sensors.values())), infrared_rad)
    if rays is not None:
        sensors = {name: msgspec.structs.replace(sensor, rays=rays) for name, sensor in sensors.items()}
    if odometer_sigma is not None:
        device["odometer"] = msgspec.structs.replace(device["odometer"], sigma_step_m=odometer_sigma)
    if compass_sigma is not None:
        device["compass"] = msgspec.structs.replace(device["compass"], sigma_rad=compass_sigma)
    others = {name: kind for name, kind in device.items() if not isinstance(kind, InfraredProximity)}
    robot = msgspec.structs.replace(ARSIM, device=sensors | others)
    return vehicle_model(robot, dt=dt, noise=noise, ends_at_collision=ends_at_collision)


def _turned(sensor: Any, angles: Any) -> dict[str, Any]:
    """That IR sensor at each of the angles, on the body's circle."""
    try:
        listed = None if isinstance(angles, str | bytes) else list(angles)
    except TypeError:
        listed = None
    if listed is None:
        raise RobotError(f"arsim: infrared_rad is {shown(angles)}; expected a list of angles (rad)")
    turned = [number("arsim", f"infrared_rad[{index}]", angle, FINITE) for index, angle in enumerate(listed)]
    names = SIDES if len(turned) == 2 else tuple(map(str, range(len(turned))))
    radius = ARSIM.body.radius_m
    return {
        f"infrared_{name}": msgspec.structs.replace(
            sensor, position_m=(radius * math.cos(angle), radius * math.sin(angle)), heading_rad=angle
        )
        for name, angle in zip(names, turned, strict=True)
    }
