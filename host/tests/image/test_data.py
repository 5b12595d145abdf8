"""Variables by their names: places and sizes against avr-nm, types against what C says, of programs built as one file,
as several that are optimized as a whole, and in C++."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from boebot.errors import AnalysisError
from boebot.image.data import Variables, read_variables

SOURCE = """
#include <stdint.h>
#include <stdbool.h>
volatile uint16_t count = 3;
static volatile int8_t small = -2;
volatile float share = 1.5;
volatile bool on;
volatile int32_t table[3] = {1, -2, 3};
typedef struct { uint8_t age; int16_t speed; unsigned flag : 1; uint32_t time; } reading;
volatile reading readings[2];
volatile enum { OFF, ON } mode;
volatile enum { BEHIND = -1, AHEAD } side;
const volatile char *volatile text;
volatile uint8_t grid[2][3];
volatile union { int number; char bytes[4]; } either;
volatile uint64_t large;
__attribute__((noinline)) int up(void) { static volatile int n; return ++n; }
__attribute__((noinline)) int down(void) { static volatile int n; return --n; }
static int nowhere = 7;
int main(void) { small++; up(); down(); return nowhere; }
"""
TYPES = {
    "count": "<u2",
    "small": "i1",
    "share": "<f4",
    "on": "?",
    "mode": "<u2",
    "side": "<i2",
    "text": "<u2",
    "large": "<u8",
    "either": "V4",
}


def built(folder: Path, source: str, *flags: str, name: str = "own.c") -> Path:
    program, image = folder / name, folder / "own.elf"
    program.write_text(source, encoding="ascii")
    command = ["avr-gcc", "-mmcu=atmega328p", "-Os", *(flags or ["-gdwarf-4"]), "-o", str(image), str(program)]
    subprocess.run(command, check=True)
    return image


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Variables:
    return read_variables(built(tmp_path_factory.mktemp("data"), SOURCE))


def test_places_and_sizes_are_those_of_the_symbol_table(own: Variables) -> None:
    text = subprocess.run(["avr-nm", "-S", own.path], capture_output=True, text=True, check=True).stdout
    rows = [line.split() for line in text.splitlines() if line.split()[2] in "bBdD"]
    there = {(row[3].partition(".")[0], int(row[0], 16) & 0xFFFF, int(row[1], 16)) for row in rows if len(row) == 4}
    assert {(each.name, each.address, each.dtype.itemsize) for each in own.all} == there
    assert len(there) == 14


def test_types_are_those_of_the_source(own: Variables) -> None:
    assert {name: own.find(name).dtype.str.lstrip("|") for name in TYPES} == {
        name: kind.replace("?", "b1") for name, kind in TYPES.items()
    }
    assert own.find("table").dtype.shape == (3,) and own.find("table").dtype.base.str == "<i4"
    assert own.find("grid").dtype.shape == (2, 3)
    assert (own.find("readings").dtype.shape, own.find("readings").dtype.itemsize) == ((2,), 2 * 8)


def test_names_that_none_or_two_have(own: Variables) -> None:
    for name, words in {
        "n": r"has 2 variables n; expected one: own\.c:n, own\.c:n$",
        "nowhere": "has no variable nowhere in RAM .*; expected one that is global, static or volatile$",
        "cuont": r"; did you mean 'count'\?$",
    }.items():
        with pytest.raises(AnalysisError, match=words):
            own.find(name)
    assert own.find("own.c:small") == own.find("small")


def test_a_program_that_is_optimized_as_a_whole_keeps_its_files(tmp_path: Path) -> None:
    (tmp_path / "other.c").write_text("static volatile int n; int other(void) { return ++n; }", encoding="ascii")
    source = "int other(void); static volatile int n; int main(void) { n = 3; return other(); }"
    found = read_variables(built(tmp_path, source, "-gdwarf-4", "-flto", str(tmp_path / "other.c")))
    assert found.find("own.c:n").address != found.find("other.c:n").address


def test_members_of_classes_and_namespaces(tmp_path: Path) -> None:
    source = """
    struct Motor { static volatile int pulses; volatile long speed; };
    volatile int Motor::pulses;
    namespace left { volatile signed char level; }
    Motor motor;
    int main() { Motor::pulses = left::level; motor.speed = 1; }
    """
    found = read_variables(built(tmp_path, source, name="own.cpp"))
    assert found.find("pulses").dtype.str == "<i2"
    assert found.find("level").dtype.str == "|i1"
    assert found.find("motor").dtype.str == "|V4"


def test_a_program_without_debugging_information_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AnalysisError, match=r"has no debugging information; expected .* -gdwarf-4"):
        read_variables(built(tmp_path, "int main(void) { }", "-g0"))
    (tmp_path / "own.hex").write_text(":00000001FF\n", encoding="ascii")
    with pytest.raises(AnalysisError, match="a HEX file has neither"):
        read_variables(tmp_path / "own.hex")
