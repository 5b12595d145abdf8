"""Coverage: programs of which is known what they execute and which way each conditional jump goes; avr-objdump knows
their jumps, avr-addr2line their lines; lcov's text as geninfo(1) says what it means."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from boebot.errors import AnalysisError, CallError
from boebot.image.elf import read_image
from sim_bridge.bench.cover import Coverage, instructions, is_conditional
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Level
from sim_bridge.boards.emulated import avr_image
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import compiled

# Each line that has code is named by what becomes of it: hit, or missed.
SOURCE = """\
#include <avr/io.h>
#include <stdint.h>
volatile uint8_t got, wanted = 99;
__attribute__((noinline)) static void never(void) {
  got = 0; // missed
}

int main(void) {
  for (uint8_t i = 0; i < 10; i++) { // hit, both
    got = i; // hit
  }
  if (got == wanted) { // hit, one
    never(); // missed
  }
  if (PINB & 1) { // hit, skip
    got = 1; // missed
  }
  if (PINB & 2) { // hit, skip
    got = 2; // hit
  }
  for (;;) { // the compiler gives its jump to line 19
  }
}
"""
HIT = {9, 10, 12, 15, 18, 19}
MISSED = {5, 13, 16}
JUMP = re.compile(r"br\w\w|cpse|sb[ri][cs]")


@dataclass
class Record:
    """Of one source file."""

    lines: dict[int, int] = field(default_factory=dict)
    branches: dict[tuple[int, int, int], int | None] = field(default_factory=dict)


def read_lcov(text: str) -> dict[str, Record]:
    """Checks the sums, too: LF and LH lines found and hit, BRF and BRH branches. A branch is `-` where its line's
    condition was never evaluated."""
    found: dict[str, Record] = {}
    now, sums = None, dict[str, int]()
    for row in text.splitlines():
        kind, _, rest = row.partition(":")
        if kind == "SF":
            now, sums = found.setdefault(rest, Record()), {}
        elif kind == "DA":
            line, count = map(int, rest.split(","))
            assert now is not None and line not in now.lines
            now.lines[line] = count
        elif kind == "BRDA":
            line, block, branch = map(int, rest.split(",")[:3])
            taken = rest.split(",")[3]
            assert now is not None and (line, block, branch) not in now.branches
            now.branches[line, block, branch] = None if taken == "-" else int(taken)
        elif kind == "end_of_record":
            assert now is not None
            ways = now.branches.values()
            assert sums == {
                "LF": len(now.lines),
                "LH": sum(map(bool, now.lines.values())),
                "BRF": len(ways),
                "BRH": sum(map(bool, ways)),
            }
        elif kind in ("LF", "LH", "BRF", "BRH"):
            sums[kind] = int(rest)
        else:
            assert row == "TN:"
    return found


def covered(image: Path, *high: int) -> Coverage:
    """Of one run, with those pins high."""
    board = create(image)
    board.cover()
    access = BoardAccess(board)
    for pin in high:
        access.drive(pin, Level.HIGH)
    access.run(5000)
    found = Coverage()
    found.add(image, board.cover())
    return found


def disassembled(path: Path) -> dict[int, tuple[str, str]]:
    """Mnemonic and operands by address, as avr-objdump writes them."""
    text = subprocess.run(["avr-objdump", "-d", "-z", str(path)], capture_output=True, text=True, check=True).stdout
    rows = re.findall(r"^ *([0-9a-f]+):\t(?:[0-9a-f]{2} )+ *\t(\S+)(?:\t([^;\n]*))?", text, re.MULTILINE)
    return {int(address, 16): (mnemonic, operands.strip()) for address, mnemonic, operands in rows}


def mnemonics(path: Path) -> list[tuple[int, str]]:
    """Line and mnemonic of each branch and skip."""
    image, there = read_image(path), disassembled(path)
    return [
        (image.sources[at][1], word) for at, (word, _) in there.items() if JUMP.fullmatch(word) and at in image.sources
    ]


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return compiled(SOURCE, tmp_path_factory.mktemp("cover") / "own.elf")


def test_lines_and_both_ways_of_each_conditional_jump(own: Path) -> None:
    record = read_lcov(covered(own, 9).lcov(own.parent))["own.c"]
    assert {line for line, count in record.lines.items() if count} == HIT
    assert {line for line, count in record.lines.items() if not count} == MISSED
    jumps: dict[int, list[int | None]] = {line: [] for line, _, _ in record.branches}
    for (line, block, way), taken in sorted(record.branches.items()):
        assert block == 0 and way in (0, 1)
        jumps[line].append(taken)
    # `got` is not `wanted`, pin 8 is low and pin 9 high: the compiler's choice of the instruction says what follows.
    straight, elsewhere = [1, 0], [0, 1]
    found = {line: mnemonic for line, mnemonic in mnemonics(own) if line in jumps}
    assert jumps == {
        9: [1, 1],
        12: {"breq": straight, "cpse": straight, "brne": elsewhere}[found[12]],
        15: {"sbis": straight, "sbic": elsewhere}[found[15]],
        18: {"sbis": elsewhere, "sbic": straight}[found[18]],
    }


def test_over_all_runs_also_those_of_other_processes(own: Path, tmp_path: Path) -> None:
    """The other process has deleted its image."""
    both = covered(own, 9)
    other = Path(shutil.copy(own, tmp_path / "other.elf"))
    found = json.dumps(covered(other, 8).as_dict())
    other.unlink()
    both.merge(json.loads(found))
    record = read_lcov(both.lcov(own.parent))["own.c"]
    assert record.lines[16] == 1
    assert {(line, taken) for (line, _, _), taken in record.branches.items()} == {
        *((9, 1), (12, 0), (12, 1), (15, 1), (18, 1))
    }
    again = Coverage()
    for high in (9, 8):
        again.merge(covered(own, high).as_dict())
    assert again.lcov(own.parent) == both.lcov(own.parent)
    assert both.table(own.parent).splitlines() == [
        "file    lines  executed          conditional jumps  both ways",
        "own.c       9         7  77.8 %                  4          3  75.0 %",
        "in all      9         7  77.8 %                  4          3  75.0 %",
    ]


def test_files_from_elsewhere_are_left_out_and_counted(own: Path, tmp_path: Path) -> None:
    found = covered(own)
    assert found.lcov(tmp_path) == ""
    _, sums, outside = found.table(tmp_path).splitlines()
    assert sums.split() == ["in", "all", "0", "0", "-", "0", "0", "-"]
    assert outside == f"not counted: 9 lines outside of {tmp_path}, most of them in {own.with_suffix('.c')}"
    assert [*read_lcov(found.lcov(own.parent.parent))] == [f"{own.parent.name}/own.c"]


def test_what_never_ran_has_branches_that_were_not_evaluated(own: Path) -> None:
    nothing = Coverage()
    nothing.add(own, np.zeros(0x4000, np.uint8))
    record = read_lcov(nothing.lcov(own.parent))["own.c"]
    assert set(record.branches.values()) == {None} and set(record.lines.values()) == {0}


def test_instructions_and_conditional_jumps_are_those_of_objdump() -> None:
    """Of the kit's firmware."""
    path = avr_image("shieldbot")
    image = read_image(path)
    there = disassembled(path)
    own = dict(instructions(image))
    assert len(own) > 5000 and own.keys() <= there.keys()
    assert own.keys() == {address for address in there if address in image.sources}
    jumps = {address for address, opcode in own.items() if is_conditional(opcode)}
    assert jumps == {address for address in own if JUMP.fullmatch(there[address][0]) and there[address][1] != ".+0"}


@pytest.mark.parametrize("flags", [(), ("-flto",), ("-gdwarf-2",)])
def test_files_and_lines_are_those_of_addr2line(tmp_path: Path, flags: tuple[str, ...]) -> None:
    image = read_image(compiled(SOURCE, tmp_path / "own.elf", *flags))
    places = sorted(image.sources.items())
    assert len(places) > 20
    command = ["avr-addr2line", "-e", image.path, *(hex(address) for address, _ in places)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    for (address, (file, line)), other in zip(places, said, strict=True):
        assert other.partition(" (")[0] == f"{file}:{line}", hex(address)


def test_a_program_without_source_lines_is_refused(tmp_path: Path) -> None:
    image = compiled("int main(void) { for (;;) {} }", tmp_path / "own.elf", "-g0")
    with pytest.raises(CallError, match=r"own.elf says nothing of source lines; expected a program built with"):
        covered(image)
    (tmp_path / "own.hex").write_text(":00000001FF\n", encoding="ascii")
    with pytest.raises(AnalysisError, match=r"own\.hex is not an ELF file"):
        Coverage().add(tmp_path / "own.hex", np.zeros(0x4000, np.uint8))
