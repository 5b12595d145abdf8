"""Time with interrupts off in small programs, counted by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import assembled, compiled
from avr_timing.interrupts.interrupts_off import ENTRY, WAKE, InterruptsOff
from boebot.errors import AnalysisError

VECTORS = "\n.global __vector_1\n.global __vector_2\n.global __vector_3\n"
JUMP = 3  # of a vector, where the linker does not relax


@pytest.mark.parametrize(
    ("source", "cycles"),
    [
        ("main: nop\n ret", 0),
        ("main: cli\n nop\n sei\n nop\n nop\n ret", 1 + 1 + 1 + 1),
        ("main: cli\n sei\n ret", 1 + 1 + 4),  # the return is the instruction that still runs
        ("main: in r0, SREG\n cli\n nop\n out SREG, r0\n lds r24, 256\n ret", 1 + 1 + 1 + 2),
        ("main: cli\n in r0, SREG\n cli\n out SREG, r0\n nop\n sei\n nop\n ret", 1 + 1 + 1 + 1 + 1 + 1 + 1),
        ("main: cli\n rcall f\n sei\n nop\n ret\n f: nop\n ret", 1 + (3 + 1 + 4) + 1 + 1),
        ("main: rcall f\n nop\n sei\n nop\n ret\n f: cli\n ret", 1 + 4 + 1 + 1 + 1),  # left off by the callee
        ("main: cli\n rcall f\n nop\n ret\n f: nop\n sei\n ret", 1 + 3 + 1 + 1 + 4),  # left on by it
        ("main: cli\n rcall f\n sei\n nop\n ret\n f: in r0, SREG\n cli\n nop\n out SREG, r0\n ret",
         1 + 3 + (1 + 1 + 1 + 1 + 4) + 1 + 1),
        ("main: cli\n ldi r24, 10\n 1: dec r24\n brne 1b\n sei\n nop\n ret", 1 + 1 + (9 * 3 + 2) + 1 + 1),
        ("main: ldi r24, 10\n 1: cli\n nop\n sei\n dec r24\n brne 1b\n ret", 1 + 1 + 1 + 1),
        ("main: cli\n sei\n nop\n cli\n nop\n sei\n nop\n ret", 4),  # an interrupt comes between the two
        ("main: cli\n sei\n nop\n nop\n cli\n nop\n sei\n nop\n ret", 4),
        ("main: cli\n sei\n cli\n sei\n nop\n ret", 5),  # it never was on
        ("main: cli\n sei\n sleep\n ret", 1 + 1 + 1 + WAKE),
        ("main: in r18, SREG\n cli\n push r18\n nop\n pop r18\n out SREG, r18\n nop\n ret", 1 + 2 + 1 + 2 + 1 + 1),
        ("main: cli\n tst r24\n breq 1f\n sei\n nop\n ret\n 1: adiw r24, 1\n sei\n nop\n ret", 1 + 1 + 2 + 2 + 1 + 1),
    ],
)  # fmt: skip
def test_counted_by_hand(tmp_path: Path, source: str, cycles: int) -> None:
    assert InterruptsOff(assembled(tmp_path, source)).of("main").cycles == cycles


def test_stretch_begins_at_its_cli(tmp_path: Path) -> None:
    program = assembled(tmp_path, "main: nop\n cli\n sei\n nop\n ret")
    assert InterruptsOff(program).of("main").begin == program.by_name["main"] + 2


def test_atomic_block_of_the_library(tmp_path: Path) -> None:
    source = (
        "#include <util/atomic.h>\nvolatile unsigned a, b;\n"
        "int main(void) { ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { a = b; } return 0; }\n"
    )
    # cli; lds, lds; sts, sts; out SREG; and an instruction: ldi of the result
    assert InterruptsOff(compiled(tmp_path, source)).of("main").cycles == 1 + 4 * 2 + 1 + 1


def test_loop_without_a_bound_counts_only_where_interrupts_are_off(tmp_path: Path) -> None:
    loop = "1: sbis 5, 0\n rjmp 1b\n"
    assert InterruptsOff(assembled(tmp_path, f"main: cli\n sei\n nop\n {loop} ret")).of("main").cycles == 3
    with pytest.raises(AnalysisError, match="has no bound"):
        InterruptsOff(assembled(tmp_path, f"main: cli\n {loop} sei\n nop\n ret")).of("main")


ASLEEP = (
    '1: .pushsection .boebot.loops, "", @progbits\n .long 1b, 0xFFFFFFFF, 9\n .popsection\n sleep\n sbis 5, 0\n rjmp 1b'
)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("main: cli\n sleep\n sei\n nop\n ret", "main sleeps with interrupts off at 0x"),
        (f"main: cli\n rcall f\n sei\n nop\n ret\n f: {ASLEEP}\n ret", "f sleeps with interrupts off at 0x"),
        ("main: cli\n rcall f\n sei\n nop\n ret\n f: jmp 0x7000", "leads out of the code"),
    ],
)
def test_a_stretch_that_may_never_end_is_refused(tmp_path: Path, source: str, words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        InterruptsOff(assembled(tmp_path, source)).of("main")


def test_stretch_begins_in_the_midst_of_a_loop(tmp_path: Path) -> None:
    """Interrupts go off in one of two ways through a loop, and stay off: the rest of that pass, 5 more, and the end."""
    row = '3: .pushsection .boebot.loops, "", @progbits\n .long 3b, 5, 0xFFFFFFFF\n .popsection\n'
    ways = " sbrs r24, 0\n rjmp 1b\n cli\n nop\n rjmp 1b\n"
    source = f"main: 1: dec r25\n breq 9f\n {row}{ways} 9: sei\n nop\n ret"
    rest, whole, end = 1 + 1 + 2, 1 + 1 + 2 + 1 + 1 + 2, 1 + 2 + 1 + 1
    assert InterruptsOff(assembled(tmp_path, source)).of("main").cycles == rest + 5 * whole + end


def test_interrupts(tmp_path: Path) -> None:
    source = VECTORS + (
        "main: cli\n nop\n nop\n sei\n nop\n ret\n __vector_1: nop\n reti\n"
        "__vector_2: nop\n sei\n nop\n nop\n cli\n nop\n nop\n nop\n reti\n __vector_3: push r0\n pop r0\n reti"
    )
    blocked = InterruptsOff(assembled(tmp_path, source))
    main = 1 + 1 + 1 + 1 + 1
    first, second, third = ENTRY + JUMP + 1 + 4, ENTRY + JUMP + 1 + 1 + 1, ENTRY + JUMP + 2 + 2 + 4
    assert blocked.of("main").cycles == main
    assert blocked.interrupt(1) == (first, None)
    assert blocked.interrupt(2) == (second, 1 + 3 + 4)
    assert blocked.interrupt(3) == (third, None)
    assert blocked.image().cycles == third


def test_planted_instruction_lengthens_the_stretch(tmp_path: Path) -> None:
    source = "main: in r0, SREG\n cli\n {} out SREG, r0\n nop\n ret"
    lengths = [
        InterruptsOff(assembled(tmp_path, source.format(text))).of("main").cycles
        for text in ("", "nop\n", "push r2\n pop r2\n")
    ]
    assert [length - lengths[0] for length in lengths] == [0, 1, 4]
