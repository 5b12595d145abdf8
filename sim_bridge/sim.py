"""The loop of board and world (loop.h) as Python calls it: one robot of a description in one arena."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import robots
from boebot.errors import ArenaError, BoardError
from sim_bridge import imperfections
from sim_bridge._core import ffi, lib
from sim_bridge.arena import Arena
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import EmulatedBoard

TICK_CYCLES = 160_000  # of the firmware; a world step divides it
STEP_CYCLES = 16_000  # 1 ms
RECORD_CYCLES = 160_000  # 10 ms
TRUTH = ("time", "x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
LOOK = ("time", "kind", "x", "y", "heading", "beam", "reach", "distance")

Floats = NDArray[np.float64]


class Sim:
    """An arena with one robot in it, in lockstep with its board. Seconds and SI units."""

    def __init__(
        self,
        board: EmulatedBoard,
        robot: robots.RobotDescription,
        arena: Arena,
        *,
        seed: int = 1,
        noise: bool = True,
        record: bool = True,
        pose: tuple[float, float, float] | None = None,
        step_cycles: int = STEP_CYCLES,
    ) -> None:
        """Puts the robot at `pose` (x, y, heading), or where the arena says.

        Raises:
            ArenaError: that place is not free.
            BoardError: a world step that does not divide the control tick.
        """
        if step_cycles <= 0 or TICK_CYCLES % step_cycles:
            raise BoardError(f"a world step of {step_cycles} cycles does not divide the control tick of {TICK_CYCLES}")
        self.board, self.robot, self.arena = board, robot, arena
        x, y, heading = arena.start if pose is None else pose
        if not arena.is_free(x, y, robot.body.radius_m):
            raise ArenaError(f"arena {arena.name}: the robot cannot start at x = {x:g} m, y = {y:g} m: no free space")
        draw = imperfections.Draw(seed, noise)
        handle = lib.sim_new(arena.handle, seed & (2**64 - 1), step_cycles, RECORD_CYCLES if record else 0, noise)
        if handle == ffi.NULL:
            raise MemoryError("simulation")
        # the board outlives the simulation, whichever of the two Python lets go of first
        self.handle = ffi.gc(handle, lambda handle, board=board: lib.sim_destroy(handle))
        _done(lib.sim_add_robot(handle, 0, board.address, imperfections.body_parameters(robot.body), x, y, heading))
        _done(lib.sim_add_battery(handle, 0, _battery_channel(robot), imperfections.battery_parameters()))
        for name, device in robot.device.items():
            if device.on:
                self._join(name, device, draw)
        self._bytes = ffi.new("uint8_t[]", 65536)
        self._count = ffi.new("size_t *")
        self._body = ffi.new("body_state *")

    def _join(self, name: str, device: robots.Device, draw: imperfections.Draw) -> None:
        """Joins a device to its pins; those without a part in the world are left alone."""
        side = lib.SIM_RIGHT if name.endswith("right") else lib.SIM_LEFT
        body = self.robot.body
        match device:
            case robots.ContinuousServo():
                servo = imperfections.servo_parameters(device, body, side, draw)
                _done(lib.sim_add_servo(self.handle, 0, side, robots.pin_number(device.pin), servo))
            case robots.Encoder():
                pin, edges = robots.pin_number(device.pin), device.edges_per_turn
                _done(lib.sim_add_encoder(self.handle, 0, side, pin, 255, edges))
            case robots.QuadratureEncoder():
                pin_a, pin_b = robots.pin_number(device.pin_a), robots.pin_number(device.pin_b)
                _done(lib.sim_add_encoder(self.handle, 0, side, pin_a, pin_b, device.edges_per_turn))
            case robots.Whisker():
                whisker = imperfections.whisker_parameters(device)
                _done(lib.sim_add_whisker(self.handle, 0, robots.pin_number(device.pin), whisker))
            case robots.InfraredPair():
                pair = imperfections.infrared_parameters(device)
                led, receiver = robots.pin_number(device.led_pin), robots.pin_number(device.receiver_pin)
                _done(lib.sim_add_infrared(self.handle, 0, led, receiver, pair))
            case robots.Ping():
                ping = imperfections.ping_parameters(device)
                _done(lib.sim_add_ping(self.handle, 0, robots.pin_number(device.pin), ping))

    @property
    def cycle(self) -> int:
        """Up to where the simulation has run."""
        return int(lib.sim_now(self.handle))

    def run(self, cycles: int, quiet: int = 0) -> None:
        """Runs for at most `cycles`; after `quiet` of them, until bytes have come and the line is idle.

        Raises:
            BoardError: the board's program crashed.
        """
        if lib.sim_run(self.handle, lib.SIM_ANY, cycles, quiet):
            fault = lib.board_fault(self.board.address)
            why = "unknown fault" if fault == ffi.NULL else ffi.string(fault).decode()
            raise BoardError(f"the {self.board.description} crashed at {self.cycle / CLOCK_HZ:.3f} s: {why}")

    def receive(self) -> bytes:
        """Bytes that left the board since the last call."""
        count = lib.sim_receive(self.handle, 0, self._bytes, 65536)
        if not count:
            return b""
        data: bytes = ffi.buffer(self._bytes, count)[:]
        return data if count < 65536 else data + self.receive()

    def send(self, data: bytes) -> None:
        """Bytes to the board, from now on."""
        lib.sim_send(self.handle, 0, data, len(data))

    def body(self) -> Any:
        """The body's state (C struct body_state): pose, speeds, wheel angles, distance, contact."""
        lib.sim_body(self.handle, 0, self._body)
        return self._body

    def _rows(self, rows: Any, columns: tuple[str, ...]) -> dict[str, Floats]:
        count = self._count[0]
        size = count * len(columns) * 8
        table = np.frombuffer(ffi.buffer(rows, size)[:] if count else b"", dtype=np.float64)
        return dict(zip(columns, table.reshape(-1, len(columns)).T, strict=True))

    def truth(self) -> dict[str, Floats]:
        """Columns `TRUTH`, one row every 10 ms; empty without recording."""
        return self._rows(lib.sim_record(self.handle, 0, self._count), TRUTH)

    def looks(self) -> dict[str, Floats]:
        """Columns `LOOK`, one row per IR burst (kind 0) and Ping (kind 1); empty without recording."""
        return self._rows(lib.sim_looks(self.handle, 0, self._count), LOOK)

    def hash(self) -> int:
        """Of the body's whole state: equal for runs that are equal bit for bit."""
        return int(lib.sim_hash(self.handle))

    def close(self) -> None:
        """Frees the simulation, then the board."""
        ffi.release(self.handle)
        self.board.close()


def _done(status: int) -> None:
    """Robot descriptions are checked when they are loaded; what fails here is memory or a mistake of ours."""
    if status < 0:
        raise MemoryError(f"simulation: error {status}")


def _battery_channel(robot: robots.RobotDescription) -> int:
    for device in robot.device.values():
        if isinstance(device, robots.Battery) and device.on:
            return robots.pin_number(device.pin) - 14
    return 255
