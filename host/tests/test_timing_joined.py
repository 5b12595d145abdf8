"""Loops of the source that the compiler copied, or made two of: bounded by their rows, where the image tells all places
at which they are entered, and refused where what is around them is a loop without a bound."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import MARKS, assembled, build
from boebot.errors import TimingError
from boebot.timing.elf import read_image
from boebot.timing.program import LoopBound
from boebot.timing.wcet import WorstCase

# The test of a `while` stands twice, so that the loop is two, one within the other.
HALVES = """main: entered 7
1: cp r18, r19
 breq 9f
2: told 5, 7
 inc r18
 sbrs r24, 0
 rjmp 4f
 nop
 nop
 nop
 cpse r18, r19
 rjmp 2b
9: ret
4: lds r23, 256
 rjmp 1b
"""
SHORT = 1 + 1 + 2 + 3 + 1 + 2  # cycles of a pass that goes back to the row
LONG = 1 + 1 + 1 + 2 + 2 + 2 + 1 + 1  # and of one over the first test
# Two passes at a time, as the compiler unrolls.
TWICE = """main: entered 7
1: told 6, 7
 sts 256, r18
 told 6, 7
 sts 257, r18
 cp r18, r19
 brne 1b
 ret
"""
# A loop within another one, each with its row, and of the inner one no more than one pass is left.
WITHIN = """main: entered 7
1: told 4, 7
 entered 9
 told 3, 9
 sts 256, r18
 cp r18, r19
 brne 1b
 ret
"""


def cycles_of(folder: Path, source: str) -> int:
    return WorstCase(assembled(folder, MARKS + source)).of("main").cycles


@pytest.mark.parametrize(
    ("source", "cycles"),
    [
        # In; 4 whole passes; in the last one the test leaves by its branch, which takes 1 cycle more; ret.
        (HALVES, 1 + 1 + 1 + 4 * LONG + (LONG + 1) + 4),
        # 3 nops more: the other way is the longer one. Leaving it, `cpse` skips in 2 cycles what would take 1 + 2.
        (HALVES.replace(" cpse", " nop\n nop\n nop\n cpse"), 1 + 1 + 1 + 4 * (SHORT + 3) + (SHORT + 2) + 4),
        (TWICE, 1 + 5 * (1 + 2 + 1 + 2 + 1 + 2) + (1 + 2 + 1 + 2 + 1 + 1) + 4),  # 6 passes hold both
        (WITHIN, 1 + 3 * (1 + 1 + 1 + 2 + 1 + 2) + (1 + 1 + 1 + 2 + 1 + 1) + 4),
    ],
    ids=["halves", "halves, the inner one longer", "unrolled", "one pass left"],
)
def test_counted_by_hand(tmp_path: Path, source: str, cycles: int) -> None:
    assert cycles_of(tmp_path, source) == cycles


@pytest.mark.parametrize(
    ("source", "old", "new"),
    [
        (HALVES, "main: entered 7\n1:", "main: nop\n1: entered 7\n"),  # the outer half is a loop around
        (HALVES, "4: lds", "4: entered 7\n lds"),  # entered again in a pass
        (WITHIN, "told 4, 7", "nop"),  # the outer one's bound removed: what is left of the inner one bounds nothing
        (TWICE, "main: entered 7\n1:", "main: nop\n1: entered 7\n"),
    ],
)
def test_bound_of_a_loop_within_is_not_that_of_the_loop_around(tmp_path: Path, source: str, old: str, new: str) -> None:
    assert source.count(old) == 1
    with pytest.raises(TimingError, match=r"0x.* has no bound"):
        cycles_of(tmp_path, source.replace(old, new))


def test_entries_are_read(tmp_path: Path) -> None:
    image = read_image(build(tmp_path, MARKS + WITHIN, assembler=True))
    main = next(symbol.address for symbol in image.symbols if symbol.name == "main")
    assert image.entries == {main: 7, main + 4: 9}
    assert image.bounds == (LoopBound(main + 2, 4, None, 7), LoopBound(main + 6, 3, None, 9))


@pytest.mark.parametrize(
    ("record", "words"),
    [(".byte 1", "has 1 bytes: records of 8 bytes"), (".long 0x7001, 1", "0x7001, which is not one of an instr")],
)
def test_broken_entry_is_refused(tmp_path: Path, record: str, words: str) -> None:
    source = f'main: ret\n.section .boebot.entries, "", @progbits\n{record}\n'
    with pytest.raises(TimingError, match=words):
        read_image(build(tmp_path, source, assembler=True))
