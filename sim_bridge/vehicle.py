"""Vehicles without boards: motor signals in, readings out, as the notes' simulator ARSim drives its robot.

A `VehicleModel` (model.py) says what a vehicle is made of; `arsim()`, or `vehicle_model(...)` of a robot's file, gives
one that is ready (model_file.py); a `Vehicle` is one of them in one world. `batch.py` steps many worlds at once. The
order of events in a step is Fig. 3.1 of the notes (vehicles/vehicle.h). Lengths in m, angles in rad, SI units; motor
signals in [-1, 1], left and right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from boebot.errors import ArenaError, BrainError, RobotError
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.model import VehicleModel as VehicleModel
from sim_bridge.model import beam as beam
from sim_bridge.model_file import ARSIM_BODY as ARSIM_BODY
from sim_bridge.model_file import arsim as arsim
from sim_bridge.model_file import vehicle_model as vehicle_model
from sim_bridge.parameters import HEADING, Range, number, several, shown, whole_number

Brain = Callable[["Vehicle"], tuple[float, float]]
Stage = Callable[[str, "Vehicle"], None]

STAGES: Final = ("sense", "process", "send", "move", "arena", "check")  # of a step, Fig. 3.1
ENDS: Final[dict[int, str]] = {
    lib.VEHICLE_RUNS: "",
    lib.VEHICLE_COLLIDED: "collision",
    lib.VEHICLE_EXHAUSTED: "battery empty",
}
STATE_BYTES: Final = 64  # of a compiled brain's memory, unless wished otherwise
STATE_MAXIMUM: Final = 1 << 30  # bytes
SPEED: Final = Range(-99.0, 99.0)  # m/s and rad/s: as body.c limits them
TURN_RATE: Final = Range(-999.0, 999.0)
ROBOT_MAXIMUM: Final = (1 << 31) - 1


def worlds(model: VehicleModel, count: int, state_bytes: int) -> Any:
    """`count` worlds of the model in C, not yet placed.

    Raises:
        RobotError: there is no memory for them, or the model steps too far for its drive.
    """
    room = whole_number("vehicle", "state_bytes", state_bytes, 0, STATE_MAXIMUM)
    if not model.dt < model.euler_limit:
        raise model.bad_step()
    handle = lib.vehicles_new(model.handle, count, room)
    if handle == ffi.NULL:
        raise RobotError(f"vehicle: there is no memory for {count} worlds with {room} bytes of brain each")
    model.in_use = True
    return ffi.gc(handle, lambda handle, model=model: lib.vehicles_destroy(handle))  # the model outlives them


def place(handle: Any, index: int, arena: Arena, seed: int, robot: int, pose: Sequence[float]) -> None:
    """Puts the vehicle of world `index` at a pose (x, y, heading).

    Raises:
        ArenaError: that is no free space.
        RobotError: a pose, seed or robot's number that is none, a model without a drive, or no memory.
    """
    x, y, heading = several("vehicle", "pose", pose, ("x (m)", "y (m)", "heading (rad)"))
    number("vehicle", "pose: heading (rad)", heading, HEADING)
    key = whole_number("vehicle", "seed", seed, -(2**63), 2**64 - 1) & (2**64 - 1)
    name = whole_number("vehicle", "robot", robot, 1, ROBOT_MAXIMUM)
    status = lib.vehicles_place(handle, index, arena.handle, key, name, x, y, heading)
    if status == lib.VEHICLE_NOT_FREE:
        raise ArenaError(f"arena {arena.name}: the robot cannot start at x = {x:g} m, y = {y:g} m: no free space")
    if status == lib.VEHICLE_NOT_PLACED:
        raise RobotError("vehicle: the model has no drive; expected dc_motors, regulated_motors or servos")
    if status == lib.VEHICLE_NO_MEMORY:
        raise RobotError(f"vehicle: there is no memory to place it in arena {arena.name}")
    if status == lib.VEHICLE_BAD_STEP:
        raise RobotError("vehicle: the model's dt is at or beyond the Euler limit of its drive; expected a smaller one")
    if status:
        raise RobotError(f"vehicle: pose is {(x, y, heading)}, robot {name}; expected numbers that the world can hold")


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
        state_bytes: int = STATE_BYTES,
    ) -> None:
        """Puts it at `pose` (x, y, heading), or where the arena says. `seed` and `robot` are the keys of its noise.

        Raises:
            ArenaError: that place is not free.
            RobotError: a pose, seed, robot or state_bytes that is none, or a model without a drive.
        """
        if not isinstance(model, VehicleModel) or not isinstance(arena, Arena):
            raise RobotError(f"vehicle: got {shown(model)} and {shown(arena)}; expected a VehicleModel and an Arena")
        self.model, self.arena = model, arena
        self.seed, self.robot = seed, robot
        self.handle = worlds(model, 1, state_bytes)
        self.place(arena.start if pose is None else pose)
        count = lib.vehicles_reading_count(self.handle)
        pointer = lib.vehicles_readings(self.handle)
        self.readings = memoryview(ffi.buffer(pointer, 8 * count)).cast("B").cast("d").toreadonly()
        self._body = lib.vehicles_body(self.handle, 0)
        self._flag = ffi.new("int8_t *")
        self._pair = ffi.new("double[2]")
        self._snapshot_bytes = lib.vehicles_snapshot_size(self.handle, 0)

    def place(self, pose: Sequence[float], speed: float = 0.0, turn_rate: float = 0.0) -> None:
        """Starts a new run at a pose (x, y, heading), at `speed` (m/s) and `turn_rate` (rad/s), wheels rolling.

        Time begins at 0, the odometer is calibrated, the battery full, noise as from the start.

        Raises:
            ArenaError: that place is not free.
            RobotError: a number is not finite, or too fast.
        """
        along = number("vehicle", "speed", speed, SPEED)
        around = number("vehicle", "turn_rate", turn_rate, TURN_RATE)
        place(self.handle, 0, self.arena, self.seed, self.robot, pose)
        lib.vehicles_set_speeds(self.handle, 0, along, around)

    def __getitem__(self, name: str) -> Any:
        """A reading by the name of its sensor: a number, or a view where the sensor has several.

        Raises:
            RobotError: there is no sensor of that name.
        """
        try:
            where = self.model.names[name]
        except (KeyError, TypeError):
            there = ", ".join(self.model.names) or "none: the model has no sensor"
            raise RobotError(f"vehicle: there is no sensor {shown(name)}; expected {there}") from None
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
    def currents(self) -> tuple[float, float]:
        """Truth: of the DC motors, left and right, A; (0, 0) with another drive."""
        lib.vehicles_currents(self.handle, 0, self._pair)
        return self._pair[0], self._pair[1]

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
            status = lib.vehicles_step_one(self.handle, 0, left, right)
        except (TypeError, OverflowError):
            raise _bad_signal((left, right)) from None
        if status < 0:
            raise _bad_signal((left, right))

    def run(self, brain: Brain, steps: int, *, stage: Stage | None = None) -> int:
        """The loop of Fig. 3.1 until it ends or for `steps` steps; `brain` takes the vehicle and gives the signals.

        `stage`, if there is one, is called after each of `STAGES` of each step. Returns the steps done.

        Raises:
            BrainError: a signal is not a finite number.
            RobotError: `steps` is no number of steps.
        """
        steps = whole_number("vehicle", "steps", steps, 0, 2**63 - 1)
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
                raise _bad_signal(signals) from None
            if status:
                if status < 0:
                    raise _bad_signal(signals)
                return done
        return steps

    def _run_by_stages(self, brain: Brain, steps: int, stage: Stage) -> int:
        for done in range(steps):
            lib.vehicles_sense(self.handle, 0)
            stage("sense", self)
            signals = brain(self)
            stage("process", self)
            try:
                left, right = signals
                status = lib.vehicles_send(self.handle, 0, left, right)
            except (TypeError, ValueError, OverflowError):
                raise _bad_signal(signals) from None
            if status:
                raise _bad_signal(signals)
            stage("send", self)
            lib.vehicles_move(self.handle, 0)
            stage("move", self)
            lib.vehicles_update_arena(self.handle, 0)
            stage("arena", self)
            ended = lib.vehicles_check(self.handle, 0)
            stage("check", self)
            if ended:
                lib.vehicles_sense(self.handle, 0)
                return done + 1
        lib.vehicles_sense(self.handle, 0)
        return steps

    def save(self) -> bytes:
        """The state of the whole world, in mid-run."""
        room = ffi.new("unsigned char[]", self._snapshot_bytes)
        lib.vehicles_save(self.handle, 0, room)
        return bytes(ffi.buffer(room))

    def restore(self, state: bytes) -> None:
        """Goes on from a saved state of the same model in the same arena, bit for bit.

        Raises:
            RobotError: it is of another model or version, or damaged.
        """
        if not isinstance(state, bytes) or lib.vehicles_restore(self.handle, 0, state, len(state)):
            raise RobotError("vehicle: this is no saved state of this model and version; expected what save() gave")

    def hash(self) -> int:
        """Of body, drive, battery and readings: equal for runs that are equal bit for bit."""
        return int(lib.vehicles_hash(self.handle, 0))


def _bad_signal(signals: object) -> BrainError:
    return BrainError(f"vehicle: motor signals are {shown(signals)}; expected two finite numbers, left and right")
