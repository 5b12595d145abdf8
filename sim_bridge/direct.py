"""A robot without a board in a simulated world, as the host opens it: a vehicle built from the robot's description.

`open_direct` is what the entry point of the group `boebot.vehicles` names.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from boebot.boards import BoardRequest, Truth
from sim_bridge.arena import load_arena
from sim_bridge.model_file import STEP_S, vehicle_model
from sim_bridge.vehicle import Vehicle

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
        return Truth(
            time=np.arange(len(x), dtype=np.float64) * self.tick_s,
            x=x,
            y=y,
            heading=heading,
            contact=touching > 0,
            left_speed=left,
            right_speed=right,
            arena_name=self.arena.name,
            outlines=self.arena.outlines,
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
