"""A run in parts, as arrays: what is made by parts takes no more memory for a long run than for a short one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot.record.record import Record
from boebot.record.series import Bools, Pose, Series
from boebot.record.shown import Shown, read_shown, shown_names
from boebot.record.telemetry_series import TELEMETRY_DTYPE, Directions
from boebot.record.truth import track_of
from boebot.record.windows import record_of, windows

if TYPE_CHECKING:
    from boebot.link.events import BoardEvent
    from boebot.record.run import Run


@dataclass(frozen=True)
class Part:
    """Consecutive ticks of a run.

    Attributes:
        record: of these ticks (boebot.record.windows).
        first: index of the first tick that no part before has had: 0 or 1.
        series: its arrays.
        odometry: at each tick, as of `Run`; None: the robot has none.
        true_pose, contact: the true pose at each tick, and whether the body had touched something; None: nobody knows.
        shown: what the brain showed then; all that it showed in the run has a name there.
    """

    record: Record
    first: int
    series: Series
    odometry: Pose | None
    true_pose: Pose | None
    contact: Bools | None
    shown: Shown


def parts(result: Run) -> Iterator[Part]:
    """The parts of a run, oldest first."""
    directions = Directions()
    place = (0.0, 0.0, 0.0)
    names = shown_names(result.record)
    for window in windows(result.record, result.clock_offset):
        series = result.series_of(window.record, directions)
        odometry = series.odometry() if result.has_odometry else None
        if odometry is not None and window.first:
            odometry = odometry.placed(*place)
        if odometry is not None:
            place = odometry.at(-1)
        track = track_of(window.record) if result.has_truth else None
        time_s = series.time + result.clock_offset
        is_known = track is not None and len(track.time) > 0
        yield Part(
            window.record,
            window.first,
            series,
            odometry,
            track.at(time_s) if track is not None and is_known else None,
            track.contact_at(time_s) if track is not None and is_known else None,
            read_shown(window.record, names=names),
        )


def events(result: Run) -> Iterator[tuple[float, BoardEvent]]:
    """The board's events with their times of the run (s): by the board's clock, as telemetry near them has both."""
    times, board = np.zeros(1), np.zeros(1)
    for group in result.record.groups():
        if "telemetry" in group:
            record = record_of(group)
            ticks = np.frombuffer(b"".join(record.telemetry), dtype=TELEMETRY_DTYPE)["tick"]
            times, board = np.array(record.times), ticks * result.tick
        for event in record_of(group).events if "event" in group else ():
            near = int(np.abs(board - event.time).argmin())
            yield max(0.0, float(times[near] + event.time - board[near])), event
