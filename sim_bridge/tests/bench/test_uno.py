"""What a test does to its board, and from when on answers count: the line's rate, resets, faults, variables, parts."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sim_bridge.bench.uno import Uno, Wanted, open_uno
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
