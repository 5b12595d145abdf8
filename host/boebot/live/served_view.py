"""The live view of a robot that is served to other programs: it has no brain here, so the page shows where it truly is,
what moves in its arena, and how much its board works. It lets nobody interfere: who drives it is the other program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from boebot.arenas import load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import BoardRequest, TruthNow, Visit
from boebot.devices.readings import Readings
from boebot.errors import BoebotError
from boebot.link.messages import Status
from boebot.live import messages
from boebot.live.audience import Audience
from boebot.live.chunks import load
from boebot.live.page_server import LOOPBACK
from boebot.record.readings_series import ReadingsSeries
from boebot.record.record import Record
from boebot.record.series import Pose
from boebot.record.shown import Shown
from boebot.view import page_data, scene


class ServedView:
    """Shows one served robot to pages (a `Stage` of boebot.live.audience).

    Attributes:
        url: the address of the page.
    """

    def __init__(self, request: BoardRequest, kind: str, *, host: str = LOOPBACK, port: int = 0) -> None:
        """`kind`: of its board.

        Raises:
            BoebotError: the port is taken.
        """
        self._request, self._kind = request, kind
        self._plan = floor_plan(load_arena(request.arena), 0.0, 0.0)
        self._before: tuple[TruthNow, Mapping[str, float]] | None = None
        self._start: tuple[float, float, float] | None = None
        self._printed = ""
        self._audience = Audience(self, host=host, port=port)
        self._audience.forget(1)
        self.url = self._audience.url

    def came(self, page: int) -> None:
        """See `Stage`."""

    def went(self, page: int) -> None:
        """See `Stage`."""

    def asked(self, page: int, what: messages.Asked) -> None:
        """See `Stage`: nothing can be done but looking."""
        if not isinstance(what, messages.Visible):
            raise BoebotError("a served robot is driven by the program that has its port; this page only shows it")

    def visit(self, visit: Visit) -> None:
        """A program came, went or was refused."""
        self._printed += f"{visit.client} {visit.what}{visit.why and f': {visit.why}'}\n"

    def look(self, now: TruthNow, counters: Mapping[str, float]) -> None:
        """See `boebot.boards.Server`."""
        before = self._before
        self._before = now, counters
        if before is None:
            self._start = now.pose
            self._audience.begin(self._content(self._series(counters["time_s"])))
            return
        time_s = counters["time_s"]
        if time_s <= before[1]["time_s"]:
            return
        share = load(before[1], counters)
        is_new = now.contacts > before[0].contacts
        stretch = page_data.Stretch(
            series=self._series(time_s),
            path=Pose(*(np.array([value]) for value in now.pose)),
            estimate=None,
            contact=np.array([is_new]),
            start=self._start or now.pose,
            shown=Shown(np.empty(0), {}, {}),
            true_contacts=np.array([now.pose[:2]]) if is_new else np.empty((0, 2)),
            events=[(time_s, "contact", "true contact")] if is_new else [],
            load=None if share is None else np.array([share]),
        )
        moving = [
            replace(one, time=np.array([time_s]), x=np.array([px]), y=np.array([py]), heading=np.array([turned]))
            for one, (px, py, turned) in zip(self._plan.moving, now.shapes, strict=True)
        ]
        printed, self._printed = self._printed, ""
        self._audience.add(
            {
                "type": "chunk",
                "number": 1,
                "runs": [page_data.rows_data(stretch)],
                "moving": page_data.moving_data(moving),
                "state": self._state(time_s),
                "printed": printed,
            }
        )

    def close(self) -> None:
        """No pages any more."""
        self._audience.close()

    def _series(self, time_s: float) -> ReadingsSeries:
        """A tick without readings: what the board senses it tells only who has its port."""
        record = Record()
        record.append_readings(time_s, Readings(0, int(Status.MOTORS_ENABLED), (), ()), 0.0, 0.0)
        return ReadingsSeries(record, self._request.robot, 0.01, {})

    def _content(self, series: ReadingsSeries) -> dict[str, Any]:
        robot, arena = self._request.robot, self._plan.name
        low, high = scene.plan_bounds(self._plan, [(0.0, 0.0)] if self._start is None else [self._start[:2]])
        about = page_data.robot_data(
            robot,
            series,
            number=1,
            title=f"{robot.name} ({self._kind}), served",
            brain="another program",
            begin=0.0,
            known=True,
            has_estimate=False,
            table={"robot": robot.name, "arena": arena, "seed": self._request.seed},
        )
        return {
            "type": "run",
            "number": 1,
            "format": page_data.FORMAT,
            "plan": page_data.plan_data(self._plan),
            "bounds": [*low.tolist(), *high.tolist()],
            "runs": [about],
            "live": {
                "can": [],
                "seed": self._request.seed,
                "seconds": None,
                "imperfections": [],
                "robots": [{"parameters": []}],
            },
        }

    def _state(self, time_s: float) -> dict[str, Any]:
        robot = {"parameters": {}, "latched": False, "driver": None, "pose": None, "link": None}
        return {
            "paused": False,
            "speed": 1.0,
            "rate": 1.0,
            "time": time_s,
            "touched": 0,
            "driver": None,
            "robots": [robot],
        }
