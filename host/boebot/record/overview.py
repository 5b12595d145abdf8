"""A run as tables, pictures and pages show it: figures computed from every tick, and few enough ticks to draw.

It takes one pass over the record, piece by piece, and so no more memory for a day than for a minute.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boebot.devices.device import SlowDevice
from boebot.link.messages import EventKind, Status
from boebot.record.brain_record import BrainNames, BrainRecord, Layer, Shown, read_brain, read_layers, read_shown
from boebot.record.columns import Columns, Recorded, chained, columns, whole
from boebot.record.truth import APART_S, Bools, Floats, Pose, Track

POINTS = 20_000  # ticks at most that are drawn
STEPS = 6_000  # of a brain of processes, at most
ODOMETRY_S = 0.1  # from place to place of a path by odometry


@dataclass
class Overview:
    """Of one robot's run. Lengths in m, times in s.

    Attributes:
        columns: at most `POINTS` ticks, the first and the last among them; all, where there are no more.
        true_distance, odometry_distance: path lengths. None: as above.
        true_contacts, whisker_touches: how many. None: nobody knows, or the robot has none.
        contact_places, touch_places: where the robot was at them, shape (n, 2).
        overruns, dead_man_stops, fallback_takeovers: counted.
        slow_reading_age: the greatest that a slow device's reading had at a step of the brain; None: none had one.
        shown, layers: what the brain showed, and its sketches.
        brain: of a brain of processes, about `STEPS` of its steps; None: a brain of another kind, or not recorded.
    """

    columns: Columns
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
        self.places: list[Floats] = []
        self._seen_s = -math.inf  # of the truth so far
        self._touched_s = -math.inf

    def add(self, track: Track, begin_s: float, end_s: float) -> None:
        """What the truth says between these times (transport's clock) and has not said yet."""
        inside = (track.time >= begin_s) & (track.time > self._seen_s) & (track.time <= end_s)
        touching = np.flatnonzero(track.contact & inside)
        if len(touching):
            before = np.concatenate(([self._touched_s], track.time[touching[:-1]]))
            new = touching[track.time[touching] - before > APART_S]
            self.places.append(np.column_stack((track.pose.x[new], track.pose.y[new])))
            self._touched_s = float(track.time[touching[-1]])
        self._seen_s = max(self._seen_s, end_s)


class _Counts:
    """What is counted from tick to tick."""

    def __init__(self) -> None:
        self.touches = self.overruns = self.dead_man = self.fallback = 0
        self.oldest: float | None = None  # reading of a slow device, at a step of the brain

    def add(self, part: Columns, whiskers: list[str], slow: list[str]) -> Bools:
        """Some more ticks. Returns where a whisker was pressed that was not pressed a tick before."""
        first = part.first
        flags = [part.flag(name, "pressed") for name in whiskers]
        self.touches += sum(int(_rises(each, first).sum()) for each in flags)
        self.overruns += part.overruns
        self.dead_man += int(_rises((part.status & int(Status.DEAD_MAN)) != 0, first).sum())
        self.fallback += int(_rises((part.status & int(Status.FALLBACK)) != 0, first).sum())
        steps = part.steps[part.steps >= first]
        ages = [part.number(name, "age")[steps] for name in slow] if len(steps) else []
        known = [float(np.nanmax(each)) for each in ages if not np.isnan(each).all()]
        self.oldest = max(known if self.oldest is None else [self.oldest, *known], default=None)
        return _rises(np.any(flags or [np.zeros(len(part), dtype=np.bool_)], axis=0), first)


def _rises(flags: Bools, first: int) -> Bools:
    """Where a flag goes up, from `first` on; one that is up from a run's start counts."""
    before = np.concatenate(([False], flags[:-1]))
    up: Bools = flags & ~before
    up[:first] = False
    return up


def overview(result: Recorded, whiskers: list[str], names: BrainNames | None) -> Overview:
    """Of a run of a robot with these whiskers. `names`: of the parts of its brain, if it is recorded."""
    record, offset_s = result.record, result.clock_offset
    slow = [name for name, device in result.robot.device.items() if isinstance(device, SlowDevice)]
    ticks = record.ticks
    stride = max(1, math.ceil(ticks / POINTS))
    counts, touches, contacts = _Counts(), list[Floats](), _Contacts()
    true_walk, odometry_walk = _Walk(), _Walk(ODOMETRY_S)
    few: list[Columns] = []
    seen = 0
    for part in columns(result):
        new, number = slice(part.first, None), seen + np.arange(len(part) - part.first)
        seen += len(number)
        time, pose, is_last = part.time[new], Pose(*np.zeros((3, len(part)))), seen == ticks
        if part.odometry is not None:
            pose = part.odometry
            odometry_walk.add(time, pose.part(new), is_last=is_last)
        if part.true_pose is not None and part.track is not None:
            pose = part.true_pose
            true_walk.add(time, pose.part(new), is_last=is_last, lifts=part.track.lifts - offset_s)
            contacts.add(part.track, offset_s, float(time[-1] + offset_s))
        pressed = counts.add(part, whiskers, slow)
        touches.append(np.column_stack((pose.x[pressed], pose.y[pressed])))
        few.append(part.part(part.first + np.flatnonzero((number % stride == 0) | (number == ticks - 1))))
    none = np.empty((0, 2))
    contact_places = np.vstack([none, *contacts.places])
    drawn = chained(few) if few else whole(result)
    events = [(event.kind, event.value) for event in record.events]
    return Overview(
        columns=drawn,
        true_distance=None if drawn.true_pose is None or not ticks else true_walk.length,
        odometry_distance=None if drawn.odometry is None or not ticks else odometry_walk.length,
        true_contacts=None if drawn.true_pose is None or not ticks else len(contact_places),
        whisker_touches=counts.touches if whiskers and ticks else None,
        contact_places=contact_places,
        touch_places=np.vstack([none, *touches]),
        overruns=counts.overruns,
        # telemetry is not heard while a session is lost, and an event not while there is none
        dead_man_stops=max(counts.dead_man, sum(kind == EventKind.DEAD_MAN for kind, _ in events)),
        fallback_takeovers=max(counts.fallback, events.count((EventKind.FALLBACK, 1))),
        slow_reading_age=counts.oldest,
        shown=read_shown(record, POINTS),
        layers=read_layers(record),
        brain=None if names is None else read_brain(record, names).thinned(STEPS),
    )
