"""`python -m avr_timing`, on a program that is not the kit's."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import build
from avr_timing.__main__ import main

PROGRAM = """
#include <avr/interrupt.h>
#include <avr/io.h>
volatile unsigned char number;
__attribute__((noinline)) void blink(void) { for (unsigned char i = 0; i < 10; i++) { PORTB ^= 1; } }
__attribute__((noinline)) void count(void) { for (unsigned char n = number; n != 0; n--) { number += n; } }
ISR(TIMER0_OVF_vect) { number++; }
int main(void) { sei(); for (;;) { blink(); count(); } }
"""


def rows(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, list[str]]:
    """The row of each function by its name."""
    assert main([str(argument) for argument in arguments]) == 0
    out = capsys.readouterr().out.splitlines()
    return {line.split()[2].rstrip(":"): line.split() for line in out[2:]}


def test_bounds_of_all_functions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = build(tmp_path, PROGRAM, "-gdwarf-2")
    found = rows(capsys, image)
    assert {"blink", "count", "main", "__vector_16"} <= found.keys()
    assert found["blink"][:2] == ["65", "0"] and int(found["__vector_16"][0]) > 0
    assert found["count"][:2] == ["-", "0"] and "has no bound" in " ".join(found["count"])
    assert rows(capsys, image, "blink") == {"blink": found["blink"]}


def test_path_by_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(build(tmp_path, PROGRAM, "-gdwarf-2")), "blink", "--path"]) == 0
    first, *lines = capsys.readouterr().out.splitlines()
    assert first.split() == ["65", "blink"]
    assert sum(int(line.split()[0]) for line in lines) == 65
    assert all("program.c:5" in line for line in lines)


def test_refused_in_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        ([str(build(tmp_path, PROGRAM)), "none"], "has no function none"),
        ([str(tmp_path / "none.elf")], "cannot be read"),
    ):
        assert main(arguments) == 2
        out, err = capsys.readouterr()
        assert out == "" and words in err and err.count("\n") == 1
