"""Computed jumps: followed where the program proves where they lead, refused elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from avr_image import assembled, build, compiled, disassembly, function, refusal
from avr_timing.flow.graph import load_program
from boebot.image.elf import read_image

SWITCH = """
#include <stdint.h>
volatile uint8_t in, out;
volatile TYPE index;
void f0(void); void f1(void); void f2(void); void f3(void); void f4(void); void f5(void); void f6(void); void f7(void);
#define F(n) __attribute__((noinline)) void f##n(void) { out = n; in = out; }
F(0) F(1) F(2) F(3) F(4) F(5) F(6) F(7)
int main(void) {
    switch (index MASK) {
    case FIRST + 0: f0(); break; case FIRST + 1: f1(); break; case FIRST + 2: f2(); break; case FIRST + 3: f3(); break;
    case FIRST + 4: f4(); break; case FIRST + 5: f5(); break; case FIRST + 6: f6(); break; case FIRST + 7: f7(); break;
    DEFAULT
    }
    return out;
}
"""
UNREACHABLE = "default: __builtin_unreachable();"


def switch(type_: str, first: int, mask: str = "", default: str = "") -> str:
    text = SWITCH.replace("TYPE", type_).replace("FIRST", str(first)).replace("MASK", mask)
    return text.replace("DEFAULT", default)


@pytest.mark.parametrize("relax", ["-Wl,--relax", "-mcall-prologues"])
@pytest.mark.parametrize(
    ("type_", "first", "mask", "default"),
    [
        ("uint8_t", 0, "", ""),
        ("uint8_t", 5, "", ""),
        ("uint8_t", 0, "& 7", UNREACHABLE),
    ],
)
def test_a_table_of_jumps_leads_to_each_case(
    tmp_path: Path, type_: str, first: int, mask: str, default: str, relax: str
) -> None:
    program = compiled(tmp_path, switch(type_, first, mask, default), "-fno-inline", relax)
    text = disassembly(tmp_path / "program.elf")
    assert any("tablejump" in line or line.startswith("ijmp") for line in text.values())
    main = function(program, "main")
    (jump,) = [b for b in main.blocks.values() if b.instructions[-1].mnemonic == "ijmp"]
    called = {b.callee for b in main.blocks.values() if b.callee is not None}
    assert called == {program.by_name[f"f{n}"] for n in range(8)}
    assert len(jump.edges) == (7 if mask else 8)  # gcc leads to the last of all cases by a branch
    assert {edge.cycles for edge in jump.edges} == {2}
    assert all(f"f{n}" in program.by_name for n in range(8))


TABLE = """
    main: lds r24, 256
    {limit}
    mov r30, r24
    ldi r31, 0
    subi r30, lo8(-(gs(table)))
    sbci r31, hi8(-(gs(table)))
    ijmp
    1: ret
    table: rjmp 1b
    rjmp 1b
    rjmp 1b
    rjmp 1b
"""


@pytest.mark.parametrize(
    ("limit", "targets"),
    [
        ("andi r24, 3", 4),
        ("cpi r24, 4\n brcc 1f", 4),
        ("cpi r24, 3\n brcs 2f\n ret\n 2:", 3),
        ("lsr r24\n cpi r24, 2\n brcs 2f\n ret\n 2:", 2),
        ("subi r24, 7\n cpi r24, 2\n brcs 2f\n ret\n 2:", 2),
        ("cpi r24, 0\n brne 1f", 1),
        ("clr r24", 1),
    ],
)
def test_an_index_is_limited_by_what_comes_before(tmp_path: Path, limit: str, targets: int) -> None:
    program = assembled(tmp_path, TABLE.format(limit=limit))
    main = function(program, "main")
    (jump,) = [b for b in main.blocks.values() if b.instructions[-1].mnemonic == "ijmp"]
    first = next(i.address for b in main.blocks.values() for i in b.instructions if i.mnemonic == "ijmp") + 4
    assert [edge.to for edge in jump.edges] == [first + 2 * n for n in range(targets)]


@pytest.mark.parametrize("limit", ["nop", "cpi r24, 4\n cpi r25, 4\n brcc 1f", "cpi r24, 4\n brcc 1f\n pop r24"])
def test_an_index_that_nothing_limits_is_refused(tmp_path: Path, limit: str) -> None:
    message = refusal(tmp_path, TABLE.format(limit=limit), "-gdwarf-4")
    assert re.search(r"program\.S:\d+\): where `ijmp` leads cannot be proven: nothing before limits its index", message)


def test_a_table_whose_index_is_limited_too_late_is_refused(tmp_path: Path) -> None:
    # The comparison is of another register than the one that the table takes.
    source = """
    main: cpi r24, 4
    brcc 1f
    mov r30, r25
    ldi r31, 0
    subi r30, lo8(-(gs(table)))
    sbci r31, hi8(-(gs(table)))
    ijmp
    1: ret
    table: rjmp 1b
    """
    assert "nothing before limits its index" in refusal(tmp_path, source)
    assert function(assembled(tmp_path, source.replace("r25", "r24").replace("cpi r24, 4", "cpi r24, 1")), "main")


def test_a_way_around_the_comparison_is_refused(tmp_path: Path) -> None:
    limited = """
    main: tst r22
    breq 2f
    cpi r24, 1
    brcc 1f
    2: mov r30, r24
    ldi r31, 0
    subi r30, lo8(-(gs(table)))
    sbci r31, hi8(-(gs(table)))
    ijmp
    1: ret
    table: rjmp 1b
    """
    assert "cannot be proven" in refusal(tmp_path, limited)
    assert function(assembled(tmp_path, limited.replace("breq 2f", "nop")), "main")


def test_a_comparison_the_wrong_way_is_refused(tmp_path: Path) -> None:
    source = switch("uint8_t", 0)
    image = build(tmp_path, source, "-fno-inline")
    text = disassembly(image)
    main = function(load_program(image), "main")
    compare = next(a for a, line in text.items() if a >= main.entry and line.startswith("cpi"))
    branch = next(a for a, line in text.items() if a > compare and line.startswith(("brcc", "brcs")))
    data = bytearray(image.read_bytes())
    place = data.index(read_image(image).code[branch - 8 : branch + 4]) + 8
    data[place + 1] ^= 0x04  # brcc and brcs differ in this bit
    image.write_bytes(data)
    assert main.entry in load_program(image).unproven


def test_shared_code_that_saves_registers_is_part_of_each_function(tmp_path: Path) -> None:
    source = """
    #include <stdint.h>
    extern volatile uint32_t v[16];
    volatile uint32_t v[16];
    __attribute__((noinline)) uint32_t g(uint32_t a, uint32_t b, uint32_t c) {
        uint32_t x = v[0], y = v[1], z = v[2];
        v[3] = a; v[4] = b; v[5] = c;
        return x + y + z + a + b + c + v[6];
    }
    __attribute__((noinline)) uint32_t h(uint32_t a) { return g(a, v[1], v[2]) + g(v[3], a, v[4]) + a; }
    int main(void) { return (int)(h(v[7]) + g(1, 2, v[9])); }
    """
    program = compiled(tmp_path, source, "-mcall-prologues", "-gdwarf-4")
    text = disassembly(tmp_path / "program.elf")
    users = 0
    for name in ("g", "h"):
        instructions = [i for b in function(program, name).blocks.values() for i in b.instructions]
        mnemonics = [i.mnemonic for i in instructions]
        users += mnemonics.count("ijmp")
        assert all(text[i.address].split()[0] == i.mnemonic for i in instructions)
        assert mnemonics[-1] == "ret" or "ret" in mnemonics
        for b in function(program, name).blocks.values():
            if b.instructions[-1].mnemonic == "ijmp":
                (edge,) = b.edges
                # gcc gives the address behind the jump to __prologue_saves__
                assert text[edge.to - 4].startswith("jmp") or text[edge.to - 2].startswith("rjmp")
    assert users >= 1
    assert not any("__prologue" in f.name or "__epilogue" in f.name for f in program.functions.values())


def test_a_long_computation_before_the_jump_is_refused(tmp_path: Path) -> None:
    steps = "add r30, r24\n adc r31, r25\n" * 400
    assert "cannot be proven" in refusal(tmp_path, f"main: andi r24, 1\n {steps} ijmp")


def test_a_loop_before_the_jump_is_no_way_of_its_own(tmp_path: Path) -> None:
    # Z is 0 only the first time: the way back around adds to it.
    assert "cannot be proven" in refusal(
        tmp_path, "main: clr r30\n clr r31\n 1: adiw r30, 1\n dec r24\n brne 1b\n ijmp"
    )
