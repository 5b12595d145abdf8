"""`python -m avr_timing`, on a program that is not the kit's."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
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


UNJUDGED = """
#include <avr/boot.h>
#include <avr/pgmspace.h>
volatile unsigned char number;
__attribute__((noinline)) void erase(void) { boot_page_erase(0x100); number++; }
__attribute__((noinline)) void tick(void) { number++; }
__attribute__((noinline)) void wild(void) { ((void (*)(void))0x3000)(); }
__attribute__((noinline)) void table(void) { static const unsigned char t[4] PROGMEM = {1}; __asm__("jmp %0"::"i"(t)); }
int main(void) { for (;;) { tick(); erase(); wild(); table(); } }
"""


def test_a_function_that_cannot_be_followed_hides_no_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image = str(build(tmp_path, UNJUDGED))
    reasons = {"erase": "`spm` writes the flash", "wild": "leads out of the code", "table": "0x0001 is no instruction"}
    assert main([image]) == 1
    found = {line.split()[2].rstrip(":"): line for line in capsys.readouterr().out.splitlines()[2:]}
    assert found["tick"].split()[:2] == ["9", "0"]
    for name, why in reasons.items():
        assert found[name].split()[:2] == ["-", "-"] and why in found[name]
    assert "writes the flash" in found["main"]  # one that calls it
    assert [main([image, *names]) for names in (["tick"], ["tick", "erase"], ["tick", "erase", "--path"])] == [0, 1, 2]
    assert "         9  tick\n" in capsys.readouterr().out


def test_a_chip_that_is_assumed_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(build(tmp_path, "main: rjmp main\n", "-nostartfiles", assembler=True))]) == 0
    assert capsys.readouterr().err.endswith(
        "program.elf does not say which chip it is for: it is taken for an ATmega328P\n"
    )


def test_output_that_is_not_read_to_its_end(tmp_path: Path) -> None:
    """As behind `| head -1`: the pipe is closed."""
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "avr_timing", str(build(tmp_path, PROGRAM))]
    ended = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (-signal.SIGPIPE, "")


def test_refused_in_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, words in (
        ([str(build(tmp_path, PROGRAM)), "none"], "has no function none"),
        ([str(tmp_path / "none.elf")], "cannot be read"),
    ):
        assert main(arguments) == 2
        out, err = capsys.readouterr()
        assert out == "" and words in err and err.count("\n") == 1
