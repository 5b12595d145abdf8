"""The control-flow graph of small programs whose ways are known, and of the images."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from avr_image import assembled, disassembly, function, operands, refusal
from avr_timing.flow.graph import load_program, program_of
from avr_timing.program import Edge, Instruction
from boebot.image.elf import read_image

IMAGES = Path(__file__).resolve().parents[3] / "build" / "images"


def test_a_branch_takes_one_cycle_or_two(tmp_path: Path) -> None:
    main = function(assembled(tmp_path, "main: tst r24\n brne 1f\n nop\n 1: ret"), "main")
    first, second, last = (main.blocks[main.entry + offset] for offset in (0, 4, 6))
    assert first.edges == (Edge(second.start, 1), Edge(last.start, 2))
    assert first.body_cycles == 1
    assert second.edges == (Edge(last.start, 1),)
    assert (last.edges, last.callee, last.last_cycles) == ((), None, 4)


@pytest.mark.parametrize("skip", ["sbrc r24, 0", "sbrs r24, 0", "sbic 5, 1", "sbis 5, 1", "cpse r24, r25"])
@pytest.mark.parametrize(("skipped", "words"), [("nop", 1), ("lds r25, 256", 2), ("sts 256, r25", 2)])
def test_a_skip_takes_a_cycle_for_each_word(tmp_path: Path, skip: str, skipped: str, words: int) -> None:
    main = function(assembled(tmp_path, f"main: {skip}\n {skipped}\n ret"), "main")
    behind = main.entry + 2
    assert main.blocks[main.entry].edges == (Edge(behind, 1), Edge(behind + 2 * words, 1 + words))


def test_a_call_ends_its_block(tmp_path: Path) -> None:
    program = assembled(tmp_path, "main: call leaf\n rcall leaf\n ret\n leaf: ret")
    main = function(program, "main")
    first, second = main.blocks[main.entry], main.blocks[main.entry + 4]
    assert first.callee == second.callee == program.by_name["leaf"]
    assert first.edges == (Edge(main.entry + 4, 4),)
    assert second.edges == (Edge(main.entry + 6, 3),)


def test_a_call_of_the_next_instruction_makes_room_on_the_stack(tmp_path: Path) -> None:
    main = function(assembled(tmp_path, "main: rcall .+0\n pop r0\n pop r0\n ret"), "main")
    (only,) = main.blocks.values()
    assert [i.mnemonic for i in only.instructions] == ["rcall", "pop", "pop", "ret"]
    assert (only.callee, only.body_cycles) == (None, 3 + 2 + 2)


@pytest.mark.parametrize(("jump", "cycles"), [("jmp", 3), ("rjmp", 2)])
def test_a_jump_to_a_function_is_a_tail_call(tmp_path: Path, jump: str, cycles: int) -> None:
    source = f"main: {jump} other\n .type other, @function\n other: ret"
    program = assembled(tmp_path, source)
    (only,) = function(program, "main").blocks.values()
    assert (only.edges, only.callee, only.last_cycles) == ((), program.by_name["other"], cycles)


def test_a_jump_into_the_middle_of_a_function_stays_in_its_own(tmp_path: Path) -> None:
    source = ".type main, @function\n main: rcall other\n rjmp 1f\n .type other, @function\n other: nop\n 1: ret"
    program = assembled(tmp_path, source)
    main, other = function(program, "main"), function(program, "other")
    assert main.blocks[other.entry + 2].last_cycles == 4
    assert [i.mnemonic for b in other.blocks.values() for i in b.instructions] == ["nop", "ret"]


def test_a_function_goes_on_in_the_next_where_it_has_no_end(tmp_path: Path) -> None:
    source = "main: rcall second\n nop\n .type second, @function\n second: inc r24\n ret"
    main = function(assembled(tmp_path, source), "main")
    assert [i.mnemonic for i in main.blocks[main.entry + 2].instructions] == ["nop", "inc", "ret"]


def test_nothing_is_behind_a_call_that_never_returns(tmp_path: Path) -> None:
    # What is behind these calls is no code: the compiler does not write any there.
    source = "main: sbrc r24, 0\n rjmp 1f\n call direct\n .word 0xffff\n 1: call forever\n .word 0xffff\n"
    program = assembled(tmp_path, source + "direct: jmp forever\n forever: rjmp forever")
    last = [b for b in function(program, "main").blocks.values() if b.callee is not None]
    assert [(b.edges, b.last_cycles) for b in last] == [((), 4), ((), 4)]
    assert {b.callee for b in last} == {program.by_name[name] for name in ("direct", "forever")}


def test_a_recursive_function_returns_where_one_way_does(tmp_path: Path) -> None:
    source = "main: rcall down\n ret\n down: dec r24\n breq 1f\n rcall down\n nop\n 1: ret"
    program = assembled(tmp_path, source)
    down = function(program, "down")
    assert down.blocks[down.entry + 4].callee == down.entry
    assert down.blocks[down.entry + 6].instructions[0].mnemonic == "nop"
    assert function(program, "main").blocks[program.by_name["main"] + 2].last_cycles == 4


def test_only_vectors_in_use_are_followed(tmp_path: Path) -> None:
    source = "main: ret\n .global __vector_18\n __vector_18: reti"
    program = assembled(tmp_path, source)
    vectors = {entry: f for entry, f in program.functions.items() if 0 < entry < 104}
    assert list(vectors) == [18 * 4]
    (only,) = vectors[18 * 4].blocks.values()
    assert (only.callee, only.last_cycles) == (program.by_name["__vector_18"], 3)
    assert vectors[18 * 4].name == "__vectors+0x48"


def test_names_of_one_address_are_all_kept(tmp_path: Path) -> None:
    program = assembled(tmp_path, "main: rcall first\n ret\n .global first, second\n first:\n second: ret")
    assert program.by_name["first"] == program.by_name["second"]
    assert "0x" not in function(program, "first").name


def test_of_two_functions_with_one_name_the_global_one_is_meant(tmp_path: Path) -> None:
    # Local symbols of several files can have the same name.
    program = assembled(tmp_path, "main: rcall 1f\n rcall twin\n ret\n 1: nop\n ret\n .global twin\n twin: ret")
    image = read_image(tmp_path / "program.elf")
    (twin,) = [s for s in image.symbols if s.name == "twin"]
    local = replace(twin, address=twin.address - 4, strength=2)
    again = program_of(replace(image, symbols=(local, *image.symbols)))
    assert program.by_name["twin"] == again.by_name["twin"] == twin.address
    assert again.functions[local.address].name == "twin"


def test_code_that_no_symbol_names_is_named_after_the_one_before(tmp_path: Path) -> None:
    program = assembled(tmp_path, "main: rcall 1f\n ret\n nop\n 1: ret")
    assert program.functions[program.by_name["main"] + 6].name == "main+0x6"


REFUSED = {
    "a jump behind the code": ("main: jmp 0x7000", "leads out of the code, to 0x7000"),
    "a call behind the code": ("main: call 0x7000\n ret", "leads out of the code, to 0x7000"),
    "a branch before the flash": ("main: rjmp .-2048", "leads out of the code"),
    "a reserved opcode": ("main: nop\n .word 0x0001\n ret", "0x0001 is no instruction"),
    "an instruction of other cores": ("main: elpm r0, Z\n ret", "0x9006 is no instruction"),
    "a constant": ("main: nop\n .type t, @object\n .size t, 4\n t: .word 0, 0\n ret", "a constant lies there"),
    "writing the flash": ("main: spm\n ret", "`spm` writes the flash"),
    "an address that is computed": ("main: lds r30, 256\n lds r31, 257\n ijmp", "where `ijmp` leads cannot be proven"),
    "a pointer in memory": ("main: ld r30, X+\n ld r31, X\n icall\n ret", "where `icall` leads cannot be proven"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_followed_is_refused_with_address_and_source_line(tmp_path: Path, name: str) -> None:
    source, text = REFUSED[name]
    message = refusal(tmp_path, source, "-gdwarf-4")
    assert text in message
    assert re.search(r"0x[0-9A-F]{4} \(program\.S:\d+\): ", message)


def test_code_without_an_end_is_refused(tmp_path: Path) -> None:
    message = refusal(tmp_path, "main: nop\n inc r24", "-nostartfiles")
    assert "0x0004 (in __ctors_end+0x4): there is no code, but __ctors_end leads there" in message


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(path.stem, marks=() if path.stem == "shieldbot" else pytest.mark.soak)
        for path in sorted(IMAGES.glob("*.elf"))
        if path.stem != "bootloader"  # it jumps out of its code on purpose, to the program's
    ],
)
def test_the_images_are_followed_whole(name: str) -> None:
    path = IMAGES / f"{name}.elf"
    image, program, text = read_image(path), load_program(path), disassembly(path)
    followed: dict[int, Instruction] = {}
    for f in program.functions.values():
        assert f.entry in f.blocks
        for b in f.blocks.values():
            assert all(edge.to in f.blocks for edge in b.edges)
            assert b.callee is None or b.callee in program.functions
            followed.update((i.address, i) for i in b.instructions)
    # Every call and jump that objdump sees in what was followed is there.
    for address, instruction in followed.items():
        words = text[address].split()
        assert words[0] == instruction.mnemonic
        if words[0] in ("call", "jmp", "rjmp", "rcall"):
            assert operands(text[address], address)[0] in followed
    # The linker kept only functions that something refers to: none is left out.
    left = [s.name for s in image.symbols if s.kind == "STT_FUNC" and s.address not in followed]
    assert left == []
    vectors = {int(n.removeprefix("__vector_")) for n in program.by_name if re.fullmatch(r"__vector_\d+", n)}
    assert {4 * number for number in vectors} == {e for e in program.functions if 0 < e < 104}
