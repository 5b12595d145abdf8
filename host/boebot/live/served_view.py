"""The live view of a robot that is served to other programs. It has no brain here; the page shows where it truly is
and, while a program has its port, what its board senses and does: the view reads along what the board sends. It lets
nobody interfere: the robot is driven by the other program."""

from __future__ import annotations

import re

from boebot.arenas import load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import BoardRequest, BoardSession, Visit
from boebot.errors import BoebotError
from boebot.link.frame import NO_SESSION, Decoder
from boebot.link.messages import DEVICE_MESSAGES, Hello, Telemetry
from boebot.live import messages
from boebot.live.audience import Audience
from boebot.live.chunks import Chunks
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.running.driver import TICK_S

_SILENT_S = 0.2  # after so long a time without telemetry nobody listens to the board
_NOTHING = bytes(Telemetry.LENGTH)  # telemetry of a board that says nothing
_SLOW = {kind.ID: kind.NAME for kind in DEVICE_MESSAGES}
_PIECE = re.compile(rb"[^\0]*\0|[^\0]+")  # of a stream, up to the end of a frame


class ServedView:
    """Shows one served robot to pages.

    Attributes:
        url: the address of the page.
    """

    def __init__(self, request: BoardRequest, kind: str, *, port: int = 0) -> None:
        """`kind`: of its board.

        Raises:
            BoebotError: the port is taken.
        """
        self._request, self._kind = request, kind
        self._plan = floor_plan(load_arena(request.arena), 0.0, 0.0)
        self._chunks: Chunks | None = None
        self._decoder = Decoder(NO_SESSION)
        self._record = Record()  # of what came since the last look
        self._heard_s, self._last_s = -_SILENT_S, -1.0  # telemetry was heard; of the newest row
        self._printed = ""
        self._audience = Audience(self._asked, port=port)
        self._audience.forget(1)
        self.url = self._audience.url

    def _asked(self, page: int, what: messages.Asked) -> None:
        """Nothing can be done but looking."""
        raise BoebotError("a served robot is driven by the program that has its port; this page only shows it")

    def visit(self, visit: Visit) -> None:
        """A program came, went or was refused."""
        self._printed += f"{visit.client} {visit.what}{visit.why and f': {visit.why}'}\n"

    def look(self, session: BoardSession, data: bytes) -> None:
        """See `boebot.boards.Server`."""
        if self._chunks is None:
            self._chunks = Chunks(session, lambda: self._record.news(), self._run(session), 1)
        time_s = session.counters()["time_s"]
        self._read_along(data, time_s)
        self._record.put(session.drain())
        if not self._chunks.gather():
            return
        rows = self._chunks.make()
        if not self._audience.knows_run:
            now = session.truth_now()
            live = {"can": [], "seed": self._request.seed, "robots": []}
            self._audience.begin(self._plan, [] if now is None else [now.pose], [self._chunks.content or {}], live)
        printed, self._printed = self._printed, ""
        self._audience.add([rows], self._chunks.moving(self._plan), {"time": time_s, "robots": []}, printed)

    def close(self) -> None:
        """No pages any more."""
        self._audience.close()

    def _read_along(self, data: bytes, now_s: float) -> None:
        """Takes what the board has sent up to now; while no program has the port, rows without telemetry."""
        record, telemetry = Record(), []
        for piece in _PIECE.findall(data):
            for number, _, payload in self._decoder.feed(piece):
                if number == Hello.ID:  # it says of which session all that follows is
                    self._decoder.seed = Hello.unpack(payload).session or NO_SESSION
                elif number == Telemetry.ID:
                    telemetry.append(payload)
                elif number in _SLOW:
                    record.append(_SLOW[number], now_s, payload)
        if telemetry:
            self._heard_s = now_s
        elif now_s - self._heard_s > _SILENT_S:
            telemetry = [_NOTHING]
        for index, payload in enumerate(telemetry, 1 - len(telemetry)):
            time_s = now_s + index * TICK_S
            if time_s > self._last_s:
                record.append_telemetry(time_s, payload, time_s, 0.0)
                record.append_command(time_s, "stop", 0.0, 0.0)
                self._last_s = time_s
        self._record = record

    def _run(self, session: BoardSession) -> Run:
        """What is known of it as of a run."""
        request = self._request
        return Run(
            brain="another program",
            robot=request.robot,
            board=self._kind,
            description=session.description,
            arena=request.arena,
            seed=request.seed,
            period=TICK_S,
            tick=TICK_S,
            record=Record(),
            world=session.arena,
            without=request.without,
            imperfections=request.imperfections,
        )
