"""Vehicles without boards: motor signals in, readings out, as the notes' simulator ARSim drives its robot.

A `VehicleModel` says what a vehicle is made of; a `Vehicle` is one of them in one world. `batch.py` steps many worlds
at once. Models are sim_bridge/vehicles/model.h, the order of events in a step is Fig. 3.1 of the notes (vehicle.h).
Lengths in m, angles in rad, SI units; motor signals in [-1, 1], left and right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from boebot.errors import BrainError, RobotError
from sim_bridge import arguments, worlds
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.motor import DCMotor

Brain = Callable[["Vehicle"], tuple[float, float]]
Stage = Callable[[str, "Vehicle"], None]

STAGES: Final = ("sense", "process", "send", "move", "arena", "check")  # of a step, Fig. 3.1
ENDS: Final[dict[int, str]] = {
    lib.VEHICLE_RUNS: "",
    lib.VEHICLE_COLLIDED: "collision",
    lib.VEHICLE_EXHAUSTED: "battery empty",
    lib.VEHICLE_BRAIN_FAILED: "brain failed",
}

# The default robot of ARSim (THEORY section 1.2).
ARSIM_BODY: Final = {
    "mass": 3.0,
    "inertia": 0.2,
    "radius": 0.20,
    "half_track": 0.20,
    "wheel_radius": 0.10,
    "wheel_mass": 0.0,
    "wheel_inertia": 0.0,
    "linear_damping": 1.0,
    "angular_damping": 0.1,
    "grip": 0.7,
}
SPEED_MAXIMUM: Final = 99.9  # m/s, at the start
TURN_RATE_MAXIMUM: Final = 999.9  # rad/s
ARSIM_INFRARED_RAD: Final = 0.7854  # left and right of straight ahead
ARSIM_INFRARED: Final = {"range": 1.0, "c1": 0.03, "c2": 0.1, "sigma": 0.01}


def beam(
    x: float = 0.0, y: float = 0.0, heading: float = 0.0, opening: float = 0.0, rays: int = 1, height: float = 0.06
) -> dict[str, float]:
    """Where a sensor is on the body and what it sees (beam.h)."""
    return {"x": x, "y": y, "heading": heading, "opening": opening, "height": height, "rays": rays}


class VehicleModel:
    """What a vehicle is made of; any number of worlds share one.

    Parameters are those of the C structs of the same names in sim_bridge/world; a wrong one raises RobotError.
    """

    def __init__(
        self, body: Mapping[str, float], *, dt: float = 0.01, noise: bool = True, ends_at_collision: bool = True
    ) -> None:
        self.dt = dt
        self.names: dict[str, slice] = {}
        """Readings by name: where they stand among all readings."""
        self.looks: dict[str, tuple[Mapping[str, float], float]] = {}
        """Sensors with a beam by name: the beam, and how far it reaches (m)."""
        self.body = dict(body)
        self.in_use = False
        self._keep: list[Any] = []
        parameters = ffi.new("body_parameters *", self.body)
        handle = lib.vehicle_model_new(parameters, dt)
        if handle == ffi.NULL:
            raise RobotError(
                f"vehicle: body {dict(body)} with dt = {dt} s; expected dt > 0, positive mass, inertia, radius, "
                "half_track and wheel_radius, and no negative number"
            )
        self.a: float = lib.body_a(parameters)  # 1/m, (2.26)
        self.b: float = lib.body_b(parameters)  # (2.30)
        self.handle = ffi.gc(handle, lib.vehicle_model_destroy)
        lib.vehicle_model_switch(self.handle, noise, ends_at_collision)

    @property
    def euler_limit(self) -> float:
        """The step, s, from which on Euler's method diverges."""
        return float(lib.vehicle_model_euler_limit(self.handle))

    @property
    def _open(self) -> Any:
        """The C model, while it may still grow: worlds have room for what it was when they were made."""
        if self.in_use:
            raise RobotError(
                "vehicle: worlds of this model exist; expected all of its devices before the first of them"
            )
        return self.handle

    def _done(self, status: int, what: str) -> int:
        if status >= 0:
            return status
        if status == lib.VEHICLE_BAD_STEP:
            limit = lib.vehicle_model_euler_limit(self.handle)
            raise RobotError(
                f"vehicle: dt = {self.dt:g} s; expected less than {limit:.4g} s, the Euler limit of its {what}"
            )
        if status == lib.VEHICLE_TOO_MANY:
            raise RobotError(f"vehicle: no room for {what}; expected at most 24 sensors, one drive and one battery")
        raise RobotError(f"vehicle: {what} has a number that is not finite or outside its range")

    def _add(self, name: str, first: int, count: int = 1) -> None:
        self._done(first, f"sensor {name!r}")
        if name in self.names:
            raise RobotError(f"vehicle: two sensors named {name!r}; expected different names")
        self.names[name] = slice(first, first + count)

    def dc_motors(self, left: Mapping[str, float] | None = None, right: Mapping[str, float] | None = None) -> None:
        """Two DC motors (1.6)-(1.10); what is not said is as in the notes' default motor."""
        motors = [DCMotor(**(changes or {})).parameters for changes in (left, right)]
        self._done(lib.vehicle_model_drive_dc(self._open, *motors, 0), "DC motors")

    def servos(self, left: Any, right: Any) -> None:
        """Two continuous-rotation servos (C structs servo_motor_parameters) driven by signal: 1500 us +- 200 us s."""
        self._done(lib.vehicle_model_drive_servo(self._open, left, right), "servos")

    def battery(
        self, name: str, *, empty: float = 5.0, full: float = 7.75, sigma: float = 0.0, **energy: float
    ) -> None:
        """The notes' battery, read as a voltage; `energy`: idle_per_s, signal_per_s, charger_per_s."""
        parameters = ffi.new("energy_parameters *")
        lib.energy_default(parameters)
        for key, value in energy.items():
            setattr(parameters, key, value)
        self._add(name, lib.vehicle_model_battery(self._open, parameters, empty, full, sigma))

    def _sensor(self, kind: str, name: str, parameters: Mapping[str, Any], *period: float, count: int = 1) -> None:
        adder = getattr(lib, f"vehicle_model_add_{kind}")
        self._add(name, adder(self._open, ffi.new(f"{kind}_parameters *", dict(parameters)), *period), count)
        if "beam" in parameters:
            reach = (parameters[key] for key in ("range", "range_maximum", "reach") if key in parameters)
            self.looks[name] = (parameters["beam"], float(next(reach, 0.0)))

    def infrared_proximity(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """The notes' IR sensor: beam, range, c1, c2, sigma, reflectance. One reading in [0, 1]."""
        self._sensor("infrared_proximity", name, parameters, period)

    def sharp_infrared(self, name: str, **parameters: Any) -> None:
        """Sharp GP2D12: beam, reach, sigma, gain, period, late. One reading, V."""
        self._sensor("sharp_infrared", name, parameters)

    def sonar(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Sonar: beam, range_minimum, range_maximum, sigma, miss, ... One reading, m; D_max: nothing heard."""
        self._sensor("sonar", name, parameters, period)

    def laser(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Laser range finder: first, step, rays, range, sigma, height. A reading a ray, m; -1: beyond the range."""
        self._sensor("laser", name, parameters, period, count=int(parameters.get("rays", 0)))

    def compass(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Compass: sigma, bias, iron_x, iron_y, current_x, current_y. One reading, rad."""
        self._sensor("compass", name, parameters, period)

    def accelerometer(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Accelerometer along the heading: mass, stiffness, damping, range, sigma, bias. One reading, m/s^2."""
        self._sensor("accelerometer", name, parameters, period)

    def light(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Phototransistor: x, y, heading, height, near_distance, ambient, sigma, gain. One reading."""
        self._sensor("phototransistor", name, parameters, period)

    def odometer(self, name: str, **parameters: Any) -> None:
        """Odometer: half_track, wheel_radius, sigma_step, factor_left, ... Three readings: x, y, heading."""
        usual = {"factor_left": 1.0, "factor_right": 1.0}
        self._sensor("odometer", name, usual | parameters, count=3)

    def table(
        self, name: str, look: Mapping[str, float], samples: Any, *, reach: float, none: float, period: float = 0.0
    ) -> None:
        """A sensor known by its table of samples (C handle table_noise): one ray of the beam `look`."""
        self._keep.append(samples)
        parameters = ffi.new("beam_parameters *", dict(look))
        self._add(name, lib.vehicle_model_add_table(self._open, parameters, samples, reach, none, period))

    def whisker(self, name: str, root: tuple[float, float], tip: tuple[float, float]) -> None:
        """A whisker from `root` to `tip` on the body. One reading: 1 while it touches something."""
        self._add(name, lib.vehicle_model_add_whisker(self._open, *root, *tip))


def arsim(
    *,
    dt: float = 0.01,
    noise: bool = True,
    ends_at_collision: bool = True,
    infrared_rad: Sequence[float] = (ARSIM_INFRARED_RAD, -ARSIM_INFRARED_RAD),
    rays: int = 3,
    odometer_sigma: float = 0.0,
    compass_sigma: float = 0.05,
) -> VehicleModel:
    """The notes' default robot (THEORY 1.2, 1.5, 1.10, 3.6): 3 kg, two 12 V DC motors, IR sensors of three rays
    on the body's circle at +-0.7854 rad, odometer, compass.

    Readings: infrared_left, infrared_right (infrared_0 ... where there are not two), odometer (x, y, heading), compass.
    """
    model = VehicleModel(ARSIM_BODY, dt=dt, noise=noise, ends_at_collision=ends_at_collision)
    model.dc_motors()
    names = ("left", "right") if len(infrared_rad) == 2 else tuple(map(str, range(len(infrared_rad))))
    for name, angle in zip(names, infrared_rad, strict=True):
        place = beam(ARSIM_BODY["radius"] * math.cos(angle), ARSIM_BODY["radius"] * math.sin(angle), angle, 0.5, rays)
        model.infrared_proximity(f"infrared_{name}", beam=place, **ARSIM_INFRARED)
    body = {"half_track": ARSIM_BODY["half_track"], "wheel_radius": ARSIM_BODY["wheel_radius"]}
    model.odometer("odometer", sigma_step=odometer_sigma, **body)
    model.compass("compass", sigma=compass_sigma)
    return model


class Vehicle:
    """One vehicle in one world. Its readings are there from the start; `step` takes motor signals to the next ones.

    Attributes:
        readings: all readings, a view that changes with each step; `model.names` says where what is.
        pose: where it truly is; not for brains.
    """

    def __init__(
        self,
        model: VehicleModel,
        arena: Arena,
        *,
        pose: Sequence[float] | None = None,
        seed: int = 1,
        robot: int = 1,
        state_bytes: int = worlds.STATE_BYTES,
    ) -> None:
        """Puts it at `pose` (x, y, heading), or where the arena says. `seed` and `robot` are the keys of its noise.

        Raises:
            ArenaError: that place is not free.
            RobotError: what is given is no model, arena, pose or seed, or the model has no drive.
        """
        worlds.check_arena("vehicle", arena)
        self.model, self.arena = model, arena
        self.seed, self.robot = seed, robot
        self.handle = worlds.make_worlds("vehicle", model, 1, state_bytes)
        self.place(arena.start if pose is None else pose)
        count = lib.vehicles_reading_count(self.handle)
        pointer = worlds.kept(lib.vehicles_readings(self.handle), self.handle)
        self.readings = memoryview(ffi.buffer(pointer, 8 * count)).cast("B").cast("d").toreadonly()
        self._body = worlds.kept(lib.vehicles_body(self.handle, 0), self.handle)
        self._flag = ffi.new("int8_t *")

    def place(self, pose: Sequence[float], speed: float = 0.0, turn_rate: float = 0.0) -> None:
        """Starts a new run at a pose (x, y, heading), at `speed` (m/s) and `turn_rate` (rad/s), wheels rolling.

        Time begins at 0, the odometer is calibrated, the battery full, noise as from the start.

        Raises:
            ArenaError: that place is not free.
            RobotError: a number is not finite, or too fast.
        """
        speeds = arguments.point(
            "vehicle: the speed", (speed, turn_rate), RobotError, "m/s and rad/s", (SPEED_MAXIMUM, TURN_RATE_MAXIMUM)
        )
        worlds.place("vehicle", self.handle, 0, self.model, self.arena, self.seed, self.robot, pose)
        lib.vehicles_set_speeds(self.handle, 0, *speeds)

    def __getitem__(self, name: str) -> Any:
        """A reading by the name of its sensor: a number, or a view where the sensor has several."""
        where = self.model.names[name]
        return self.readings[where.start] if where.stop - where.start == 1 else self.readings[where]

    @property
    def time(self) -> float:
        """s since the start."""
        return float(lib.vehicles_steps_done(self.handle, 0) * self.model.dt)

    @property
    def pose(self) -> tuple[float, float, float]:
        """x (m), y (m), heading (rad)."""
        return self._body.x, self._body.y, self._body.heading

    @property
    def body(self) -> Any:
        """Truth: C struct body_state with pose, speeds, wheel angles, distance, contact."""
        return self._body

    @property
    def ended(self) -> str:
        """Why the run has ended, "" while it goes on: "collision" or "battery empty"."""
        lib.vehicles_flags(self.handle, 0, 1, self._flag)
        return ENDS[self._flag[0]]

    @property
    def collided(self) -> bool:
        """Whether it touches something."""
        return bool(self._body.touching)

    @property
    def energy(self) -> float:
        """Of the notes' battery, [0, 1]."""
        return float(lib.vehicles_energy(self.handle, 0))

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals; does nothing once the run has ended.

        Raises:
            BrainError: a signal is not a finite number.
        """
        try:
            if lib.vehicles_step_one(self.handle, 0, left, right) >= 0:
                return
        except (TypeError, OverflowError):
            pass
        raise _bad_signals((left, right))

    def run(self, brain: Brain, steps: int, *, stage: Stage | None = None) -> int:
        """The loop of Fig. 3.1 until it ends or for `steps` steps; `brain` takes the vehicle and gives the signals.

        `stage`, if there is one, is called after each of `STAGES` of each step. Returns the steps done.

        Raises:
            BrainError: it gave no two finite numbers. Whatever is raised, the steps before are done as a whole.
        """
        arguments.whole("vehicle: steps", steps, RobotError, least=0, most=worlds.STEPS_MAXIMUM)
        if self.ended:
            return 0
        if stage is not None:
            return self._run_by_stages(brain, steps, stage)
        handle, step = self.handle, lib.vehicles_step_one
        for done in range(1, steps + 1):
            signals = brain(self)
            try:
                left, right = signals
                status = step(handle, 0, left, right)
            except (TypeError, ValueError, OverflowError):
                raise _bad_signals(signals) from None
            if status:
                if status < 0:
                    raise _bad_signals(signals)
                return done
        return steps

    def _run_by_stages(self, brain: Brain, steps: int, stage: Stage) -> int:
        for done in range(1, steps + 1):
            lib.vehicles_sense(self.handle, 0)
            stage("sense", self)
            signals = brain(self)
            stage("process", self)
            self._send(signals)
            rest = [("move", lib.vehicles_move), ("arena", lib.vehicles_update_arena), ("check", lib.vehicles_check)]
            try:
                stage("send", self)
                while rest:
                    name, part = rest.pop(0)
                    part(self.handle, 0)
                    stage(name, self)
            finally:  # a step is done as a whole, even if Ctrl-C comes in the middle
                for _, part in rest:
                    part(self.handle, 0)
                lib.vehicles_sense(self.handle, 0)
            if self.ended:
                return done
        return steps

    def _send(self, signals: Any) -> None:
        try:
            left, right = signals
            if lib.vehicles_send(self.handle, 0, left, right) == lib.VEHICLE_OK:
                return
        except (TypeError, ValueError, OverflowError):
            pass
        raise _bad_signals(signals)

    def save(self) -> bytes:
        """The state of the whole world, in mid-run: the same bytes on every machine."""
        return worlds.save(self.handle, 0)

    def restore(self, state: bytes) -> None:
        """Goes on from a saved state of the same model in the same arena, bit for bit. What is refused changes nothing.

        Raises:
            RobotError: it is of another model, arena, size of a brain's memory or version, or damaged.
        """
        worlds.restore("vehicle", self.handle, 0, self.arena, state)

    def hash(self) -> int:
        """Of all that `save` writes, in the same order: equal for runs that are equal bit for bit, on every machine."""
        return int(lib.vehicles_hash(self.handle, 0))


def _bad_signals(signals: Any) -> BrainError:
    return BrainError(f"motor signals {arguments.shown(signals)}; expected two finite numbers, left and right")
