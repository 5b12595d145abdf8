"""Worst-case execution times of small programs, counted by hand after the instruction set manual; planted changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import assembled, build, compiled
from avr_timing.bounds.wcet import Visit, WorstCase
from avr_timing.flow.graph import load_program
from boebot.errors import AnalysisError

# What firmware/src/bounds.h writes, in short.
LOOP = """
.macro bounded passes, cycles=0xFFFFFFFF
.Lloop\\@:
.pushsection .boebot.loops, "", @progbits
.long .Lloop\\@, \\passes, \\cycles
.popsection
.endm
"""
C_LOOP = """
#include <stdint.h>
#include <string.h>
__asm__(".macro bounded passes, cycles\\n.Lloop\\\\@:\\n.pushsection .boebot.loops, \\"\\", @progbits\\n"
        ".long .Lloop\\\\@, \\\\passes, \\\\cycles\\n.popsection\\n.endm");
#define BOUNDED(n) __asm__ volatile("bounded %0, 0xFFFFFFFF" ::"n"(n))
"""
WHILE = "main: ldi r24, 0\n 1: tst r25\n breq 2f\n bounded 5\n nop\n rjmp 1b\n 2: ret"
NESTED = """main: nop
1: dec r24
 breq 9f
 bounded 3
2: bounded 4
 lds r25, 256
 cp r25, r24
 brne 2b
 rjmp 1b
9: ret
"""
TWO_ENTRIES = "main: ldi r25, 3\n sbrc r24, 0\n rjmp 2f\n 1: nop\n nop\n nop\n 2: nop\n dec r25\n brne 1b\n ret"
# From wherever X points to three bytes behind it.
STEPPED = """main: ldi r24, 3
 ldi r25, 0
 movw r30, r26
 add r24, r26
 adc r25, r27
1: ld r0, X+
 cp r26, r24
 cpc r27, r25
 brne 1b
 ret
"""


def cycles_of(folder: Path, source: str, name: str = "main") -> int:
    return WorstCase(assembled(folder, LOOP + source)).of(name).cycles


@pytest.mark.parametrize(
    ("source", "cycles"),
    [
        ("main: nop\n nop\n ret", 1 + 1 + 4),
        ("main: tst r24\n breq 1f\n adiw r24, 1\n 1: ret", 1 + 1 + 2 + 4),
        ("main: tst r24\n breq 1f\n nop\n 1: ret", 1 + 2 + 4),  # 1 + 1 + 1 + 4 the other way
        ("main: sbrc r24, 0\n sts 256, r24\n ret", 1 + 2 + 4),  # as long as the skip of two words
        ("main: call f\n ret\n f: push r24\n pop r24\n ret", 4 + (2 + 2 + 4) + 4),
        ("main: rcall f\n rcall f\n ret\n f: ret", 2 * (3 + 4) + 4),
        ("main: sbi EECR, EERE\n sbi EECR, EEMPE\n sbi EECR, EEPE\n ret", (2 + 4) + 2 + (2 + 2) + 4),
        ("main: jmp f\n .type f, @function\n f: ret", 3 + 4),
        (WHILE, 1 + 5 * (1 + 1 + 1 + 2) + (1 + 2) + 4),
        (NESTED, 1 + 3 * (1 + 1 + (3 * (2 + 1 + 2) + (2 + 1 + 1)) + 2) + (1 + 2) + 4),
        ("main: ldi r24, 7\n 1: nop\n dec r24\n brne 1b\n ret", 1 + 6 * (1 + 1 + 2) + (1 + 1 + 1) + 4),
        ("main: ldi r24, 7\n 1: dec r24\n brpl 1b\n ret", 1 + 7 * 3 + 2 + 4),  # 6 to 0, then 255
        ("main: ldi r24, 1\n ldi r25, 1\n 1: sbiw r24, 1\n brne 1b\n ret", 2 + 256 * 4 + 3 + 4),
        ("main: ldi r24, 0\n 1: dec r24\n brne 1b\n ret", 1 + 255 * 3 + 2 + 4),
        ("main: ldi r18, 2\n ldi r25, 1\n ldi r20, 0\n 1: subi r18, 1\n sbci r25, 0\n sbci r20, 0\n brne 1b\n ret",
         3 + 257 * 5 + 4 + 4),
        ("main: ldi r30, 0\n ldi r31, 0\n 1: adiw r30, 1\n cpi r30, 0xE8\n ldi r18, 3\n cpc r31, r18\n brne 1b\n ret",
         2 + 999 * 7 + 6 + 4),
        ("main: set\n bld r1, 3\n 1: lsr r24\n lsr r1\n brne 1b\n ret", 2 + 3 * (2 + 2) + (2 + 1) + 4),  # 8, 4, 2, 1
        ("main: ldi r24, 1\n rjmp 2f\n 1: ldi r24, 0\n 2: cpse r24, r1\n rjmp 1b\n ret", 3 + (1 + 2 + 1) + 2 + 4),
        ("main: ldi r24, 96\n ldi r25, 0\n bst r24, 5\n 1: bld r25, 7\n inc r25\n brmi 1b\n ret", 3 + 127 * 4 + 3 + 4),
        (STEPPED, 2 + 1 + 2 + 3 * (2 + 1 + 1 + 2) - 1 + 4),
        (STEPPED.replace("ldi r24, 3", "ldi r24, 3\n ldi r26, 250\n ldi r27, 1"), 4 + 1 + 2 + 3 * (2 + 1 + 1 + 2) - 1 +
        4),
        (STEPPED.replace("add r24, r26\n adc r25, r27", "movw r24, r26\n subi r24, 0xFD\n sbci r25, 0xFF"),
         2 + 1 + 1 + 2 + 3 * (2 + 1 + 1 + 2) - 1 + 4),
        ("main: movw r30, r26\n ldi r24, 255\n ldi r25, 1\n add r24, r25\n cpc r27, r31\n breq 1f\n nop\n nop\n 1: ret",
         5 + 1 + 2 + 4),  # what was added came to 0 with a carry
        (STEPPED.replace("ld r0, X+", "st X+, r0"), 2 + 1 + 2 + 3 * (2 + 1 + 1 + 2) - 1 + 4),
        (STEPPED.replace("add r24, r26\n adc r25, r27", "movw r24, r26\n adiw r24, 3"),
         2 + 1 + 1 + 2 + 3 * (2 + 1 + 1 + 2) - 1 + 4),
        ("main: 1: sbis 5, 0\n rjmp 2f\n ret\n 2: bounded 0xFFFFFFFF, 1000\n rjmp 1b", 1000 + (1 + 2 + 2) + 2 + 4),
        ("main: 1: sbis 5, 0\n rjmp 2f\n ret\n 2: bounded 0xFFFFFFFF, 1000\n sleep\n rjmp 1b",
         1000 + (1 + 2 + 1 + 2) + 2 + 4),
        ("main: ldi r24, 7\n 1: bounded 0xFFFFFFFF, 1000\n sleep\n dec r24\n brne 1b\n ret",
         1 + 1000 + (1 + 1 + 2) + (1 + 1 + 1) + 4),
    ],
    ids=["straight", "branch", "branch taken", "skip", "call", "two calls", "EEPROM halts", "tail call", "while",
         "nested", "counted", "counted below zero", "two bytes", "256 times", "three bytes", "up to 1000", "shifted",
         "flag", "bit of another", "up to a pointer", "up to a known one", "from a difference",
         "zero with a carry", "stored", "from a copy", "waits", "waits asleep", "counts naps"],
)  # fmt: skip
def test_counted_by_hand(tmp_path: Path, source: str, cycles: int) -> None:
    assert cycles_of(tmp_path, source) == cycles


@pytest.mark.parametrize(
    ("old", "new", "more"),
    [
        ("2: ret", "2: nop\n ret", 1),  # an inserted instruction
        ("nop\n rjmp", "nop\n lds r24, 256\n rjmp", 5 * 2),  # in the loop
        ("tst r25", "tst r25\n nop", 6),  # in its test
        ("bounded 5", "bounded 6", 5),  # a pass more
        ("nop\n rjmp", "rcall f\n rjmp", 5 * (3 + 4 - 1)),  # a call in place of the nop
        ("2: ret", "2: sbrs r24, 0\n rcall f\n ret", 1 + 3 + 4),  # a longer path
    ],
)
def test_planted_change_raises_the_bound_by_what_it_takes(tmp_path: Path, old: str, new: str, more: int) -> None:
    base = WHILE + "\n f: ret"
    assert base.count(old) == 1
    assert cycles_of(tmp_path, base.replace(old, new)) == cycles_of(tmp_path, base) + more


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (WHILE.replace("bounded 5", "nop"), "has no bound"),
        ("main: push r30\n push r31\n ret", "returns at .* with 2 bytes on the stack"),
        ("main: push r30\n push r31\n rjmp f\n .type f, @function\n f: ret", "main returns at .* with 2 bytes"),
        ("main: rcall f\n ret\n .type f, @function\n f: out SPH, r25\n out SPL, r24\n ret", "stack pointer gets"),
        (NESTED.replace("bounded 3", "nop"), "has no bound"),
        (NESTED.replace("bounded 4", "nop"), "has no bound"),
        ("main: set\n bld r1, 3\n 1: lsr r24\n asr r1\n sec\n brcs 1b\n ret", "has no bound"),
        ("main: ldi r24, 1\n rjmp 2f\n 1: ldi r24, 2\n 2: cpse r24, r1\n rjmp 1b\n ret", "has no bound"),
        ("main: bst r25, 5\n bld r1, 3\n 1: nop\n dec r1\n brne 1b\n ret", "has no bound"),
        ("main: rcall f\n ret\n f: rcall main\n ret", "recursion at .*: main calls f calls main"),
        ("main: rjmp main", "has no bound"),
        (TWO_ENTRIES, "can be entered at two places"),
        ("main: sleep\n ret", "main waits asleep at"),
        ("main: 1: bounded 5\n sleep\n sbis 5, 0\n rjmp 1b\n ret", "main waits asleep at"),  # passes are no time
        ("main: ldi r24, 7\n 1: sleep\n dec r24\n brne 1b\n ret", "main waits asleep at"),
        ("main: 1: bounded 0xFFFFFFFF, 9\n rcall f\n sbis 5, 0\n rjmp 1b\n ret\n f: sleep\n ret", "f waits asleep at"),
        (STEPPED.replace("cp r26, r24", "cp r30, r24"), "has no bound"),
        # C that was not left by the count, nor by the lower byte, or the other way round
        ("main: cp r22, r23\n ldi r24, 5\n 1: dec r24\n brcc 1b\n ret", "has no bound"),
        ("main: ldi r24, 5\n 1: in r0, SREG\n dec r24\n out SREG, r0\n brne 1b\n ret", "has no bound"),
        (STEPPED.replace("adc r25", "out SREG, r18\n adc r25"), "has no bound"),
        ("main: movw r24, r26\n subi r26, 5\n adc r27, r1\n1: ld r0, X+\n cp r26, r24\n cpc r27, r25\n brne 1b\n ret",
         "has no bound"),
    ],
)  # fmt: skip
def test_refused_with_the_place(tmp_path: Path, source: str, words: str) -> None:
    with pytest.raises(AnalysisError, match=words) as caught:
        cycles_of(tmp_path, source)
    assert "0x" in str(caught.value)


def test_refusal_names_the_line(tmp_path: Path) -> None:
    source = "#include <stdint.h>\nvolatile uint8_t x;\nint main(void) {\n  while (x != 0) {\n    x--;\n  }\n}\n"
    program = load_program(build(tmp_path, source, "-gdwarf-2"))
    with pytest.raises(AnalysisError, match=r"loop at 0x[0-9A-F]{4} \(.*program\.c:[45]\)"):
        WorstCase(program).of("main")


def test_path_says_how_often_each_block_runs(tmp_path: Path) -> None:
    program = assembled(tmp_path, LOOP + NESTED)
    bound = WorstCase(program).of("main")
    main = program.by_name["main"]
    inner = 3 * (3 * 5 + 4)
    assert Visit(main + 6, 3 * 4, inner) in bound.path
    assert sum(visit.cycles for visit in bound.path) == bound.cycles


# 60 passes at most; how many, r20 says.
SHARED = "f: bounded 60\n nop\n dec r20\n brne f\n ret\n"
PASSES = {n: 4 * n - 1 + 4 for n in (3, 5, 60)}  # a pass 1 + 1 + 2, the last one 1 less; ret


@pytest.mark.parametrize(
    ("source", "cycles"),
    [
        ("main: ldi r20, 3\n rcall f\n ldi r20, 5\n rcall f\n ret\n", 1 + 3 + PASSES[3] + 1 + 3 + PASSES[5] + 4),
        ("main: rcall f\n ret\n", 3 + PASSES[60] + 4),
        ("main: ldi r20, 3\n rcall g\n rcall f\n ret\n g: ret\n", 1 + 3 + 4 + 3 + PASSES[60] + 4),  # g may write r20
        ("main: ldi r16, 3\n rcall g\n mov r20, r16\n rcall f\n ret\n g: ret\n", 1 + 7 + 1 + 3 + PASSES[3] + 4),
        ("main: ldi r20, 3\n sbrc r24, 0\n ldi r20, 5\n rcall f\n ret\n", 1 + 2 + 3 + PASSES[60] + 4),
        ("main: ldi r20, 3\n sbrc r24, 0\n ldi r20, 3\n rcall f\n ret\n", 1 + 2 + 3 + PASSES[3] + 4),
        ("main: ldi r20, 3\n jmp f\n .type f, @function\n", 1 + 3 + PASSES[3]),
        ("main: ldi r20, 3\n rcall g\n ret\n g: rcall f\n ret\n", 1 + 3 + 3 + PASSES[3] + 4 + 4),  # handed through
    ],
    ids=["two calls", "unknown", "clobbered", "kept", "two values", "one value", "tail call", "through"],
)  # fmt: skip
def test_loop_by_what_its_function_is_called_with(tmp_path: Path, source: str, cycles: int) -> None:
    assert cycles_of(tmp_path, source + SHARED) == cycles


@pytest.mark.parametrize(
    ("test", "value", "cycles"),
    [
        ("tst r24\n breq 1f", 0, 1 + 2 + 4),
        ("tst r24\n breq 1f", 1, 1 + 1 + 2 + 4),
        ("cpi r24, 7\n brcs 1f", 6, 1 + 2 + 4),
        ("cpi r24, 7\n brcs 1f", 7, 1 + 1 + 2 + 4),
        ("cpi r24, 7\n brlt 1f", 0x80, 1 + 2 + 4),  # -128
        ("cpi r24, 7\n brge 1f", 0x80, 1 + 1 + 2 + 4),
        ("sbrc r24, 3\n rjmp 1f", 8, 1 + 2 + 4),
        ("sbrc r24, 3\n rjmp 1f", 7, 2 + 2 + 4),
        ("cpse r24, r1\n rjmp 1f", 0, 2 + 2 + 4),
        ("cpse r24, r1\n rjmp 1f", 1, 1 + 2 + 4),
        ("subi r24, 5\n sbc r25, r1\n brcc 1f", 4, 1 + 1 + 1 + 2 + 4),  # r25 is not known
        ("cpi r25, 3\n brne 1f\n cpi r25, 4\n brne 1f", 0, 1 + 1 + 1 + 2 + 4),  # it is 3 behind the first
        ("subi r25, 1\n brcc 1f\n inc r25\n brne 1f", 0, 1 + 1 + 1 + 1 + 2 + 4),  # 255 behind the first, then 0
    ],
)  # fmt: skip
def test_ways_that_an_argument_closes_do_not_count(tmp_path: Path, test: str, value: int, cycles: int) -> None:
    """Behind the test 2 cycles and the return, at 1 the return alone."""
    source = f"main: ldi r24, {value}\n rcall f\n ret\n f: {test}\n lds r18, 256\n 1: ret\n"
    assert cycles_of(tmp_path, source) == 1 + 3 + cycles + 4


@pytest.mark.parametrize(("said", "passes"), [(4, 7), (10, 7)])
def test_count_that_the_code_shows_holds(tmp_path: Path, said: int, passes: int) -> None:
    """Whatever is said: the row may be that of a loop within, which the compiler left out."""
    source = f"main: ldi r20, 7\n 1: bounded {said}\n sbic 5, 0\n rjmp 2f\n dec r20\n brne 1b\n 2: ret"
    a_pass = 2 + 1 + 2  # sbic skips
    leaves = max(1 + 2, 2 + 1 + 1)  # by the jump, by the branch
    assert cycles_of(tmp_path, source) == 1 + (passes - 1) * a_pass + leaves + 4


def test_bound_of_an_unrolled_loop_is_not_that_of_the_loop_around(tmp_path: Path) -> None:
    """The compiler leaves two copies of the inner loop's body, and no loop of it, in the outer one."""
    source = C_LOOP + (
        "volatile uint8_t n, x;\nint main(void) {{ while (n) {{ {0}\n"
        "  for (uint8_t i = 0; i < 2; i++) {{\n    BOUNDED(2); x = i; }} }}\n return 0; }}\n"
    )
    flags = ("-gdwarf-2", "-O3")
    with pytest.raises(AnalysisError, match="has no bound"):
        WorstCase(compiled(tmp_path, source.format(""), *flags)).of("main")
    of = [WorstCase(compiled(tmp_path, source.format(f"BOUNDED({n});"), *flags)).of("main").cycles for n in (3, 6, 9)]
    assert of[2] - of[1] == of[1] - of[0] > 3 * 2 * 2


def test_library_routines_by_what_they_are_called_with(tmp_path: Path) -> None:
    source = C_LOOP + "uint8_t a[40], b[40];\nint main(void) {{ memcpy(a, b, {}); return 0; }}\n"
    of = [WorstCase(compiled(tmp_path, source.format(n), "-fno-builtin")).of("main").cycles for n in (9, 10, 40)]
    assert of[1] - of[0] == 2 + 2 + 1 + 1 + 2  # ld, st, subi, sbci, brcc
    assert of[2] - of[1] == 30 * (of[1] - of[0])


def test_library_routine_with_an_unknown_number_of_bytes_is_refused(tmp_path: Path) -> None:
    source = C_LOOP + "uint8_t a[40], b[40];\nvolatile uint8_t n;\nint main(void) { memcpy(a, b, n); return 0; }\n"
    with pytest.raises(AnalysisError, match=r"memcpy is called at 0x.* not a constant"):
        WorstCase(compiled(tmp_path, source)).of("main")


def test_what_the_compiler_makes_of_annotated_c(tmp_path: Path) -> None:
    """Twice the bound, twice the loop: whatever shape the compiler gave it."""
    source = C_LOOP + (
        "volatile uint8_t n, x;\nint main(void) {{\n for (uint8_t i = 0; i < n; i++) {{ BOUNDED({0});"
        "\n  if (x == 7) {{ x = 9; continue; }}\n  if (x == 8) {{ break; }}\n  x = i; }}\n return 0; }}\n"
    )
    of = [WorstCase(compiled(tmp_path, source.format(n))).of("main").cycles for n in (10, 20, 40)]
    assert of[2] - of[1] == 2 * (of[1] - of[0]) > 0
