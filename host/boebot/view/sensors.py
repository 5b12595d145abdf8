"""Where a robot's sensors sit and which way they look, as pictures show it: those that it has, and that are on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from boebot.description import robots
from boebot.devices import vehicle_devices
from boebot.devices.analog_infrared import RANGE_MAX_M

Kind = Literal["infrared", "sonar", "analog_infrared", "laser", "light"]
Point = tuple[float, float]


@dataclass(frozen=True)
class Look:
    """A sensor that looks somewhere; lengths in m, angles in rad, in the robot's frame.

    Attributes:
        beam: its full opening; 0: a single ray. reach: how far it sees; 0: no matter how far.
        axis: of the turret that it sits on, or None.
    """

    device: str
    kind: Kind
    position: Point
    heading: float
    beam: float
    reach: float
    axis: Point | None = None


def looks(robot: robots.RobotDescription) -> list[Look]:
    """All of them, in the order of the description."""
    turret = robot.device.get("turret")
    axis = turret.position_m if isinstance(turret, robots.PositionServo) and turret.on else None
    found = (_look(name, device, axis) for name, device in robot.device.items() if device.on)
    return [look for look in found if look is not None]


def _look(name: str, device: robots.AnyDevice, axis: Point | None) -> Look | None:
    match device:
        case robots.InfraredPair() | vehicle_devices.InfraredProximity():
            return Look(name, "infrared", device.position_m, device.heading_rad, device.beam_rad, device.range_m)
        case robots.Ping():
            return Look(name, "sonar", device.position_m, device.heading_rad, device.beam_rad, device.range_max_m, axis)
        case vehicle_devices.Sonar():
            return Look(name, "sonar", device.position_m, device.heading_rad, device.beam_rad, device.range_max_m)
        case robots.AnalogInfrared():
            return Look(name, "analog_infrared", device.position_m, device.heading_rad, 0.0, RANGE_MAX_M)
        case vehicle_devices.Laser():
            beam = device.step_rad * (device.rays - 1)
            return Look(name, "laser", device.position_m, device.heading_rad, beam, device.range_m)
        case robots.LightSensor() | vehicle_devices.Phototransistor():
            return Look(name, "light", device.position_m, device.heading_rad, 0.0, 0.0)
    return None


def whiskers(robot: robots.RobotDescription) -> dict[str, tuple[Point, Point]]:
    """Root and tip of each, by name."""
    return {
        name: (device.root_m, device.tip_m)
        for name, device in robot.device.items()
        if device.on and isinstance(device, robots.Whisker | vehicle_devices.TouchWhisker)
    }
