"""Variables of a running program, read and set by name: what the program makes of them, and what does not fit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from boebot.errors import BoardError, CallError
from boebot.image.data import read_variables
from sim_bridge.bench.symbols import Symbol
from sim_bridge.boards.avr import create
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import compiled

SOURCE = """
#include <stdint.h>
volatile uint16_t count = 1000, twice;
volatile float share = 0.5;
volatile uint8_t table[3] = {7, 8, 9}, sum;
volatile struct { uint8_t age; int16_t speed; } reading = {3, -300};
volatile union { int number; char bytes[2]; } either = {0x4241};
int main(void) {
  for (;;) {
    twice = 2 * count;
    sum = table[0] + table[1] + table[2];
  }
}
"""


class Running:
    """A board that has run the program for some turns of its loop."""

    def __init__(self, folder: Path) -> None:
        self.image = compiled(SOURCE, folder / "own.elf")
        self.board = BoardAccess(create(self.image))
        self.board.run(400)

    def __getitem__(self, name: str) -> Symbol:
        return Symbol(self.board, read_variables(self.image).find(name))


@pytest.fixture
def running(tmp_path: Path) -> Running:
    return Running(tmp_path)


def test_what_the_program_has_made_of_it_and_what_it_makes_of_what_is_set(running: Running) -> None:
    assert (running["twice"].value, running["sum"].value) == (2000, 24)
    running["table"][2] = 100
    running["count"].value = 300
    running.board.run(400)
    assert (running["twice"].value, running["sum"].value) == (600, 115)
    with pytest.raises(ValueError, match="read-only"):
        running["table"].value[1] = 5
    running["table"].value = b"AB"
    assert bytes(running["table"].value) == b"AB\0"
    running["table"].value = [1, 2, 3]
    assert running["table"].value.tolist() == [1, 2, 3] and running["table"][-1] == 3


def test_each_type_as_python_has_it(running: Running) -> None:
    assert running["share"].value == 0.5
    running["share"].value = 0.1
    assert running["share"].value == pytest.approx(0.1, rel=1e-7)
    assert running["reading"].value == b"\x03\xd4\xfe"
    assert running["either"].value == b"AB"


@pytest.mark.parametrize("value", [-1, 0x10000, 1.5, "x", [1], None])
def test_what_does_not_fit_is_refused_and_changes_nothing(running: Running, value: object) -> None:
    before = running["count"].value
    with pytest.raises(CallError, match=r"count: .* does not fit; expected 0 to 65535"):
        running["count"].value = value
    assert running["count"].value == before


def test_elements_that_are_not_there(running: Running) -> None:
    for name, key in (("table", 3), ("table", "age"), ("count", 0), ("reading", "age")):
        with pytest.raises(CallError, match=re.escape(f"{name}[{key!r}]: ") + ".*; expected an element"):
            running[name][key]
        with pytest.raises(CallError):
            running[name][key] = 1
    with pytest.raises(CallError, match=r"share: 1e\+300 does not fit; expected a value of type float32"):
        running["share"].value = 1e300
    with pytest.raises(CallError, match=r"table: b'ABCD' does not fit"):
        running["table"].value = b"ABCD"
    with pytest.raises(CallError, match=r"table: 5 does not fit; expected an array \(3,\) of 0 to 255"):
        running["table"].value = 5


def test_a_board_without_a_data_space(running: Running) -> None:
    with pytest.raises(BoardError, match="only the emulated ATmega328P"):
        _ = Symbol(BoardAccess(native_board(native_library("shieldbot"))), running["count"].variable).value
