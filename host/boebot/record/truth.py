"""What really happened in a simulated run, from the streams of its record that only the simulator knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot.arenas.floor_plan import FloorPlan, Lateness, Shift, floor_plan
from boebot.boards import Truth
from boebot.record.series import Bools, Floats, Pose

if TYPE_CHECKING:
    from boebot.arenas import Arena
    from boebot.record.record import Record

COLUMNS = ("x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
"""Of the stream "truth": m, m, rad, m/s, rad/s, wheel speeds along the ground (m/s), 1: touched since the last row."""
_ROW = np.dtype([(name, "<f8") for name in COLUMNS])
_WAIT = np.dtype([("shape", "<f8"), ("waited", "<f8")])
_SHIFT = np.dtype([(name, "<f8") for name in ("shape", "x", "y", "heading")])
LIFTED_S = 1e-6  # two rows of the truth that are nearer in time: the robot was put elsewhere between them


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
        heading = np.interp(times, self.time, np.unwrap(self.pose.heading))
        return Pose(
            np.interp(times, self.time, self.pose.x),
            np.interp(times, self.time, self.pose.y),
            np.arctan2(np.sin(heading), np.cos(heading)),
        )

    @property
    def lifts(self) -> Floats:
        """When the robot was put elsewhere: between the two rows (s)."""
        before = np.flatnonzero(np.diff(self.time) < LIFTED_S)
        return (self.time[before] + self.time[before + 1]) / 2

    def contact_at(self, times: Floats) -> Bools:
        """Whether it touched something, in the row at or after each of these instants."""
        moment = np.searchsorted(self.time, times)
        return self.contact[np.minimum(moment, len(self.contact) - 1)]


def track_of(record: Record) -> Track:
    """All that is in the record; it may be empty."""
    rows = record.table("truth", _ROW)
    return Track(record.times_of("truth"), Pose(rows["x"], rows["y"], rows["heading"]), rows["contact"] > 0)


def plan_of(record: Record, arena: Arena) -> FloorPlan:
    """The arena, with its moving shapes where they were."""
    begin, end = record.span("truth")
    return floor_plan(arena, begin, end, lateness(record), shifts(record))


def truth_of(record: Record, plan: FloorPlan) -> Truth | None:
    """All of it; None where none was recorded."""
    time, rows = record.times_of("truth"), record.table("truth", _ROW)
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
