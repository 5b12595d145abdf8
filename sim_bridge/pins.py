"""The pins of a simulated robot's board, and what else a test reaches for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import number, shown, whole
from boebot.boards import PinNow
from boebot.devices.device import ANALOG_PINS
from boebot.errors import BoardError
from boebot.record.blocks import Block, Group
from boebot.record.record import LINE_FRAME
from sim_bridge.boards.board import (
    CLOCK_HZ,
    EDGE,
    FRACTION,
    BoardMemory,
    EmulatedBoard,
    Level,
    ResetCause,
    checked_pin,
)
from sim_bridge.compiled import ffi, lib
from sim_bridge.sim import CYCLES_MAXIMUM, SimRobot

SUPPLY_MAXIMUM_V = 30.0
EDGES_MAXIMUM = 10_000_000  # of a square wave
GUARD = 64  # cycles; BOARD_GUARD_CYCLES of board.h
EDGES_KEPT = 1 << 20  # SIM_EDGES_KEPT of loop.h
EDGES_SHOWN = 20_000  # newest ones that `BoardPins.now` looks at, of SHOWN cycles
SHOWN = CLOCK_HZ // 10
# Of the data space: double speed; receiver, transmitter (ATmega328P data sheet 20.11.2, 20.11.3).
UCSR0A, U2X0, UCSR0B, RXEN0, TXEN0 = 0xC0, 1 << 1, 0xC1, 1 << 4, 1 << 3


class BoardPins(BoardMemory):
    """The board's pins, its memory and what else a test reaches for.

    Pins by Arduino number 0..19 (A0 is 14); levels LOW 0, HIGH 1, RELEASED 2.
    """

    def __init__(self, robot: SimRobot) -> None:
        self._robot = robot
        self._sim = robot.sim

    @property
    def board(self) -> EmulatedBoard:
        """The board itself."""
        return self._robot.board

    @property
    def _with_board(self) -> Any:
        """The robot in C; raises BoardError where it has no board."""
        _ = self.board
        return self._robot.handle

    @property
    def reset_cycle(self) -> int:
        """At which the program was last started by `reset`; 0 before."""
        return int(self._robot.handle.reset_at)

    @property
    def cycle(self) -> int:
        """Now, in cycles since power-on."""
        return self._sim.cycle

    @property
    def edge_count(self) -> int:
        """Output edges of the board so far."""
        return int(self._robot.handle.edges.count)

    def pin_log(self, newest: int = EDGES_KEPT) -> NDArray[Any]:
        """The board's `newest` output edges (dtype EDGE), a million at most, oldest first."""
        newest = whole("pin_log: newest", newest, BoardError, least=0, most=CYCLES_MAXIMUM)
        count = min(self.edge_count, EDGES_KEPT, newest)
        log = np.empty(count, dtype=EDGE)
        edges = ffi.addressof(self._robot.handle, "edges")
        lib.edge_log_copy(edges, ffi.from_buffer("board_edge[]", log, require_writable=True), count)
        return log

    def uses_line(self, what: int) -> bool:
        """The program has switched its receiver (RXEN0) or transmitter (TXEN0) on; of a native board it always has."""
        return self.board.extension("data", "uint8_t") is None or bool(self.read_memory(UCSR0B, 1)[0] & what)

    def bit_cycles(self) -> int:
        """That a bit takes the serial line of an emulated ATmega328P, by its registers (data sheet, table 20-1)."""
        registers = self.read_memory(UCSR0A, 6)  # with UBRR0, 12 bits, at the end
        return (int.from_bytes(registers[4:], "little") % 0x1000 + 1) * (8 if registers[0] & U2X0 else 16)

    def now(self) -> list[PinNow]:
        """What is at the board's pins, for people; empty of a board that cannot be seen into."""
        log, robot, found = self.pin_log(EDGES_SHOWN), self._robot.handle, []
        for pin, level in enumerate(self.levels()):
            does, share, rate = self.output(pin), None, None
            edges = log[(log["pin"] == pin) & (log["cycle"] + SHOWN >= self.cycle)]
            rises = np.flatnonzero(edges["level"] == Level.HIGH)
            if does <= Level.HIGH and len(rises) > 1:  # over whole periods
                whole_ones = edges[rises[0] : rises[-1] + 1]
                lengths = np.diff(whole_ones["cycle"]).astype(float)
                share = float(lengths[whole_ones["level"][:-1] == Level.HIGH].sum() / lengths.sum())
                rate = float((len(rises) - 1) / lengths.sum() * CLOCK_HZ)
            channel = pin - ANALOG_PINS[0]
            volts = robot.sampled[channel] if channel >= 0 else math.nan
            found.append(PinNow(int(does), level, share, rate, None if math.isnan(volts) else volts))
        return found

    def drive(self, pin: int, level: int, at_cycle: int | None = None) -> None:
        """Takes a pin from its part and drives it from `at_cycle` on (now)."""
        at = self._sim.cycle + GUARD if at_cycle is None else at_cycle
        at = max(0, whole("drive: at_cycle", at, BoardError, least=-CYCLES_MAXIMUM, most=CYCLES_MAXIMUM))
        level = whole("drive: the level", level, BoardError, least=0, most=Level.RELEASED)
        lib.robot_drive(self._with_board, at, checked_pin("drive", pin), level)

    def drive_edges(self, pin: int, cycles: NDArray[np.uint64], levels: NDArray[np.uint8]) -> None:
        """Takes a pin from its part and drives it to each of these levels from its cycle on; the earliest is first."""
        at, to = ffi.from_buffer("uint64_t[]", cycles), ffi.from_buffer("uint8_t[]", levels)
        lib.robot_drive_edges(self._with_board, checked_pin("drive", pin), at, to, min(len(cycles), len(levels)))

    def release(self, pin: int) -> None:
        """Gives a pin back to its part, or lets go of it."""
        lib.robot_release(self._with_board, checked_pin("release", pin))

    def analog(self, channel: int, volts: float) -> None:
        """Holds the voltage at analog channel 0..5, until its pin is driven or released. The pin's level follows: low
        below 0.3 of the supply, high above 0.6 of it, and else it stays (ATmega328P data sheet, section 29.2)."""
        channel = whole("analog: the channel", channel, BoardError, least=0, most=5)
        volts = number("analog: the voltage", volts, BoardError, least=0, most=5.5)
        share = volts / max(self._robot.supply_voltage, 1e-6)
        if not 0.3 <= share <= 0.6:
            lib.robot_drive(self._with_board, 0, ANALOG_PINS[channel], share > 0.6)
        self._with_board.held[channel] = volts

    def square_wave(self, pin: int, period: int, seconds: float) -> None:
        """Takes a pin from its part; its level changes every half `period` (cycles) for that long."""
        half = whole("square_wave: the period", period, BoardError, least=2, most=2**32 - 1) // 2
        most = EDGES_MAXIMUM * half / CLOCK_HZ
        seconds = number("square_wave: seconds", seconds, BoardError, least=0, most=most)
        level = self._with_board.chassis.driven[checked_pin("square_wave", pin)]
        start = self._sim.handle.world_at + GUARD  # edges up to there are queued already
        edges = np.arange(0, round(seconds * CLOCK_HZ) + 1, half, dtype=np.uint64)
        levels = (np.arange(len(edges)) + level) % 2
        levels[0] = level  # ends what was queued
        self.drive_edges(pin, start + edges, levels.astype(np.uint8))

    def unplug(self, device: str) -> None:
        """Pulls the plug of a device of the robot's description: it hears and drives nothing."""
        self._plug(device, unplugged=True)

    def plug(self, device: str) -> None:
        """Puts the plug in again."""
        self._plug(device, unplugged=False)

    def _plug(self, device: str, *, unplugged: bool) -> None:
        if device not in (parts := self._robot.parts):
            raise BoardError(f"device {device!r}: the robot has no such thing")
        lib.robot_unplug(self._robot.handle, parts[device], unplugged)

    def supply(self, volts: float | None) -> None:
        """Holds the 5 V rail of board and servos at that voltage; None: what the regulator gives."""
        held = 0.0  # not held
        if volts is not None:
            held = max(number("supply: the voltage", volts, BoardError, least=0, most=SUPPLY_MAXIMUM_V), 1e-6)
        self._with_board.held_supply = held / lib.SUPPLY_NOMINAL_V
        lib.robot_update_supply(self._robot.handle)

    def brown_out(self, **changes: float) -> None:
        """What a weak supply does to the board: reset_v, hysteresis_v, erratic_v, upsets_per_s (parts/brown_out.h).

        What is not named is as the data sheet has it; upsets 2 per second at the worst.
        """
        values = {"reset_v": 2.7, "hysteresis_v": 0.05, "erratic_v": 3.78, "upsets_per_s": 2.0}
        for name, value in changes.items():
            if name not in values:
                raise BoardError(f"brown_out: there is no {name!r}; expected one of {', '.join(values)}")
            values[name] = number(f"brown_out: {name}", value, BoardError, least=0)
        if values["reset_v"] >= values["erratic_v"]:
            raise BoardError(f"brown_out: reset_v is {values['reset_v']:g}; expected less than erratic_v")
        self._with_board.brown_out.parameters = values

    def reset(self, cause: str = "external") -> None:
        """Resets the microcontroller: power, external, brown_out or watchdog."""
        causes = {one.name.lower(): one for one in ResetCause}
        if cause not in causes:
            raise BoardError(f"reset: there is no cause {shown(cause)}; expected one of {', '.join(causes)}")
        self._robot.handle.reset_at = self.cycle
        self.board.handle.op.reset(self.board.handle, causes[cause])


class PinRecorder:
    """The streams "pins" of a record, the output edges of a board, and of what the outside does "inputs", "line_in" and
    "line_out"."""

    def __init__(self, pins: BoardPins) -> None:
        self._pins = pins
        self._seen = pins.edge_count
        self._kept: list[NDArray[Any]] = []
        pins.log_outside()

    def collect(self) -> None:
        """Called now and then, before the simulator forgets edges, of which it keeps `EDGES_KEPT`."""
        if self._pins.edge_count - self._seen > EDGES_KEPT // 4:
            self._take()

    def drain(self) -> Group:
        """The streams since they were last drained: rows as of boebot.record.record."""
        self._take()
        edges = np.concatenate(self._kept)
        self._kept.clear()
        return streams_of({"pins": edges, **self._pins.outside_log()})

    def _take(self) -> None:
        new = self._pins.edge_count - self._seen
        self._seen += new
        self._kept.append(self._pins.pin_log(new))


STREAMS = {"pins": "pins", "driven": "inputs", "to_board": "line_in", "from_board": "line_out"}
"""of a record, by what is logged of a board's pins and line"""
EDGE_LOGS = ("pins", "driven")  # the others are of frames


def streams_of(log: Mapping[str, NDArray[Any]]) -> Group:
    """What is logged of a board, by the names in STREAMS, as the streams of a record; without empty ones."""
    rows = {STREAMS[name]: (_edges if name in EDGE_LOGS else _frames)(found) for name, found in log.items()}
    return {name: block for name, block in rows.items() if len(block)}


def _edges(edges: NDArray[Any]) -> Block:
    rows = np.column_stack((edges["pin"], edges["level"]))
    return Block(edges["cycle"] / CLOCK_HZ, rows.tobytes(), np.array([rows.shape[1]], dtype=np.uint32))


def _frames(frames: NDArray[Any]) -> Block:
    rows = frames[["bit_time", "bits", "byte"]].astype(LINE_FRAME)
    return Block(
        frames["start"] / FRACTION / CLOCK_HZ, rows.tobytes(), np.array([LINE_FRAME.itemsize], dtype=np.uint32)
    )
