"""Devices at the pins of an emulated board that answer at the cycle of what the board does: a two-wire device, the
capacitor of a light sensor, an infra-red receiver."""

from __future__ import annotations

from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US
from sim_bridge.boards.board import Level
from sim_bridge.pins import BoardPins
from sim_bridge.tests.boards.access import BoardAccess

SDA, SCL = 18, 19
LATER = 16  # cycles from an edge to the answer


class TwoWireDevice:
    """Registers on the two-wire bus, bit by bit after NXP UM10204; SDA is low where board or device pulls it."""

    def __init__(self, pins: BoardPins | BoardAccess, address: int) -> None:
        self.registers = bytearray(16)
        self.plugged = True
        self.bytes_moved = 0
        self._pins, self._address = pins, address
        self._state, self._bit, self._shift, self._pointer, self._pointer_set = "idle", -1, 0, 0, False
        self._data = self._clock = True
        self._pulls = self._holds = False
        for pin, react in ((SDA, self._on_data), (SCL, self._on_clock)):
            pins.drive(pin, Level.HIGH)  # the module's pull-ups
            pins.board.on_edge(pin, react)

    def hold(self, holds: bool) -> None:
        """Holds the data line, or lets go of it."""
        self._holds, self._state = holds, "idle"
        self._pull(holds, 0)

    def _pull(self, low: bool, cycle: int) -> None:
        if low != self._pulls:
            self._pulls = low
            self._pins.drive(SDA, Level.LOW if low else Level.HIGH, cycle + LATER)

    def _on_data(self, cycle: int, level: Level) -> None:
        data = level != Level.LOW
        if self._clock and data != self._data and not self._pulls and self.plugged:
            self._state, self._bit = ("idle" if data else "address"), -1
        self._data = data

    def _on_clock(self, cycle: int, level: Level) -> None:
        clock = level != Level.LOW
        if clock != self._clock and not self._holds:
            self._rise(self._data) if clock else self._fall(cycle)
        self._clock = clock

    def _rise(self, data: bool) -> None:
        if 0 <= self._bit < 8 and self._state != "read":
            self._shift = (self._shift << 1 | data) & 0xFF
        elif self._bit == 8 and self._state == "read" and data:
            self._state = "idle"  # the last byte

    def _fall(self, cycle: int) -> None:
        if self._state == "idle" or not self.plugged:
            self._pull(False, cycle)
            return
        self._bit += 1
        if self._bit == 8 and self._state != "read":
            self._pull(self._take_byte(), cycle)
        elif self._bit == 9:
            self.bytes_moved += 1
            self._bit = 0
            if self._state == "address":
                self._state, self._pointer_set = ("read" if self._shift & 1 else "write"), False
            if self._state == "read":
                self._shift = self.registers[self._pointer % 16]
                self._pointer += 1
            else:
                self._pull(False, cycle)
        if self._state == "read":
            self._pull(self._bit < 8 and not self._shift >> (7 - self._bit) & 1, cycle)

    def _take_byte(self) -> bool:
        if self._state == "address":
            if self._shift >> 1 != self._address:
                self._state = "idle"
                return False
        elif not self._pointer_set:
            self._pointer, self._pointer_set = self._shift, True
        else:
            self.registers[self._pointer % 16] = self._shift
            self._pointer += 1
        return True


class Capacitor:
    """Follows the pin while the board charges it, and is low `decay_us` after the board lets go."""

    def __init__(self, pins: BoardPins, pin: int, decay_us: float) -> None:
        self._pins, self._pin, self._decay, self._charged = pins, pin, round(decay_us * CYCLES_PER_US), False
        pins.board.on_edge(pin, self._on_edge)

    def _on_edge(self, cycle: int, level: Level) -> None:
        if level == Level.HIGH:
            self._charged = True
            self._pins.drive(self._pin, Level.HIGH, cycle + LATER)
        elif self._charged:
            self._charged = False
            self._pins.drive(self._pin, Level.LOW, cycle + self._decay)


class Receiver:
    """An IR receiver that sees every burst of the LED: low from half a millisecond after its beginning on, for 1 ms."""

    def __init__(self, pins: BoardPins, led: int, pin: int) -> None:
        self._pins, self._pin, self._until = pins, pin, 0
        pins.drive(pin, Level.HIGH)
        pins.board.on_edge(led, self._on_edge)

    def _on_edge(self, cycle: int, level: Level) -> None:
        if level == Level.HIGH and cycle > self._until:
            begin = cycle + CYCLES_PER_S // 2000
            self._until = begin + CYCLES_PER_S // 1000
            self._pins.drive(self._pin, Level.LOW, begin)
            self._pins.drive(self._pin, Level.HIGH, self._until)
