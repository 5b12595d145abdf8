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
from sim_bridge._core import lib
from sim_bridge.arena import load_arena
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import EmulatedBoard, avr_board, avr_image, image_file, native_board, native_library
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Floats, Sim

_sim_now, _last_byte, _send = lib.sim_now, lib.sim_last_byte, lib.sim_send
DEFAULT_BAUD = 500_000  # of a robot whose description names no serial line


class SimTransport:
    """The board's serial line, in this process. Time passes only while `read` waits."""

    realtime = False
    baud_given = False

    def __init__(self, sim: Sim, name: str, paced: bool = False) -> None:
        """`paced`: `read` also waits until as much time has passed on the wall."""
        self.name = name
        self.baud = _baud(sim.robot)
        self._sim = sim
        self._handle = sim.handle
        self._pace = Pace(sim) if paced else None
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
        sim.run(cycles, quiet)
        if self._pace is not None:
            self._pace.wait()
        data = sim.receive()
        return [(_last_byte(self._handle, 0) / CLOCK_HZ, data)] if data else []

    def set_baud(self, rate: int) -> None:
        """Another bit rate of this side of the line, from now on; what was received so far is forgotten."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        lib.sim_line_rate(self._handle, 0, rate)
        self.baud = rate
        self._sim.receive()

    def write(self, data: bytes) -> None:
        """Sends bytes, back to back from now on."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        _send(self._handle, 0, data, len(data))

    def now(self) -> float:
        """Simulated time since power-on (s)."""
        if self._closed:
            raise BoardError("the emulated board is closed")
        now: float = _sim_now(self._handle) / CLOCK_HZ
        return now

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

    def __init__(self, sim: Sim, kind: str, paced: bool = False) -> None:
        self.sim = sim
        self.arena = sim.arena
        self.description = f"{sim.board.description} in arena {sim.arena.name}"
        self.transport = SimTransport(sim, kind, paced)
        self.transport.set_baud(self.transport.baud)
        self.board = BoardPins(sim)
        self._closed = False

    def truth(self) -> Truth | None:
        """What happened so far; None without recording."""
        columns = self.sim.truth()
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
        return self.sim.looks()

    def counters(self) -> Mapping[str, float]:
        """Counters of the board, and `contacts`, `distance` (m), `time` (s), `load` (share of cycles executed)."""
        board = self.board.counters()
        cycle = self.sim.cycle
        return {
            **board,
            "contacts": float(lib.sim_contacts(self.sim.handle, 0)),
            "distance": float(self.sim.body().distance),
            "time": cycle / CLOCK_HZ,
            "load": board["executed_cycles"] / cycle if cycle else 0.0,
            "supply_voltage": float(lib.sim_supply_voltage(self.sim.handle, 0)),
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
    arena = load_arena(request.arena)
    board = make()
    try:
        sim = Sim(
            board,
            request.robot,
            arena,
            seed=request.seed,
            noise=request.noise,
            record=request.record,
            pose=request.start_pose,
            step_cycles=round(float(request.options.get("world_step_s", 0.001)) * CLOCK_HZ),
        )
    except Exception:
        board.close()
        raise
    return SimSession(sim, kind, request.realtime)
