"""A robot with a board in a simulated world as the host opens it: bytes, pins, truth.

`open_native` and `open_avr` are what the entry points of the group `boebot.boards` name: called with one request they
give a session, their `together` puts several robots into one world (together.py), also such without boards. A session
joins one emulated board to a body in an arena, by the robot's description; the loop that advances both is C
(loop/loop.h), and Python is called only where somebody reads or writes bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from boebot.boards import BoardRequest, BoardSession, SharedWorld, VehicleSession, WatchdogReset
from boebot.description import robots
from boebot.devices.uart import Uart
from boebot.errors import BoardError
from boebot.record.blocks import Group
from sim_bridge.boards.board import CLOCK_HZ, note_sentences, watchdog_resets
from sim_bridge.boards.emulated import EmulatedBoard, avr_board, avr_image, image_file, native_board, native_library
from sim_bridge.pins import BoardPins, PinRecorder
from sim_bridge.sessions.opening import InWorld, Wait, alone, drain, new_sim
from sim_bridge.sessions.together import SimWorld
from sim_bridge.sessions.without_board import DirectSession, add_vehicle
from sim_bridge.sim import Floats, Sim, SimRobot

DEFAULT_BAUD = 500_000  # of a robot whose description names no serial line
STEP_S = 0.001  # of a world with boards


class SimTransport:
    """The board's serial line, in this process. Time passes only while `read` waits."""

    realtime = False
    baud_given = False

    def __init__(self, robot: SimRobot, name: str, wait: Wait | None = None, pins: PinRecorder | None = None) -> None:
        """`wait` lets time pass; None: for this robot alone. `pins`: collects edges meanwhile."""
        self.name = name
        self.baud = _baud(robot.description)
        self._robot = robot
        self._sim = robot.sim
        self._wait = wait or alone(robot.sim)
        self._pins = pins
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
        self._wait(self._robot, cycles, quiet)
        if self._pins is not None:
            self._pins.collect()
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


class SimSession(InWorld):
    """An opened simulated robot (BoardSession of boebot.boards)."""

    def __init__(self, robot: SimRobot, kind: str, wait: Wait, *, pins: bool = False, shared: bool = False) -> None:
        """`pins`: the board's edges are recorded. `shared`: the world is not this robot's alone, and is closed by
        somebody else."""
        super().__init__(robot)
        self.description = f"{robot.board.description} in arena {self.arena.name}"
        self.board = BoardPins(robot)
        self._pins = PinRecorder(self.board) if pins else None
        self.transport = SimTransport(robot, kind, wait, self._pins)
        self.transport.set_baud(self.transport.baud)
        self._shared = shared
        self._closed = False
        self._notes: list[str] = []

    def drain(self, *, ended: bool = False) -> Group:
        """See `boebot.boards.BoardSession`."""
        edges = {} if self._pins is None else self._pins.drain()
        return {**drain(self.robot, ended=ended), **edges}

    def looks(self) -> dict[str, Floats]:
        """Where the range sensors looked from and what they saw: columns `LOOK`."""
        return self.robot.looks()

    def counters(self) -> Mapping[str, float]:
        """Counters of the board, and `time_s`, `load` (share of cycles executed), and what only a simulator knows:
        `true_contacts`, `true_distance_m`, `true_supply_v`."""
        board = self.board.counters()
        cycle = self.sim.cycle
        return {
            **board,
            "true_contacts": float(self.robot.true_contacts),
            "true_distance_m": float(self.robot.body().distance),
            "time_s": cycle / CLOCK_HZ,
            "load": board["executed_cycles"] / cycle if cycle else 0.0,
            "true_supply_v": self.robot.supply_voltage,
        }

    def notes(self) -> list[str]:
        """See `boebot.boards.BoardSession`."""
        self._notes += note_sentences(self.board.notes(since=len(self._notes)), self.robot.board.elf)
        assumed = self.robot.board.assumed
        return [assumed, *self._notes] if assumed else list(self._notes)

    def watchdog_resets(self) -> list[WatchdogReset]:
        """Where the watchdog of an emulated ATmega328P found the program; none of a board without one."""
        return watchdog_resets(self.board.watchdog_log(), self.robot.board.elf)

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        if self._closed:
            return
        self._closed = True
        self.transport.close()
        if not self._shared:
            self.sim.close()


class BoardKind:
    """A kind of emulated board (TogetherFactory of boebot.boards)."""

    def __init__(self, name: str, find: Callable[[str], Path], make: Callable[[Path], EmulatedBoard]) -> None:
        """`find`: the bundled firmware for a pin map; `make`: a board with some firmware."""
        self.name = name
        self._find, self._make = find, make

    def __call__(self, request: BoardRequest) -> SimSession:
        """Opens one robot in a world that is its alone."""
        sim = new_sim(request, STEP_S)
        try:
            robot = self.add(sim, request)
        except Exception:
            sim.close()
            raise
        return SimSession(robot, self.name, alone(sim, paced=request.realtime), pins=request.pins)

    def together(self, requests: Sequence[BoardRequest]) -> SharedWorld:
        """Opens several robots in one world; those whose description has no board get none."""

        def open_shared(robot: SimRobot, wait: Wait) -> BoardSession | VehicleSession:
            if robot.description.has_board:
                return SimSession(robot, self.name, wait, pins=requests[0].pins, shared=True)
            return DirectSession(robot, wait, shared=True)

        return SimWorld(new_sim(requests[0], STEP_S), requests, self.add, open_shared)

    def add(self, sim: Sim, request: BoardRequest) -> SimRobot:
        """Puts the request's robot into a world, with its board if it has one."""
        if not request.robot.has_board:
            return add_vehicle(sim, request)
        find = self._find
        board = self._make(find(request.robot.pin_map) if request.image is None else image_file(request.image))
        try:
            return sim.add(
                board,
                request.robot,
                pose=request.start_pose,
                without=request.without,
                imperfections=request.imperfections,
            )
        except Exception:
            if not board.is_in_use():  # else the simulation's end is the board's
                board.close()
            raise


open_native = BoardKind("native", native_library, native_board)
"""The native board: the firmware's own C on this computer."""

open_avr = BoardKind("avr", avr_image, avr_board)
"""The emulated ATmega328P with the image that would be flashed."""


def _baud(robot: robots.RobotDescription) -> int:
    """Of the robot's serial line."""
    uart = robot.device.get("uart")
    return uart.baud if isinstance(uart, Uart) else DEFAULT_BAUD
