"""The readings of a robot without a board as arrays: computed after a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boebot.devices.device import Column, Held
from boebot.devices.readings import Layout
from boebot.record.record import Record
from boebot.record.series import Floats, Pose, Series

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription


class ReadingsSeries(Series):
    """A vehicle's readings, one entry per tick."""

    _layout: Layout

    def __init__(self, record: Record, robot: RobotDescription, tick_s: float, layout: Layout) -> None:
        super().__init__(record, robot, tick_s, layout)
        self.raw = record.readings(max((where.stop for where in layout.values()), default=0))
        self.status = self.raw["status"]

    def values(self, device: str) -> Floats:
        """All readings of a device of the description, shape (ticks, readings of the device)."""
        return np.asarray(self.raw["values"][:, self._layout[device]], dtype=np.float64)

    def ages(self, device: str) -> Floats:
        """Their ages (s)."""
        return np.asarray(self.raw["ages"][:, self._layout[device].start], dtype=np.float64)

    def held(self, kind: type) -> Held:
        """A robot without a board sends no messages."""
        raise NotImplementedError(kind)

    @property
    def signals(self) -> tuple[Floats, Floats]:
        """See `Series`."""
        return self.raw["left"], self.raw["right"]

    def odometry(self) -> Pose:
        """See `Series`: the odometer's own estimate; without one it stays there."""
        if "odometer" not in self._layout or not len(self):
            return Pose(*np.zeros((3, len(self))))
        x, y, heading = self.values("odometer").T
        start = float(heading[0])
        return Pose(x - x[0], y - y[0], heading).placed(0.0, 0.0, -start)

    def own_columns(self) -> list[Column]:
        """See `Series`."""
        left, right = self.signals
        return [
            Column("signal_left", "", left, 4),
            Column("signal_right", "", right, 4),
            Column("status", "", self.status, None),
        ]
