"""The loop of boards and world (loop.h) as Python calls it: an arena and the robots in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import robots
from boebot.errors import ArenaError, BoardError
from sim_bridge import imperfections, switches
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import EmulatedBoard
from sim_bridge.joining import done, join
from sim_bridge.outline import collision_outline

TICK_CYCLES = 160_000  # of the firmware; a world step divides it
STEP_CYCLES = 16_000  # 1 ms
RECORD_CYCLES = 160_000  # 10 ms
NEVER = 2**64 - 1
TRUTH = ("time", "x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
TONE = ("time", "duration", "frequency")
LOOK = ("time", "kind", "x", "y", "heading", "beam", "reach", "distance")

Floats = NDArray[np.float64]


class Sim:
    """An arena and the robots in it, in lockstep with their boards. Seconds and SI units.

    A run is a function of arena, seed, robots by number, boards and what is sent to them: neither the order in which
    robots are added nor the way a run is cut into calls matters.
    """

    def __init__(
        self,
        arena: Arena,
        *,
        seed: int = 1,
        noise: bool = True,
        record: bool = True,
        step_cycles: int = STEP_CYCLES,
    ) -> None:
        """An arena without robots.

        Raises:
            ArenaError: too many moving obstacles.
            BoardError: a world step that does not divide the control tick.
        """
        if step_cycles <= 0 or TICK_CYCLES % step_cycles:
            raise BoardError(f"a world step of {step_cycles} cycles does not divide the control tick of {TICK_CYCLES}")
        moving = int(lib.arena_moving_count(arena.handle))
        if moving > lib.SIM_OBSTACLES_MAXIMUM:
            raise ArenaError(
                f"arena {arena.name}: {moving} moving obstacles; a simulation with boards takes "
                f"{lib.SIM_OBSTACLES_MAXIMUM} at most"
            )
        self.arena, self.seed, self.noise = arena, seed, noise
        handle = lib.sim_new(arena.handle, seed & (2**64 - 1), step_cycles, RECORD_CYCLES if record else 0, noise)
        if handle == ffi.NULL:
            raise MemoryError("simulation")
        self._members: dict[int, tuple[EmulatedBoard, robots.RobotDescription]] = {}
        self._outlines: list[Any] = []
        # Arena and boards outlive the simulation, whichever of them Python lets go of first. That a SimRobot is never
        # kept here leaves no cycle of references, in which the order would be anybody's guess.
        self.handle = ffi.gc(handle, lambda handle, keep=(arena, self._members): lib.sim_destroy(handle))

    def add(
        self,
        board: EmulatedBoard,
        description: robots.RobotDescription,
        *,
        pose: tuple[float, float, float] | None = None,
        number: int | None = None,
        without: Sequence[str] = (),
    ) -> SimRobot:
        """Puts a robot at `pose` (x, y, heading; m, m, rad), or where the arena says.

        `number` is its name in the run and the key of its noise and its imperfections: the next one if None.
        `without`: its imperfections that are switched off (switches.py).

        Raises:
            ArenaError: that place is not free.
            BoardError: the number is taken or negative, there are too many robots, or no such imperfection.
        """
        if number is None:
            number = max(self._members, default=-1) + 1
        if number < 0 or number in self._members:
            raise BoardError(f"robot number {number} is taken or negative")
        if len(self._members) == lib.BODY_MAXIMUM:
            raise BoardError(f"a simulation takes {len(self._members)} robots at most")
        x, y, heading = self.arena.start if pose is None else pose
        draw = imperfections.Draw(self.seed, self.noise, number, description.unit, without)
        corners = description.body.outline_m
        outline = collision_outline(f"robot {description.name!r}: body.outline_m", corners) if corners else ffi.NULL
        self._outlines.append(outline)  # bodies in C point to them
        body = imperfections.body_parameters(description.body, draw, outline)
        status = lib.sim_add_robot(self.handle, number, board.address, body, x, y, heading)
        if status == lib.SIM_NOT_FREE:
            raise ArenaError(
                f"arena {self.arena.name}: the robot cannot start at x = {x:g} m, y = {y:g} m: no free space"
            )
        done(status, f"the {board.description}")
        self._members[number] = board, description
        join(self.handle, number, switches.idealised(description, without), draw)
        return self.robot(number)

    def robot(self, number: int) -> SimRobot:
        """The robot of that number.

        Raises:
            BoardError: there is none.
        """
        if number not in self._members:
            raise BoardError(f"there is no robot number {number} in this simulation")
        return SimRobot(self, number, *self._members[number])

    @property
    def robots(self) -> list[SimRobot]:
        """All of them, by increasing number."""
        return [self.robot(number) for number in sorted(self._members)]

    @property
    def cycle(self) -> int:
        """Up to where the simulation has run."""
        return int(lib.sim_now(self.handle))

    def run(self, cycles: int, quiet: int = 0, hear: SimRobot | None = None) -> None:
        """Runs for at most `cycles`; after `quiet` of them, until bytes have come and the line is idle.

        `hear`: the robot whose bytes end the run; None: anybody's.

        Raises:
            BoardError: a board's program crashed.
        """
        number = lib.SIM_ANY if hear is None else hear.number
        self._check(lib.sim_run(self.handle, number, cycles, quiet))

    def run_until(self, cycle: int) -> None:
        """Runs until that cycle, or until a robot speaks that is listened to (see `SimRobot.listen`).

        Raises:
            BoardError: a board's program crashed.
        """
        self._check(lib.sim_run_until(self.handle, cycle))

    def _check(self, crashed: int) -> None:
        if crashed:
            board, _ = self._members[crashed - 1]
            whose = f" of robot {crashed}" if len(self._members) > 1 else ""
            fault = lib.board_fault(board.address)
            why = "unknown fault" if fault == ffi.NULL else ffi.string(fault).decode()
            raise BoardError(f"the {board.description}{whose} crashed at {self.cycle / CLOCK_HZ:.3f} s: {why}")

    def hash(self) -> int:
        """Of the whole state of all bodies, by robot number: equal for runs that are equal bit for bit."""
        return int(lib.sim_hash(self.handle))

    def close(self) -> None:
        """Frees the simulation, then the boards."""
        ffi.release(self.handle)
        for board, _ in self._members.values():
            board.close()


class SimRobot:
    """One robot of a simulation: its line, its truth, its logs. Given by `Sim.add` and `Sim.robot`."""

    def __init__(self, sim: Sim, number: int, board: EmulatedBoard, description: robots.RobotDescription) -> None:
        self.sim, self.number, self.board, self.description = sim, number, board, description
        self._handle = sim.handle
        self._bytes = ffi.new("uint8_t[]", 65536)
        self._count = ffi.new("size_t *")
        self._body = ffi.new("body_state *")

    def receive(self) -> bytes:
        """Bytes that left the board since the last call."""
        count = lib.sim_receive(self._handle, self.number, self._bytes, 65536)
        if not count:
            return b""
        data: bytes = ffi.buffer(self._bytes, count)[:]
        return data if count < 65536 else data + self.receive()

    def send(self, data: bytes) -> None:
        """Bytes to the board, from now on."""
        lib.sim_send(self._handle, self.number, data, len(data))

    def listen(self, cycle: int) -> None:
        """From that cycle on its bytes end a run of `Sim.run_until`."""
        lib.sim_listen(self._handle, self.number, cycle)

    @property
    def speaks(self) -> bool:
        """Bytes have come since it is listened to, and the line has been idle since."""
        return bool(lib.sim_speaks(self._handle, self.number))

    def line_rate(self, baud: int) -> None:
        """Bit rate of the outside's side of the serial line."""
        lib.sim_line_rate(self._handle, self.number, baud)

    @property
    def last_byte_cycle(self) -> int:
        """At which the last byte from the board had come."""
        return int(lib.sim_last_byte(self._handle, self.number))

    @property
    def contacts(self) -> int:
        """Touches begun so far; apart by 0.1 s at least."""
        return int(lib.sim_contacts(self._handle, self.number))

    @property
    def pack_voltage(self) -> float:
        """Of the battery, V."""
        return float(lib.sim_pack_voltage(self._handle, self.number))

    @property
    def supply_voltage(self) -> float:
        """Of the rail that the board runs on, V."""
        return float(lib.sim_supply_voltage(self._handle, self.number))

    def body(self) -> Any:
        """The body's state (C struct body_state): pose, speeds, wheel angles, distance, contact."""
        lib.sim_body(self._handle, self.number, self._body)
        return self._body

    def _rows(self, rows: Any, columns: tuple[str, ...]) -> dict[str, Floats]:
        count = self._count[0]
        size = count * len(columns) * 8
        table = np.frombuffer(ffi.buffer(rows, size)[:] if count else b"", dtype=np.float64)
        return dict(zip(columns, table.reshape(-1, len(columns)).T, strict=True))

    def truth(self) -> dict[str, Floats]:
        """Columns `TRUTH`, one row every 10 ms; empty without recording."""
        return self._rows(lib.sim_record(self._handle, self.number, self._count), TRUTH)

    def tones(self) -> dict[str, Floats]:
        """Columns `TONE`, one row per tone that a buzzer has sounded."""
        return self._rows(lib.sim_tones(self._handle, self.number, self._count), TONE)

    def turret_angle(self, pin: int) -> float:
        """Of the turret on that pin, rad, counter-clockwise from straight ahead."""
        return float(lib.sim_turret_angle(self._handle, self.number, pin))

    def looks(self) -> dict[str, Floats]:
        """Columns `LOOK`, one row per IR burst (kind 0) and Ping (kind 1); empty without recording."""
        return self._rows(lib.sim_looks(self._handle, self.number, self._count), LOOK)
