"""Waves out of value change dumps: by hand, and what a board did given to another board."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boebot.errors import CallError
from sim_bridge.bench.uno import Wanted, open_uno
from sim_bridge.bench.waves import read_wave
from sim_bridge.tests.bench.test_plugin import SERVO
from sim_bridge.tests.boards.avr.avr_program import compiled

DUMP = """$timescale 10 us $end
$scope module top $end
$var wire 1 ! key $end
$var wire 8 # bus $end
$upscope $end
$enddefinitions $end
#0
0!
#150
1!
b101 #
#151
x!
"""


def test_a_dump_is_read_in_its_own_unit(tmp_path: Path) -> None:
    (tmp_path / "key.vcd").write_text(DUMP)
    assert read_wave(tmp_path / "key.vcd").tolist() == [
        [0.0, 0],
        [pytest.approx(1.5e-3), 1],
        [pytest.approx(1.51e-3), 2],
    ]
    with pytest.raises(CallError, match=r"has the signals top.key, the wave names 'kex'; expected one$"):
        read_wave(tmp_path / "key.vcd", "kex")
    for text in ("no dump", "$timescale 3 us $end", DUMP.partition("\n")[2]):
        (tmp_path / "bad.vcd").write_text(text)
        with pytest.raises(
            CallError, match=r"bad.vcd (is no value change dump: (.*:|it has no )|has the signals none)"
        ):
            read_wave(tmp_path / "bad.vcd")
    with pytest.raises(CallError, match="cannot be read"):
        read_wave(tmp_path / "none.vcd")


def test_a_name_that_two_signals_have_needs_its_scope(tmp_path: Path) -> None:
    """Signals of the one-bit bus `b` have names of their own."""
    (tmp_path / "two.vcd").write_text("""$timescale 1 us $end
$scope module top $end
$scope module a $end $var wire 1 ! clk $end $upscope $end
$scope module b $end $var wire 1 " clk $end $var wire 1 # b [0] $end $var wire 1 & b [1] $end $upscope $end
$upscope $end
$enddefinitions $end
#1
1!
#2
1"
#3
1#
#4
1&
""")
    for name, time_us in ("a.clk", 1), ("top.b.clk", 2), ("b[0]", 3), ("b[1]", 4):
        assert read_wave(tmp_path / "two.vcd", name).tolist() == [[pytest.approx(time_us * 1e-6), 1]]
    with pytest.raises(CallError, match=r"signals top.a.clk, top.b.clk, .*, the wave names 'clk'; expected one$"):
        read_wave(tmp_path / "two.vcd", "clk")


def test_what_a_board_did_drives_another(tmp_path: Path) -> None:
    """The pulses at pin 9 of one board, as its dump has them, are those at pin 4 of another, to the cycle."""
    own = Wanted(image=compiled(SERVO, tmp_path / "own.elf"))
    with open_uno("avr", own) as first, open_uno("avr", own) as second:
        first.run(0.1)
        first.save_pins(tmp_path / "pins.vcd")
        second.pin(4).wave(tmp_path / "pins.vcd", signal="D9")
        second.run(0.1)
        of = [uno.pin(pin).all_pulses() for uno, pin in ((first, 9), (second, 4))]
        assert len(of[0]) >= 4 and np.array_equal(of[0][:, 1], of[1][:, 1])
