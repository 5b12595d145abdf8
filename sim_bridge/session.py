"""A robot in a simulated world as the host opens it: bytes, pins, truth.

`open_native` and `open_avr` are what the entry points of the group `boebot.boards` name. A session joins one emulated
board to a body in an arena, by the robot's description; the loop that advances both is C (loop.h), and Python is called
only where somebody reads or writes bytes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from boebot import robots
from boebot.boards import BoardRequest, Truth
from boebot.errors import BoardError
from sim_bridge.arena import load_arena
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import EmulatedBoard, avr_board, avr_image, image_file, native_board, native_library
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Floats, Sim, SimRobot

DEFAULT_BAUD = 500_000  # of a robot whose description names no serial line


class SimTransport:
    """The board's serial line, in this process. Time passes only while `read` waits."""

    realtime = False
    baud_given = False

    def __init__(self, robot: SimRobot, name: str, paced: bool = False) -> None:
        """`paced`: `read` also waits until as much time has passed on the wall."""
        self.name = name
        self.baud = _baud(robot.description)
        self._robot = robot
        self._sim = robot.sim
        self._pace = Pace(robot.sim) if paced else None
        self._closed = False

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """Advances by `quiet_s`, then until bytes have come and the line is idle, at most by `wait_s` in all."""
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """As `read`, with the instant at which the last byte had come (s)."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        # of any time at all at least one cycle: a wait that lets no time pass would be repeated for ever
        cycles = int(wait_s * CLOCK_HZ + 0.5) or 1 if wait_s > 0.0 else 0
        quiet = int(quiet_s * CLOCK_HZ + 0.5) or 1 if quiet_s > 0.0 else 0
        sim = self._sim
        sim.run(cycles, quiet, self._robot)
        if self._pace is not None:
            self._pace.wait()
        data = self._robot.receive()
        return [(self._robot.last_byte_cycle / CLOCK_HZ, data)] if data else []

    def set_baud(self, rate: int) -> None:
        """Another bit rate of this side of the line, from now on; what was received so far is forgotten."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        self._robot.line_rate(rate)
        self.baud = rate
        self._robot.receive()

    def write(self, data: bytes) -> None:
        """Sends bytes, back to back from now on."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        self._robot.send(data)

    def now(self) -> float:
        """Simulated time since power-on (s)."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        return self._sim.cycle / CLOCK_HZ

    def close(self) -> None:
        """Nothing is sent or received any more."""
        self._closed = True


class Pace:
    """Holds simulated time to the wall clock."""

    LAG_S = 0.5  # what cannot be caught up is forgotten

    def __init__(self, sim: Sim) -> None:
        self._sim = sim
        self._start = time.monotonic() - sim.cycle / CLOCK_HZ

    def due(self) -> int:
        """Cycles that the wall clock is ahead of the simulation."""
        ahead = time.monotonic() - self._start - self._sim.cycle / CLOCK_HZ
        if ahead > self.LAG_S:
            self._start += ahead
            ahead = 0.0
        return max(0, int(ahead * CLOCK_HZ))

    def wait(self) -> None:
        """Sleeps until the wall clock has caught up."""
        behind = self._sim.cycle / CLOCK_HZ + self._start - time.monotonic()
        if behind > 0:
            time.sleep(behind)
        elif behind < -self.LAG_S:
            self._start -= behind


class SimSession:
    """An opened simulated robot (BoardSession of boebot.boards)."""

    def __init__(self, robot: SimRobot, kind: str, paced: bool = False) -> None:
        self.robot = robot
        self.sim = robot.sim
        self.arena = robot.sim.arena
        self.description = f"{robot.board.description} in arena {self.arena.name}"
        self.transport = SimTransport(robot, kind, paced)
        self.transport.set_baud(self.transport.baud)
        self.board = BoardPins(robot)
        self._closed = False

    def truth(self) -> Truth | None:
        """What happened so far; None without recording."""
        columns = self.robot.truth()
        if not len(columns["time"]):
            return None
        return Truth(
            time=columns["time"],
            x=columns["x"],
            y=columns["y"],
            heading=columns["heading"],
            contact=columns["contact"] > 0,
            left_speed=columns["left"],
            right_speed=columns["right"],
            arena_name=self.arena.name,
            outlines=self.arena.outlines,
        )

    def looks(self) -> dict[str, Floats]:
        """Where the range sensors looked from and what they saw: columns `LOOK`."""
        return self.robot.looks()

    def counters(self) -> Mapping[str, float]:
        """Counters of the board, and `contacts`, `distance` (m), `time` (s), `load` (share of cycles executed)."""
        board = self.board.counters()
        cycle = self.sim.cycle
        return {
            **board,
            "contacts": float(self.robot.contacts),
            "distance": float(self.robot.body().distance),
            "time": cycle / CLOCK_HZ,
            "load": board["executed_cycles"] / cycle if cycle else 0.0,
            "supply_voltage": self.robot.supply_voltage,
        }

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        if self._closed:
            return
        self._closed = True
        self.transport.close()
        self.sim.close()


def open_native(request: BoardRequest) -> SimSession:
    """Opens the native board: the firmware's own C on this computer."""
    library = native_library(request.robot.pin_map) if request.image is None else image_file(request.image)
    return _open(request, "native", lambda: native_board(library))


def open_avr(request: BoardRequest) -> SimSession:
    """Opens the emulated ATmega328P with the image that would be flashed."""
    image = avr_image(request.robot.pin_map) if request.image is None else image_file(request.image)
    return _open(request, "avr", lambda: avr_board(image))


def _baud(robot: robots.RobotDescription) -> int:
    """Of the robot's serial line."""
    uart = robot.device.get("uart")
    return uart.baud if isinstance(uart, robots.Uart) else DEFAULT_BAUD


def _open(request: BoardRequest, kind: str, make: Callable[[], EmulatedBoard]) -> SimSession:
    step_cycles = round(float(request.options.get("world_step_s", 0.001)) * CLOCK_HZ)
    sim = Sim(
        load_arena(request.arena),
        seed=request.seed,
        noise=request.noise,
        record=request.record,
        step_cycles=step_cycles,
    )
    board = make()
    try:
        robot = sim.add(board, request.robot, pose=request.start_pose)
    except Exception:
        sim.close()
        board.close()
        raise
    return SimSession(robot, kind, request.realtime)
