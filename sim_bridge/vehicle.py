"""Vehicles without boards: motor signals in, readings out, as the notes' simulator ARSim drives its robot.

A `VehicleModel` (vehicles/model.py) says what a vehicle is made of; `arsim()`, or `vehicle_model(...)` of a robot's
file, gives one that is ready (vehicles/model_file.py); a `Vehicle` is one of them in one world. `batch.py` steps many
worlds at once. The order of events in a step is Fig. 3.1 of the notes (vehicles/vehicle.h). Lengths in m, angles in
rad, SI units; motor signals in [-1, 1], left and right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final

from boebot import arguments
from boebot.arenas import Arena
from boebot.errors import BrainError, RobotError
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicles import ENDS, worlds
from sim_bridge.vehicles.model import VehicleModel as VehicleModel
from sim_bridge.vehicles.model import beam as beam
from sim_bridge.vehicles.model_file import ARSIM_BODY as ARSIM_BODY
from sim_bridge.vehicles.model_file import arsim as arsim
from sim_bridge.vehicles.model_file import vehicle_model as vehicle_model

Brain = Callable[["Vehicle"], tuple[float, float]]
Stage = Callable[[str, "Vehicle"], None]

STAGES: Final = ("sense", "process", "send", "move", "arena", "check")  # of a step, Fig. 3.1
SPEED_MAXIMUM: Final = 99.9  # m/s, at the start
TURN_RATE_MAXIMUM: Final = 999.9  # rad/s


class Vehicle:
    """One vehicle in one world. Its readings are there from the start; `step` takes motor signals to the next ones.

    Attributes:
        readings: all readings, a view that changes with each step; `model.names` says where what is.
        true_pose: where it truly is; not for brains.
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
        pointer = worlds.kept(self.handle.readings, self.handle)
        self.readings = memoryview(ffi.buffer(pointer, 8 * model.readings)).cast("B").cast("d").toreadonly()
        self._world = worlds.kept(self.handle.worlds, self.handle)
        self._body = worlds.kept(ffi.addressof(self._world[0].body, "state"), self.handle)
        self._pair = ffi.new("double[2]")

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
        """A reading by the name of its sensor: a number, or a view where the sensor has several.

        Raises:
            RobotError: there is no sensor of that name.
        """
        try:
            where = self.model.names[name]
        except (KeyError, TypeError):
            there = ", ".join(self.model.names) or "none: the model has no sensor"
            raise RobotError(f"vehicle: there is no sensor {arguments.shown(name)}; expected {there}") from None
        return self.readings[where.start] if where.stop - where.start == 1 else self.readings[where]

    @property
    def time(self) -> float:
        """s since the start."""
        return float(self._world.state.step * self.model.dt)

    @property
    def true_pose(self) -> tuple[float, float, float]:
        """Truth: x (m), y (m), heading (rad)."""
        return self._body.x, self._body.y, self._body.heading

    @property
    def body(self) -> Any:
        """Truth: C struct body_state with pose, speeds, wheel angles, distance, contact."""
        return self._body

    @property
    def movers(self) -> Any:
        """Truth: C structs mover of the arena's moving shapes as they stand now, which may have waited; a copy."""
        own = self._world.own
        return ffi.new("mover[]", [own.movers[k] for k in range(own.obstacles)])

    @property
    def ended(self) -> str:
        """Why the run has ended, "" while it goes on: "collision" or "battery empty"."""
        return ENDS[self._world.state.flag]

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
        return float(self._world.state.energy)

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals; does nothing once the run has ended.

        Raises:
            BrainError: a signal is not a finite number.
        """
        self.run(lambda _: (left, right), 1)

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

    def hash(self) -> int:
        """Of all that the world has come to: equal for runs that are equal bit for bit, on every machine."""
        return int(lib.vehicles_hash(self.handle, 0))


def _bad_signals(signals: Any) -> BrainError:
    return BrainError(f"motor signals {arguments.shown(signals)}; expected two finite numbers, left and right")
