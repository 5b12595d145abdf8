"""What the emulated ATmega328P says of a program that asks for what is not built, or that the chip drops as its data
sheet has it: once, with place and cycle; and of nothing else. Section numbers are those of the data sheet."""

from __future__ import annotations

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.image.program import elf_program
from sim_bridge.boards.avr import AvrBoard, create
from sim_bridge.sessions.world import AVR, open_on
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import PREAMBLE, Machine, assemble, gaps
from sim_bridge.tests.boards.symbols import entry_of

# Bits that are not built, by the names of 36; what the README of boards/avr says in words.
NOT_BUILT = {
    **dict.fromkeys(("OSCCAL", "ADCL", "ADCH", "TWAR"), 0xFF),
    "GTCCR": 0x80,
    "ACSR": 0x7F,
    "SMCR": 0x0E,
    "MCUCR": 0x63,
    "CLKPR": 0x0F,
    "PRR": 0xEF,
    "ADCSRB": 0x47,
    "DIDR0": 0x3F,
    "DIDR1": 0x03,
    "ASSR": 0x60,
    "TWAMR": 0xFE,
    "UCSR0A": 0x01,
    "UCSR0B": 0x05,
    "UCSR0C": 0xF0,
}
AFTER_RESET = {"UCSR0C": 0x06, "TWAR": 0xFE}
KEEPS_NOT = {"GTCCR": 0x80}  # bits that do not stay as they were written
LEADS_ELSEWHERE = {"SPL", "SPH", "SREG", "WDTCSR"}  # another stack, interrupts, a reset


@cache
def registers() -> dict[str, int]:
    """Addresses of all 8-bit registers in the data space, as avr-libc has them."""
    command = ["avr-gcc", "-mmcu=atmega328p", "-dM", "-E", "-x", "c", "-include", "avr/io.h", "/dev/null"]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.findall(r"#define (\w+) _SFR_(IO|MEM)8 ?\(0x([0-9A-Fa-f]+)\)", text)
    return {name: int(number, 16) + (0x20 if where == "IO" else 0) for name, where, number in found}


def notes(board: BoardAccess) -> list[str]:
    """What its program did, in the order of the first time."""
    return [does for _, _, does, _ in board.notes()]


def stored(*writes: tuple[str, int]) -> list[str]:
    """What is noted of a program that writes those values to those registers."""
    return notes(written([(registers()[name], value) for name, value in writes], reads=False))


def test_a_comparator_that_is_switched_on_is_noted_and_where_it_is_waited_for() -> None:
    source = """
      main:
        ldi r24, 0x43         ; ACBG, ACIS
      set: out ACSR, r24
        out ACSR, r24         ; once more: it changes nothing
      wait: in r24, ACSR
        sbrs r24, ACI
        rjmp wait
    """
    machine = Machine(source)
    machine.board.run(1000)
    (cycle, sets, first, why), (_, waits, second, _) = machine.board.notes()
    assert [first, second] == ["writes to ACSR", "reads ACSR"]
    assert "comparator is not built" in why
    assert (sets, waits) == tuple(entry_of(assemble(source), name) for name in ("set", "wait"))
    assert cycle < 100
    assert len(machine.board.notes(since=1)) == 1


LDS_R25, STS_R24, LDI_R24, ROOM = 0x9190, 0x9380, 0xE080, 1000


@cache
def frame() -> tuple[bytes, bytes]:
    """An image, what stands before room for a program and what behind it."""
    filled = b"\x5a" * ROOM
    before, _, behind = assemble(f"main:\n .fill {ROOM}, 1, 0x5A\n1: rjmp 1b").partition(filled)
    return before, behind


def written(writes: list[tuple[int, int]], *, reads: bool = True) -> BoardAccess:
    """A board that has run a program which stores those values at those addresses, in that order, and reads what is
    there then, if not told otherwise."""
    code: list[int] = []
    for to, value in writes:
        code += (LDI_R24 | (value & 0xF0) << 4 | value & 0xF, STS_R24, to)
        code += (LDS_R25, to) if reads else ()
    program = b"".join(word.to_bytes(2, "little") for word in code)
    assert len(program) <= ROOM
    before, behind = frame()
    board = BoardAccess(AvrBoard(elf_program(Path("program.elf"), before + program.ljust(ROOM, b"\0") + behind)))
    board.run(4 * ROOM)
    return board


ADDRESSES = sorted(set(range(0x20, 0x100)) - {registers()[name] for name in LEADS_ELSEWHERE})


@given(st.lists(st.tuples(st.sampled_from(ADDRESSES), st.integers(0, 255)), max_size=100))
def test_any_writes_tell_what_is_not_built_and_nothing_else(writes: list[tuple[int, int]]) -> None:
    names = {address: name for name, address in registers().items()}
    held = {registers()[name]: value for name, value in AFTER_RESET.items()}
    expected = []
    for address, value in writes:
        name = names.get(address, "a reserved address")
        changed = (value ^ held.get(address, 0)) & NOT_BUILT.get(name, 0 if address in names else 0xFF)
        held[address] = 0 if address not in names else value & ~KEEPS_NOT.get(name, 0)
        if changed and f"writes to {name}" not in expected:
            expected.append(f"writes to {name}")
    names_told = {f"writes to {name}" for name in (*NOT_BUILT, "a reserved address")}
    assert [told for told in notes(written(writes)) if told in names_told] == expected


@given(st.lists(st.tuples(st.integers(0x20, 0xFF), st.integers(0, 255)), max_size=100))
def test_any_writes_at_all_end_in_a_run_or_a_fault(writes: list[tuple[int, int]]) -> None:
    """Also to the stack pointer, SREG and the watchdog: soft resets, resets, stacks anywhere."""
    try:
        written(writes)
    except BoardError as error:
        assert re.match(r"The board stopped: the (program|stack)", str(error))  # noqa: PT017


def test_each_register_that_is_not_built_is_noted_at_its_place() -> None:
    writes = [(registers()[name], bits ^ AFTER_RESET.get(name, 0)) for name, bits in NOT_BUILT.items()]
    told = written([*writes, (0xFF, 1)]).notes()
    assert [does for _, _, does, _ in told if "reads" in does] == ["reads ACSR"]
    told = [row for row in told if "writes" in row[2]]
    assert [row[2] for row in told] == [*(f"writes to {name}" for name in NOT_BUILT), "writes to a reserved address"]
    assert set(gaps(address for _, address, _, _ in told)) == {10}  # LDI, STS, LDS


def test_what_a_program_of_the_kits_kind_writes_is_not_told() -> None:
    assert (
        stored(
            *(("PRR", 0), ("SPCR", 0), ("SMCR", 1), ("ACSR", 0x80), ("TWAR", 0xFE), ("CLKPR", 0x80), ("CLKPR", 0)),
            *(("UCSR0A", 2), ("UCSR0B", 0xD8), ("UCSR0C", 0x06), ("TIMSK1", 2), ("ICR1H", 0), ("ICR1L", 0)),
        )
        == []
    )


DROPPED = {
    "ICR1 before its mode (16.6)": ([("ICR1H", 4), ("ICR1L", 1)], ["writes to ICR1"]),
    "ICR1 behind its mode": ([("TCCR1B", 0x10), ("ICR1H", 4), ("ICR1L", 1)], []),
    "low byte first (16.3)": ([("OCR1AL", 1), ("OCR1AH", 4)], ["writes a high byte behind its low one"]),
    "two low bytes of one high byte": ([("OCR1AH", 4), ("OCR1AL", 1), ("OCR1BL", 1), ("OCR1BH", 4)], []),
    "a match forced in PWM (15.9.2)": ([("TCCR0A", 3), ("TCCR0B", 0x80)], ["forces a compare match"]),
    "clock at T0": ([("TCCR0B", 7)], []),
    "clock of timer 2": ([("TCCR2B", 7)], []),
    "UDR0 without a transmitter (20.11.1)": ([("UDR0", 1)], ["writes to UDR0"]),
    "a third byte at once": ([("UCSR0B", 8), ("UDR0", 1), ("UDR0", 1), ("UDR0", 1)], ["writes to UDR0"]),
    "two bytes": ([("UCSR0B", 8), ("UDR0", 1), ("UDR0", 1)], []),
    "TWDR without TWINT (22.9.4)": ([("TWDR", 1)], ["writes to TWDR"]),
    "EEPE without EEMPE (8.6.3)": ([("EECR", 2)], ["sets EEPE"]),
    "EEAR during a write": ([("EECR", 4), ("EECR", 2), ("EEARL", 1), ("EECR", 1)], ["writes to EEAR", "sets EERE"]),
    "a watchdog without WDCE (11.9.2)": ([("WDTCSR", 1)], ["writes to WDTCSR"]),
    "a watchdog with it": ([("WDTCSR", 0x18), ("WDTCSR", 0x0F)], []),
    "flags of MCUSR (11.9.1)": ([("MCUSR", 0xF)], ["writes 1 to MCUSR"]),
    "ADC6": ([("ADMUX", 0x46), ("ADCSRA", 0xC0)], ["converts a channel without pin"]),
    "AREF": ([("ADMUX", 0x02), ("ADCSRA", 0xC0)], ["converts with the reference AREF"]),
    "A2": ([("ADMUX", 0x42), ("ADCSRA", 0xC0)], []),
}


@pytest.mark.parametrize("what", DROPPED)
def test_what_the_chip_drops_is_noted(what: str) -> None:
    writes, told = DROPPED[what]
    assert stored(*writes) == told


@pytest.mark.parametrize("access", ["sts 0x0900, r24", "ld r24, Z", "std Y + 1, r24"])
def test_an_access_behind_the_memory_is_noted(access: str) -> None:
    """7.3: RAM ends at 0x08FF."""
    source = (
        f"main: ldi r31, 0x12\n ldi r28, 0xFE\n ldi r29, 0x08\n std Y + 1, r24\n adiw r28, 1\n at: {access}\n1: rjmp 1b"
    )
    machine = Machine(source)
    machine.board.run(1000)
    ((_, address, does, _),) = machine.board.notes()
    assert (address, does) == (entry_of(assemble(source), "at"), "reads or writes behind the memory's end")


def test_spm_outside_of_the_boot_section_is_dropped_and_noted() -> None:
    """27.3.2. A page is to be erased; what is there stays."""
    source = "main: ldi r30, lo8(page)\n ldi r31, hi8(page)\n ldi r24, 3\n out SPMCSR, r24\nat: spm\n"
    source += "1: in r24, SPMCSR\n sbrc r24, 0\n rjmp 1b\n lpm r2, Z\n2: rjmp 2b\n .balign 128\npage: .byte 0x5A"
    machine = Machine(source)
    machine.board.run(1000)
    assert machine.board.read_memory(2, 1) == b"\x5a"
    ((_, address, does, _),) = machine.board.notes()
    assert (address, does) == (entry_of(assemble(source), "at"), "executes SPM")


# ---- legal, though seldom meant ----


def test_a_jump_to_the_start_is_a_soft_reset() -> None:
    source = "main: lds r24, 0x0200\n inc r24\n sts 0x0200, r24\n sbi DDRB, 5\nlast: jmp 0"
    machine = Machine(source)
    before = machine.board.read_memory(0x200, 1)[0]
    machine.board.run(1000)
    ((_, address, does, why),) = machine.board.notes()
    assert (address, does) == (entry_of(assemble(source), "last"), "jumps to its start")
    assert why.startswith("no reset")
    assert (machine.board.read_memory(0x200, 1)[0] - before) % 256 > 10
    assert machine.board.counters()["resets"] == 0


# Two routines in turn, each on its stack: the second one's lies among the variables.
COROUTINES = """
  main: clr r2
    clr r3
    ldi r24, hi8(there + 62)
    ldi r25, lo8(there + 62)
    ldi r16, pm_lo8(other)
    ldi r17, pm_hi8(other)
    sts there + 64, r16       ; where the first switch returns to
    sts there + 63, r17
  1: inc r2
    rcall switch
    rjmp 1b
  other: inc r3
    rcall deeper
    rcall switch
    rjmp other
  deeper: push r3
    pop r3
    ret
  switch: in r18, SPH
    in r19, SPL
    out SPH, r24
    {set}out SPL, r25
    mov r24, r18
    mov r25, r19
    ret
  .lcomm there, 65
"""


def test_a_stack_among_the_variables_is_legal() -> None:
    source = COROUTINES.format(set="set: ")
    machine = Machine(source)
    machine.board.run(2000)
    rounds = machine.board.read_memory(2, 2)
    assert rounds[1] > 10 and rounds[0] - rounds[1] in (0, 1)
    ((_, address, does, _),) = machine.board.notes()
    assert (address, does) == (entry_of(assemble(source), "set"), "has a stack among its variables")


def test_behind_such_a_stack_the_first_one_is_watched_as_before() -> None:
    source = COROUTINES.format(set="").replace("rjmp 1b\n  other", "rcall 1b\n  other")
    with pytest.raises(BoardError, match=r"the stack overflows: it reaches 0x0.*, variables end below 0x0141"):
        Machine(source).board.run(100_000)


@pytest.mark.parametrize("subtract", ["sbiw r28, 40", "subi r28, 40\n sbc r29, r1", "sub r28, r26\n sbc r29, r27"])
def test_a_frame_that_reaches_the_variables_is_an_overflow(subtract: str) -> None:
    """As gcc makes room for the variables of a function."""
    source = f"""
      main: ldi r26, 40
        clr r27
        clr r1
      1: in r28, SPL
        in r29, SPH
        {subtract}
        in r0, SREG
        cli
        out SPH, r29
        out SREG, r0
      last: out SPL, r28
        rjmp 1b
      .lcomm variables, 0x100
    """
    with pytest.raises(BoardError, match="the stack overflows: it reaches 0x01") as caught:
        Machine(source).board.run(10_000)
    assert f"at address 0x{entry_of(assemble(source), 'last'):04X}" in str(caught.value)


def test_erased_flash_leads_into_the_boot_section(tmp_path: Path) -> None:
    """As an Uno does that holds nothing but its bootloader, time and again."""
    source, image = tmp_path / "boot.S", tmp_path / "boot.elf"
    source.write_text(PREAMBLE + "main: inc r2\n jmp 0", encoding="ascii")
    options = ["-nostartfiles", "-Wl,-e,main", "-Wl,--section-start=.text=0x7C00"]
    subprocess.run(["avr-gcc", "-mmcu=atmega328p", *options, "-o", str(image), str(source)], check=True)
    machine = create(image)
    board = BoardAccess(machine)
    before = board.read_memory(2, 1)[0]
    rounds, words = 5, 0x7C00 // 2
    board.run(rounds * (words + 1 + 3) + 1)  # a cycle for each word, INC, JMP
    assert (board.read_memory(2, 1)[0] - before) % 256 == rounds + 1
    assert notes(board) == ["runs through erased flash"]


# ---- images ----


def image_for(chip: str, folder: Path, *options: str) -> Path:
    source, image = folder / "program.S", folder / f"{chip}.elf"
    source.write_text(PREAMBLE + "main: ldi r24, 0x43\n out ACSR, r24\n1: rjmp 1b", encoding="ascii")
    subprocess.run(["avr-gcc", f"-mmcu={chip}", *options, "-o", str(image), str(source)], check=True)
    return image


def test_an_image_for_another_chip_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(BoardError, match=r"^the firmware image .*atmega32\.elf is for the ATmega32; expected an image"):
        create(image_for("atmega32", tmp_path))


def test_a_session_tells_of_the_chip_that_is_assumed_and_of_what_is_not_built(tmp_path: Path) -> None:
    image = image_for("atmega328p", tmp_path)
    bare = tmp_path / "bare.elf"
    subprocess.run(["avr-objcopy", "-R", ".note.gnu.avr.deviceinfo", str(image), str(bare)], check=True)
    told = {}
    for path in (image, bare):
        session = open_on(
            AVR, BoardRequest(robot=load_robot("shieldbot"), arena="empty", record=False, image=str(path))
        )
        session.transport.read(0.01)
        told[path] = session.notes()
        assert session.notes() == told[path]
        session.close()
    (note,) = told[image]
    assert re.fullmatch(
        r"the program writes to ACSR at address 0x[0-9A-F]{4} in cycle \d+ in main: the analog comparator is not .*",
        note,
    )
    assert told[bare] == [
        f"the firmware image {bare} does not say which chip it is for: it is taken for an ATmega328P",
        note,
    ]
