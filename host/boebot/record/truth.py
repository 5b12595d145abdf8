"""What really happened in a simulated run, from the streams of its record that only the simulator knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boebot.arenas.floor_plan import Lateness, floor_plan
from boebot.boards import Truth

if TYPE_CHECKING:
    from boebot.arenas import Arena
    from boebot.record.record import Record

COLUMNS = ("x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
"""Of the stream "truth": m, m, rad, m/s, rad/s, wheel speeds along the ground (m/s), 1: touched since the last row."""
_ROW = np.dtype([(name, "<f8") for name in COLUMNS])
_WAIT = np.dtype([("shape", "<f8"), ("waited", "<f8")])


def truth_of(record: Record, arena: Arena) -> Truth | None:
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
        plan=floor_plan(arena, float(time[0]), float(time[-1]), lateness(record)),
    )


def lateness(record: Record) -> list[Lateness]:
    """How far the clock of each of the arena's moving shapes was behind; none: there are none, or nothing is known."""
    time, rows = record.times_of("waits"), record.table("waits", _WAIT)
    shapes = (rows["shape"] == shape for shape in range(int(rows["shape"].max(initial=-1)) + 1))
    return [Lateness(time=time[own], waited=rows["waited"][own]) for own in shapes]
