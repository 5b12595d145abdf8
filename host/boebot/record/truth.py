"""Where a robot was: poses over time, and what really happened in a simulated run, from the streams of its record that
only the simulator knows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan, Lateness, Shift, floor_plan
from boebot.boards import Truth
from boebot.record.blocks import Block

if TYPE_CHECKING:
    from boebot.arenas import Arena
    from boebot.record.record import Record

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

COLUMNS = ("x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
"""Of the stream "truth": m, m, rad, m/s, rad/s, wheel speeds along the ground (m/s), 1: touched since the last row."""
_ROW = np.dtype([(name, "<f8") for name in COLUMNS])
_WAIT = np.dtype([("shape", "<f8"), ("waited", "<f8")])
_SHIFT = np.dtype([(name, "<f8") for name in ("shape", "x", "y", "heading")])
LIFTED_S = 1e-6  # two rows of the truth that are nearer in time: the robot was put elsewhere between them


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

    @classmethod
    def chained(cls, parts: Sequence[Pose | None]) -> Pose | None:
        """One path after another; None: one of them is not known."""
        if any(part is None for part in parts):
            return None
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("x", "y", "heading")))


def interpolated(time: Floats, pose: Pose, times: Floats) -> Pose:
    """The pose at these instants, between others by interpolation."""
    heading = np.interp(times, time, np.unwrap(pose.heading))
    x, y = np.interp(times, time, pose.x), np.interp(times, time, pose.y)
    return Pose(x, y, np.arctan2(np.sin(heading), np.cos(heading)))


@dataclass(frozen=True)
class Track:
    """Where the robot was, and whether it touched something.

    Attributes:
        time: on the transport's clock, s.
        pose: m, rad.
        contact: it has touched something since the row before.
    """

    time: Floats
    pose: Pose
    contact: Bools

    def at(self, times: Floats) -> Pose:
        """The pose at these instants, between rows by interpolation."""
        return interpolated(self.time, self.pose, times)

    @property
    def lifts(self) -> Floats:
        """When the robot was put elsewhere: between the two rows (s)."""
        before = np.flatnonzero(np.diff(self.time) < LIFTED_S)
        return (self.time[before] + self.time[before + 1]) / 2

    def contact_at(self, times: Floats) -> Bools:
        """Whether it touched something, in the row at or after each of these instants."""
        moment = np.searchsorted(self.time, times)
        return self.contact[np.minimum(moment, len(self.contact) - 1)]


def track_of(block: Block) -> Track:
    """Of rows of the stream "truth"; it may be empty."""
    rows = block.table(_ROW)
    return Track(block.times, Pose(rows["x"], rows["y"], rows["heading"]), rows["contact"] > 0)


APART_S = 0.1  # touches nearer in time than this are one


def touch_indices(time: Floats, contact: Bools) -> NDArray[np.intp]:
    """Indices at which the body came to touch something that it had not touched for `APART_S`: sliding along a wall
    chatters."""
    touching = np.flatnonzero(contact)
    before = np.concatenate(([-np.inf], time[touching[:-1]])) if len(touching) else np.empty(0)
    return touching[time[touching] - before > APART_S]


def plan_of(record: Record, arena: Arena) -> FloorPlan:
    """The arena, with its moving shapes where they were."""
    begin, end = record.span("truth")
    return floor_plan(arena, begin, end, lateness(record), shifts(record))


def truth_of(record: Record, plan: FloorPlan) -> Truth | None:
    """All of it; None where none was recorded."""
    return as_truth(record.times_of("truth"), record.table("truth", _ROW), plan)


def as_truth(time: Floats, rows: Any, plan: FloorPlan) -> Truth | None:
    """Rows of the truth at those times (s), by the names of their columns; None where there are none."""
    if not len(time):
        return None
    return Truth(
        time=time,
        x=rows["x"],
        y=rows["y"],
        heading=rows["heading"],
        contact=rows["contact"] > 0,
        left_speed=rows["left"],
        right_speed=rows["right"],
        plan=plan,
    )


def lateness(record: Record) -> list[Lateness]:
    """How far the clock of each of the arena's moving shapes was behind; none: there are none, or nothing is known."""
    time, rows = record.times_of("waits"), record.table("waits", _WAIT)
    shapes = (rows["shape"] == shape for shape in range(int(rows["shape"].max(initial=-1)) + 1))
    return [Lateness(time=time[own], waited=rows["waited"][own]) for own in shapes]


def shifts(record: Record) -> list[Shift]:
    """When the arena's moving shapes were put elsewhere, oldest first."""
    time, rows = record.times_of("shifts").tolist(), record.table("shifts", _SHIFT).tolist()
    return [Shift(at, int(shape), *off) for at, (shape, *off) in zip(time, rows, strict=True)]
