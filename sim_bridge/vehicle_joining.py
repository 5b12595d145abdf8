"""The devices of a robot's description as motors, sensors and battery of a vehicle without a board."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from boebot import robots, vehicle_devices
from boebot.errors import RobotError
from sim_bridge import imperfections
from sim_bridge.switches import idealised
from sim_bridge.vehicle import VehicleModel, beam

STEP_S = 0.01  # THEORY section 2.4


def vehicle_model(
    robot: robots.RobotDescription, *, dt: float = STEP_S, noise: bool = True, without: Sequence[str] = ()
) -> VehicleModel:
    """The vehicle of a description; touching something does not end its run. `without`: names of switches.py.

    Raises:
        RobotError: a device that no vehicle has, or a parameter outside its range.
        BoardError: no such imperfection.
    """
    robot, body = idealised(robot, without), robot.body
    model = VehicleModel(
        {
            "mass": body.mass_kg,
            "inertia": body.inertia_kg_m2,
            "radius": body.radius_m,
            "half_track": body.track_width_m / 2,
            "wheel_radius": body.wheel_radius_m,
            "wheel_mass": body.wheel_mass_kg,
            "wheel_inertia": body.wheel_inertia_kg_m2,
            "linear_damping": body.linear_damping_n_s_m,
            "angular_damping": body.angular_damping_n_m_s,
            "grip": imperfections.Draw(0, noise, without=without)["TYRE_GRIP"],
        },
        dt=dt,
        noise=noise,
        ends_at_collision=False,
    )
    left, right = robot.device["motor_left"], robot.device["motor_right"]
    assert isinstance(left, vehicle_devices.DcMotor) and isinstance(right, vehicle_devices.DcMotor)
    model.dc_motors(_motor(left), _motor(right))
    for name, device in robot.device.items():
        if device.on and not isinstance(device, vehicle_devices.DcMotor):
            _add(model, name, device, body)
    return model


def _motor(motor: vehicle_devices.DcMotor) -> dict[str, float]:
    return {
        "torque_constant": motor.torque_constant_n_m_a,
        "emf_constant": motor.emf_constant_v_s,
        "resistance_ohm": motor.resistance_ohm,
        "inductance_h": motor.inductance_h,
        "coulomb_n_m": motor.coulomb_friction_n_m,
        "viscous_n_m_s": motor.viscous_friction_n_m_s,
        "gear": motor.gear,
        "efficiency": motor.efficiency,
        "torque_maximum_n_m": motor.torque_maximum_n_m,
        "voltage_maximum": motor.voltage_maximum_v,
    }


def _beam(device: vehicle_devices.InfraredProximity | vehicle_devices.Sonar) -> dict[str, Any]:
    """How often it looks, from where and how wide."""
    look = beam(*device.position_m, device.heading_rad, device.beam_rad, device.rays, device.height_m)
    return {"period": device.period_s, "beam": look}


def _place(device: vehicle_devices.Laser | vehicle_devices.Phototransistor) -> dict[str, float]:
    """How often it looks, and from where."""
    x, y = device.position_m
    return {"period": device.period_s, "x": x, "y": y, "heading": device.heading_rad, "height": device.height_m}


def _add(model: VehicleModel, name: str, device: robots.Device, body: robots.Body) -> None:
    """Adds a sensor or a battery."""
    match device:
        case vehicle_devices.InfraredProximity():
            model.infrared_proximity(
                name,
                **_beam(device),
                range=device.range_m,
                c1=device.c1_m2,
                c2=device.c2,
                sigma=device.sigma,
            )
        case vehicle_devices.Sonar():
            model.sonar(
                name,
                **_beam(device),
                range_minimum=device.range_min_m,
                range_maximum=device.range_max_m,
                sigma=device.sigma,
                miss=device.miss,
            )
        case vehicle_devices.Laser():
            model.laser(
                name,
                **_place(device),
                first=device.step_rad * (device.rays - 1) / 2,
                step=device.step_rad,
                rays=device.rays,
                range=device.range_m,
                sigma=device.sigma,
            )
        case vehicle_devices.Odometer():
            track = {"half_track": body.track_width_m / 2, "wheel_radius": body.wheel_radius_m}
            model.odometer(name, sigma_step=device.sigma_step_m, **track)
        case vehicle_devices.HeadingCompass():
            model.compass(name, period=device.period_s, sigma=device.sigma_rad, bias=device.bias_rad)
        case vehicle_devices.Accelerometer():
            model.accelerometer(
                name,
                period=device.period_s,
                mass=device.proof_mass_kg,
                stiffness=device.stiffness_n_m,
                damping=device.damping_n_s_m,
                range=device.range_m_s2,
                sigma=device.sigma_m_s2,
                bias=device.bias_m_s2,
            )
        case vehicle_devices.Phototransistor():
            model.light(
                name,
                **_place(device),
                near_distance=device.near_distance_m,
                ambient=device.ambient,
                sigma=device.sigma,
                gain=1.0,
            )
        case vehicle_devices.TouchWhisker():
            model.whisker(name, device.root_m, device.tip_m)
        case vehicle_devices.Energy():
            model.battery(
                name,
                empty=device.empty_v,
                full=device.full_v,
                sigma=device.sigma_v,
                idle_per_s=device.idle_per_s,
                signal_per_s=device.signal_per_s,
                charger_per_s=device.charger_per_s,
            )
        case _:
            raise RobotError(f"device.{name} is no device of a robot without a board")
