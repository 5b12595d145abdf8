"""One robot of a simulation as Python calls it: its line, its motor signals and readings, its truth, its logs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import shown, whole
from boebot.description import robots
from boebot.errors import BoardError, BrainError
from sim_bridge._core import ffi, lib
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import EmulatedBoard
from sim_bridge.vehicle import ENDS

if TYPE_CHECKING:
    from sim_bridge.sim import Sim

TRUTH = ("time", "x", "y", "heading", "speed", "turn_rate", "left", "right", "contact")
TONE = ("time", "duration", "frequency")
LOOK = ("time", "kind", "x", "y", "heading", "beam", "reach", "distance")

BAUD_MAXIMUM = 4_000_000
ROOM = 1024  # bytes that are fetched at a time
PORTION_CYCLES = CLOCK_HZ  # of a long run, between two chances for Ctrl-C

Floats = NDArray[np.float64]


class SimRobot:
    """One robot of a simulation: its line, its truth, its logs. Given by `Sim.add` and `Sim.robot`."""

    def __init__(self, sim: Sim, number: int) -> None:
        self.sim, self.number = sim, number
        self._count = ffi.new("size_t *")
        self._room = ffi.new("uint8_t[]", ROOM)
        self._view = ffi.buffer(self._room)

    @property
    def board(self) -> EmulatedBoard:
        """Its board; another one after `Sim.restore`.

        Raises:
            BoardError: it has none.
        """
        board = self.sim.members[self.number].board
        if board is None:
            raise BoardError(f"robot {self.description.name!r} has no board")
        return board

    @property
    def description(self) -> robots.RobotDescription:
        """What it was built from."""
        return self.sim.members[self.number].description

    @property
    def _handle(self) -> Any:
        return self.sim.handle

    def receive(self) -> bytes:
        """Bytes that left the board since the last call."""
        handle, number, room = self.sim.handle, self.number, self._room
        count = lib.sim_receive(handle, number, room, ROOM)
        data: bytes = self._view[:count]
        while count == ROOM:
            count = lib.sim_receive(handle, number, room, ROOM)
            data += self._view[:count]
        return data

    def send(self, data: bytes | bytearray | memoryview) -> None:
        """Bytes to the board, from now on.

        Raises:
            BoardError: they are none, or the robot has no board.
        """
        if not isinstance(data, bytes | bytearray | memoryview):
            raise BoardError(f"send: got {shown(data)}; expected bytes")
        data = bytes(data)
        if lib.sim_send(self.sim.handle, self.number, data, len(data)) != lib.SIM_OK:
            self._need_board("bytes")

    # ---- without a board ---------------------------------------------------------------------------------------------

    @property
    def layout(self) -> Mapping[str, slice]:
        """Where the readings of each device stand; of a robot without a board."""
        model = self.sim.members[self.number].model
        return {} if model is None else dict(model.names)

    def readings(self) -> tuple[float, ...]:
        """All readings now, in SI units; of a robot without a board."""
        readings = lib.sim_readings(self._handle, self.number, self._count)
        return tuple(ffi.unpack(readings, self._count[0])) if self._count[0] else ()

    def signals(self, left: float, right: float) -> None:
        """Motor signals from now on, of a robot without a board; what is beyond -1 to 1 is limited.

        Raises:
            BrainError: they are no finite numbers.
            BoardError: the robot is driven by its board.
        """
        if self.description.has_board:
            raise BoardError(f"robot {self.description.name!r} is driven by its board; expected bytes for it")
        try:
            status = lib.sim_signals(self._handle, self.number, left, right)
        except (TypeError, OverflowError):
            status = lib.SIM_BAD_ARGUMENT
        if status != lib.SIM_OK:
            raise BrainError(f"motor signals {shown(left)}, {shown(right)}; expected two finite numbers")

    @property
    def ended(self) -> str:
        """Why a robot without a board can go no further, or ""."""
        return ENDS[lib.sim_vehicle_flag(self._handle, self.number)]

    # ---- its line ----------------------------------------------------------------------------------------------------

    def listen(self, cycle: int) -> None:
        """From that cycle on its bytes end a run of `Sim.run_until`."""
        cycle = whole("listen: the cycle", cycle, BoardError, least=0, most=2**64 - 1)
        lib.sim_listen(self._handle, self.number, cycle)

    def wait(self, cycles: int, quiet: int) -> None:
        """Lets that many cycles pass; after `quiet` of them (0: 1) only until a robot speaks that is listened to, as
        this one is then.

        Raises:
            BoardError: a board's program crashed.
        """
        sim, quiet = self.sim, quiet or 1
        if cycles <= PORTION_CYCLES:
            if crashed := lib.sim_run_for(sim.handle, self.number, cycles, quiet):
                sim.check(crashed)
        else:
            now = sim.cycle
            self.listen(now + quiet)
            sim.run_until(now + cycles)

    @property
    def speaks(self) -> bool:
        """Bytes have come since it is listened to, and the line has been idle since."""
        return bool(lib.sim_speaks(self._handle, self.number))

    def line_rate(self, baud: int) -> None:
        """Bit rate of the outside's side of the serial line.

        Raises:
            BoardError: there is no such rate, or the robot has no board.
        """
        baud = whole("line_rate: the rate", baud, BoardError, least=1, most=BAUD_MAXIMUM)
        self._need_board("a line")
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
        """The body's state now (a C struct body_state of its own): pose, speeds, wheel angles, distance, contact."""
        body = ffi.new("body_state *")
        lib.sim_body(self._handle, self.number, body)
        return body

    def _need_board(self, what: str) -> None:
        if not self.description.has_board:
            raise BoardError(f"robot {self.description.name!r} has no board, and so no {what}")

    def _rows(self, rows: Any, columns: tuple[str, ...]) -> dict[str, Floats]:
        count = self._count[0]
        size = count * len(columns) * 8
        table = np.frombuffer(ffi.buffer(rows, size)[:] if count else b"", dtype=np.float64)
        return dict(zip(columns, table.reshape(-1, len(columns)).T, strict=True))

    def truth(self) -> dict[str, Floats]:
        """Columns `TRUTH`, one row every 10 ms; empty without recording."""
        return self._rows(lib.sim_record(self._handle, self.number, self._count), TRUTH)

    def truth_to_now(self) -> dict[str, Floats]:
        """The same with a row of now at its end, of a robot whose run ends with a world step."""
        columns, body = self.truth(), self.body()
        half = self.description.body.track_width_m / 2
        left, right = body.speed - half * body.turn_rate, body.speed + half * body.turn_rate  # (2.18), (2.19)
        now = (self.sim.cycle / CLOCK_HZ, body.x, body.y, body.heading, body.speed, body.turn_rate, left, right)
        if not len(columns["time"]) or columns["time"][-1] >= now[0]:
            return columns
        row = dict(zip(TRUTH, (*now, float(body.touching != 0)), strict=True))
        return {name: np.append(values, row[name]) for name, values in columns.items()}

    def tones(self) -> dict[str, Floats]:
        """Columns `TONE`, one row per tone that a buzzer has sounded."""
        return self._rows(lib.sim_tones(self._handle, self.number, self._count), TONE)

    def turret_angle(self, pin: int) -> float:
        """Of the turret on that pin, rad, counter-clockwise from straight ahead."""
        return float(lib.sim_turret_angle(self._handle, self.number, pin))

    def looks(self) -> dict[str, Floats]:
        """Columns `LOOK`, one row per IR burst (kind 0) and Ping (kind 1); empty without recording."""
        return self._rows(lib.sim_looks(self._handle, self.number, self._count), LOOK)
