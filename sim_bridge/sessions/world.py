"""The simulated world of a run, with its robots: how it is opened, and how time passes in it.

`native_world`, `avr_world` and `direct_world` are what the entry points of the group `boebot.boards` name. A robot that
is alone lets time pass as it waits. Among several time is everybody's: it passes only while all of them wait, and then
up to the earliest wake-up of any. A robot's wake-up depends on its own line and its own waiting only (`listen_from` of
loop/loop.h), so that a robot that nobody senses changes no bit of another's run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from boebot.arenas import load_arena
from boebot.boards import DIRECT_ARENA, BoardRequest
from boebot.errors import BoardError, CallError
from sim_bridge.boards import avr
from sim_bridge.boards.board import CLOCK_HZ, EmulatedBoard
from sim_bridge.boards.emulated import avr_image, image_file, native_board, native_library
from sim_bridge.compiled import lib
from sim_bridge.sessions.places import places_of
from sim_bridge.sessions.session import DirectSession, SimSession
from sim_bridge.sim import NEVER, Sim, SimRobot
from sim_bridge.vehicles import STEP_S as DIRECT_STEP_S

STEP_S = 0.001  # of a world with boards


class Pace:
    """Holds simulated time to the wall clock."""

    LAG_S = 0.5  # what cannot be caught up is forgotten

    def __init__(self, sim: Sim) -> None:
        self._sim = sim
        self._start = self._now() - sim.cycle / CLOCK_HZ

    def _now(self) -> float:
        return time.perf_counter() - self._sim.stood_still_s

    def due(self) -> int:
        """Cycles that the wall clock is ahead of the simulation."""
        ahead = self._now() - self._start - self._sim.cycle / CLOCK_HZ
        if ahead > self.LAG_S:
            self._start += ahead
            ahead = 0.0
        return max(0, int(ahead * CLOCK_HZ))

    def forget(self, but_s: float = 0.0) -> None:
        """Whatever the wall clock is ahead of the simulation, `but_s` excepted, is not caught up."""
        self._start += max(0.0, self._now() - self._start - self._sim.cycle / CLOCK_HZ - but_s)

    def wait(self) -> None:
        """Sleeps until the wall clock has caught up."""
        behind = self._sim.cycle / CLOCK_HZ + self._start - self._now()
        if behind > 0:
            time.sleep(behind)
        elif behind < -self.LAG_S:
            self._start -= behind


class SimWorld:
    """The world of the robots of one run, one or several (World of boebot.boards).

    Attributes:
        sessions: one per robot, in the order of the requests.
    """

    def __init__(self, requests: Sequence[BoardRequest], board: BoardKind | None) -> None:
        """`board`: the kind of board of those whose description has one; None: no robot has a board.

        Raises:
            ArenaError: two robots overlap, or there is no free place.
            BoardError: too many robots; no such option or imperfection.
        """
        first, alone = requests[0], len(requests) == 1
        self._sim = sim = _new_sim(first, DIRECT_STEP_S if board is None else STEP_S)
        self._waits: dict[int, int] = {}  # robot -> cycle until which it waits
        self._pause: Callable[[int], None] | None = None
        self._closed = False
        try:
            if len(requests) > lib.BODY_MAXIMUM:
                raise BoardError(f"{len(requests)} robots are too many; expected at most {lib.BODY_MAXIMUM} in one run")
            places = [first.pose] if alone else places_of(sim.arena, requests)
            self._robots = [_add(sim, board, *one) for one in zip(requests, places, strict=True)]
        except Exception:
            sim.close()
            raise
        paces = first.realtime and (board is not None or not alone)  # a direct robot that is alone paces itself
        self._pace = Pace(sim) if paces else None
        wait = (self._wait if self._pace else SimRobot.wait) if alone else self._wait_for_others
        self.sessions: list[SimSession | DirectSession] = [
            SimSession(robot, board.name, wait, pins=first.pins, shared=not alone)
            if board is not None and robot.description.has_board
            else DirectSession(robot, wait, shared=not alone)
            for robot in self._robots
        ]

    def _wait(self, robot: SimRobot, cycles: int, quiet: int) -> None:
        robot.wait(cycles, quiet)
        if self._pace is not None:
            self._pace.wait()

    def on_wait(self, pause: Callable[[int], None]) -> None:
        """Who is called with a robot's index when it waits, and returns once it has woken."""
        self._pause = pause

    def _wait_for_others(self, robot: SimRobot, cycles: int, quiet: int) -> None:
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


class BoardKind(NamedTuple):
    """A kind of emulated board."""

    name: str
    find: Callable[[str], Path]
    """The bundled firmware for a pin map."""
    make: Callable[[Path], EmulatedBoard]
    """A board with some firmware."""


NATIVE = BoardKind("native", native_library, native_board)
AVR = BoardKind("avr", avr_image, avr.create)
KINDS = {kind.name: kind for kind in (AVR, NATIVE)}


def native_world(requests: Sequence[BoardRequest]) -> SimWorld:
    """Robots on the native board: the firmware's own C on this computer. Raises as `SimWorld`."""
    return SimWorld(requests, NATIVE)


def avr_world(requests: Sequence[BoardRequest]) -> SimWorld:
    """Robots on the emulated ATmega328P, with the image that would be flashed. Raises as `SimWorld`."""
    return SimWorld(requests, AVR)


def direct_world(requests: Sequence[BoardRequest]) -> SimWorld:
    """Robots without boards, which motor signals drive. Raises as `SimWorld`."""
    first = requests[0]
    return SimWorld([replace(first, arena=first.arena or DIRECT_ARENA), *requests[1:]], None)


def open_on(board: BoardKind, request: BoardRequest) -> SimSession:
    """One robot on a board, in a world that is closed with its session. Raises as `SimWorld`."""
    (session,) = SimWorld([request], board).sessions
    assert isinstance(session, SimSession)
    return session


def _add(sim: Sim, kind: BoardKind | None, request: BoardRequest, pose: tuple[float, float, float] | None) -> SimRobot:
    """Puts the request's robot into a world, with its board if it has one."""
    board = None
    if kind is not None and request.robot.has_board:
        board = _board(kind, request)
    try:
        if board is not None and request.gdb is not None:
            from sim_bridge.gdb import Gdb

            board.debugger = Gdb(_inner(board, "a debugger looks"), request.gdb, waits=request.gdb_waits)
        if board is not None and (request.notes or request.strict):
            _inner(board, "these notes look").check(strict=request.strict)
        return sim.add(board, request.robot, pose=pose, without=request.without, imperfections=request.imperfections)
    except Exception:
        if board is not None and not board.is_in_use():  # else the simulation's end is the board's
            board.close()
        raise


def _inner(board: EmulatedBoard, who: str) -> avr.AvrBoard:
    """Raises CallError of a board that `who` cannot look into."""
    if not isinstance(board, avr.AvrBoard):
        raise CallError(f"{who} into the emulated ATmega328P ({AVR.name}), not into the {board.description}")
    return board


def _board(kind: BoardKind, request: BoardRequest) -> EmulatedBoard:
    """With the request's program, or the kit's; behind a boot loader and for a robot of other programs with none."""
    robot = request.robot
    image = None if request.image is None else image_file(request.image)
    if request.bootloader is None:
        if image is None:
            robot.expect_kit()
        return kind.make(image or kind.find(robot.pin_map))
    if kind is not AVR:
        raise BoardError(f"a boot loader begins on an emulated Uno; expected avr, not {kind.name}")
    return avr.create(image or (kind.find(robot.pin_map) if robot.takes_brain else None), Path(request.bootloader))


def _new_sim(request: BoardRequest, step_s: float) -> Sim:
    """The world that a request wants, without robots; `step_s`: its step."""
    return Sim(
        load_arena(request.arena),
        seed=request.seed,
        noise=request.noise,
        record=request.record,
        step_cycles=round(step_s * CLOCK_HZ),
    )
