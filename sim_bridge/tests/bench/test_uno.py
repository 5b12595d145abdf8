"""What a test does to its board, and from when on answers count: the line's rate, resets, faults, variables, parts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from boebot.errors import BoebotError, CallError
from sim_bridge.bench.buses import I2cDevice, SpiDevice
from sim_bridge.bench.uno import Uno, Wanted, open_uno
from sim_bridge.bench.waiting import WaitError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.tests.bench import programs
from sim_bridge.tests.bench.test_plugin import SERVO


@pytest.fixture
def uno() -> Iterator[Uno]:
    """It says "ready", sends back what it hears, at 9600 bit/s."""
    with open_uno("avr", Wanted(image=programs.image(SERVO))) as opened:
        yield opened


@pytest.mark.parametrize("baud", [None, 9600])
@pytest.mark.parametrize(("share", "begins"), [(0.0001, b"r"), (-0.01, b"r"), (0.09, b"\xf2")])
def test_a_rate_that_is_off_is_off_the_programs_own(baud: int | None, share: float, begins: bytes) -> None:
    """1 % changes nothing (ATmega328P data sheet, table 20-3). A host that is 9 % too fast samples bit n of "r", 0x72,
    at (n + 1.5) / 1.09 of the board's bits from the start on: bits 0 to 4 as they are, then bits 4, 5 and 6 again."""
    faults = (f"serial.rate={share}@0s..20ms",)
    with open_uno("avr", Wanted(image=programs.image(SERVO), baud=baud, faults=faults)) as uno:
        uno.run(0.03)
        assert uno.serial.text.startswith(begins) and uno.unfired() == ""
        uno.serial.send(b"b")
        uno.serial.expect(b"b", within=0.01)


RESETS: dict[str, Callable[[Any], object]] = {
    "reset": lambda uno: uno.reset(),
    "fault now": lambda uno: uno.fault(f"board.reset@{uno.now}s"),
    "fault later": lambda uno: [uno.fault(f"board.reset@{uno.now + 0.01}s"), uno.run(0.01)],
    "brown-out": lambda uno: uno.fault(f"board.brown_out=2@{uno.now}s..{uno.now + 0.01}s"),
}


@pytest.mark.parametrize("how", RESETS)
def test_what_was_said_before_a_reset_is_not_what_comes_after_it(uno: Uno, how: str) -> None:
    """The text takes seven bytes of 1.04 ms each time."""
    uno.run(0.1)
    RESETS[how](uno)
    begun = uno.now
    uno.serial.expect(b"ready\r\n", within=0.1)
    assert uno.now > begun + 0.007


QUICK = """
volatile int width = 10;
int main(void) {
  DDRB = 1 << 1;
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0 | 1 << RXEN0;
  UDR0 = '>';
  for (;;) {
    PORTB ^= 1 << 1;
    _delay_loop_2(width);
  }
}
"""
ACTS: dict[str, Callable[[Uno], object]] = {
    "send": lambda uno: uno.serial.send(b"x"),
    "symbol": lambda uno: setattr(uno.symbol("width"), "value", 20),
    "analog": lambda uno: uno.analog("A0").set(5.0),
    "place": lambda uno: uno.robot.place(0.5, 0.0, 0.0),
    "fault": lambda uno: uno.fault(f"whisker_left.stuck@{uno.now}"),
}


@pytest.mark.parametrize("act", ACTS)
def test_a_pulse_from_before_what_the_test_did_is_no_answer_to_it(act: str) -> None:
    """Half a millisecond may have passed since what was waited for, and more than ten pulses with it."""
    with open_uno("avr", Wanted(image=programs.image(QUICK), robot="shieldbot-basic", arena="empty")) as uno:
        uno.serial.expect(b">")
        ACTS[act](uno)
        begun = uno.now
        assert uno.pin(9).pulse().start >= round(begun * CLOCK_HZ)


@pytest.mark.parametrize("act", [*ACTS, "drive"])
def test_text_from_before_what_the_test_did_is_no_answer_to_it(act: str) -> None:
    """It says ">" once, within 50 us."""
    acts: dict[str, Callable[[Uno], object]] = {**ACTS, "drive": lambda uno: uno.pin(2).drive(1)}
    with open_uno("avr", Wanted(image=programs.image(QUICK), robot="shieldbot-basic", arena="empty")) as uno:
        uno.run(0.001)
        acts[act](uno)
        with pytest.raises(WaitError, match=r"nothing came; before that came b'>'"):
            uno.serial.expect(b">", within=0.001)


LEVELS = """
/* Shows the level of A2 on pin 13 and what the converter makes of it, the upper byte, on the line (500,000 bit/s). */
int main(void) {
  DDRB = 1 << 5;
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0;
  ADMUX = 1 << REFS0 | 1 << ADLAR | 2;
  for (;;) {
    ADCSRA = 1 << ADEN | 1 << ADSC | 4;
    while (ADCSRA & 1 << ADSC) {}
    if (PINC & 1 << 2) PORTB |= 1 << 5; else PORTB &= ~(1 << 5);
    while (!(UCSR0A & 1 << UDRE0)) {}
    UDR0 = ADCH;
  }
}
"""


@pytest.mark.parametrize("robot", [None, "shieldbot-basic"])
def test_a_pin_has_a_level_and_a_voltage(robot: str | None) -> None:
    """A level is low below 0.3 VCC, high above 0.6 VCC, and else as it was (data sheet 29.2); the converter gives
    256 V / 5 V (24.7), 255 at most."""
    with open_uno("avr", Wanted(image=programs.image(LEVELS), robot=robot)) as uno:
        pin = uno.pin("A2")
        steps: list[tuple[Callable[[], object], int, int]] = [
            (lambda: uno.analog(2).set(3.01), 154, 1),
            (lambda: uno.analog(2).set(2.51), 128, 1),
            (lambda: uno.analog(2).set(1.49), 76, 0),
            (lambda: uno.analog(2).set(2.51), 128, 0),
            (lambda: pin.drive(1), 255, 1),
            (lambda: pin.drive(0), 0, 0),
            (lambda: uno.analog(2).set(5), 255, 1),
        ]
        for act, voltage, level in steps:
            act()
            uno.serial.expect(bytes([voltage]) * 3, within=0.01)
            assert uno.pin(13).level == level == pin.level


def test_a_program_that_drives_what_the_test_drives_is_found_when_both_do() -> None:
    said = (
        r"pin 9: the program drives it, to 0, and the test to 1, at 0\.0000\d+ s; expected a pin that the program reads"
    )
    with open_uno("avr", Wanted(image=programs.image(QUICK))) as uno:
        uno.pin(9).drive(1)
        assert uno.unfired() == ""
        uno.serial.expect(b">")
        assert re.fullmatch(said, uno.unfired())
        with pytest.raises(CallError, match=said):
            _ = uno.pin(9).level
    with open_uno("avr", Wanted(image=programs.image(QUICK))) as uno:
        uno.run(0.001)
        uno.pin(9).drive(1, after=0.001)
        uno.pin(2).drive(1)
        uno.pin(2).release()
        uno.run(0.002)
        assert uno.unfired().startswith("pin 9: the program drives it, to 0, and the test to 1, at 0.002")


def test_a_rate_that_is_not_the_programs_is_named() -> None:
    wanted = Wanted(image=programs.image(SERVO), baud=115_200)
    said = "; the program's rate is 9615 bit/s, the mark says baud=115200$"
    with open_uno("avr", wanted) as uno, pytest.raises(WaitError, match=said):
        uno.serial.expect(b"ready", within=0.1)


def test_what_cannot_be_is_one_sentence() -> None:
    class Chip(SpiDevice):
        select = 4

    class Early(I2cDevice):
        pass

    with open_uno("avr", Wanted(image=programs.image(QUICK))) as opened:
        uno: Any = opened
        begins = "width is set before the program begins, which gives it its first value then"
        calls: list[tuple[Callable[[], object], str]] = [
            (lambda: setattr(uno.symbol("width"), "value", 20), begins),
            (lambda: uno.serial.expect(b">"), ""),
            (lambda: setattr(uno.symbol("width"), "value", 20), ""),
            (uno.reset, ""),
            (lambda: setattr(uno.symbol("width"), "value", 20), begins),
            (lambda: uno.symbol(None), "has no variable None"),
            (lambda: uno.fault("board.reset@10us"), "fault board.reset=external@1e-05s is past: it is 0"),
            (lambda: uno.fault(b"board.reset@1"), "fault: got b'board.reset@1'; expected a text"),
            (
                lambda: uno.fault("host.killed@1"),
                "fault 'host.killed@1': the host is the test itself; expected its line's",
            ),
            (lambda: uno.fault("ping.missing@1"), "the board is on no robot; expected one in the mark"),
            (lambda: uno.analog("A6"), "analog: the channel is 'A6'; expected a whole number from 0 to 5"),
            (lambda: uno.serial.expect(re.compile(b"x*")), "the pattern b'x\\*' is found where nothing came"),
            (lambda: uno.i2c.add(Early), "got .*Early.*; expected an object whose class is made from I2cDevice"),
            (lambda: uno.i2c.add(Early()), "the address of Early is None"),
            (lambda: uno.spi.add(object()), "expected an object whose class is made from SpiDevice"),
            (lambda: uno.spi.add(Chip()), ""),
            (lambda: uno.spi.add(Chip()), "pin 4 selects another device; expected another one as select of Chip"),
        ]
        for call, words in calls:
            if words:
                with pytest.raises(BoebotError, match=words):
                    call()
            else:
                call()
        with pytest.raises(AttributeError):
            uno.symbol("width").vlaue = 5
