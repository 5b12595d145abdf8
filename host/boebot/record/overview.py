"""A run as tables, pictures and pages show it: figures computed from every tick, and few enough ticks to draw.

It takes one pass over the record, window by window, and so no more memory for a day than for a minute.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from boebot.link.messages import DevicesTelemetry, EventKind, Status
from boebot.record.brain_record import BrainNames, BrainRecord, read_brain
from boebot.record.record import Record
from boebot.record.series import APART_S, Bools, Floats, Pose, Series
from boebot.record.shown import Layer, Shown, read_layers, read_shown
from boebot.record.telemetry_series import Directions
from boebot.record.truth import Track, track_of
from boebot.record.windows import windows

POINTS = 20_000  # ticks at most that are drawn
PLACES = 5_000  # touches at most whose places are drawn
ODOMETRY_S = 0.1  # from place to place of a path by odometry


@dataclass
class Overview:
    """Of one robot's run. Lengths in m, times in s.

    Attributes:
        record: of at most `POINTS` ticks, the first and the last among them; of all, where there are no more.
        series: these ticks as arrays.
        true_pose: at these ticks; None: no simulator knows it.
        odometry: at these ticks, as seen from the start; None: the robot has none.
        contact: at these ticks, whether the body touches something.
        true_distance, odometry_distance: path lengths. None: as above.
        true_contacts, whisker_touches: how many. None: nobody knows, or the robot has none.
        contact_places, touch_places: where the robot was at them, shape (n, 2).
        overruns, dead_man_stops, fallback_takeovers: counted.
        slow_reading_age: the greatest that a slow device's reading had at a step of the brain; None: none had one.
        shown, layers: what the brain showed, and its sketches.
        brain: of a brain of processes, at most `POINTS` of its steps; None: a brain of another kind, or not recorded.
    """

    record: Record
    series: Series
    true_pose: Pose | None
    odometry: Pose | None
    contact: Bools
    true_distance: float | None
    odometry_distance: float | None
    true_contacts: int | None
    whisker_touches: int | None
    contact_places: Floats
    touch_places: Floats
    overruns: int
    dead_man_stops: int
    fallback_takeovers: int
    slow_reading_age: float | None
    shown: Shown
    layers: list[Layer]
    brain: BrainRecord | None

    @property
    def placed_odometry(self) -> Pose | None:
        """The odometry as it lies in the arena, from the true pose at the start; None: there is no truth, or no
        odometry."""
        if self.true_pose is None or self.odometry is None:
            return None
        return self.odometry.placed(*self.true_pose.at(0))


class _Places:
    """Where something happened, and how often."""

    def __init__(self) -> None:
        self.count = 0
        self._found: list[Floats] = []

    def add(self, x: Floats, y: Floats) -> None:
        """Some more."""
        room = max(0, PLACES - self.count)
        self._found.append(np.column_stack((x, y))[:room])
        self.count += len(x)

    @property
    def found(self) -> Floats:
        """The first `PLACES` of them, shape (n, 2)."""
        return np.vstack([np.empty((0, 2)), *self._found])


class _Walk:
    """The length of a path through places a time apart, and its last tick."""

    def __init__(self, apart_s: float = 0.0) -> None:
        """`apart_s`: 0: through every tick."""
        self.length = 0.0
        self._apart_s = apart_s
        self._begun_s: float | None = None
        self._places = 0  # so far
        self._time, self._x, self._y = np.empty(0), np.empty(0), np.empty(0)  # the last one

    def add(self, time: Floats, pose: Pose, *, is_last: bool, lifts: Floats | None = None) -> None:
        """Some more ticks. `is_last`: there are no more. `lifts`: when the robot was put elsewhere, which is no way."""
        at = np.arange(len(time))
        if self._apart_s:
            self._begun_s = float(time[0]) if self._begun_s is None else self._begun_s
            near = np.floor((time - self._begun_s) / self._apart_s)
            numbers = np.unique((near - 1, near, near + 1))  # no more, however long the time between two ticks
            wanted = self._begun_s + numbers * self._apart_s
            is_new = (numbers >= self._places) & (wanted <= time[-1])
            self._places = np.max(numbers[is_new], initial=self._places - 1) + 1
            at = np.searchsorted(time, wanted[is_new])
            at = np.append(at, len(time) - 1) if is_last else at
        when = np.append(self._time, time[at])
        x, y = np.append(self._x, pose.x[at]), np.append(self._y, pose.y[at])
        way = np.hypot(np.diff(x), np.diff(y))
        if lifts is not None and len(lifts):
            way = way[np.diff(np.searchsorted(lifts, when, side="right")) == 0]
        self.length += float(way.sum())
        self._time, self._x, self._y = when[-1:], x[-1:], y[-1:]


class _Contacts:
    """Where the body came to touch something that it had not touched for `APART_S`."""

    def __init__(self) -> None:
        self.places = _Places()
        self._seen_s = -math.inf  # of the truth so far
        self._touched_s = -math.inf

    def add(self, track: Track, begin_s: float, end_s: float) -> None:
        """What the truth says between these times (transport's clock) and has not said yet."""
        inside = (track.time >= begin_s) & (track.time > self._seen_s) & (track.time <= end_s)
        touching = np.flatnonzero(track.contact & inside)
        if len(touching):
            before = np.concatenate(([self._touched_s], track.time[touching[:-1]]))
            new = touching[track.time[touching] - before > APART_S]
            self.places.add(track.pose.x[new], track.pose.y[new])
            self._touched_s = float(track.time[touching[-1]])
        self._seen_s = max(self._seen_s, end_s)


class _Thinned:
    """The record of few ticks: every `stride`-th, and the last one."""

    def __init__(self, record: Record) -> None:
        self.record = Record()
        self._stream, self._last = record.tick_stream, record.ticks - 1
        self._stride = max(1, math.ceil(record.ticks / POINTS))
        self._passed = 0
        self._message = b""

    @property
    def is_whole(self) -> bool:
        """No tick is left out."""
        return self._stride == 1

    def choose(self, first: int, count: int) -> NDArray[np.intp]:
        """Which ticks of a window are kept; those from `first` on are new."""
        number = self._passed + np.arange(count - first)
        self._passed += count - first
        return first + np.flatnonzero((number % self._stride == 0) | (number == self._last))

    def add(self, window: Record, series: Series, kept: NDArray[np.intp]) -> None:
        """These ticks, and what was in force and newest at each."""
        rows, commands = window.rows(self._stream), series.commands
        held = series.held(DevicesTelemetry) if window.count(DevicesTelemetry.NAME) else None
        for index in kept.tolist():
            time_s, data = rows[index]
            self.record.append(self._stream, time_s, data)
            self.record.append_command(time_s, *commands[index])
            if held is not None and held.newest[index] >= 0:
                message = held.messages[held.newest[index]].pack()
                if message != self._message:
                    self.record.append(DevicesTelemetry.NAME, time_s, message)
                    self._message = message


class _Counts:
    """What is counted from tick to tick."""

    def __init__(self) -> None:
        self.touches = self.overruns = self.dead_man = self.fallback = 0
        self.oldest: float | None = None  # reading of a slow device, at a step of the brain

    def add(self, window: Record, series: Series, first: int, whiskers: list[str], slow: list[str]) -> Bools:
        """Some more ticks. Returns where a whisker was pressed that was not pressed a tick before."""
        flags = [series.flag(name, "pressed") for name in whiskers]
        self.touches += sum(int(_rises(each, first).sum()) for each in flags)
        self.overruns += series.overruns
        self.dead_man += int(_rises((series.status & int(Status.DEAD_MAN)) != 0, first).sum())
        self.fallback += int(_rises((series.status & int(Status.FALLBACK)) != 0, first).sum())
        steps = np.array([index for index, *_ in window.steps if index >= first], dtype=np.intp)
        ages = [series.number(name, "age")[steps] for name in slow] if len(steps) else []
        known = [float(np.nanmax(each)) for each in ages if not np.isnan(each).all()]
        self.oldest = max(known if self.oldest is None else [self.oldest, *known], default=None)
        return _rises(np.any(flags or [np.zeros(len(series), dtype=np.bool_)], axis=0), first)


def _rises(flags: Bools, first: int) -> Bools:
    """Where a flag goes up, from `first` on; one that is up from a run's start counts."""
    before = np.concatenate(([False], flags[:-1]))
    up: Bools = flags & ~before
    up[:first] = False
    return up


def overview(
    record: Record,
    series_of: Callable[[Record, Directions | None], Series],
    *,
    clock_offset_s: float,
    whiskers: list[str],
    slow: list[str],
    has_odometry: bool,
    has_truth: bool,
    brain_names: BrainNames | None,
) -> Overview:
    """Of a run.

    Args:
        series_of: makes arrays of a part of the record, which goes on with the directions of the wheels before it.
        clock_offset_s: the transport's clock at the run's time 0.
        whiskers, slow: names of these devices.
        has_odometry: the robot has what it takes. has_truth: a simulator knows what happened.
        brain_names: of a brain of processes.
    """
    ticks = record.ticks
    thinned, counts = _Thinned(record), _Counts()
    true_walk, odometry_walk = _Walk(), _Walk(ODOMETRY_S)
    contacts, touches = _Contacts(), _Places()
    true_poses: list[Pose] = []
    odometry: list[Pose] = []
    contact: list[Bools] = []
    place: tuple[float, float, float] | None = None
    directions = Directions()
    seen = 0
    for window in windows(record, clock_offset_s):
        series, first = series_of(window.record, directions), window.first
        seen += len(series) - first
        kept, new = thinned.choose(first, len(series)), slice(first, None)
        time_s = series.time + clock_offset_s
        pose = Pose(*np.zeros((3, len(series))))
        if has_odometry:
            pose = series.odometry() if place is None else series.odometry().placed(*place)
            place = pose.at(-1)
            odometry_walk.add(series.time[new], pose.part(new), is_last=seen == ticks)
            odometry.append(pose.part(kept))
        if has_truth:
            track = track_of(window.record)
            pose = track.at(time_s)
            lifts = track.lifts - clock_offset_s
            true_walk.add(series.time[new], pose.part(new), is_last=seen == ticks, lifts=lifts)
            contacts.add(track, clock_offset_s, float(time_s[-1]))
            true_poses.append(pose.part(kept))
            contact.append(track.contact_at(time_s[kept]))
        pressed = counts.add(window.record, series, first, whiskers, slow)
        touches.add(pose.x[pressed], pose.y[pressed])
        if not thinned.is_whole:
            thinned.add(window.record, series, kept)
    few = record if thinned.is_whole else thinned.record
    events = [(event.kind, event.value) for event in record.events]
    series = series_of(few, None)
    return Overview(
        record=few,
        series=series,
        true_pose=_chained(true_poses),
        odometry=_chained(odometry),
        contact=np.concatenate(contact) if contact else np.zeros(len(series), dtype=np.bool_),
        true_distance=true_walk.length if has_truth and ticks else None,
        odometry_distance=odometry_walk.length if has_odometry and ticks else None,
        true_contacts=contacts.places.count if has_truth and ticks else None,
        whisker_touches=counts.touches if whiskers and ticks else None,
        contact_places=contacts.places.found,
        touch_places=touches.found,
        overruns=counts.overruns,
        # telemetry is not heard while a session is lost, and an event not while there is none
        dead_man_stops=max(counts.dead_man, sum(kind == EventKind.DEAD_MAN for kind, _ in events)),
        fallback_takeovers=max(counts.fallback, events.count((EventKind.FALLBACK, 1))),
        slow_reading_age=counts.oldest,
        shown=read_shown(record, POINTS),
        layers=read_layers(record),
        brain=None if brain_names is None else read_brain(record, brain_names, POINTS),
    )


def _chained(poses: list[Pose]) -> Pose | None:
    if not poses:
        return None
    return Pose(*(np.concatenate([getattr(pose, name) for pose in poses]) for name in ("x", "y", "heading")))
