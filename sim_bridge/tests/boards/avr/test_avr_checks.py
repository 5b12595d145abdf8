"""What is noted of a program that a bench does not show, and that nothing else is."""

from __future__ import annotations

import re

import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import BoardError, CallError
from sim_bridge.boards.board import Level, ResetCause
from sim_bridge.sessions.world import AVR, NATIVE, open_on
from sim_bridge.tests.boards.avr.avr_program import Machine, assemble
from sim_bridge.tests.boards.native.native_program import FIRMWARE
from sim_bridge.tests.boards.symbols import entry_of


def checked(source: str, *, strict: bool = False, joined: int = 0, low: int = 0, high: int = 0) -> Machine:
    """A board with a program; what is joined to its pins as bits, and what pulls them low or high there."""
    machine = Machine(source)
    machine.avr.check(strict=strict)
    checks = machine.avr.extension("checks", "board_checks")
    assert checks is not None
    checks.joined |= joined
    checks.pulls_low, checks.pulls_high = low, high
    return machine


def found(machine: Machine, cycles: int = 1000) -> list[str]:
    """What is noted."""
    machine.board.run(cycles)
    return [does for _, _, does, _ in machine.board.notes()]


# ---- a pin that is driven from both sides ----

OUTPUT = "main: sbi DDRD, 7\n at: sbi PORTD, 7\n1: rjmp 1b"


def test_board_and_part_drive_a_pin_against_each_other() -> None:
    machine = checked(OUTPUT, joined=1 << 7, low=1 << 7)
    machine.board.drive(7, Level.LOW)
    assert found(machine) == ["drives pin 7"]
    ((cycle, address, _, why),) = machine.board.notes()
    assert address == entry_of(assemble(OUTPUT), "at") and cycle < 100 and "pulls it low" in why


def test_also_where_the_part_begins_later() -> None:
    machine = checked(OUTPUT, joined=1 << 7, low=1 << 7)
    machine.board.drive(7, Level.HIGH)
    machine.board.drive(7, Level.LOW, at=500)
    assert found(machine, 400) == []
    assert found(machine, 400) == ["drives pin 7"]


@pytest.mark.parametrize(
    ("level", "low", "high"),
    [
        (Level.LOW, 0, 1 << 7),  # a pull-down
        (Level.HIGH, 1 << 7, 1 << 7),
        (Level.RELEASED, 1 << 7, 1 << 7),
        (Level.LOW, 1 << 6, 1 << 6),
    ],
)
def test_resistors_agreement_and_silence_are_no_fight(level: Level, low: int, high: int) -> None:
    machine = checked("main: sbi PORTD, 7\n sbi DDRD, 7\n1: rjmp 1b", low=low, high=high)
    machine.board.drive(7, level)
    assert found(machine) == []


# ---- an input that nothing decides ----

READS = {
    "SBIC": "sbic PIND, 7\n nop",
    "SBIS": "sbis PIND, 7\n nop",
    "IN, ANDI": "in r24, PIND\n andi r24, 0x80",
    "IN, SBRC": "in r24, PIND\n sbrc r24, 7\n nop",
    "IN, BST": "in r24, PIND\n bst r24, 7",
    "LDS, AND": "ldi r20, 0x80\n lds r24, 0x29\n and r24, r20",
    "LD, AND, the other way": "ldi r20, 0x80\n ldi r30, 0x29\n ldi r31, 0\n ld r24, Z\n ldi r25, 0\n and r20, r24",
}
SILENT = {
    "another bit": "in r24, PIND\n andi r24, 0x40",
    "the whole port": "in r24, PIND\n sts 0x200, r24\n andi r24, 0x80",
    "a mask that changes": "ldi r20, 0x80\n in r24, PIND\n ldi r20, 0\n and r24, r20",
    "an output": "sbi DDRD, 7\n sbic PIND, 7\n nop",
    "a pull-up": "sbi PORTD, 7\n sbic PIND, 7\n nop",
}


@pytest.mark.parametrize("how", READS)
def test_a_floating_input_that_decides(how: str) -> None:
    source = f"main: {READS[how]}\n1: rjmp 1b"
    assert found(checked(source)) == ["decides by pin 7"]
    assert found(checked(source, joined=1 << 7)) == []
    driven = checked(source)
    driven.board.drive(7, Level.LOW)
    assert found(driven) == []


@pytest.mark.parametrize("how", SILENT)
def test_what_decides_nothing_is_not_noted(how: str) -> None:
    assert found(checked(f"main: {SILENT[how]}\n1: rjmp 1b", joined=1 << 6)) == []


INTERRUPTS = {
    "INT1": ("ldi r24, 2\n out EIMSK, r24", 3),
    "pin change, its mask first": ("ldi r24, 4\n sts PCMSK1, r24\n ldi r24, 2\n sts PCICR, r24", 16),
    "pin change, its mask last": ("ldi r24, 4\n sts PCICR, r24\n ldi r24, 0x10\n sts PCMSK2, r24", 4),
    "ADC": ("ldi r24, 0x43\n sts ADMUX, r24\n ldi r24, 0xC0\n sts ADCSRA, r24", 17),
}


@pytest.mark.parametrize("how", INTERRUPTS)
def test_interrupts_and_conversions_of_a_floating_input(how: str) -> None:
    source, pin = INTERRUPTS[how]
    source = f"main: {source}\n1: rjmp 1b"
    (does,) = found(checked(source))
    assert does.endswith(f"pin {pin}" if pin < 14 else f"A{pin - 14}")
    assert found(checked(source, joined=1 << pin)) == []


# ---- RAM ----

LOADS = {
    "LDS": "lds r24, 0x400",
    "LD": "ldi r26, 0\n ldi r27, 4\n ld r24, X+",
    "LD from behind": "ldi r30, 1\n ldi r31, 4\n ld r24, -Z",
    "LDD": "ldi r28, 0xF0\n ldi r29, 3\n ldd r24, Y + 16",
    "POP": "ldi r24, 0xFF\n ldi r25, 3\n out SPH, r25\n out SPL, r24\n pop r24",
}


@pytest.mark.parametrize("how", LOADS)
def test_ram_that_is_read_before_it_is_written(how: str) -> None:
    assert found(checked(f"main: {LOADS[how]}\n1: rjmp 1b")) == ["reads RAM that was never written"]
    assert found(checked(f"main: sts 0x400, r1\n {LOADS[how]}\n1: rjmp 1b")) == []


def test_each_place_is_noted_once() -> None:
    machine = checked("main: ldi r26, 0\n ldi r27, 4\n1: ld r24, X+\n ld r25, X+\n cpi r26, 8\n brne 1b\n2: rjmp 2b")
    assert found(machine) == ["reads RAM that was never written"] * 2


def test_what_the_start_the_stack_and_interrupts_write_is_written() -> None:
    source = """
      main: lds r24, variable
        push r24
        pop r25
        call work
        ldi r24, 1
        sts TIMSK0, r24
        out TCCR0B, r24
        sei
      1: rjmp 1b
      work: in r30, SPL
        in r31, SPH
        ldd r24, Z + 1
        ldd r24, Z + 2
        ret
      .global __vector_16
      __vector_16: in r30, SPL
        in r31, SPH
        ldd r24, Z + 1
        ldd r24, Z + 2
        reti
      .data
      variable: .byte 5
      .global __do_copy_data
    """
    assert found(checked(source), 2000) == []


def test_ram_is_anything_after_the_power_came() -> None:
    source = "main: sbis PIND, 2\n sts 0x400, r1\n lds r24, 0x400\n1: rjmp 1b"
    machine = checked(source, joined=0xFFFFF)
    assert found(machine) == []
    machine.board.drive(2, Level.HIGH)  # from now on it does not write there
    machine.board.reset(ResetCause.EXTERNAL)
    assert found(machine) == []
    machine.board.reset(ResetCause.POWER)
    assert found(machine) == ["reads RAM that was never written"]


# ---- strict ----


def test_the_first_one_is_a_fault() -> None:
    source = "main: lds r24, 0x400\n sbic PIND, 7\n1: rjmp 1b"
    machine = checked(source, strict=True)
    with pytest.raises(BoardError, match=r"The board stopped: the program reads RAM that was never written \(.*\) at"):
        machine.board.run(1000)
    assert machine.board.notes() == []
    machine = checked("main: sbic PIND, 7\n1: rjmp 1b", strict=True)
    with pytest.raises(BoardError, match=r"the program decides by pin 7 \(nothing drives it .*\) at address 0x"):
        machine.board.run(1000)


# ---- in the world ----


def reads_what_survived_a_reset(note: str) -> bool:
    """As the firmware does on purpose, in reset.c. The linker, which shortens calls, leaves some lines of the debugging
    information two bytes late: the first such read may name the statement before its own, that before reset_start()."""
    where = re.search(r"reads RAM that was never written .* \((\w+\.c):(\d+)\)", note)
    if where is None:
        return False
    file, line = where[1], int(where[2])
    return file == "reset.c" or "reset_start()" in (FIRMWARE / file).read_text().splitlines()[line]


def test_a_run_with_notes_is_the_run_without_and_the_kits_firmware_has_one() -> None:
    """It reads at its start what survived a reset."""
    states = []
    for notes in (False, True):
        session = open_on(AVR, BoardRequest(robot=load_robot("shieldbot"), arena="room", notes=notes))
        session.transport.read(0.2, 0.2)
        states.append((session.sim.hash(), session.counters(), session.board.read_memory(0, 0x900)))
        assert bool(session.notes()) == notes
        assert all(reads_what_survived_a_reset(note) for note in session.notes())
        session.close()
    assert states[0] == states[1]


def test_only_the_emulated_chip_is_looked_into() -> None:
    with pytest.raises(CallError, match="these notes look into the emulated ATmega328P"):
        open_on(NATIVE, BoardRequest(robot=load_robot("shieldbot"), arena="empty", strict=True))
