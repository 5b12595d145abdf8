"""What happened to a robot since the last chunk, in the form in which the page draws it: a replay in small pieces.

A chunk is made from the rows that the record has got meanwhile, by the code that makes replays: so both show the same.
It holds few ticks, so many in a second of the wall clock: the page is for the eye, the record has all of them.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from operator import itemgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan, Moving
from boebot.boards import BoardSession, VehicleSession
from boebot.devices.whisker import Whisker
from boebot.link.messages import DevicesTelemetry
from boebot.record.blocks import Block, Group, joined
from boebot.record.brain_record import STEPS, SWITCHES, read_brain
from boebot.record.interventions import STREAM, in_words
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.record.series import Floats, Pose, Series
from boebot.record.shown import Shown, read_layers, read_shown
from boebot.record.telemetry_series import Directions
from boebot.record.truth import track_of
from boebot.record.windows import OF_TICKS, cut, record_of
from boebot.running.driver import gather_rows
from boebot.running.hands import Hands
from boebot.showing import SKETCH
from boebot.view import page_data, scene

TICKS_AT_MOST = 12  # in a chunk, of those that come close together
EACH_S = 0.05  # of the wall clock, from one of them to the next one
MORE = 6  # times as many in one that comes after a longer time
COGNITIVE_AT_MOST = 4


class Source(Protocol):
    """Where the rows of a robot come from."""

    @property
    def session(self) -> BoardSession | VehicleSession:
        """The robot as it was opened."""

    @property
    def clock_offset_s(self) -> float:
        """The transport's clock at the run's time 0, once there are rows."""

    def news(self) -> Group:
        """The rows of a record that came since this was last asked."""


class OfRun:
    """A robot of a run, whose rows go into its record (a `Source`)."""

    def __init__(self, hands: Hands) -> None:
        self._driver, self._task = hands.driver, hands.task
        self.session = hands.driver.session

    @property
    def clock_offset_s(self) -> float:
        """See `Source`."""
        return self._driver.result(None, 0.0).clock_offset

    def news(self) -> Group:
        """See `Source`."""
        gather_rows(self._driver, self._task)
        return self._task.record.news()


class Chunks:
    """Of one robot.

    Attributes:
        content: what the page knows of the robot from the start; None before the first chunk.
    """

    def __init__(self, source: Source, result: Run, number: int, *, title: str = "") -> None:
        """`result`: what is known as the run begins. `number`: of the robot, from 1. `title`: "": by the result."""
        self.content: dict[str, Any] | None = None
        self._source, self._result, self._number = source, result, number
        self._title = title or f"{result.brain} on {result.robot.name} ({result.board})"
        self._waiting: dict[str, Block] = {}  # of ticks and the truth, from the last chunk's last tick on
        self._others: dict[str, Block] = {}  # of other streams, since the last chunk
        self._first = 0  # index of the first new tick in them
        self._directions = Directions()
        self._place: tuple[float, float, float] | None = None  # by odometry, at that last tick
        self._start: tuple[float, float, float] | None = None  # where the run began
        self._offset_s = 0.0  # the transport's clock at the run's time 0
        self._counters: Mapping[str, float] = {}  # of the board, when it was last looked at
        self._made_s = time.perf_counter()  # the last chunk, by the wall clock

    def gather(self) -> bool:
        """Takes what has happened since the last chunk; whether there is anything to show."""
        for name, block in self._source.news().items():
            kept = self._waiting if name in (*OF_TICKS, "truth") else self._others
            kept[name] = joined(kept.get(name), block)
        is_simulated = self._result.world is not None
        has_truth = not is_simulated or "truth" in self._waiting
        return has_truth and record_of(self._waiting).ticks > self._first

    def make(self) -> dict[str, Any] | None:
        """The rows of a chunk; None: nothing has happened."""
        if not self.gather():
            return None
        record = record_of(self._waiting)
        if self.content is None:
            self._offset_s = self._source.clock_offset_s
        stretch, series = self._stretch(record, self._others)
        self._others = {}
        if self.content is None:
            self.content = self._content(series, stretch)
        rows = page_data.rows_data(stretch, cognitive=self._cognitive())
        end_s = float(series.time[-1])
        _, self._waiting = cut(self._waiting, end_s, end_s, self._offset_s)
        self._first = 1
        return rows

    def nothing(self) -> dict[str, Any]:
        """The rows of a robot that has ended, beside others that go on."""
        series = self._result.series_of(Record())
        nowhere = Pose(*np.zeros((3, 0)))
        shown = Shown(np.empty(0), {}, {})
        estimate = nowhere if self._result.has_odometry and self._result.world is not None else None
        start = self._start or (0.0, 0.0, 0.0)
        stretch = page_data.Stretch(series, nowhere, estimate, np.zeros(0, np.bool_), start, shown)
        return page_data.rows_data(stretch)

    def _stretch(self, record: Record, news: Group) -> tuple[page_data.Stretch, Series]:
        result = self._result
        series = result.series_of(record, self._directions)
        made_s, self._made_s = self._made_s, time.perf_counter()
        most = int(TICKS_AT_MOST * min(MORE, max(1.0, (self._made_s - made_s) / EACH_S)))
        new = np.arange(self._first, len(series))
        kept = new[:: -(-len(new) // most)] if len(new) > most else new
        kept = np.unique(np.append(kept, len(series) - 1))
        few = result.series_of(_part(record, series, kept))
        track = track_of(record)
        true = track.at(series.time + self._offset_s) if len(track.time) else None
        contact = track.contact_at(series.time + self._offset_s) if len(track.time) else np.zeros(len(series), np.bool_)
        odometry = self._odometry(series)
        seen = true or odometry or Pose(*np.zeros((3, len(series))))
        if self._start is None:
            self._start = seen.at(0)
        path = seen.part(kept)
        whiskers = [name for name, device in result.robot.device.items() if device.on and isinstance(device, Whisker)]
        events = page_data.events(series, contact, whiskers, first=self._first)
        events += [(time_s, "intervention", in_words(data)) for time_s, data in _rows(news, STREAM)]
        names = result.brain_names
        stretch = page_data.Stretch(
            series=few,
            path=path,
            estimate=None if true is None or odometry is None else odometry.placed(*self._start).part(kept),
            contact=contact[kept],
            start=self._start if true is not None else (0.0, 0.0, 0.0),
            shown=read_shown(record),
            layers=read_layers(record_of({SKETCH: news[SKETCH]})) if SKETCH in news else (),
            brain=None if names is None or STEPS not in news else read_brain(_brain_of(news), names),
            swept=scene.swept(few, path),
            true_contacts=_where(true, events, "contact", series),
            touches=_where(seen, events, "touch", series),
            events=sorted(events, key=itemgetter(0)),
            load=self._load(len(kept)),
            pins=page_data.pins(record_of({"pins": news["pins"]}), result.robot, self._offset_s)
            if "pins" in news
            else {},
        )
        return stretch, series

    def _odometry(self, series: Series) -> Pose | None:
        """As seen from the run's start."""
        if not self._result.has_odometry:
            return None
        pose = series.odometry()
        if self._place is not None:
            pose = pose.placed(*self._place)
        self._place = pose.at(-1)
        return pose

    def _load(self, ticks: int) -> Floats | None:
        """At each of so many ticks."""
        before, self._counters = self._counters, self._source.session.counters()
        share = load(before, self._counters)
        return None if share is None else np.full(ticks, share)

    def moving(self, plan: FloorPlan) -> list[Moving]:
        """The moving shapes of that plan where they are now."""
        now = self._source.session.truth_now()
        if now is None or "truth" not in self._waiting:
            return []
        time = self._waiting["truth"].times[-1:]
        return [
            replace(moving, time=time, x=np.array([x]), y=np.array([y]), heading=np.array([heading]))
            for moving, (x, y, heading) in zip(plan.moving, now.shapes, strict=True)
        ]

    def _cognitive(self) -> list[str]:
        names = self._result.brain_names
        return [] if names is None else list(names.cognitive[:COGNITIVE_AT_MOST])

    def _content(self, series: Series, stretch: page_data.Stretch) -> dict[str, Any]:
        result = self._result
        return page_data.robot_data(
            result.robot,
            series,
            number=self._number,
            title=self._title,
            brain=result.brain,
            begin=self._offset_s,
            known=self._result.world is not None,
            has_estimate=stretch.estimate is not None,
            table={
                "robot": result.robot.name,
                "arena": result.world.name if result.world else None,
                "seed": result.seed,
            },
            names=result.brain_names,
            cognitive=self._cognitive(),
        )


def load(before: Mapping[str, float], now: Mapping[str, float]) -> float | None:
    """The share of its cycles that an emulated board has worked between two looks at its counters; None: not known."""
    if not now.get("load"):
        return None
    passed_s = now["time_s"] - before.get("time_s", 0.0)
    if passed_s <= 0:
        return None
    worked_s = [one["load"] * one["time_s"] if one else 0.0 for one in (before, now)]
    return (worked_s[1] - worked_s[0]) / passed_s


def _part(record: Record, series: Series, kept: NDArray[np.intp]) -> Record:
    """The record of a few of its ticks, with what was newest at each."""
    (ticks,) = record.blocks(record.tick_stream)  # made of one group
    part = {record.tick_stream: ticks.chosen(kept)}
    if record.count(DevicesTelemetry.NAME):
        held = series.held(DevicesTelemetry)
        newest = [(index, held.messages[held.newest[index]]) for index in kept.tolist() if held.newest[index] >= 0]
        if newest:
            part[DevicesTelemetry.NAME] = Block.of([(float(series.time[at]), one.pack()) for at, one in newest])
    return record_of(part)


def _brain_of(news: Group) -> Record:
    return record_of({name: news[name] for name in (STEPS, SWITCHES) if name in news})


def _rows(news: Group, stream: str) -> list[tuple[float, bytes]]:
    return news[stream].rows() if stream in news else []


def _where(pose: Pose | None, events: list[page_data.Event], kind: str, series: Series) -> Floats:
    """Where the robot was at the events of a kind, shape (n, 2)."""
    at = [int(np.searchsorted(series.time, time_s)) for time_s, what, _ in events if what == kind]
    return np.empty((0, 2)) if pose is None or not at else np.column_stack((pose.x[at], pose.y[at]))
