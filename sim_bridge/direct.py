"""A robot without a board in a simulated world, as the host opens it: a vehicle built from the robot's description.

`open_direct` is what the entry point of the group `boebot.vehicles` names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from boebot import robots, vehicle_devices
from boebot.boards import BoardRequest, Truth
from boebot.errors import RobotError
from sim_bridge import imperfections
from sim_bridge.arena import load_arena
from sim_bridge.floor_plan import floor_plan
from sim_bridge.switches import idealised
from sim_bridge.vehicle import Vehicle, VehicleModel, beam

STEP_S = 0.01  # THEORY section 2.4
DEFAULT_ARENA = "arsim"


class DirectSession:
    """An opened vehicle (VehicleSession of boebot.boards)."""

    tick_s = STEP_S

    def __init__(self, vehicle: Vehicle, record: bool = True) -> None:
        self.vehicle = vehicle
        self.arena = vehicle.arena
        self.layout: Mapping[str, slice] = dict(vehicle.model.names)
        self.description = f"robot without a board in arena {vehicle.arena.name}"
        self._rows: list[tuple[float, ...]] | None = [] if record else None
        self._note()

    def _note(self) -> None:
        if self._rows is not None:
            body = self.vehicle.body
            self._rows.append((body.x, body.y, body.heading, body.rim_left, body.rim_right, body.touching))

    def readings(self) -> tuple[float, ...]:
        """All readings now."""
        return tuple(self.vehicle.readings)

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals."""
        self.vehicle.step(left, right)
        self._note()

    @property
    def ended(self) -> str:
        """Why it can go no further, or ""."""
        return self.vehicle.ended

    def truth(self) -> Truth | None:
        """What happened so far; None without recording."""
        if self._rows is None:
            return None
        x, y, heading, left, right, touching = np.array(self._rows, dtype=np.float64).reshape(-1, 6).T
        time = np.arange(len(x), dtype=np.float64) * self.tick_s
        return Truth(
            time=time,
            x=x,
            y=y,
            heading=heading,
            contact=touching > 0,
            left_speed=left,
            right_speed=right,
            plan=floor_plan(self.arena, 0.0, float(time[-1])),
        )

    def counters(self) -> Mapping[str, float]:
        """`distance` (m) and `time` (s)."""
        return {"distance": float(self.vehicle.body.distance), "time": self.vehicle.time}

    def close(self) -> None:
        """Nothing is held beyond the vehicle's memory."""


def open_direct(request: BoardRequest) -> DirectSession:
    """Opens a robot without a board.

    Raises:
        RobotError: its description is none of such a robot.
        ArenaError: no such arena, or its start is not free.
        BoardError: no such imperfection.
    """
    arena = load_arena(request.arena or DEFAULT_ARENA)
    model = vehicle_model(request.robot, noise=request.noise, without=request.without)
    return DirectSession(Vehicle(model, arena, pose=request.start_pose, seed=request.seed), request.record)


def vehicle_model(robot: robots.RobotDescription, *, noise: bool = True, without: Sequence[str] = ()) -> VehicleModel:
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
        dt=STEP_S,
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


def _add(model: VehicleModel, name: str, device: robots.Device, body: robots.Body) -> None:
    """Adds a sensor or a battery."""
    match device:
        case vehicle_devices.InfraredProximity():
            look = beam(*device.position_m, device.heading_rad, device.beam_rad, device.rays, device.height_m)
            model.infrared_proximity(
                name,
                period=device.period_s,
                beam=look,
                range=device.range_m,
                c1=device.c1_m2,
                c2=device.c2,
                sigma=device.sigma,
            )
        case vehicle_devices.Sonar():
            look = beam(*device.position_m, device.heading_rad, device.beam_rad, device.rays, device.height_m)
            model.sonar(
                name,
                period=device.period_s,
                beam=look,
                range_minimum=device.range_min_m,
                range_maximum=device.range_max_m,
                sigma=device.sigma,
                miss=device.miss,
            )
        case vehicle_devices.Laser():
            x, y = device.position_m
            model.laser(
                name,
                period=device.period_s,
                x=x,
                y=y,
                heading=device.heading_rad,
                height=device.height_m,
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
            x, y = device.position_m
            model.light(
                name,
                period=device.period_s,
                x=x,
                y=y,
                heading=device.heading_rad,
                height=device.height_m,
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
