"""Chips of a test's own on the buses of a board: on the two-wire bus (I2C; NXP UM10204) and on SPI (ATmega328P data
sheet 19), each a class of a few lines that says which bytes it sends and takes. They answer at the edge's own cycle.

    class Eeprom(I2cDevice):
        address = 0x50

        def begin(self, reading):
            self.expects_place = not reading

        def write(self, byte):
            if self.expects_place:
                self.place, self.expects_place = byte, False
            else:
                self.cells[self.place] = byte

What a chip raises ends the run, and is raised by what lets time pass.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from boebot.arguments import shown, whole
from boebot.devices.device import pin_number
from boebot.errors import CallError
from sim_bridge.boards.board import EmulatedBoard, Level
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.catalogue import Part
from sim_bridge.robots.wiring import add_part, done

if TYPE_CHECKING:
    from sim_bridge.sim import SimRobot

SDA, SCL = "A4", "A5"
MOSI, MISO, SCK = 11, 12, 13


class I2cDevice:
    """A chip on the two-wire bus."""

    address: int
    """Seven bits."""

    def begin(self, reading: bool) -> None:
        """It was addressed, to be read or written."""

    def write(self, byte: int) -> bool | None:
        """It gets a byte. Returns False not to acknowledge it."""

    def read(self) -> int:
        """The byte that it sends."""
        return 0xFF


class SpiDevice:
    """A chip on SPI, which listens while its pin `select` is low; most significant bit first."""

    select: int | str = 10
    mode: int = 0
    """2: the clock rests high (CPOL); 1: bits are read at its second edge (CPHA)."""

    def begin(self) -> int | None:
        """It was selected. Returns the byte that it sends while the first one comes; None: 0xFF."""

    def transfer(self, byte: int) -> int | None:
        """It got a byte. Returns what it sends while the next one comes; None: 0xFF."""


class I2c:
    """Chips of a test's own at SDA (A4) and SCL (A5)."""

    def __init__(self, robot: SimRobot) -> None:
        self._board, self._robot, self._devices = robot.board, robot, dict[int, I2cDevice]()
        self._spoken_to: I2cDevice | None = None

    def add(self, device: I2cDevice) -> None:
        """The chip is there from now on, and so are the bus's pull-ups.

        Raises:
            CallError: it is no I2cDevice, has no address, or another chip has it.
            BoardError: a device of the robot is at these pins.
        """
        name, said = _name(device, I2cDevice), getattr(device, "address", None)
        address = whole(f"the address of {name}", said, CallError, least=0x08, most=0x77)
        if address in self._devices:
            raise CallError(f"there is a device at address 0x{address:02X} already; expected another address")
        if not self._devices:
            answer = _called(self._board, "own_chips_answer", self._answer)
            _join(self._robot, "own_chips_kind", [SDA, SCL], ffi.new("own_chips_parameters *", (answer, ffi.NULL)))
        self._devices[address] = device
        self._robot.touched()

    def _answer(self, _: Any, does: int, byte: int, cycle: int) -> int:
        """See own_chips.h."""
        self._board.reacts_at = cycle
        answer = 0
        if does == lib.OWN_CHIP_BEGIN:
            self._spoken_to = self._devices.get(byte >> 1)
            if self._spoken_to is not None:
                self._spoken_to.begin(bool(byte & 1))
                answer = 1
        elif self._spoken_to is not None and does == lib.OWN_CHIP_WRITE:
            answer = self._spoken_to.write(byte) is not False
        elif self._spoken_to is not None:
            answer = _byte(self._spoken_to, self._spoken_to.read())
        self._board.reacts_at = None
        return int(answer)


class Spi:
    """Chips of a test's own at MISO (12), MOSI (11) and SCK (13)."""

    def __init__(self, robot: SimRobot) -> None:
        self._board, self._robot = robot.board, robot
        self._selected: SpiDevice | None = None
        self._selects: set[int] = set()
        self._part: Any = None

    def add(self, device: SpiDevice) -> None:
        """The chip is there from now on.

        Raises:
            CallError: it is no SpiDevice, names no pin or no mode, or another chip is selected by that pin.
            BoardError: a device of the robot is at these pins.
        """
        name, mode = _name(device, SpiDevice), device.mode
        whole(f"the mode of {name}", mode, CallError, least=0, most=3)
        try:
            select = pin_number(device.select)
        except ValueError as refused:
            raise CallError(f"select of {name}: {refused}") from None
        if select in self._selects:
            raise CallError(f"pin {device.select} selects another device; expected another one as select of {name}")
        if self._part is None:
            answer, made = _called(self._board, "own_spi_answer", self._answer), ffi.new("own_spi **")
            parameters = ffi.new("own_spi_parameters *", (answer, ffi.NULL, made))
            _join(self._robot, "own_spi_kind", [MISO, MOSI, SCK], parameters)
            self._part = made[0]

        def selects(cycle: int, level: Level) -> None:
            if level is Level.LOW:
                self._selected = device
                lib.own_spi_select(self._part, mode, _byte(device, device.begin()), cycle)
            elif self._selected is device:
                self._selected = None
                lib.own_spi_select(self._part, -1, 0, cycle)

        self._selects.add(select)
        self._board.on_edge(select, selects)
        self._robot.touched()

    def _answer(self, _: Any, byte: int, cycle: int) -> int:
        """See own_spi.h."""
        self._board.reacts_at = cycle
        answer = 0xFF if self._selected is None else _byte(self._selected, self._selected.transfer(byte))
        self._board.reacts_at = None
        return answer


def _name(device: object, kind: type) -> str:
    """Of a device's class. Raises CallError where that is not made from this one."""
    if not isinstance(device, kind):
        raise CallError(f"got {shown(device)}; expected an object whose class is made from {kind.__name__}")
    return type(device).__name__


def _called(board: EmulatedBoard, kind: str, answer: Callable[..., int]) -> Any:
    """For C: what it raises ends the run."""
    board.called_by_c.append(ffi.callback(kind, answer, error=0, onerror=board.failed))
    return board.called_by_c[-1]


def _join(robot: SimRobot, kind: str, pins: list[int | str], parameters: Any) -> None:
    """Raises BoardError where the robot has a device there."""
    done(add_part(robot.handle, Part(kind, 0, pins, parameters)), f"a chip at pins {', '.join(map(str, pins))}")


def _byte(device: object, value: int | None) -> int:
    return 0xFF if value is None else whole(f"what {type(device).__name__} sends", value, CallError, least=0, most=255)
