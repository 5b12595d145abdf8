"""What happened to a robot since the last chunk, in the form in which the page draws it: a replay in small pieces.

A chunk is made from the rows that the record has got meanwhile, by the code that makes replays: so both show the same.
It holds few ticks, so many in a second of the wall clock: the page is for the eye, the record has all of them.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from boebot.arenas.floor_plan import FloorPlan, Moving
from boebot.boards import BoardSession, VehicleSession
from boebot.record.blocks import Block, Group, few, joined
from boebot.record.brain_record import STEPS, SWITCHES, names_in, read_brain, read_layers, shown_in
from boebot.record.columns import Reader
from boebot.record.interventions import STREAM
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.showing import SKETCH
from boebot.view import page_data, scene

OTHERS = {STREAM, STEPS, SWITCHES, SKETCH, "pins"}  # streams that chunks show besides columns
TICKS_AT_MOST = 12  # in a chunk, of those that come close together
EACH_S = 0.05  # of the wall clock, from one of them to the next one
MORE = 6  # times as many in one that comes after a longer time


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

    def make(self) -> dict[str, Any]:
        """The rows of a chunk: a few of the ticks that are new, and the newest one in any case."""
        columns, record, self._others = self._reader.read(), Record.of(self._others), {}
        made_s, self._made_s = self._made_s, time.perf_counter()
        most = int(TICKS_AT_MOST * min(MORE, max(1.0, (self._made_s - made_s) / EACH_S)))
        new = np.arange(columns.first, len(columns))
        if self._start is None:
            self._start = (0.0, 0.0, 0.0) if columns.true_pose is None else columns.true_pose.at(0)
        names, showing = self._result.brain_names, columns.showing.rows()
        view = scene.View(
            columns=columns.part(np.unique(np.append(new[few(len(new), most)], len(columns) - 1))),
            start=self._start,
            shown=shown_in(showing, names_in(showing)),
            layers=read_layers(record),
            brain=None if names is None or not record.count(STEPS) else read_brain(record, names),
        )
        if self.content is None:
            arena = self._result.world.name if self._result.world else None
            table = {"robot": self._result.robot.name, "arena": arena, "seed": self._result.seed}
            self.content = page_data.robot_data(self._result, view, self._number, table=table)
        return page_data.rows_data(self._result, view, columns, record)

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
