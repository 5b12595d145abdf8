"""What a test does to its board, and from when on answers count: the line's rate, resets, faults, variables, parts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from boebot.errors import BoebotError
from sim_bridge.bench.buses import I2cDevice, SpiDevice
from sim_bridge.bench.uno import Uno, Wanted, open_uno
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
