"""A simulated robot as the host opens it: with a board bytes, pins and truth, without one readings and motor signals.

A session joins one robot to a world; the loop that advances both is C (loop/loop.h), and Python is called only where
somebody reads or writes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from boebot.boards import DEFAULT_BAUD, PinNow, TruthNow, WatchdogReset
from boebot.record.blocks import Group
from sim_bridge.boards.board import CLOCK_HZ, note_sentences, watchdog_resets
from sim_bridge.pins import BoardPins, PinRecorder
from sim_bridge.sessions.board_faults import KINDS, Acting
from sim_bridge.sim import NEVER, SimRobot
from sim_bridge.vehicles import STEP_S

Wait = Callable[[SimRobot, int, int], object]
"""Lets time pass for a robot: (robot, cycles, quiet) at most `cycles`; after `quiet` of them only until bytes come."""


class InWorld:
    """What every simulated robot's session offers: the truth, and hands that lift things. Of `BoardSession` and
    `VehicleSession` of boebot.boards."""

    def __init__(self, robot: SimRobot, *, shared: bool) -> None:
        """`shared`: the world is not this robot's alone, and is closed by somebody else."""
        self.robot = robot
        self._shared = shared
        self.sim = robot.sim
        self.arena = robot.sim.arena

    def truth_now(self) -> TruthNow:
        """Where the robot and the arena's moving shapes are."""
        return self.robot.truth_now()

    @property
    def layout(self) -> Mapping[str, slice]:
        """Where the readings of each device stand."""
        return self.robot.layout

    def readings(self) -> tuple[float, ...]:
        """All readings: see `SimRobot.readings`."""
        return self.robot.readings()

    def set_part(self, device: str, value: float) -> None:
        """Works a device: see `SimRobot.set_part`."""
        self.robot.set_part(device, value)

    def fault(self, owner: str, kind: str, value: float, begin_s: float, end_s: float) -> Callable[[], int]:
        """See `boebot.boards.Session`."""
        begin, end = _cycle(begin_s), _cycle(end_s)
        if end <= self.sim.cycle:
            return lambda: 0  # it was over before the first step of the brain was: it never acts
        return self.robot.fault(owner, kind, value, begin, end)

    def place(self, x: float, y: float, heading: float) -> None:
        """Lifts the robot and puts it there, at rest."""
        self.robot.place(x, y, heading)

    def place_shape(self, index: int, x: float, y: float, heading: float) -> None:
        """Puts a moving shape there; it goes on along its way shifted by as much."""
        self.sim.place_shape(index, (x, y, heading))

    def drain(self, *, ended: bool = False) -> Group:
        """See `boebot.boards.Session`. What belongs to the world goes with its first robot."""
        robot = self.robot
        world = self.sim.drain(ended=ended) if robot.number == min(self.sim.members) else {}
        return {**robot.drain(to_now=ended and not robot.description.has_board), **world}

    def counters(self) -> Mapping[str, float]:
        """`time_s`, and what only a simulator knows: `true_contacts`, `true_distance_m`."""
        return {
            "true_contacts": float(self.robot.true_contacts),
            "true_distance_m": float(self.robot.body().distance),
            "time_s": self.sim.cycle / CLOCK_HZ,
        }

    def close(self) -> None:
        """Frees board and world. May be called twice."""
        if not self._shared:
            self.sim.close()


class SimTransport:
    """The board's serial line, in this process. Time passes only while `read` waits.

    Attributes:
        baud: bit rate of this side; 0: the board's own, whatever that is.
    """

    realtime = False
    baud_given = False

    def __init__(self, robot: SimRobot, name: str, wait: Wait = SimRobot.wait, pins: PinRecorder | None = None) -> None:
        """`wait` lets time pass, and does what is due. `pins`: collects edges meanwhile."""
        self.name = name
        self.baud = robot.description.baud or DEFAULT_BAUD
        self._robot = robot
        self._sim = robot.sim
        self.wait = wait
        self._pins = pins
        self._stamps = False

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """Advances by `quiet_s`, then until bytes have come and the line is idle, at most by `wait_s` in all."""
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """As `read`, with the instant at which the last byte had come (s); byte by byte after `stamp`."""
        # of any time at all at least one cycle: a wait that lets no time pass would be repeated for ever
        cycles = int(wait_s * CLOCK_HZ + 0.5) or 1 if wait_s > 0.0 else 0
        quiet = int(quiet_s * CLOCK_HZ + 0.5) or 1 if quiet_s > 0.0 else 0
        self.wait(self._robot, cycles, quiet)
        if self._pins is not None:
            self._pins.collect()
        if self._stamps:
            data, came = self._robot.received()
            return [(cycle / CLOCK_HZ, bytes([byte])) for cycle, byte in zip(came, data, strict=True)]
        data = self._robot.receive()
        return [(self._robot.last_byte_cycle / CLOCK_HZ, data)] if data else []

    def set_baud(self, rate: int) -> None:
        """Another bit rate of this side of the line, from now on; what was received so far is forgotten."""
        self._robot.line_rate(rate)
        self.baud = rate
        self._robot.received()

    def follow(self) -> None:
        """From now on this side has the board's own bit rate, whatever that is."""
        self._robot.follow_line()
        self._stamps, self.baud = True, 0

    def stamp(self) -> None:
        """From now on `read_stamped` says of each byte when it had come."""
        self._robot.handle.is_stamped = self._stamps = True

    def write(self, data: bytes) -> None:
        """Sends bytes, back to back from now on."""
        self._robot.send(data)

    def now(self) -> float:
        """Simulated time since power-on (s)."""
        return self._sim.cycle / CLOCK_HZ

    def close(self) -> None:
        """It ends with its world."""


class SimSession(InWorld):
    """An opened simulated robot (BoardSession of boebot.boards)."""

    def __init__(self, robot: SimRobot, kind: str, wait: Wait, *, pins: bool = False, shared: bool = False) -> None:
        """`pins`: the board's edges are recorded."""
        super().__init__(robot, shared=shared)
        self.description = f"{robot.board.description} in arena {self.arena.name}"
        self.board = BoardPins(robot)
        self.recorder = PinRecorder(self.board) if pins else None
        self.transport = SimTransport(robot, kind, wait, self.recorder)
        self.transport.set_baud(self.transport.baud)
        self._notes: list[str] = []

    def drain(self, *, ended: bool = False) -> Group:
        """See `boebot.boards.BoardSession`."""
        edges = {} if self.recorder is None else self.recorder.drain()
        return {**super().drain(ended=ended), **edges}

    def counters(self) -> Mapping[str, float]:
        """Counters of the board, those of every simulated robot, `load` (share of cycles executed), `true_supply_v`."""
        board = self.board.counters()
        cycle = self.sim.cycle
        return {
            **board,
            **super().counters(),
            "load": board["executed_cycles"] / cycle if cycle else 0.0,
            "true_supply_v": self.robot.supply_voltage,
        }

    def fault(self, owner: str, kind: str, value: float, begin_s: float, end_s: float) -> Callable[[], int]:
        """See `boebot.boards.Session`."""
        if (act := KINDS.get(f"{owner}.{kind}")) is not None:
            baud, acting = self.transport.baud, list[Acting]()
            self.sim.at(_cycle(begin_s), lambda: acting.append(act(self.robot, baud, value)))
            self.sim.at(_cycle(end_s), lambda: acting[0][0]())
            return lambda: sum(fired() for _, fired in acting)
        return super().fault(owner, kind, value, begin_s, end_s)

    def texts(self) -> dict[str, str]:
        """See `boebot.boards.BoardSession`."""
        return self.robot.texts()

    def pins_now(self) -> list[PinNow]:
        """See `boebot.boards.BoardSession`."""
        return self.board.now()

    def notes(self) -> list[str]:
        """See `boebot.boards.BoardSession`."""
        self._notes += note_sentences(self.board.notes(since=len(self._notes)), self.robot.board.elf)
        assumed = self.robot.board.assumed
        return [assumed, *self._notes] if assumed else list(self._notes)

    def watchdog_resets(self) -> list[WatchdogReset]:
        """Where the watchdog of an emulated ATmega328P found the program; none of a board without one."""
        return watchdog_resets(self.board.watchdog_log(), self.robot.board.elf)


class DirectSession(InWorld):
    """An opened vehicle (VehicleSession of boebot.boards)."""

    tick_s = STEP_S

    def __init__(self, robot: SimRobot, wait: Wait, *, shared: bool = False) -> None:
        super().__init__(robot, shared=shared)
        self.description = f"robot without a board in arena {robot.sim.arena.name}"
        self._wait = wait
        self._cycles = round(STEP_S * CLOCK_HZ)

    def step(self, left: float, right: float) -> None:
        """One step under these motor signals."""
        self.robot.signals(left, right)
        self._wait(self.robot, self._cycles, self._cycles)

    def stop(self) -> None:
        """No motor signals from now on."""
        self.robot.signals(0.0, 0.0)

    @property
    def ended(self) -> str:
        """Why it can go no further, or ""."""
        return self.robot.ended


def _cycle(time_s: float) -> int:
    return NEVER if time_s == math.inf else round(time_s * CLOCK_HZ)
