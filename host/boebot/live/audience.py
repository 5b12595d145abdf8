"""The pages that look at something: each gets what has happened so far, and then what happens, as fast as it reads."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable

from boebot.arenas.floor_plan import FloorPlan, Moving
from boebot.boards import Pose
from boebot.errors import BoebotError
from boebot.live import messages
from boebot.live.outbox import Message, Outbox, merged
from boebot.live.page_server import PageServer
from boebot.view import page_data, replay, scene

PAST = 1_200  # chunks that are kept for pages that come later
BYE_S = 0.5  # for the last messages


class Audience:
    """All pages, from one run to the next.

    Attributes:
        url: the address of the page.
        changed: notified when a page comes, goes or asks for something.
    """

    def __init__(
        self,
        asked: Callable[[int, messages.Asked], None],
        went: Callable[[int], None] = lambda page: None,
        *,
        port: int = 0,
    ) -> None:
        """`asked`: a page, by its number, wants something; a BoebotError says why that cannot be done, and the page is
        told. `went`: a page is gone. Both are called in the server's thread.

        Raises:
            BoebotError: the port is taken.
        """
        self._asked, self._went = asked, went
        self._lock = threading.Lock()  # of all that follows: two threads use it
        self.changed = threading.Condition(self._lock)
        self._pages: dict[int, Outbox] = {}
        self._run: Message | None = None  # the present run's first message, without rows
        self._end: Message | None = None
        self._past: deque[Message] = deque()
        self._state: Message = {}  # the newest
        self._layers: list[dict[str, Message]] = []  # of each robot the newest sketches
        self._server = PageServer(replay.live_page, self._heard, self._is_gone, port=port)
        self.url = self._server.url

    @property
    def is_there(self) -> bool:
        """A page is open."""
        return bool(self._pages)

    # ---- in the server's thread ------------------------------------------------------------------------------------

    def _heard(self, page: Outbox, data: str) -> str | None:
        try:
            what = messages.decode(data)
        except BoebotError as error:
            return str(error)
        if isinstance(what, messages.Hello):
            if page.number in self._pages:
                return "expected hello once"
            with self.changed:
                self._pages[page.number] = page
                self._begin_page(page)
                self.changed.notify_all()
            return None
        if page.number not in self._pages:
            return "expected hello first"
        try:
            self._asked(page.number, what)
        except BoebotError as error:
            self._send(page, {"type": "refused", "sentence": str(error)})
        with self.changed:
            self.changed.notify_all()
        return None

    def _is_gone(self, page: Outbox) -> None:
        with self.changed:
            self._pages.pop(page.number, None)
            self.changed.notify_all()
        self._went(page.number)

    # ---- in the thread of what is looked at ------------------------------------------------------------------------

    def pages(self) -> list[int]:
        """Their numbers."""
        with self._lock:
            return list(self._pages)

    def forget(self, robots: int) -> None:
        """Another run begins, of so many robots."""
        with self._lock:
            self._run = self._end = None
            self._past.clear()
            self._layers = [{} for _ in range(robots)]

    @property
    def knows_run(self) -> bool:
        """What `begin` tells is told."""
        return self._run is not None

    def begin(self, plan: FloorPlan, poses: Iterable[Pose], runs: list[Message], live: Message) -> None:
        """What pages know of a run from its start; they get it with the first chunk.

        Args:
            plan: of its arena. poses: of the robots (m, m, rad). runs: of each robot what does not change.
            live: what can be done to it: `can`, `seed`, `imperfections`, and of each of the `robots` its `parameters`.
        """
        low, high = scene.plan_bounds(plan, [(x, y) for x, y, _ in poses])
        bounds, data = [*low.tolist(), *high.tolist()], page_data.plan_data(plan)
        self._run = {
            "type": "run",
            "plan": data,
            "bounds": bounds,
            "runs": runs,
            "live": live,
        }

    def add(self, runs: list[Message], moving: list[Moving], state: Message, printed: str) -> None:
        """What has happened since the last chunk: rows of each robot, where moving shapes are, how the run is now."""
        rows_of = page_data.moving_data(moving)
        chunk: Message = {"type": "chunk", "runs": runs, "moving": rows_of, "state": state, "printed": printed}
        with self._lock:
            for known, rows in zip(self._layers, chunk["runs"], strict=True):
                known.update((layer["name"], layer) for layer in rows["layers"])
            self._state = chunk["state"]
            self._past.append(chunk | {"runs": [rows | {"layers": []} for rows in chunk["runs"]], "of": 1})
            if len(self._past) > PAST:
                self._past = thinned(self._past)
            is_first = len(self._past) == 1
            for page in self._pages.values():
                if is_first:
                    self._begin_page(page)
                else:
                    self._send(page, chunk)

    def tell(self, message: Message) -> None:
        """A message for all pages; of those a page that comes later gets the newest state, and the run's end."""
        with self._lock:
            self._state = message.get("state", self._state)
            self._end = message if message["type"] == "end" else self._end
            for page in self._pages.values():
                self._send(page, message)

    def close(self) -> None:
        """Nothing is shown any more; what pages wait for still gets to them."""
        deadline = time.perf_counter() + BYE_S
        while time.perf_counter() < deadline and any(page.is_waiting for page in list(self._pages.values())):
            time.sleep(0.01)
        self._server.close()

    def _begin_page(self, page: Outbox) -> None:
        """The run with its first chunk, those since, how it is now, and its end."""
        if self._run is None or not self._past:
            return
        past = [{name: value for name, value in chunk.items() if name != "state"} for chunk in self._past]
        newest = zip(past[-1]["runs"], self._layers, strict=True)
        past[-1] = past[-1] | {"runs": [rows | {"layers": list(layers.values())} for rows, layers in newest]}
        first, *others = past
        runs = [known | {"rows": rows} for known, rows in zip(self._run["runs"], first["runs"], strict=True)]
        begin = self._run | {"page": page.number, "runs": runs, "moving": first["moving"], "printed": first["printed"]}
        state = {"type": "state", "state": self._state}
        page.begin(begin, [*others, state, *([] if self._end is None else [self._end])])
        self._server.wake(page)

    def _send(self, page: Outbox, message: Message) -> None:
        page.put(message)
        self._server.wake(page)


def thinned(past: Iterable[Message]) -> deque[Message]:
    """At most about half as many as `PAST` chunks, evenly over the run: `of` says how many each is made of."""
    chunks = list(past)
    most = -(-4 * sum(chunk["of"] for chunk in chunks) // PAST)
    kept: deque[Message] = deque()
    for chunk in chunks:
        if kept and kept[-1]["of"] + chunk["of"] <= most:
            kept[-1] = merged(kept[-1], chunk) | {"of": kept[-1]["of"] + chunk["of"]}
        else:
            kept.append(chunk)
    return kept
