"""A board by itself on the bench, with devices at its pins that answer within a few microseconds: a two-wire device
and the capacitors of light sensors. Time goes by in slices of SLICE cycles; after each the devices look at what the
board does.

It has the face of a board session, so that a Rig speaks with the board as with any other.
"""

from __future__ import annotations

from pathlib import Path

from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, Rig
from sim_bridge.boards import avr
from sim_bridge.boards.board import BoardAccess, Level
from sim_bridge.boards.emulated import avr_image, image_file, native_board, native_library

SLICE = 32  # cycles: 2 us
SDA, SCL = 18, 19


def power_on(
    kind: str, pin_map: str = "shieldbot", image: str | None = None, bootloader: Path | None = None
) -> BoardAccess:
    """A board, native or avr, with the image of that pin map or another one, and with nothing around it; an avr behind
    a boot loader, if one is given."""
    if kind == "avr":
        return avr.create(image_file(image) if image else avr_image(pin_map), bootloader).access()
    return native_board(native_library(pin_map)).access()


class TwoWireDevice:
    """Registers on the two-wire bus, bit by bit after NXP UM10204; SDA is low where board or device pulls it."""

    def __init__(self, board: BoardAccess, address: int) -> None:
        self.registers = bytearray(16)
        self.plugged = True
        self.holds = False  # the data line
        self.bytes_moved = 0
        self._board, self._address = board, address
        self._state, self._bit, self._shift, self._pointer, self._pointer_set = "idle", -1, 0, 0, False
        self._data = self._clock = True
        self._pulls: bool | None = None
        for pin in (SDA, SCL):
            board.drive(pin, Level.HIGH)  # the module's pull-ups

    def _pull(self, low: bool) -> None:
        if low != self._pulls:
            self._pulls = low
            self._board.drive(SDA, Level.LOW if low else Level.HIGH)

    def step(self) -> None:
        """Looks at the bus."""
        data, clock = self._board.output(SDA) != Level.LOW, self._board.output(SCL) != Level.LOW
        if self.holds:
            self._pull(True)
            self._state = "idle"
        elif clock and self._clock and data != self._data and not self._pulls and self.plugged:
            self._state, self._bit = ("idle" if data else "address"), -1
        elif clock and not self._clock:
            self._rise(data)
        elif self._clock and not clock:
            self._fall()
        self._data, self._clock = data, clock

    def _rise(self, data: bool) -> None:
        if 0 <= self._bit < 8 and self._state != "read":
            self._shift = (self._shift << 1 | data) & 0xFF
        elif self._bit == 8 and self._state == "read" and data:
            self._state = "idle"  # the last byte

    def _fall(self) -> None:
        if self._state == "idle" or not self.plugged:
            self._pull(False)
            return
        self._bit += 1
        if self._bit == 8 and self._state != "read":
            self._pull(self._take_byte())
        elif self._bit == 9:
            self.bytes_moved += 1
            self._bit = 0
            if self._state == "address":
                self._state, self._pointer_set = ("read" if self._shift & 1 else "write"), False
            if self._state == "read":
                self._shift = self.registers[self._pointer % 16]
                self._pointer += 1
            else:
                self._pull(False)
        if self._state == "read":
            self._pull(self._bit < 8 and not self._shift >> (7 - self._bit) & 1)

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

    def __init__(self, board: BoardAccess, pin: int, decay_us: float) -> None:
        self.decay_us = decay_us
        self._board, self._pin, self._charged = board, pin, False

    def step(self) -> None:
        """Looks at the pin."""
        level = self._board.output(self._pin)
        if level == Level.HIGH and not self._charged:
            self._charged = True
            self._board.drive(self._pin, Level.HIGH)
        elif level != Level.HIGH and self._charged:
            self._charged = False
            self._board.drive(self._pin, Level.LOW, self._board.now + round(self.decay_us * CYCLES_PER_US))


class Receiver:
    """An IR receiver that sees every burst of the LED: low from half a millisecond after its beginning on, for 1 ms."""

    def __init__(self, board: BoardAccess, led: int, pin: int) -> None:
        self._board, self._led, self._pin, self._until = board, led, pin, 0
        board.drive(pin, Level.HIGH)

    def step(self) -> None:
        """Looks at the LED."""
        if self._board.output(self._led) == Level.HIGH and self._board.now > self._until:
            begin = self._board.now + CYCLES_PER_S // 2000
            self._until = begin + CYCLES_PER_S // 1000
            self._board.drive(self._pin, Level.LOW, begin)
            self._board.drive(self._pin, Level.HIGH, self._until)


class DeviceBench:
    """A board session whose devices are ours, and its serial line as a Rig reads and writes it."""

    realtime = False

    def __init__(self, access: BoardAccess) -> None:
        self.access = self.board = access
        self.transport = self
        self.now = lambda: access.now / CYCLES_PER_S
        self.write = access.send
        self.devices: list[TwoWireDevice | Capacitor | Receiver] = []

    def run(self, seconds: float) -> None:
        """Lets time pass."""
        end = self.access.now + round(seconds * CYCLES_PER_S)
        while self.access.now < end:
            self.access.advance(min(self.access.now + SLICE, end) if self.devices else end)
            for device in self.devices:
                device.step()

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What the board sends within that time."""
        del quiet_s
        self.run(wait_s)
        return bytes(byte.byte for byte in self.access.receive())

    def close(self) -> None:
        """Lets go of the board."""
        self.access.close()


class DeviceRig(Rig):
    """A rig around a board by itself, whose devices are ours."""

    def __init__(self, access: BoardAccess) -> None:
        self.bench = DeviceBench(access)
        super().__init__(self.bench)  # type: ignore[arg-type]

    def __enter__(self) -> DeviceRig:
        return self
