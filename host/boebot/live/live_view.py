"""The live view of one run after another: the onlooker that joins pages, pace, controls and chunks.

The run's thread makes chunks, at most twenty a second and with at most a share of its time where it is not paced; the
server's thread sends them. Neither waits for the other.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TextIO

from boebot.arenas.floor_plan import FloorPlan, floor_plan
from boebot.boards import imperfections
from boebot.errors import BoebotError
from boebot.live import messages
from boebot.live.chunks import Chunks
from boebot.live.controls import Controls
from boebot.live.outbox import LETTERS, Message, merged
from boebot.live.pace import Pace
from boebot.live.page_server import LOOPBACK, Page, PageServer
from boebot.record.result import RunResult
from boebot.running.brain_parameters import bounds, meaning, parameters
from boebot.running.interventions import Deed, Hands
from boebot.view import page_data, scene, web_page

EACH_S = 0.05  # of the wall clock, from chunk to chunk
EACH_UNSEEN_S = 0.5  # where no page is open
EACH_AT_MOST_S = 1.0
SHARE = 30  # a chunk may take this part of the time of a run that is not paced
PAST = 1_200  # chunks that are kept for pages that come later
RATE_S = 1.0  # over which the speed of a run is measured
BYE_S = 0.5


class RestartedError(BoebotError):
    """A page has asked for another run."""


class LiveView:
    """Serves pages from one run to the next (an `Onlooker` of boebot.running.interventions).

    Attributes:
        server: what serves the pages.
        url: their address.
    """

    def __init__(
        self, show: Callable[[str], None], *, host: str = LOOPBACK, port: int = 0, speed: float | None = 1.0
    ) -> None:
        """
        Args:
            show: is told the address as the first run begins.
            speed: at first, simulated seconds in one of the wall clock; None: as fast as possible.

        Raises:
            BoebotError: the port is taken.
        """
        self._show = show
        self._lock = threading.Lock()  # of all that both threads touch
        self._pages: dict[int, Page] = {}
        self._speed = speed
        self._pace = Pace(speed)
        self._controls: Controls | None = None
        self._run: Message | None = None  # the present run's first message
        self._end: Message | None = None
        self._past: deque[Message] = deque()
        self._layers: list[dict[str, Message]] = []
        self._number = 0
        self._printed = ""
        self._robots: list[Hands] = []
        self._chunks: list[Chunks] = []
        self._due_s = 0.0
        self._rates: deque[tuple[float, float]] = deque(maxlen=40)
        self._state_sent: Message = {}
        self._over = threading.Condition(self._lock)
        self.server = PageServer(web_page.live, self, host=host, port=port)
        self.url = self.server.url

    # ---- pages: in the server's thread -----------------------------------------------------------------------------

    def came(self, page: Page) -> None:
        """See `page_server.Listener`. It gets nothing before it has said hello."""

    def heard(self, page: Page, data: str) -> str | None:
        """See `page_server.Listener`."""
        try:
            asked = messages.decode(data)
        except BoebotError as error:
            return str(error)
        if isinstance(asked, messages.Hello):
            if asked.format != page_data.FORMAT:
                return f"this page is of another version (format {asked.format}, not {page_data.FORMAT}); load it again"
            self._welcome(page)
            return None
        with self._lock:
            controls, is_welcome = self._controls, page.number in self._pages
            ended = self._end is not None
        if not is_welcome:
            return "expected hello first"
        try:
            if controls is None or (ended and not isinstance(asked, messages.Restart)):
                return None
            controls.heard(page.number, asked)
        except BoebotError as error:
            self._send(page, {"type": "refused", "sentence": str(error)})
        with self._over:
            self._over.notify_all()
        return None

    def went(self, page: Page) -> None:
        """See `page_server.Listener`."""
        with self._over:
            self._pages.pop(page.number, None)
            if self._controls is not None:
                self._controls.went(page.number)
            self._over.notify_all()

    def _welcome(self, page: Page) -> None:
        with self._lock:
            self._pages[page.number] = page
            if self._controls is not None:
                self._controls.came(page.number)
            self._begin_page(page)

    def _begin_page(self, page: Page) -> None:
        """What a page needs first: the run, what has happened so far, and its end."""
        if self._run is None:
            return
        past = [self._for_page(page, chunk) for chunk in self._past]
        newest = [
            rows | {"layers": list(layers.values())}
            for rows, layers in zip(past[-1]["runs"], self._layers, strict=True)
        ]
        past[-1] = past[-1] | {"runs": newest}
        first = past[0]
        runs = [known | {"rows": rows} for known, rows in zip(self._run["runs"], first["runs"], strict=True)]
        begin = self._run | {"runs": runs, "moving": first["moving"]}
        end = [] if self._end is None else [self._end]
        page.outbox.begin(begin, [*past[1:], {"type": "state", "state": past[-1]["state"]}, *end])
        self.server.wake(page)

    def _send(self, page: Page, message: Message) -> None:
        page.outbox.put(message)
        self.server.wake(page)

    # ---- the run: in its thread ------------------------------------------------------------------------------------

    def begin(self, robots: Sequence[Hands], results: Sequence[RunResult]) -> None:
        """See `Onlooker`."""
        can = _possible(robots)
        self._pace = Pace(self._speed if "speed" in can else None)
        self._robots = list(robots)
        self._chunks = [
            Chunks(each, result, n) for n, (each, result) in enumerate(zip(robots, results, strict=True), 1)
        ]
        world = results[0].world
        plan = FloorPlan() if world is None else floor_plan(world, 0.0, 0.0)
        with self._lock:
            self._controls = Controls(len(robots), len(plan.moving), can, self._pace)
            for number in self._pages:
                self._controls.came(number)
            self._run = self._end = None
            self._past.clear()
            self._layers = [{} for _ in robots]
            self._number += 1
            self._rates.clear()
        self._plan, self._due_s = plan, 0.0
        if self._number == 1:
            self._show(self.url)

    def before_step(self, number: int, time_s: float) -> Iterator[Deed]:
        """See `Onlooker`. While time stands still, what people do is carried out at once."""
        controls = self._controls
        assert controls is not None
        while True:
            if controls.restart is not None:
                raise RestartedError("restarted by hand")
            deeds = controls.due(number, self._robots[number].held)
            yield from deeds
            if deeds:
                self._due_s = 0.0
            if not self._pace.holds(time_s):
                return
            if self._pace.paused:
                self._send_state(time_s)

    def refuse(self, number: int, error: BoebotError) -> None:
        """See `Onlooker`."""
        with self._lock:
            for page in self._pages.values():
                self._send(page, {"type": "refused", "sentence": str(error)})

    def look(self, time_s: float) -> None:
        """See `Onlooker`."""
        now = time.perf_counter()
        if now < self._due_s:
            return
        self._make_chunk(time_s)
        took = time.perf_counter() - now
        each = EACH_S if self._pages else EACH_UNSEEN_S
        self._due_s = now + (max(each, min(SHARE * took, EACH_AT_MOST_S)) if self._hurries else each)

    @property
    def _hurries(self) -> bool:
        """The run goes as fast as possible."""
        return self._controls is not None and "speed" in self._controls.can and self._pace.speed is None

    def _make_chunk(self, time_s: float) -> None:
        rows = [chunks.make() for chunks in self._chunks]
        if any(one is None for one in rows):
            return  # a robot that has not begun yet, or has ended
        self._rates.append((time.perf_counter(), time_s))
        message: Message = {
            "type": "chunk",
            "number": self._number,
            "runs": rows,
            "moving": page_data.moving_data(self._chunks[0].moving(self._plan)),
            "state": self._state(time_s),
        }
        with self._lock:
            message["printed"], self._printed = self._printed, ""
            if self._run is None:
                self._run = self._first_message(message)
            self._keep(message)
            for page in self._pages.values():
                if len(self._past) == 1:
                    self._begin_page(page)
                else:
                    self._send(page, self._for_page(page, message))

    def _keep(self, message: Message) -> None:
        """For pages that come later: of what the brain has sketched only the newest."""
        for known, rows in zip(self._layers, message["runs"], strict=True):
            known.update((layer["name"], layer) for layer in rows["layers"])
        self._past.append(message | {"runs": [rows | {"layers": []} for rows in message["runs"]]})
        if len(self._past) > PAST:
            halves = [merged(one, other) for one, other in zip(*[iter(list(self._past))] * 2, strict=False)]
            self._past = deque(halves)

    def _first_message(self, chunk: Message) -> Message:
        contents = [chunks.content for chunks in self._chunks]
        poses = [pose for pose in map(_pose_now, self._robots) if pose is not None]
        low, high = scene.plan_bounds(self._plan, [(x, y) for x, y, _ in poses or [(0.0, 0.0, 0.0)]])
        return {
            "type": "run",
            "number": self._number,
            "format": page_data.FORMAT,
            "plan": page_data.plan_data(self._plan),
            "bounds": [*low.tolist(), *high.tolist()],
            "runs": contents,
            "live": self._live(),
        }

    def _live(self) -> Message:
        assert self._controls is not None
        request = self._robots[0].task.request
        off = set(request.without)
        return {
            "can": sorted(self._controls.can),
            "seed": request.seed,
            "seconds": None if self._robots[0].task.seconds == float("inf") else self._robots[0].task.seconds,
            "imperfections": [
                {"name": name, "text": text, "off": name in off} for name, text in imperfections().items()
            ],
            "robots": [{"parameters": _sliders(robot)} for robot in self._robots],
        }

    def _state(self, time_s: float) -> Message:
        assert self._controls is not None
        return {
            "paused": self._pace.paused,
            "speed": self._pace.speed,
            "rate": self._rate(),
            "time": time_s,
            "touched": sum(robot.count for robot in self._robots),
            "driver": None,
            "robots": [
                {
                    "parameters": parameters(robot.task.brain),
                    "latched": robot.driver.robot.latched,
                    "driver": page,
                    "pose": _pose_now(robot),
                    "link": _quality(robot),
                }
                for robot, page in zip(self._robots, self._controls.drivers(), strict=True)
            ],
        }

    def _rate(self) -> float | None:
        """Simulated seconds in one of the wall clock, of late."""
        while len(self._rates) > 2 and self._rates[-1][0] - self._rates[0][0] > RATE_S:
            self._rates.popleft()
        if len(self._rates) < 2:
            return None
        (wall_0, time_0), (wall_1, time_1) = self._rates[0], self._rates[-1]
        return round((time_1 - time_0) / max(wall_1 - wall_0, 1e-6), 3)

    def _for_page(self, page: Page, message: Message) -> Message:
        """With who drives each robot, as that page sees it."""
        state = message["state"]
        robots = [
            robot
            | {"driver": None if robot["driver"] is None else "you" if robot["driver"] == page.number else "another"}
            for robot in state["robots"]
        ]
        return message | {"state": state | {"robots": robots, "driver": robots[0]["driver"]}}

    def _send_state(self, time_s: float) -> None:
        """While time stands still, when it has changed."""
        if time.perf_counter() < self._due_s or not self._pages or self._run is None:
            return
        self._due_s = time.perf_counter() + EACH_S
        state = self._state(time_s)
        if state == self._state_sent:
            return
        self._state_sent = state
        with self._lock:
            for page in self._pages.values():
                self._send(page, self._for_page(page, {"type": "state", "state": state}))

    def print(self, text: str) -> None:
        """The brain has printed something."""
        with self._lock:
            self._printed = (self._printed + text)[-LETTERS:]

    # ---- the end ---------------------------------------------------------------------------------------------------

    @property
    def restart(self) -> messages.Restart | None:
        """What the run is to begin afresh with, if a page has asked for that."""
        return None if self._controls is None else self._controls.restart

    def announce_end(self, tables: list[Message], ended: str, *, again: bool) -> None:
        """Tells all pages."""
        message = {"type": "end", "ended": ended, "tables": tables, "again": again}
        with self._lock:
            self._end = message
            for page in self._pages.values():
                self._send(page, message)

    def wait_for_restart(self) -> messages.Restart | None:
        """Waits while a page is open, until one asks for another run; None: there is no page any more."""
        controls = self._controls
        while True:
            with self._over:
                if controls is None or not self._pages:
                    return None
                if controls.restart is not None:
                    return controls.restart
                self._over.wait(0.2)  # and not for ever: Ctrl-C is to be heard

    def close(self) -> None:
        """No pages any more."""
        deadline = time.monotonic() + BYE_S
        while (
            self._pages and time.monotonic() < deadline and any(page.outbox.is_waiting for page in self._pages.values())
        ):
            time.sleep(0.01)  # the end is on its way
        self.server.close()


class Heard:
    """Standard output, that the live view hears, too."""

    def __init__(self, own: TextIO, view: LiveView) -> None:
        self._own, self._view = own, view

    def write(self, text: str) -> int:
        """Both get it."""
        self._view.print(text)
        return self._own.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)


def _possible(robots: Sequence[Hands]) -> frozenset[str]:
    """What people may do to that run."""
    can = {"hand"}
    if any(parameters(robot.task.brain) for robot in robots):
        can.add("parameters")
    first = robots[0]
    if first.driver.session.arena is not None:
        can |= {"drag", "restart"}
        if not first.task.request.realtime:
            can |= {"pause", "step", "speed"}
    return frozenset(can)


def _sliders(robot: Hands) -> Iterable[Message]:
    brain = robot.task.brain
    sliders = []
    for name, value in parameters(brain).items():
        least, most = bounds(brain, name)
        text = meaning(brain, name)
        sliders.append({"name": name, "value": value, "least": least, "most": most, "unit": "", "text": text})
    return sliders


def _pose_now(robot: Hands) -> tuple[float, float, float] | None:
    now = robot.driver.session.truth_now()
    return None if now is None else now.pose


def _quality(robot: Hands) -> Message | None:
    quality = robot.driver.link_quality()
    return None if quality is None else quality._asdict()
