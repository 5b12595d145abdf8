"""The emulated EEPROM (data sheet, 8.4 and 8.6): the timed sequence, how long writes take, modes, interrupt, resets."""

from __future__ import annotations

import pytest

from sim_bridge.boards.board import Damage, ResetCause
from sim_bridge.tests.boards.avr.avr_program import Machine, assemble, edges_of, gaps
from sim_bridge.tests.boards.symbols import find_symbol

MS = 16_000  # cycles
BOTH, ONE = 3.4 * MS, 1.8 * MS  # table 8-1: erase and write; one of the two
MODES = {0b00: BOTH, 0b01: ONE, 0b10: ONE}

# `put address, value`: address and data; `go`: the timed sequence, with `delay` between its two steps
MACROS = """
.macro put address, value
  ldi r24, lo8(\\address)
  out EEARL, r24
  ldi r24, hi8(\\address)
  out EEARH, r24
  ldi r24, \\value
  out EEDR, r24
.endm
.macro go
  sbi EECR, EEMPE
  sbi EECR, EEPE
.endm
"""


def poll(address: int, value: int, mode: int = 0) -> Machine:
    """Writes one byte; pin 13 changes before the sequence's last step and when EEPE has cleared itself."""
    return Machine(
        f"""{MACROS}
        main:
          sbi DDRB, 5
          put {address}, {value}
          ldi r24, {mode} << EEPM0
          out EECR, r24
          sbi EECR, EEMPE
          sbi PINB, 5
          sbi EECR, EEPE
        1: sbic EECR, EEPE
          rjmp 1b
          sbi PINB, 5
        2: rjmp 2b
        """
    )


def test_fresh_board_is_erased() -> None:
    assert Machine("main: rjmp main").board.read_eeprom() == b"\xff" * 1024


@pytest.mark.parametrize("address", [0, 255, 256, 1023])
def test_a_write_takes_3_4_ms(address: int) -> None:
    machine = poll(address, 0x5A)
    machine.board.run(int(BOTH) - 100)
    assert machine.board.read_eeprom() == b"\xff" * 1024
    machine.board.run(200)
    _, begun, done = edges_of(machine.board.log(), 13)
    assert BOTH < done - begun < BOTH + 10  # SBI, then the loop's granularity
    expected = bytearray(b"\xff" * 1024)
    expected[address] = 0x5A
    assert machine.board.read_eeprom() == expected


@pytest.mark.parametrize(("mode", "result"), [(0b00, 0x3C), (0b01, 0xFF), (0b10, 0xF0 & 0x3C)])
def test_erasing_and_writing_apart(mode: int, result: int) -> None:
    machine = poll(7, 0x3C, mode)
    machine.board.write_eeprom(7, [0xF0])
    machine.board.run(4 * MS)
    _, begun, done = edges_of(machine.board.log(), 13)
    assert MODES[mode] < done - begun < MODES[mode] + 10
    assert machine.board.read_eeprom()[7] == result


@pytest.mark.parametrize(("nops", "written"), [(0, True), (2, True), (3, False), (10, False)])
def test_write_enable_lasts_four_cycles(nops: int, written: bool) -> None:
    # from the end of the first SBI, the second one sets its bit in its own second cycle: NOPs + 2
    nop = "nop\n" * nops
    machine = Machine(
        f"""{MACROS}
        main:
          put 3, 0x12
          sbi EECR, EEMPE
          {nop}
          sbi EECR, EEPE
        1: rjmp 1b
        """
    )
    machine.board.run(4 * MS)
    assert machine.board.read_eeprom()[3] == (0x12 if written else 0xFF)


@pytest.mark.parametrize("control", ["1 << EEPE", "1 << EEPE | 1 << EEMPE"])
def test_a_write_without_the_sequence_is_none(control: str) -> None:
    machine = Machine(
        f"""{MACROS}
        main:
          put 3, 0x12
          ldi r24, {control}
          out EECR, r24
          in r16, EECR
        1: rjmp 1b
        """
    )
    machine.board.run(4 * MS)
    assert machine.board.read_eeprom()[3] == 0xFF
    assert machine.board.read_memory(16, 1)[0] & 0x06 == 0


def test_the_cpu_stands_still() -> None:
    machine = Machine(
        f"""{MACROS}
        main:
          sbi DDRB, 5
          put 0, 1
          ldi r24, 1 << EERE
          ldi r25, 1 << EEMPE
          ldi r26, 1 << EEMPE | 1 << EEPE
          sbi PINB, 5
          sbi PINB, 5             ; 2 cycles after the last
          out EECR, r24           ; a read: 1 and 4
          sbi PINB, 5
          out EECR, r25
          out EECR, r26           ; a write: 1 and 2
          sbi PINB, 5
          out EECR, r24           ; neither: a write is under way
          sbi PINB, 5
        1: rjmp 1b
        """
    )
    machine.board.run(200)
    assert gaps(edges_of(machine.board.log(), 13)[1:]) == [2, 2 + 1 + 4, 2 + 1 + 1 + 2, 2 + 1]


def test_reading() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 2
          out EEARH, r24
          ldi r24, 0x34
          out EEARL, r24
          sbi EECR, EERE
          in r16, EEDR
          in r17, EECR
          in r18, EEARL
          in r19, EEARH
        1: rjmp 1b
        """
    )
    machine.board.write_eeprom(0x234, [0x77])
    machine.board.run(100)
    assert machine.board.read_memory(16, 4) == bytes([0x77, 0, 0x34, 2])


def test_nothing_else_happens_during_a_write() -> None:
    machine = Machine(
        f"""{MACROS}
        main:
          put 10, 0x12
          go
          put 20, 0x34            ; the address stays
          in r16, EEARL
          go                      ; no other write
          ldi r24, 0x99
          out EEDR, r24
          sbi EECR, EERE          ; no read
          in r17, EEDR
          in r18, EECR
        1: sbic EECR, EEPE
          rjmp 1b
          sbi EECR, EERE
          in r19, EEDR
        2: rjmp 2b
        """
    )
    machine.board.write_eeprom(20, [0xAB])
    machine.board.run(4 * MS)
    eeprom = machine.board.read_eeprom()
    assert (eeprom[10], eeprom[20]) == (0x12, 0xAB)
    address, data, control, again = machine.board.read_memory(16, 4)
    assert (address, data, again) == (10, 0x99, 0x12)
    assert control & 0x02


# The interrupt toggles pin 13; the main loop toggles pin 12.
READY = f"""{MACROS}
.global __vector_22
__vector_22:
  sbi PINB, 5
  reti
main:
  sbi DDRB, 5
  sbi DDRB, 4
  put 4, 0x44
  go
  sbi EECR, EERIE
  sei
1: sbi PINB, 4
  rjmp 1b
"""


def test_ready_interrupt_comes_while_ready() -> None:
    machine = Machine(READY)
    machine.board.run(int(BOTH) - 100)
    assert len(edges_of(machine.board.log(), 13)) == 1  # the pin became an output
    machine.board.run(2000)
    log = machine.board.log()
    ready = edges_of(log, 13)
    assert abs(ready[0] - BOTH) < 50
    # 4 cycles in, RJMP from the table 3 (JMP), SBI 2, RETI 4, and one instruction of the main loop, of 2
    assert set(gaps(ready)) == {4 + 3 + 2 + 4 + 2}
    assert machine.board.read_eeprom()[4] == 0x44
    assert len(edges_of(log, 12)) > 50


@pytest.mark.parametrize("cause", [ResetCause.EXTERNAL, ResetCause.WATCHDOG])
def test_a_write_outlives_a_reset_that_keeps_the_supply(cause: ResetCause) -> None:
    machine = Machine(
        f"""{MACROS}
        main:
          in r20, EECR            ; EEPE: the write is still under way
          lds r21, 0x200
          cpi r21, 0x5A
          breq 2f
          ldi r21, 0x5A
          sts 0x200, r21
          put 5, 0x55
          go
        1: rjmp 1b
        2: sbi DDRB, 5
        3: sbic EECR, EEPE
          rjmp 3b
          sbi PINB, 5
        4: rjmp 4b
        """
    )
    machine.board.run(MS)
    machine.board.reset(cause)
    machine.board.run(4 * MS)
    assert machine.board.read_memory(20, 1)[0] & 0x02
    done = edges_of(machine.board.log(), 13)[1]
    assert abs(done - BOTH) < 50
    assert machine.board.read_eeprom()[5] == 0x55


@pytest.mark.parametrize("cause", [ResetCause.POWER, ResetCause.BROWN_OUT])
@pytest.mark.parametrize(
    ("damage", "left"),
    [(None, 0xFF), (Damage.ERASED, 0xFF), (Damage.OLD, 0x0F), (Damage.NEW, 0x55), (Damage.GARBAGE, 0xC3)],
)
def test_loss_of_supply_damages_the_cell_under_way(cause: ResetCause, damage: Damage | None, left: int) -> None:
    machine = Machine(
        f"""{MACROS}
        main:
          in r20, MCUSR
          out MCUSR, r1
          cpi r20, 1
          brne 1f
          lds r20, 0x200
          cpi r20, 0x77           ; set by the test
          brne 1f
          put 5, 0x55
          go
        1: rjmp 1b
        """
    )
    machine.board.write_memory(0x200, [0x77])
    machine.board.write_eeprom(4, [1, 0x0F, 2])
    if damage is not None:
        machine.board.eeprom_damage(damage, garbage=0xC3)
    machine.board.run(3 * MS)
    machine.board.reset(cause)
    machine.board.run(10 * MS)
    eeprom = machine.board.read_eeprom()
    assert eeprom[4:7] == bytes([1, left, 2])
    assert eeprom.count(0xFF) >= 1021


def test_contents_outlive_every_reset() -> None:
    machine = Machine("main: rjmp main")
    content = bytes(index * 7 & 0xFF for index in range(1024))
    machine.board.write_eeprom(0, content)
    for cause in ResetCause:
        machine.board.reset(cause)
        machine.board.run(1000)
        assert machine.board.read_eeprom() == content


def test_a_reset_turns_the_interrupt_off() -> None:
    machine = Machine(READY.replace("main:", "main:\n in r20, MCUSR\n sbrc r20, EXTRF\n 9: rjmp 9b\n sei"))
    machine.board.run(4 * MS)
    machine.board.reset()
    machine.board.run(10)
    before = machine.board.counters()["interrupts"]
    machine.board.run(4 * MS)
    assert machine.board.counters()["interrupts"] == before > 10


def test_a_run_does_not_depend_on_how_it_is_cut() -> None:
    whole, cut = Machine(READY).board, Machine(READY).board
    whole.run(4 * MS)
    while cut.now < 4 * MS:
        cut.advance(min(4 * MS, cut.now + 137))
    assert cut.log() == whole.log()


def test_image_that_brings_eeprom_contents() -> None:
    machine = Machine(
        """
        .section .eeprom, "aw", @progbits
        .byte 1, 2, 3
        .text
        main: rjmp main
        """
    )
    assert machine.board.read_eeprom()[:4] == b"\1\2\3\xff"


def test_variables_are_found_by_name() -> None:
    source = """
    .data
    .global answer
    .type answer, @object
    .size answer, 2
    answer: .word 0x1234
    .text
    main:
      ldi r24, 0x42
      sts answer, r24
    1: rjmp 1b
    """
    machine = Machine(source)
    machine.board.run(1000)
    answer = find_symbol(assemble(source), "answer")
    assert answer.size == 2
    assert machine.board.read_memory(answer.address, 1) == b"\x42"
    with pytest.raises(KeyError):
        find_symbol(assemble(source), "question")


def test_memory_ends_somewhere() -> None:
    board = Machine("main: rjmp main").board
    with pytest.raises(ValueError, match="no data at 0x8FF"):
        board.read_memory(0x8FF, 2)
    with pytest.raises(ValueError, match="no EEPROM at 0x3FF"):
        board.write_eeprom(1023, b"ab")
