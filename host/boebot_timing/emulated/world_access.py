"""A board in a simulated world, with all devices of its robot built, as a bench uses a board: the parts of the world
answer at its pins, and others may take some of the pins from them."""

from __future__ import annotations

from typing import Any

import msgspec
from numpy.typing import NDArray

from boebot.arenas import load_arena
from boebot.description.robots import RobotDescription
from sim_bridge.boards.avr import AvrBoard
from sim_bridge.boards.board import BoardMemory, EmulatedBoard, Level
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Sim

ARENA = "room"


def with_all_devices(robot: RobotDescription) -> RobotDescription:
    """The robot with every device of its pin map built and on."""
    device = {name: msgspec.structs.replace(one, on=True) for name, one in robot.device.items()}
    return msgspec.structs.replace(robot, device=device)


class WorldAccess(BoardMemory):
    """What a bench uses of a BoardAccess."""

    def __init__(self, board: AvrBoard, robot: RobotDescription, seed: int) -> None:
        """Puts the board into a room, without noise."""
        self._sim = Sim(load_arena(ARENA), seed=seed, noise=False, record=False)
        self._robot = self._sim.add(board, with_all_devices(robot))
        self._pins = BoardPins(self._robot)
        self._to_send: list[tuple[int, bytes]] = []
        self._edges_seen = 0

    @property
    def board(self) -> EmulatedBoard:
        """The board itself."""
        return self._robot.board

    @property
    def now(self) -> int:
        """The cycle up to which board and world have run."""
        return self._sim.cycle

    def advance(self, until: int) -> None:
        """Runs until that cycle. A crash raises BoardError."""
        while self._sim.cycle < until:
            while self._to_send and self._to_send[0][0] <= self._sim.cycle:
                self._robot.send(self._to_send.pop(0)[1])
            self._sim.run_until(min(until, self._to_send[0][0]) if self._to_send else until)

    def drive(self, pin: int, level: Level, at: int = 0) -> None:
        """Takes a pin from its part and drives it from cycle `at` on."""
        self._pins.drive(pin, int(level), at)

    def wave(self, pin: int, half: int, first: int, count: int, level: Level) -> None:
        """Drives a pin to `level` at cycle `first`, to the other level `half` cycles later, and so on."""
        for number in range(count):
            self.drive(pin, Level(int(level) ^ number & 1), first + number * half)

    def send(self, data: bytes, at: int = 0) -> None:
        """Puts bytes on the line towards the board, some cycles after `at`."""
        self._to_send.append((at, data))
        self._to_send.sort(key=lambda one: one[0])

    def received(self) -> tuple[bytes, list[int]]:
        """Bytes that left the board since the last call; all have the cycle of the last one."""
        data = self._robot.receive()
        return data, [self._robot.last_byte_cycle] * len(data)

    def edges(self) -> NDArray[Any]:
        """The output edges since the last call."""
        seen, self._edges_seen = self._edges_seen, self._pins.edge_count
        return self._pins.pin_log(self._edges_seen - seen)

    def close(self) -> None:
        """Frees world and board."""
        self._sim.close()
