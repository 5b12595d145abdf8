"""Depths of the stack of small programs, counted by hand."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import assembled, compiled
from avr_timing.bounds.stack import Stack
from avr_timing.bounds.wcet import WorstCase
from boebot.errors import AnalysisError

FRAME = "in r28, SPL\n in r29, SPH\n {take}\n in r0, SREG\n cli\n out SPH, r29\n out SREG, r0\n out SPL, r28\n"
TAKE = FRAME.format(take="sbiw r28, 20")
GIVE = FRAME.format(take="adiw r28, 20")
LARGE = FRAME.format(take="subi r28, 0x2C\n sbci r29, 0x01")
LARGE_BACK = FRAME.format(take="subi r28, 0xD4\n sbci r29, 0xFE")
UNKNOWN = FRAME.format(take="sub r28, r24\n sbc r29, r25")
SAVED = "push r28\n push r29\n"
RESTORED = "pop r29\n pop r28\n ret\n"


@pytest.mark.parametrize(
    ("source", "depth"),
    [
        ("main: ret", 0),
        ("main: push r24\n push r25\n pop r25\n pop r24\n ret", 2),
        ("main: rcall f\n ret\n f: push r24\n pop r24\n ret", 2 + 1),
        ("main: push r24\n call f\n pop r24\n push r24\n push r24\n pop r24\n pop r24\n ret\n f: ret", 1 + 2),
        ("main: rcall .+0\n pop r0\n pop r0\n ret", 2),
        ("main: push r2\n pop r2\n jmp f\n .type f, @function\n f: push r24\n push r25\n pop r25\n pop r24\n ret", 2),
        (f"main: {SAVED}{TAKE} rcall f\n {GIVE}{RESTORED} f: ret", 2 + 20 + 2),
        (f"main: {SAVED}{LARGE}{LARGE_BACK}{RESTORED}", 2 + 300),
    ],
    ids=["leaf", "push", "call", "the deeper of two", "room", "tail call", "frame", "large frame"],
)  # fmt: skip
def test_counted_by_hand(tmp_path: Path, source: str, depth: int) -> None:
    assert Stack(assembled(tmp_path, source)).of("main") == depth


def test_depth_of_a_chain_of_calls(tmp_path: Path) -> None:
    source = "main: rcall f\n rcall g\n ret\n f: ret\n g: push r24\n rcall f\n pop r24\n ret"
    assert Stack(assembled(tmp_path, source)).of("main") == 2 + 1 + 2


@pytest.mark.parametrize("size", [10, 60, 200])
@pytest.mark.parametrize("flags", [(), ("-mcall-prologues",)], ids=["own prologues", "shared prologues"])
def test_frames_of_the_compiler(tmp_path: Path, size: int, flags: tuple[str, ...]) -> None:
    """A frame of n bytes more is n bytes deeper, with a call within it."""
    source = (
        'void __attribute__((noinline, noclone)) use(char *p) {{ __asm__ volatile("" ::"r"(p) : "memory"); }}\n'
        "int __attribute__((noinline, noclone)) f(int a, int b, int c, int d) {{\n"
        "  char room[{0}]; use(room); use(room + 1); use((char *)a); use((char *)b); use((char *)c); use((char *)d);\n"
        "  return room[2] + a + b + c + d; }}\n"
        "int main(void) {{ return f(1, 2, 3, 4); }}\n"
    )
    depths = [Stack(compiled(tmp_path, source.format(n), *flags)).of("f") for n in (size, size + 7)]
    assert depths[1] - depths[0] == 7
    assert depths[0] >= size + 2 + 8  # room, a call, and a to d across calls


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("main: rcall main\n ret", "recursion"),
        ("main: tst r24\n breq 1f\n push r24\n 1: ret", "0 bytes on the stack|with 1 bytes"),
        ("main: push r24\n ret", "returns at .* with 1 bytes"),
        ("main: pop r24\n ret", "more is popped"),
        (f"main: {UNKNOWN} ret", "stack pointer gets a value"),
        (
            "main: in r28, SPL\n in r29, SPH\n subi r28, 5\n out SREG, r2\n sbci r29, 0\n out SPH, r29",
            "stack pointer gets",
        ),
        (f"main: {TAKE} 1: push r24\n dec r25\n brne 1b\n {GIVE} ret", "one depth at each place"),
    ],
)
def test_refused_with_the_place(tmp_path: Path, source: str, words: str) -> None:
    with pytest.raises(AnalysisError, match=words) as caught:
        Stack(assembled(tmp_path, source)).of("main")
    assert "0x" in str(caught.value)


def test_ways_that_cannot_be_gone_count_neither_for_cycles_nor_for_the_stack(tmp_path: Path) -> None:
    """A weak function without a definition: its call goes to address 0, and the test in front of the call fails."""
    source = (
        "extern void hook(void) __attribute__((weak));\nvolatile unsigned char n;\n"
        "__attribute__((noinline)) void tick(void) { if (hook) hook(); n++; }\nint main(void) { tick(); return 0; }\n"
    )
    program = compiled(tmp_path, source)
    assert 0 in program.below(program.by_name["tick"])
    assert (Stack(program).of("tick"), Stack(program).of("main")) == (0, 2)
    assert WorstCase(program).of("tick").cycles == 3 * 1 + 2 + (2 + 1 + 2) + 4  # ldi ldi or breq, lds subi sts, ret


@pytest.mark.parametrize(("argument", "depth"), [("ldi r24, 0", 2), ("ldi r24, 1", 2 + 1), ("in r24, 5", 2 + 1)])
def test_depth_by_what_a_function_is_called_with(tmp_path: Path, argument: str, depth: int) -> None:
    source = f"main: {argument}\n rcall f\n ret\n f: tst r24\n breq 1f\n push r2\n pop r2\n 1: ret"
    assert Stack(assembled(tmp_path, source)).of("main") == depth


def test_arrays_of_variable_length_are_refused(tmp_path: Path) -> None:
    source = (
        'void __attribute__((noinline, noclone)) use(char *p) { __asm__ volatile("" ::"r"(p) : "memory"); }\n'
        "volatile unsigned char n;\n"
        "int main(void) { char room[n]; use(room); return room[0]; }\n"
    )
    with pytest.raises(AnalysisError, match="stack pointer gets a value"):
        Stack(compiled(tmp_path, source)).of("main")


def test_interrupts_that_let_others_in_add_up(tmp_path: Path) -> None:
    source = """main: push r24
    pop r24
    ret
    .global __vector_1
    .global __vector_2
    .global __vector_3
    __vector_1: push r0
    pop r0
    reti
    __vector_2: sei
    push r0
    push r1
    pop r1
    pop r0
    reti
    __vector_3: push r0
    push r1
    push r2
    pop r2
    pop r1
    pop r0
    reti"""
    depth = Stack(assembled(tmp_path, source)).image()
    assert depth == (2 + 1) + (2 + 2) + (2 + 3)
