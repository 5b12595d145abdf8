"""A run as arrays in SI units, one entry per control tick that was recorded: the same for robots with and without a
board. Computed when first asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.description.equipment import places
from boebot.devices.device import Column, Place, Readout, Run
from boebot.devices.drawing import Sweeps
from boebot.link.messages import Status

if TYPE_CHECKING:
    from boebot.boards import Truth
    from boebot.description.robots import RobotDescription
    from boebot.devices.readings import Layout
    from boebot.record.record import Record

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Pose:
    """Poses over time: arrays of equal length."""

    x: Floats
    """m"""
    y: Floats
    """m"""
    heading: Floats
    """rad, counter-clockwise from the x axis"""

    def at(self, index: int) -> tuple[float, float, float]:
        """x (m), y (m), heading (rad) of one of them."""
        return float(self.x[index]), float(self.y[index]), float(self.heading[index])

    def part(self, which: slice | NDArray[np.intp]) -> Pose:
        """Those of these indices."""
        return Pose(self.x[which], self.y[which], self.heading[which])

    @property
    def length(self) -> float:
        """Of the path (m)."""
        return float(np.hypot(np.diff(self.x), np.diff(self.y)).sum())

    def placed(self, x: float, y: float, heading: float) -> Pose:
        """The same path moved and turned: what is 0, 0, 0 here comes to that pose (m, m, rad)."""
        cosine, sine = np.cos(heading), np.sin(heading)
        turned = self.heading + heading
        return Pose(
            x + cosine * self.x - sine * self.y,
            y + sine * self.x + cosine * self.y,
            np.arctan2(np.sin(turned), np.cos(turned)),
        )


class Series(Run, ABC):
    """What the robot sent, and what was asked of it.

    Attributes:
        raw: what was recorded at each tick: a board's telemetry, or a vehicle's readings; has the column "tick".
        time: the run's time (s), by the robot's clock.
        status: flags as in telemetry (`boebot.link.messages.Status`).
    """

    status: NDArray[np.uint16]

    def __init__(self, record: Record, robot: RobotDescription, tick_s: float, layout: Layout | None) -> None:
        self.time: Floats = record.times_of(record.tick_stream)
        self._record = record
        self._robot = robot
        self._tick_s = tick_s
        self._layout = layout

    def __len__(self) -> int:
        return len(self.time)

    @property
    @abstractmethod
    def signals(self) -> tuple[Floats, Floats]:
        """Motor signals in force, left and right."""

    @property
    def overruns(self) -> int:
        """Control ticks overrun during the run."""
        return 0

    @abstractmethod
    def odometry(self) -> Pose:
        """The pose estimate at each tick, as seen from the first: there it is 0, 0, 0."""

    @abstractmethod
    def own_columns(self) -> list[Column]:
        """Columns of run.csv besides those of the devices."""

    @cached_property
    def _places(self) -> dict[str, Place]:
        return places(self._robot, self._tick_s, self._layout)

    @cached_property
    def _device_columns(self) -> dict[str, dict[str, Column]]:
        return {}

    def device_columns(self, device: str) -> Mapping[str, Column]:
        """The columns of one device, by their names; none: the robot does not have it."""
        if device not in self._places:
            return {}
        if device not in self._device_columns:
            place = self._places[device]
            found = self._robot.device[device].columns(place, self)
            self._device_columns[device] = {column.name: column for column in found}
        return self._device_columns[device]

    def flag(self, device: str, name: str) -> Bools:
        """A column of yes and no, such as a whisker's "pressed"; no, if the robot does not have the device."""
        column = self.device_columns(device).get(name)
        return np.zeros(len(self), dtype=np.bool_) if column is None else np.asarray(column.values, dtype=np.bool_)

    def number(self, device: str, name: str) -> Floats:
        """A column of numbers, such as the Ping's "distance"; NaN, if the robot does not have the device."""
        column = self.device_columns(device).get(name)
        return np.full(len(self), np.nan) if column is None else np.asarray(column.values, dtype=np.float64)

    def columns(self) -> dict[str, tuple[NDArray[Any], int | None]]:
        """The devices' columns for run.csv: heading (unit in its name) -> (values, digits; None: whole numbers)."""
        found = {}
        for device in self._places:
            for column in self.device_columns(device).values():
                found[_heading(device, column)] = (column.values, column.digits)
        return found | {_heading("", column): (column.values, column.digits) for column in self.own_columns()}

    def readouts(self) -> list[Readout]:
        """The devices' readings that pages show as a number."""
        found = [
            self._robot.device[device].readout(place, self, self.device_columns(device))
            for device, place in self._places.items()
        ]
        return [readout for readout in found if readout is not None]

    def sweeps(self) -> list[Sweeps]:
        """The areas that devices measured, which pictures and pages show."""
        found = [self._robot.device[device].sweeps(place, self) for device, place in self._places.items()]
        return [sweeps for sweeps in found if sweeps is not None]

    @cached_property
    def commands(self) -> list[tuple[str, float, float]]:
        """The command in force at each tick, as the brain gave it."""
        commands: list[tuple[str, float, float]] = []
        current = ("stop", 0.0, 0.0)
        for index, kind, left, right in self._record.steps:
            commands += [current] * (index - len(commands))
            current = (kind, left, right)
        return commands + [current] * (len(self) - len(commands))

    def rising(self, flag: Status) -> int:
        """How many times the status flag went up."""
        return onsets((self.status & int(flag)) != 0)


def _heading(device: str, column: Column) -> str:
    return "_".join(part for part in (device, column.name, column.unit) if part)


def onsets(flags: Bools) -> int:
    """How many times a flag goes up; one that is up from the start counts."""
    return int(np.count_nonzero(flags[1:] & ~flags[:-1]) + (1 if len(flags) and flags[0] else 0))


APART_S = 0.1  # touches nearer in time than this are one


def touch_indices(time: Floats, contact: Bools) -> NDArray[np.intp]:
    """Indices at which the body came to touch something that it had not touched for `APART_S`: sliding along a wall
    chatters."""
    touching = np.flatnonzero(contact)
    before = np.concatenate(([-np.inf], time[touching[:-1]])) if len(touching) else np.empty(0)
    return touching[time[touching] - before > APART_S]


def truth_at(truth: Truth, times: Floats) -> Pose:
    """The true pose at the given instants on the transport's clock, between samples by interpolation."""
    heading = np.interp(times, truth.time, np.unwrap(truth.heading))
    return Pose(
        np.interp(times, truth.time, truth.x),
        np.interp(times, truth.time, truth.y),
        np.arctan2(np.sin(heading), np.cos(heading)),
    )
