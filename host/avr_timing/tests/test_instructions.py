"""The decoder against avr-objdump, and its cycles against the data sheet of the ATmega328P (section 31)."""

from __future__ import annotations

from pathlib import Path

import pytest

from avr_image import assembled, disassembly, function, operands
from avr_timing.flow.instructions import BRANCHES, SKIPS, decode

IMAGES = Path(__file__).resolve().parents[3] / "build" / "images"
# objdump knows the instructions of all cores; the ATmega328P does not have these.
OTHER_CORES = {"des", "eicall", "eijmp", "elpm", "lac", "las", "lat", "xch"}
# Cycles of an instruction that goes on behind it, data sheet section 31. All others take 1.
CYCLES = {
    2: "adiw sbiw mul muls mulsu fmul fmuls fmulsu rjmp ijmp sbi cbi ld ldd lds st std sts push pop",
    3: "rcall icall jmp lpm",
    4: "call ret reti",
}

EEPROM = {("sbi", 0x1F), ("out", 0x1F)}  # instructions that write EECR


def test_every_opcode_is_what_objdump_says(tmp_path: Path) -> None:
    # Each opcode is followed by two words of zeros, so that those of two words have their second one.
    opcodes = b"".join(word.to_bytes(2, "little") + bytes(4) for word in range(0x10000))
    binary = tmp_path / "opcodes.bin"
    binary.write_bytes(opcodes)
    expected = disassembly(binary, "-D", "-b", "binary", "-m", "avr:5")
    wrong = []
    for word in range(0x10000):
        address = 6 * word
        text = expected[address]
        instruction = decode(opcodes, address)
        name = text.split()[0]
        if name == ".word" or name in OTHER_CORES or text.startswith("spm\tZ+"):
            right = instruction is None
        else:
            numbers = (0, 30, 0) if text.strip() == "lpm" else operands(text, address)
            right = instruction is not None and (instruction.mnemonic, instruction.operands) == (name, numbers)
        if not right:
            wrong.append(f"{word:04x}: {text!r}, decoded {instruction}")
    assert not wrong, wrong[:10]


def test_cycles_are_those_of_the_data_sheet() -> None:
    expected = {name: cycles for cycles, names in CYCLES.items() for name in names.split()}
    seen: dict[str, int] = {}
    for word in range(0x10000):
        instruction = decode(word.to_bytes(2, "little") + bytes(2), 0)
        if instruction is not None and (instruction.mnemonic, *instruction.operands[:1]) not in EEPROM:
            assert instruction.cycles == expected.get(instruction.mnemonic, 1), instruction
            assert instruction.size == (4 if instruction.mnemonic in ("jmp", "call", "lds", "sts") else 2)
            seen[instruction.mnemonic] = instruction.cycles
    assert seen.keys() >= expected.keys() | BRANCHES | SKIPS


@pytest.mark.parametrize(
    ("source", "cycles"),
    [
        ("sbi EECR, EERE", 2 + 4),  # section 8.6.3: "when the EEPROM is read, the CPU is halted for four cycles"
        ("sbi EECR, EEPE", 2 + 2),  # "when EEPE has been set, the CPU is halted for two cycles"
        ("sbi EECR, EEMPE", 2),
        ("cbi EECR, EERIE", 2),
        ("out EECR, r24", 1 + 4),  # at most
        ("sts 0x3F, r24", 2 + 4),
        ("sts 0x40, r24", 2),  # EEDR
        ("out EEDR, r24", 1),
        ("in r24, EECR", 1),
    ],
)
def test_the_eeprom_halts_the_cpu(tmp_path: Path, source: str, cycles: int) -> None:
    program = assembled(tmp_path, f"main: {source}\n ret")
    main = function(program, "main")
    assert main.blocks[main.entry].body_cycles == cycles


def test_an_instruction_that_the_end_cuts_off_is_none() -> None:
    assert decode(b"", 0) is None
    assert decode(b"\x0c", 0) is None
    assert decode(b"\x0c\x94", 0) is None  # the first word of `jmp`
    assert decode(b"\x00\x00", -2) is None
