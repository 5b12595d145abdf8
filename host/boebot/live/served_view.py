"""The live view of a robot that is served to other programs. It has no brain here; the page shows where it truly is
and, while a program has its port, what its board senses and does: the view reads along what the board sends. It lets
nobody interfere: the robot is driven by the other program."""

from __future__ import annotations

from typing import Any

from boebot.arenas import load_arena
from boebot.arenas.floor_plan import floor_plan
from boebot.boards import BoardRequest, BoardSession, Visit
from boebot.errors import BoebotError
from boebot.link.frame import NO_SESSION, Decoder
from boebot.link.messages import DEVICE_MESSAGES, Hello, Telemetry
from boebot.live import messages
from boebot.live.audience import Audience
from boebot.live.chunks import Chunks
from boebot.record.blocks import Group
from boebot.record.record import Record
from boebot.record.run import Run
from boebot.running.driver import TICK_S

_SILENT_S = 0.2  # after so long a time without telemetry nobody listens to the board
_NOTHING = bytes(Telemetry.LENGTH)  # telemetry of a board that says nothing


class ReadAlong:
    """The rows of a served robot: what its board sends, and the truth."""

    def __init__(self, session: BoardSession) -> None:
        self.session = session
        self._decoder = Decoder(NO_SESSION)
        self._data = b""
        self._heard_s = -_SILENT_S
        self._last_s = -1.0  # of the newest row

    def hear(self, data: bytes) -> None:
        """What the board has sent."""
        self._data += data

    def news(self) -> Group:
        """The rows that came since this was last asked; nothing but the truth, while no program has the port."""
        record, now_s = Record(), self.session.counters()["time_s"]
        telemetry = [payload for number, payload in self._messages(record, now_s) if number == Telemetry.ID]
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
        record.put(self.session.drain())
        return record.news()

    def _messages(self, record: Record, now_s: float) -> list[tuple[int, bytes]]:
        """Number and payload of each that has come whole. The handshake tells the session, by which the others are
        known."""
        data, self._data = self._data, b""
        found = []
        kinds = {kind.ID: kind for kind in DEVICE_MESSAGES}
        while data:
            piece, delimiter, data = data.partition(b"\0")
            for number, _, payload in self._decoder.feed(piece + delimiter):
                if number == Hello.ID:
                    self._decoder.seed = Hello.unpack(payload).session or NO_SESSION
                elif number in kinds:
                    record.append(kinds[number].NAME, now_s, payload)
                found.append((number, payload))
        return found


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
        self._source: ReadAlong | None = None
        self._chunks: Chunks | None = None
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
        if self._source is None or self._chunks is None:
            self._source = ReadAlong(session)
            self._chunks = Chunks(session, self._source.news, self._result(session), 1)
        self._source.hear(data)
        if not self._chunks.gather():
            return
        rows = self._chunks.make()
        if not self._audience.knows_run:
            assert self._chunks.content is not None
            now = session.truth_now()
            live = {"can": [], "seed": self._request.seed, "imperfections": [], "robots": [{"parameters": []}]}
            self._audience.begin(self._plan, [] if now is None else [now.pose], [self._chunks.content], live)
        printed, self._printed = self._printed, ""
        moving, state = self._chunks.moving(self._plan), _state(session.counters()["time_s"])
        self._audience.add([rows], moving, state, printed)

    def close(self) -> None:
        """No pages any more."""
        self._audience.close()

    def _result(self, session: BoardSession) -> Run:
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


def _state(time_s: float) -> dict[str, Any]:
    robot = {"parameters": {}, "latched": False, "driver": None, "pose": None, "link": None}
    run = {"paused": False, "speed": 1.0, "time": time_s, "touched": 0}
    return run | {"robots": [robot]}
