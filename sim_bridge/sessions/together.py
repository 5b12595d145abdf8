"""Several robots in one simulated world, each with its own program at the host's end, and with a board or without.

Time is everybody's: it passes only while all robots wait, and then up to the earliest wake-up of any. A robot's wake-up
depends on its own line and its own waiting only (sim_listen of loop/loop.h), so that a robot that nobody senses changes
no bit of another's run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from boebot.boards import BoardRequest, BoardSession, VehicleSession
from boebot.errors import BoardError
from sim_bridge._core import lib
from sim_bridge.sessions.opening import Pace, Wait
from sim_bridge.sessions.places import places_of
from sim_bridge.sim import NEVER, Sim, SimRobot

Add = Callable[[Sim, BoardRequest], SimRobot]
Open = Callable[[SimRobot, Wait], BoardSession | VehicleSession]


class SimWorld:
    """The world of several robots (SharedWorld of boebot.boards)."""

    def __init__(self, sim: Sim, requests: Sequence[BoardRequest], add: Add, open_session: Open) -> None:
        """Puts the robots into `sim`, in the order of the requests; it is freed where that fails.

        `add` puts one robot there, `open_session` gives the host's end of one in a world that is shared.

        Raises:
            ArenaError: two robots overlap, or there is no free place.
            BoardError: too many robots.
        """
        self._sim = sim
        self._pace = Pace(sim) if requests[0].realtime else None
        self._waits: dict[int, int] = {}  # robot -> cycle until which it waits
        self._pause: Callable[[int], None] | None = None
        self._closed = False
        try:
            if len(requests) > lib.BODY_MAXIMUM:
                raise BoardError(f"{len(requests)} robots are too many; expected at most {lib.BODY_MAXIMUM} in one run")
            places = places_of(sim.arena, requests)
            self._robots = [
                add(sim, replace(request, start_pose=place)) for request, place in zip(requests, places, strict=True)
            ]
        except Exception:
            sim.close()
            raise
        self.sessions = [open_session(robot, self._wait) for robot in self._robots]

    def on_wait(self, pause: Callable[[int], None]) -> None:
        """Who is called with a robot's index when it waits, and returns once it has woken."""
        self._pause = pause

    def _wait(self, robot: SimRobot, cycles: int, quiet: int) -> None:
        if not cycles:
            return
        now = self._sim.cycle
        robot.listen(now + max(quiet, 1))
        self._waits[robot.number] = now + cycles
        if self._pause is None:
            raise BoardError("nobody turns the clock of this world")
        try:
            self._pause(robot.number)
        finally:
            robot.listen(NEVER)
            self._waits.pop(robot.number, None)

    def advance(self) -> list[int]:
        """Lets time pass up to the earliest wake-up; the indices of the robots that wake then, in order.

        Raises:
            BoardError: a board's program crashed.
        """
        sim = self._sim
        sim.run_until(min(self._waits.values()))
        if self._pace is not None:
            self._pace.wait()
        now = sim.cycle
        return sorted(n for n, end in self._waits.items() if now >= end or self._robots[n].speaks)

    def close(self) -> None:
        """Frees boards and world. May be called twice."""
        if self._closed:
            return
        self._closed = True
        for session in self.sessions:
            session.close()
        self._sim.close()
