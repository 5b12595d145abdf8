"""A run as arrays in SI units, one entry per control tick that was recorded: the same for robots with and without a
board. Computed when first asked for."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from boebot.link.messages import Status

if TYPE_CHECKING:
    from boebot.boards import Truth

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Steps = Sequence[tuple[int, str, float, float]]
"""(index of the tick of the observation, command kind, left, right), one per step of the brain"""


@dataclass(frozen=True)
class Pose:
    """Poses over time: arrays of equal length."""

    x: Floats
    """m"""
    y: Floats
    """m"""
    heading: Floats
    """rad, counter-clockwise from the x axis"""


@dataclass(frozen=True)
class Readout:
    """What one device said over time, for people to read: one entry per tick; NaN: nothing, or not known yet."""

    device: str
    """by the brain's name"""
    unit: str
    digits: int
    values: Floats
    """in that unit"""
    ages: Floats
    """s"""


class Series(ABC):
    """What the robot told, and what was asked of it.

    Attributes:
        raw: what was recorded at each tick: a board's telemetry, or a vehicle's readings; has the column "tick".
        time: the run's time (s), by the robot's clock.
        status: flags as in telemetry (`boebot.link.messages.Status`).
    """

    raw: NDArray[np.void]
    status: NDArray[np.uint16]

    def __init__(self, times: Sequence[float], steps: Steps) -> None:
        self.time: Floats = np.array(times, dtype=np.float64)
        self._steps = steps

    def __len__(self) -> int:
        return len(self.time)

    @property
    @abstractmethod
    def left_whisker(self) -> Bools:
        """Pressed; never, if there is none."""

    @property
    @abstractmethod
    def right_whisker(self) -> Bools:
        """Pressed; never, if there is none."""

    @property
    @abstractmethod
    def left_ir(self) -> Bools:
        """Something detected."""

    @property
    @abstractmethod
    def right_ir(self) -> Bools:
        """Something detected."""

    @property
    @abstractmethod
    def ping_distance(self) -> Floats:
        """Metres; NaN without an echo."""

    @property
    @abstractmethod
    def left_signal(self) -> Floats:
        """Motor signal in force."""

    @property
    @abstractmethod
    def right_signal(self) -> Floats:
        """Motor signal in force."""

    @property
    def overruns(self) -> int:
        """Control ticks overrun during the run."""
        return 0

    @abstractmethod
    def odometry(self, start: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Pose:
        """The pose estimate at each tick, from `start` (x m, y m, heading rad) at the first."""

    @abstractmethod
    def columns(self) -> dict[str, tuple[NDArray[np.generic], int | None]]:
        """What the devices said, for run.csv: heading (unit in its name) -> (values, digits; None: whole numbers)."""

    def readouts(self) -> list[Readout]:
        """What the devices said that have a number to tell, besides those above."""
        return []

    @cached_property
    def commands(self) -> list[tuple[str, float, float]]:
        """The command in force at each tick, as the brain gave it."""
        commands: list[tuple[str, float, float]] = []
        current = ("stop", 0.0, 0.0)
        for index, kind, left, right in self._steps:
            commands += [current] * (index - len(commands))
            current = (kind, left, right)
        return commands + [current] * (len(self) - len(commands))

    def rising(self, flag: Status) -> int:
        """How many times the status flag went up."""
        return onsets((self.status & int(flag)) != 0)


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
