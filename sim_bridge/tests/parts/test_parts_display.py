"""Character displays, by the data sheet of the HD44780U: instructions, memory, times; the bus of four lines."""

from __future__ import annotations

import msgspec
import pytest

from boebot.description.robots import load_robot
from boebot.devices.display import Display, letters_of
from sim_bridge.tests.simulated import MS, US, scripted

RS, E, DATA = 12, 11, (5, 4, 3, 2)  # DB4 first
LOW, HIGH = range(2)
CLEAR, HOME, ON, FUNCTION, RIGHT_MOVING = 0x01, 0x02, 0x0C, 0x28, 0x06
DEVICE = Display(rs_pin=RS, enable_pin=E, d4_pin=5, d5_pin=4, d6_pin=3, d7_pin=2)
SHORT_US, DATA_US, LONG_US, POWER_ON_US = 37, 41, 1520, 10_000


class Bus:
    """A program that writes to the display, as slowly as the data sheet asks for, or faster."""

    def __init__(self, *, spread: float = 0.0, begin_us: float = 40_000) -> None:
        robot = msgspec.structs.replace(load_robot("shieldbot"), firmware="none", device={"lcd": DEVICE})
        self.robot = scripted(robot=robot)
        self.now = round(begin_us * US)

    def half(self, value: int, rs: int, width: int = 16) -> None:
        for bit, pin in enumerate(DATA):
            self.robot.edge(self.now, pin, value >> bit & 1)
        self.robot.edge(self.now, RS, rs)
        self.robot.edge(self.now + 8, E, HIGH)
        self.now += 8 + width
        self.robot.edge(self.now, E, LOW)
        self.now += 16

    def byte(self, value: int, rs: int = LOW, after_us: float | None = None) -> None:
        """Two halves, and a wait behind them (us); None: as the data sheet has it."""
        self.half(value >> 4, rs)
        self.half(value & 15, rs)
        usual = DATA_US if rs else LONG_US if value < 4 else SHORT_US
        self.now += round((usual if after_us is None else after_us) * US)

    def text(self, text: str) -> None:
        for letter in text:
            self.byte(ord(letter), HIGH)

    def begin(self) -> None:
        """Figure 24, as the program of an LCD library has it."""
        for value, wait_us in ((3, 4100), (3, 100), (3, SHORT_US), (2, SHORT_US)):
            self.half(value, LOW)
            self.now += wait_us * US
        for value in (FUNCTION, 0x08, CLEAR, RIGHT_MOVING, ON):
            self.byte(value)

    def lines(self) -> tuple[str, str]:
        self.robot.run((self.now + MS) / 16e6 - self.robot.robot.sim.cycle / 16e6)
        texts = self.robot.robot.texts()
        assert texts.keys() == {"lcd_1", "lcd_2"}
        return texts["lcd_1"], texts["lcd_2"]


@pytest.fixture
def bus() -> Bus:
    bus = Bus()
    bus.begin()
    return bus


def test_letters_come_to_the_cells_of_both_lines(bus: Bus) -> None:
    bus.text("Hello")
    bus.byte(0x80 | 0x40 + 6)
    bus.text("world")
    assert bus.lines() == ("Hello", "      world")


def test_it_is_blank_before_it_is_on_and_in_8_bits_after_power_on() -> None:
    bus = Bus()
    bus.text("a")
    assert bus.lines() == ("", "")


@pytest.mark.parametrize(("begin_us", "shown"), [(POWER_ON_US - 100, ""), (POWER_ON_US + 100, "x")])
def test_its_reset_takes_10_ms(begin_us: float, shown: str) -> None:
    bus = Bus(begin_us=begin_us)
    bus.half(2, LOW)  # alone switches a fresh display to four bits
    bus.now += SHORT_US * US
    for value in (FUNCTION, ON):
        bus.byte(value, after_us=SHORT_US + 1)
    bus.text("x")
    assert bus.lines()[0] == shown


def test_what_comes_while_it_is_busy_is_lost(bus: Bus) -> None:
    bus.byte(ord("a"), HIGH, after_us=DATA_US - 6)  # both halves of the next one come within them
    bus.byte(ord("b"), HIGH, after_us=DATA_US)
    bus.byte(ord("c"), HIGH)
    assert bus.lines()[0] == "ac"
    bus.byte(CLEAR, after_us=LONG_US - 10)
    bus.byte(ord("d"), HIGH, after_us=DATA_US)
    bus.byte(ord("e"), HIGH)
    assert bus.lines()[0] == "e"


def test_a_short_pulse_of_enable_is_none(bus: Bus) -> None:
    bus.half(4, HIGH, width=3)  # 187.5 ns of at least 230
    bus.text("A")
    assert bus.lines()[0] == "A"


def test_lines_have_40_cells_and_the_window_moves(bus: Bus) -> None:
    bus.text("0123456789" * 4 + "second")
    assert bus.lines() == ("0123456789012345", "second")
    for _ in range(3):
        bus.byte(0x18)  # to the left
    assert bus.lines() == ("3456789012345678", "ond")
    bus.byte(0x1C)
    assert bus.lines()[1] == "cond"
    bus.byte(HOME)
    bus.text("X")
    assert bus.lines() == ("X123456789012345", "second")


def test_entry_modes_and_the_cursor(bus: Bus) -> None:
    bus.byte(0x80 | 5)
    bus.byte(0x04)  # to the left
    bus.text("abc")
    assert bus.lines()[0] == "   cba"
    bus.byte(0x14)  # cursor to the right: over c, the next letter goes there
    bus.text("C")
    assert bus.lines()[0] == "   Cba"
    bus.byte(CLEAR)
    bus.byte(0x07)  # the window moves with each letter
    bus.text("xy")
    assert bus.lines()[0] == ""
    bus.byte(HOME)
    assert bus.lines()[0] == "xy"


def test_glyphs_are_no_letters_and_off_is_blank(bus: Bus) -> None:
    bus.byte(0x40 | 8)
    for row in range(8):
        bus.byte(row, HIGH)
    bus.byte(0x80)
    bus.byte(1, HIGH)
    bus.text("ok")
    assert bus.lines()[0] == "□ok"
    bus.byte(0x08)
    assert bus.lines()[0] == ""
    bus.byte(ON)
    bus.robot.pins.unplug("lcd")
    assert bus.lines()[0] == ""


def test_letters_of_the_rom() -> None:
    assert letters_of(b"az}~\x7f\\ \xdf\xe0\xf4\xb1\xff \x80 ") == "az}→←¥ °αΩｱ█"
