"""The live view of one run after another: the onlooker that joins audience, pace, controls and chunks.

The run's thread makes chunks, at most twenty a second, and where the run is as fast as possible at most in a share of
its time; the server's thread sends them. Neither waits for the other.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, cast

from boebot.arenas.floor_plan import FloorPlan, floor_plan
from boebot.boards import BoardSession, PinNow
from boebot.description.wiring import named_pins
from boebot.errors import BoebotError
from boebot.imperfections import switched_off, switches
from boebot.link.transport import Measures
from boebot.live import messages
from boebot.live.audience import Audience
from boebot.live.chunks import EACH_S, Chunks
from boebot.live.controls import Controls
from boebot.live.outbox import LETTERS, Message
from boebot.live.pace import Pace
from boebot.record.interventions import Deed
from boebot.record.run import Run
from boebot.running import interrupts
from boebot.running.brain_parameters import bounds, sliders
from boebot.running.hands import Hands, Onlooker
from boebot.running.loop import gather_rows

EACH_UNSEEN_S = 0.5  # where no page is open
EACH_AT_MOST_S = 1.0
SHARE = 60  # of the time of a run that hurries a chunk takes this part at most


class RestartedError(BoebotError):
    """A page has asked for another run."""


class LiveView(Onlooker):
    """Shows runs to pages.

    Attributes:
        url: the address of the page.
        restart: what the run is to begin afresh with; None: it goes on.
    """

    def __init__(self, show: Callable[[str], None], *, port: int = 0, speed: float | None = 1.0) -> None:
        """
        Args:
            show: is told the address as the first run begins.
            speed: at first, simulated seconds in one of the wall clock; None: as fast as possible.

        Raises:
            BoebotError: the port is taken.
        """
        self._show = show
        self._speed = speed
        self._pace = Pace(speed)
        self._controls: Controls | None = None
        self.restart: messages.Restart | None = None
        self._changing = threading.Lock()  # held while they become another run's, and while a page comes, goes or asks
        self._has_ended = False
        self._number = 0
        self._robots: list[Hands] = []
        self._chunks: list[Chunks] = []
        self._plan = FloorPlan()
        self._due_s = 0.0  # when the next chunk is to be made
        self._printed = ""
        self._printing = threading.Lock()
        self._audience = Audience(self._asked, self._went, port=port)
        self.url = self._audience.url

    # ---- pages: in the server's thread -----------------------------------------------------------------------------

    def _went(self, page: int) -> None:
        with self._changing:
            if self._controls is not None:
                self._controls.went()

    def _asked(self, page: int, what: messages.Asked) -> None:
        """Once the run has ended, only another one can be asked for."""
        switched_off(getattr(what, "without", ()))
        with self._changing:
            if self._controls is not None and (not self._has_ended or isinstance(what, messages.Restart)):
                self._controls.heard(page, what)
                self.restart = what if isinstance(what, messages.Restart) else self.restart

    # ---- the run: in its thread ------------------------------------------------------------------------------------

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        """See `Onlooker`."""
        can = _possible(robots)
        self._pace = Pace(self._speed if "speed" in can else None)
        self._robots = list(robots)
        self._chunks = [
            Chunks(each.driver.session, each.task.record.news, result, n)
            for n, (each, result) in enumerate(zip(robots, results, strict=True), 1)
        ]
        world = results[0].world
        self._plan = FloorPlan() if world is None else floor_plan(world, 0.0, 0.0)
        self._audience.forget(len(robots))
        controls = Controls(len(robots), len(self._plan.moving), can, self._pace, self._audience.pages)
        with self._changing:
            self._controls, self._has_ended = controls, False
        self._number += 1
        self._due_s = 0.0
        if self._number == 1:
            self._show(self.url)

    def before_step(self, number: int, time_s: float) -> Iterator[Deed]:
        """See `Onlooker`. While time stands still, what people do is carried out at once."""
        controls = self._controls
        assert controls is not None
        while True:
            if self.restart is not None:
                raise RestartedError("restarted by hand")
            deeds = controls.due(number, self._robots[number].held)
            yield from deeds
            if deeds:
                self._due_s = 0.0
            if not self._pace.holds(time_s):
                return
            if self._pace.paused:
                self._show_standing(time_s)

    def refuse(self, number: int, error: BoebotError) -> None:
        """See `Onlooker`."""
        self._audience.tell({"type": "refused", "sentence": str(error)})

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        """See `Onlooker`."""
        now = time.perf_counter()
        if now < self._due_s and not is_over:
            return
        self._make_chunk(time_s, is_over=is_over)
        took = time.perf_counter() - now
        each = EACH_S if self._audience.is_there else EACH_UNSEEN_S
        self._due_s = now + (max(each, min(SHARE * took, EACH_AT_MOST_S)) if self._hurries else each)

    @property
    def _hurries(self) -> bool:
        """The run goes as fast as possible."""
        return self._controls is not None and "speed" in self._controls.can and self._pace.speed is None

    def _make_chunk(self, time_s: float, *, is_over: bool = False) -> None:
        for robot in self._robots if not is_over else ():
            with interrupts.uncut():
                gather_rows(robot.driver, robot.task)
        # the first chunk has all robots from their beginning
        if not (any if self._audience.knows_run else all)([chunks.gather() for chunks in self._chunks]):
            return
        rows = [chunks.make() for chunks in self._chunks]
        if not self._audience.knows_run:
            poses = [pose for pose in map(_pose_now, self._robots) if pose is not None] or [(0.0, 0.0, 0.0)]
            contents = [chunks.content for chunks in self._chunks if chunks.content is not None]
            self._audience.begin(self._plan, poses, contents, self._live())
        with self._printing:
            printed, self._printed = self._printed, ""
        self._audience.add(rows, self._chunks[0].moving(self._plan), self._state(time_s), printed)

    def _live(self) -> Message:
        assert self._controls is not None
        request = self._robots[0].task.request
        off = set(self._robots[0].task.board.without)
        return {
            "can": sorted(self._controls.can),
            "seed": request.seed,
            "imperfections": [{"name": name, "text": text, "off": name in off} for name, text in switches().items()],
            "robots": [
                {"parameters": _sliders(robot), "inputs": _inputs(robot), "pins": named_pins(robot.driver.description)}
                for robot in self._robots
            ],
        }

    def _state(self, time_s: float) -> Message:
        assert self._controls is not None
        return {
            "paused": self._pace.paused,
            "speed": self._pace.speed,
            "time": time_s,
            "touched": sum(robot.count for robot in self._robots),
            "robots": [
                {
                    "parameters": sliders(robot.task.brain),
                    "latched": robot.driver.robot.latched,
                    "driver": page,
                    "pose": _pose_now(robot),
                    "link": _quality(robot),
                    "pins": _pins(robot) if self._audience.is_there else (),
                }
                for robot, page in zip(self._robots, self._controls.drivers(), strict=True)
            ],
        }

    def _show_standing(self, time_s: float) -> None:
        """While time stands still: what has happened up to then, and the state."""
        if time.perf_counter() < self._due_s:
            return
        self._due_s = time.perf_counter() + EACH_S
        self._make_chunk(time_s)  # none, if there was one since
        if self._audience.knows_run:
            self._audience.tell({"type": "state", "state": self._state(time_s)})

    def print(self, text: str) -> None:
        """The brain has printed something."""
        with self._printing:
            self._printed = (self._printed + text)[-LETTERS:]

    # ---- the end ---------------------------------------------------------------------------------------------------

    def take_restart(self) -> messages.Restart | None:
        """`restart`; what pages ask for from now on is another one."""
        with self._changing:
            taken, self.restart = self.restart, None
        return taken

    def announce_end(self, tables: list[Message], ended: str, *, again: bool) -> None:
        """Tells all pages. `again`: another run can be asked for."""
        self._has_ended = True
        self._audience.tell({"type": "end", "ended": ended, "tables": tables, "again": again})

    def wait_for_restart(self) -> None:
        """Waits while a page is open, until one asks for another run."""
        with self._audience.changed:
            while self._audience.is_there and self.restart is None:
                self._audience.changed.wait(0.2)  # and not for ever: Ctrl-C is to be heard

    def close(self) -> None:
        """No pages any more."""
        self._audience.close()


class Heard:
    """Standard output that the live view hears, too."""

    def __init__(self, view: LiveView) -> None:
        self._own, self._view = sys.stdout, view

    def write(self, text: str) -> int:
        """Both get it."""
        self._view.print(text)
        return self._own.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)


def _possible(robots: Sequence[Hands]) -> frozenset[str]:
    """What people may do to that run."""
    can = {"type" if robot.driver.is_program else "hand" for robot in robots}
    if any(sliders(robot.task.brain) for robot in robots):
        can.add("parameters")
    if any(_inputs(robot) for robot in robots):
        can.add("set")
    first = robots[0]
    if first.driver.session.arena is not None:
        can |= {"drag", "restart"}
        if not first.task.request.realtime:
            can |= {"pause", "step", "speed"}
    return frozenset(can)


def _sliders(robot: Hands) -> list[Message]:
    brain = robot.task.brain
    made = []
    for name, value in sliders(brain).items():
        least, most = bounds(brain, name)
        made.append({"name": name, "value": value, "least": least, "most": most})
    return made


def _inputs(robot: Hands) -> list[Message]:
    """What a person can work at its board, and how (`Device.CONTROL`)."""
    devices = robot.driver.description.device.items()
    return [{"name": name, "kind": device.CONTROL} for name, device in devices if device.on and device.CONTROL]


def _pose_now(robot: Hands) -> tuple[float, float, float] | None:
    now = robot.driver.session.truth_now()
    return None if now is None else now.pose


def _pins(robot: Hands) -> Sequence[PinNow]:
    driver = robot.driver
    return cast(BoardSession, driver.session).pins_now() if driver.description.has_board else ()


def _quality(robot: Hands) -> Message:
    """Of its link, and how much of its time an emulated board works, in words; nothing where a program drives it."""
    if robot.driver.is_program:
        return {}
    link, status = robot.driver.link, robot.driver.status()
    found: dict[str, Any] = {}
    if link is not None:
        found = {
            "lost frames": status.lost_frames,
            "damaged frames": status.bad_frames,
            "round trip": _shown(link.clock.round_trips.quantile(0.5), 1000, "ms"),
            "sessions lost": status.sessions_lost,
            "resets": status.resets,
        }
        if isinstance(link.transport, Measures):
            found |= {name.replace("_", " "): value for name, value in link.transport.figures().items()}
    found["load of the tick"] = _shown(robot.driver.session.counters().get("load"), 100, "%")
    return {name: value for name, value in found.items() if value is not None}


def _shown(value: float | None, factor: float, unit: str) -> str | None:
    return None if value is None else f"{factor * value:.1f} {unit}"
