"""What happened to a robot since the last chunk, in the form in which the page draws it: a replay in small pieces.

A chunk is made from the rows that the record has got meanwhile, by the code that makes replays: so both show the same.
It holds few ticks, so many in a second of the wall clock: the page is for the eye, the record has all of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from boebot.arenas.floor_plan import FloorPlan, Moving
from boebot.boards import BoardSession, VehicleSession
from boebot.record.blocks import EMPTY, Block, Group, joined
from boebot.record.brain_record import STEPS, SWITCHES, Shown, names_in, read_brain, read_layers, shown_in
from boebot.record.columns import Columns, Reader
from boebot.record.interventions import STREAM, in_words
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.record.truth import Floats, Pose
from boebot.showing import SKETCH
from boebot.view import page_data, scene

OTHERS = {STREAM, STEPS, SWITCHES, SKETCH, "pins"}  # streams that chunks show besides columns
TICKS_AT_MOST = 12  # in a chunk, of those that come close together
EACH_S = 0.05  # of the wall clock, from one of them to the next one
MORE = 6  # times as many in one that comes after a longer time
COGNITIVE_AT_MOST = 4


class Chunks:
    """Of one robot.

    Attributes:
        content: what the page knows of the robot from the start; None before the first chunk.
    """

    def __init__(
        self, session: BoardSession | VehicleSession, news: Callable[[], Group], result: Run, number: int
    ) -> None:
        """
        Args:
            session: the robot as it was opened.
            news: gives the rows of its record that came since it was last called.
            result: what is known as the run begins.
            number: of the robot, from 1.
        """
        self.content: dict[str, Any] | None = None
        self._session, self._news, self._result, self._number = session, news, result, number
        self._reader = Reader(result)
        self._others: dict[str, Block] = {}  # of streams that are no columns, since the last chunk
        self._start: tuple[float, float, float] | None = None  # where the run began
        self._counters: Mapping[str, float] = {}  # of the board, when it was last looked at
        self._made_s = time.perf_counter()  # the last chunk, by the wall clock

    def gather(self) -> bool:
        """Takes what has happened since the last chunk; whether there is anything to show."""
        news = self._news()
        if "clock" in news:
            self._reader.offset_s = Record.of({"clock": news["clock"]}).clock_offset
            self._result = replace(self._result, clock_offset=self._reader.offset_s)
        self._reader.feed(news)
        for name in OTHERS & news.keys():
            self._others[name] = joined(self._others.get(name), news[name])
        has_truth = self._result.world is None or len(self._reader.truth) > 0
        return has_truth and self._reader.ticks > 0

    def make(self) -> dict[str, Any] | None:
        """The rows of a chunk; None: nothing has happened."""
        if not self.gather():
            return None
        columns, news, self._others = self._reader.read(), self._others, {}
        events = page_data.events(columns, self._result.whiskers)
        events += [(time_s, "intervention", in_words(data)) for time_s, data in _rows(news, STREAM)]
        view = self._view(columns, news, events)
        if self.content is None:
            self.content = self._content(view)
        before, self._counters = self._counters, self._session.counters()
        return page_data.rows_data(
            view,
            events=sorted(events, key=itemgetter(0)),
            pins=page_data.pins(news.get("pins", EMPTY), self._result.robot, self._reader.offset_s),
            load=load(before, self._counters),
            cognitive=self._cognitive(),
        )

    def nothing(self) -> dict[str, Any]:
        """The rows of a robot that has ended, beside others that go on."""
        columns = Reader(self._result).read()
        true = None if self._result.world is None else Pose(*np.zeros((3, 0)))
        start = self._start or (0.0, 0.0, 0.0)
        view = scene.View(replace(columns, true_pose=true), start, Shown(np.empty(0), {}, {}))
        return page_data.rows_data(view)

    def _view(self, columns: Columns, news: Group, events: list[page_data.Event]) -> scene.View:
        """Of a few of these ticks."""
        made_s, self._made_s = self._made_s, time.perf_counter()
        most = int(TICKS_AT_MOST * min(MORE, max(1.0, (self._made_s - made_s) / EACH_S)))
        new = np.arange(columns.first, len(columns))
        kept = new[:: -(-len(new) // most)] if len(new) > most else new
        true, seen = columns.true_pose, columns.true_pose or columns.odometry
        if self._start is None:
            self._start = (0.0, 0.0, 0.0) if true is None else true.at(0)
        mind, names = {name: news[name] for name in (STEPS, SWITCHES) if name in news}, self._result.brain_names
        showing = columns.showing.rows()
        return scene.View(
            columns=columns.part(np.unique(np.append(kept, len(columns) - 1))),
            start=self._start,
            shown=shown_in(showing, names_in(showing)),
            layers=read_layers(Record.of({name: news[name] for name in (SKETCH,) if name in news})),
            brain=None if names is None or STEPS not in news else read_brain(Record.of(mind), names),
            true_contacts=_where(true, events, "contact", columns),
            touches=_where(seen, events, "touch", columns),
        )

    def moving(self, plan: FloorPlan) -> list[Moving]:
        """The moving shapes of that plan where they are now."""
        now = self._session.truth_now()
        time = self._reader.truth.times[-1:]
        if now is None or not len(time):
            return []
        return [
            replace(moving, time=time, x=np.array([x]), y=np.array([y]), heading=np.array([heading]))
            for moving, (x, y, heading) in zip(plan.moving, now.shapes, strict=True)
        ]

    def _cognitive(self) -> list[str]:
        names = self._result.brain_names
        return [] if names is None else list(names.cognitive[:COGNITIVE_AT_MOST])

    def _content(self, view: scene.View) -> dict[str, Any]:
        result = self._result
        arena = result.world.name if result.world else None
        table = {"robot": result.robot.name, "arena": arena, "seed": result.seed}
        return page_data.robot_data(result, view, self._number, table=table, cognitive=self._cognitive())


def load(before: Mapping[str, float], now: Mapping[str, float]) -> float | None:
    """The share of its cycles that an emulated board has worked between two looks at its counters; None: not known."""
    if not now.get("load"):
        return None
    passed_s = now["time_s"] - before.get("time_s", 0.0)
    if passed_s <= 0:
        return None
    worked_s = [one["load"] * one["time_s"] if one else 0.0 for one in (before, now)]
    return (worked_s[1] - worked_s[0]) / passed_s


def _rows(news: Group, stream: str) -> list[tuple[float, bytes]]:
    return news[stream].rows() if stream in news else []


def _where(pose: Pose | None, events: list[page_data.Event], kind: str, columns: Columns) -> Floats:
    """Where the robot was at the events of a kind, shape (n, 2)."""
    at = [int(np.searchsorted(columns.time, time_s)) for time_s, what, _ in events if what == kind]
    return np.empty((0, 2)) if pose is None or not at else np.column_stack((pose.x[at], pose.y[at]))
