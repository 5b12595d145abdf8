"""The record of a vehicle that is stepped by hand: one row a step, columns as numpy arrays. What ARSim calls motion
results. (`boebot.run` records its runs itself; both write `boebot.record.record.Record`.)"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan, plan_of_poses, poses_of
from boebot.errors import RobotError
from boebot.record.record import Record
from sim_bridge.vehicle import Vehicle

Floats = NDArray[np.float64]
TRUTH = {
    "time": "s", "true_x": "m", "true_y": "m", "true_heading": "rad", "true_speed": "m_s", "true_turn_rate": "rad_s",
    "true_distance": "m", "true_contact": "",
}  # fmt: skip
"""Columns of what only a simulator knows, and their units."""


class Recorder:
    """Rows of truth and readings. Given to `Vehicle.run` as `stage` it appends one after each step.

    Attributes:
        record: the rows, streams "vehicle" and "movers".
        names: of the columns: `TRUTH`, then a column for each reading, such as "compass", "odometer[0]".
    """

    def __init__(self, vehicle: Vehicle) -> None:
        """Empty."""
        self.vehicle = vehicle
        self.record = Record()
        self.names = list(TRUTH)
        for name, where in vehicle.model.names.items():
            count = where.stop - where.start
            self.names += [name] if count == 1 else [f"{name}[{k}]" for k in range(count)]

    def append(self) -> None:
        """A row of how things are now. Lengths in m, times in s, angles in rad."""
        v, body = self.vehicle, self.vehicle.body
        truth = (v.time, body.x, body.y, body.heading, body.speed, body.turn_rate, body.distance, body.touching)
        self.record.append("vehicle", v.time, array("d", (*truth, *v.readings)).tobytes())
        self.record.append("movers", v.time, poses_of(v.movers).tobytes())

    def __call__(self, stage: str, vehicle: Vehicle) -> None:
        """A row at the end of each step: as ARSim, with the readings that the step's brain got."""
        if stage == "check":
            self.append()

    def __len__(self) -> int:
        return len(self.record.rows("vehicle"))

    def __getitem__(self, name: str) -> Floats:
        """A column, shape (rows,); one of a sensor with several readings by "odometer[0]".

        Raises:
            KeyError: there is no such column.
        """
        if name not in self.names:
            raise KeyError(f"no column {name!r}; expected {', '.join(self.names)}")
        return self.table[:, self.names.index(name)]

    @property
    def table(self) -> Floats:
        """All, shape (rows, columns)."""
        return self._stream("vehicle").reshape(-1, len(self.names))

    def _stream(self, name: str) -> Floats:
        return np.frombuffer(b"".join(data for _, data in self.record.rows(name)), dtype=np.float64).copy()

    def floor_plan(self) -> FloorPlan:
        """The arena with its moving shapes where they really were, at the rows' times, for pictures of the run.

        After another `Vehicle.place` it is that of the newest run.

        Raises:
            RobotError: there is no row.
        """
        if not len(self):
            raise RobotError("recorder: it has no row; expected append() after some steps before a floor plan is made")
        time = self["time"]
        newest = 1 + max(np.flatnonzero(np.diff(time) < 0), default=-1)
        shapes = len(self.vehicle.arena.description.moving)
        movers = self._stream("movers").reshape(len(self), shapes, 4)[newest:]
        return plan_of_poses(self.vehicle.arena, time[newest:], movers.transpose(1, 2, 0))

    def save(self, path: str | Path) -> None:
        """Writes a CSV file with the columns' names in its first line, those of the truth with their units."""
        heading = ",".join(f"{name}_{TRUTH[name]}" if TRUTH.get(name) else name for name in self.names)
        np.savetxt(path, self.table, fmt="%.9g", delimiter=",", header=heading, comments="")
