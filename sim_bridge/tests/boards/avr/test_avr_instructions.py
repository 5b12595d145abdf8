"""Instructions and interrupts of the emulated ATmega328P; what each of them takes is in tools/tests/calibration."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.errors import BoardError
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Level, ResetCause
from sim_bridge.tests.boards.access import BoardAccess
from sim_bridge.tests.boards.avr.avr_program import Machine, assemble, edges_of, gaps
from sim_bridge.tests.boards.symbols import entry_of

SBI_CYCLES = 2

# Timer 1 matches at a known cycle, shown by the edge of its output, pin 9; the interrupt moves pin 13.
MATCH_INTERRUPT = """
.global __vector_11
__vector_11:
  sbi PINB, 5
  reti
main:
  sbi DDRB, 5
  sbi DDRB, 1
  ldi r24, 2000 >> 8
  sts OCR1AH, r24
  ldi r24, 2000 & 255
  sts OCR1AL, r24
  ldi r24, 1 << COM1A0
  sts TCCR1A, r24
  ldi r24, 1 << OCIE1A
  sts TIMSK1, r24
  ldi r24, 1
  sts TCCR1B, r24
  sei
  {main_loop}
"""
ENTRY = 4
VECTOR_JUMP = 3


def latency(main_loop: str) -> int:
    """Cycles from the compare edge to the end of the interrupt's first instruction, without its own time."""
    machine = Machine(MATCH_INTERRUPT.format(main_loop=main_loop))
    machine.board.run(20_000)
    log = machine.board.log()
    match = edges_of(log, 9)[1]  # the first edge is the pin becoming an output
    reaction = edges_of(log, 13)[1]
    return reaction - match - VECTOR_JUMP - SBI_CYCLES


def test_instruction_is_finished_before_an_interrupt() -> None:
    latencies = {latency(f".rept {shift}\n nop\n .endr\n1: jmp 1b") for shift in range(3)}
    assert latencies == {ENTRY, ENTRY + 1, ENTRY + 2}


def test_one_instruction_runs_between_two_interrupts() -> None:
    # The interrupt's flag is raised again at once, so that it returns into itself: one NOP each time.
    machine = Machine(
        """
        .global __vector_1
        __vector_1:
          sbi PINB, 5
          reti
        main:
          sbi DDRB, 5
          sbi EIMSK, 0      ; INT0 while pin 2 is low, which it is
          sei
        1: nop
          rjmp 1b
        """
    )
    machine.board.drive(2, Level.LOW)
    machine.board.run(1000)
    edges = edges_of(machine.board.log(), 13)[1:]
    periods = set(gaps(edges))
    around = ENTRY + VECTOR_JUMP + SBI_CYCLES + 4  # and one instruction: NOP or RJMP
    assert periods == {around + 1, around + 2}


def test_interrupt_enabled_while_its_flag_is_set_fires() -> None:
    machine = Machine(
        """
        .global __vector_14
        __vector_14:
          sbi PINB, 5
          reti
        main:
          sbi DDRB, 5
          ldi r24, 10
          out OCR0A, r24
          ldi r24, 1
          out TCCR0B, r24
          sei
          .rept 50
          nop
          .endr
          out TCCR0B, r1        ; stopped, with the flag set long ago
          sbi PINB, 5
          ldi r24, 1 << OCIE0A
          sts TIMSK0, r24
        1: rjmp 1b
        """
    )
    machine.board.run(1000)
    _, enabled, fired = edges_of(machine.board.log(), 13)
    assert 0 < fired - enabled < 20


def test_executed_cycles_count_no_sleep() -> None:
    machine = Machine(
        """
        .global __vector_16
        __vector_16:
          reti
        main:
          ldi r24, 1
          out SMCR, r24
          sts TIMSK0, r24       ; overflow
          ldi r24, 2
          out TCCR0B, r24       ; clk/8: every 2048 cycles
          sei
        1: sleep
          rjmp 1b
        """
    )
    machine.board.run(100)
    start = machine.board.counters()
    machine.board.run(2048 * 100)
    end = machine.board.counters()
    assert end["interrupts"] - start["interrupts"] == 100
    # entry, jump, RETI, RJMP, SLEEP
    assert end["executed_cycles"] - start["executed_cycles"] == 100 * (4 + 3 + 4 + 2 + 1)


def test_bad_opcode_is_a_crash_until_the_next_reset() -> None:
    machine = Machine("main:\n sbi DDRB, 5\n nop\n .word 0x0001\n1: rjmp 1b")
    with pytest.raises(BoardError, match="invalid instruction 0x0001"):
        machine.board.run(1000)
    assert machine.board.now < 1000
    machine.board.reset(ResetCause.EXTERNAL)
    with pytest.raises(BoardError, match="invalid instruction"):
        machine.board.run(1000)
    assert machine.board.counters()["resets"] == 1


WILD_JUMPS = ["ijmp", "icall", "push r30\n push r31\n ret", "push r30\n push r31\n reti", "jmp 0x7F00", "call 0x7F00"]


@pytest.mark.parametrize(
    ("jump", "address", "what"),
    [
        *((jump, 0x7F00, "goes to 0x7F00, but ends at") for jump in WILD_JUMPS),
        *((jump, 0, "returns to its start") for jump in WILD_JUMPS if "ret" in jump),
    ],
)
def test_a_jump_to_where_no_instruction_is_is_a_crash(jump: str, address: int, what: str) -> None:
    jump = jump.replace("0x7F00", str(address))
    source = f"main: ldi r30, lo8({address // 2})\n ldi r31, hi8({address // 2})\n {jump}\n last: nop"
    machine, length = Machine(source), 4 if jump[:2] in ("jm", "ca") else 2
    with pytest.raises(BoardError, match=f"{what}.* at address 0x{entry_of(assemble(source), 'last') - length:04X} "):
        machine.board.run(100)


def test_running_straight_off_the_image_is_a_crash_of_its_last_instruction(tmp_path: Path) -> None:
    whole, ending = assemble("main: ret"), b"\xf8\x94\xff\xcf"  # cli; rjmp .-2: where main returns to
    assert whole.count(ending) == 1
    image = tmp_path / "image.elf"
    image.write_bytes(whole.replace(ending, b"\xf8\x94\x00\x00"))
    last = entry_of(whole, "__stop_program")
    with pytest.raises(BoardError, match=f"ends at 0x{last + 2:04X} at address 0x{last:04X} "):
        BoardAccess(create(image)).run(1000)


def test_memory_at_power_on_is_not_zero_and_always_the_same() -> None:
    first, second = (Machine("main: rjmp main").board.read_memory(0x100, 0x800) for _ in range(2))
    assert first == second
    assert len(set(first)) > 200


def test_eeprom_and_program_memory() -> None:
    machine = Machine(
        """
        .section .eeprom, "aw", @progbits
          .byte 0x5A
        .text
        main:
          ldi r24, 0
          out EEARH, r24
          out EEARL, r24
          sbi EECR, EERE
          in r16, EEDR
          ldi r30, lo8(table)
          ldi r31, hi8(table)
          lpm r17, Z
        1: rjmp 1b
        table: .byte 0xA5, 0
        """
    )
    machine.board.run(200)
    assert machine.board.read_memory(16, 2) == b"\x5a\xa5"
