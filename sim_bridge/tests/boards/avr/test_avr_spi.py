"""The SPI of the emulated ATmega328P as a master, measured at its pins (data sheet, section 19)."""

from __future__ import annotations

import pytest

from sim_bridge.boards.board import Edge, Level
from sim_bridge.tests.boards.avr.avr_program import Machine, edges_of, gaps

SS, MOSI, MISO, SCK = 10, 11, 12, 13
SPE, DORD, MSTR, CPOL, CPHA = 0x40, 0x20, 0x10, 0x08, 0x04
SPIF, WCOL = 0x80, 0x40
RESULTS = 0x200

# `setup`: SS, MOSI and SCK are outputs; `send` writes SPDR, waits for SPIF and keeps at X what came.
MACROS = """
.macro setup control, doubled=0
  ldi XL, 0
  ldi XH, 2
  ldi r24, 0x2C
  out DDRB, r24
  ldi r24, \\doubled
  out SPSR, r24
  ldi r24, \\control
  out SPCR, r24
.endm
.macro put value
  ldi r24, \\value
  out SPDR, r24
.endm
.macro send value
  put \\value
9: in r24, SPSR
  sbrs r24, SPIF
  rjmp 9b
  in r24, SPDR
  st X+, r24
.endm
.macro keep register
  in r24, \\register
  st X+, r24
.endm
"""


def program(source: str) -> Machine:
    return Machine(MACROS + f"main:\n{source}\n8: rjmp 8b\n")


def results(machine: Machine, count: int) -> list[int]:
    return list(machine.board.read_memory(RESULTS, count))


def level_at(log: list[Edge], pin: int, cycle: int) -> int:
    """What the board drives the pin to just before that cycle."""
    before = [edge for edge in log if edge.pin == pin and edge.cycle < cycle]
    return int(bool(before) and before[-1].level == Level.HIGH)


def in_order(value: int, control: int) -> list[int]:
    """The bits of a byte as they stand on the line."""
    bits = [value >> bit & 1 for bit in range(8)]
    return bits if control & DORD else bits[::-1]


@pytest.mark.parametrize("order", [0, DORD])
@pytest.mark.parametrize("mode", [0, CPHA, CPOL, CPOL | CPHA])
def test_modes_and_order(mode: int, order: int) -> None:
    """Table 19-2: who listens at the sampling edges gets the byte; so does the board, from a wire from MOSI to MISO."""
    control = SPE | MSTR | mode | order
    machine = program(f"setup {control}\n send 0xA6\n send 0x35")
    machine.avr.on_edge(MOSI, lambda cycle, level: machine.board.drive(MISO, level, cycle + 1))
    machine.board.run(400)
    log = machine.board.log()
    clock = [edge for edge in log if edge.pin == SCK][-32:]  # before them it becomes an output, and comes to rest
    assert [edge.level for edge in clock[::2]] == [Level.LOW if mode & CPOL else Level.HIGH] * 16
    sampled = [level_at(log, MOSI, edge.cycle) for edge in clock[bool(mode & CPHA) :: 2]]
    assert sampled == in_order(0xA6, control) + in_order(0x35, control)
    assert results(machine, 2) == [0xA6, 0x35]


@pytest.mark.parametrize(
    ("rate", "doubled", "divider"),
    [(r, d, v) for r, d, v in zip([0, 1, 2, 3] * 2, [0] * 4 + [1] * 4, [4, 16, 64, 128, 2, 8, 32, 64], strict=True)],
)
def test_rates(rate: int, doubled: int, divider: int) -> None:
    """Table 19-5; SPIF comes with the last of the 16 edges."""
    machine = program(
        f"setup {SPE | MSTR | rate}, {doubled}\n put 0x55\n9: in r24, SPSR\n sbrs r24, SPIF\n rjmp 9b\n sbi DDRD, 7"
    )
    machine.board.run(1400)
    log = machine.board.log()
    clock = edges_of(log, SCK)[-16:]
    assert gaps(clock) == [divider // 2] * 15
    ended = edges_of(log, 7)[0]
    assert 5 <= ended - clock[-1] < 5 + 4  # IN, SBRS that skips, SBI; up to a round later


def test_flag_is_seen_in_the_cycle_of_the_last_edge() -> None:
    """SPDR is written at the end of its OUT, 32 cycles before SPIF: an IN that many cycles later sees it."""
    for wait, seen in ((31, 0), (32, SPIF)):
        machine = program(
            f"setup {SPE | MSTR}, 1\n setup {SPE | MSTR}\n put 0\n .rept {wait}\n nop\n .endr\n keep SPSR"
        )
        machine.board.run(200)
        assert results(machine, 1) == [seen], wait


def test_miso_is_sampled_at_its_edge() -> None:
    """Mode 0 at 16 cycles: the level counts that stands when SCK rises."""
    dry = program(f"setup {SPE | MSTR | 1}\n send 0xFF")
    dry.board.run(400)
    rises = [edge.cycle for edge in dry.board.log() if edge.pin == SCK and edge.level == Level.HIGH]
    for offset, expected in ((0, 0b10110011), (1, 0b01011001)):  # a cycle late: it counts for the bit behind
        machine = program(f"setup {SPE | MSTR | 1}\n send 0xFF")
        machine.board.drive(MISO, Level.LOW)
        for rise, bit in zip(rises, "10110011", strict=True):
            machine.board.drive(MISO, Level(int(bit)), at=rise + offset)
        machine.board.run(400)
        assert results(machine, 1) == [expected], offset


def test_nothing_at_miso_reads_as_the_pin_does() -> None:
    """A pull-up: 0xFF; else the last level. MISO is an input whatever DDR says (table 19-1)."""
    machine = program(
        f"setup {SPE | MSTR}\n send 0x5A\n sbi PORTB, 4\n send 0x5A\n sbi DDRB, 4\n cbi PORTB, 4\n send 0\n keep PINB"
    )
    machine.board.run(800)
    assert results(machine, 3) == [0x00, 0xFF, 0xFF]
    assert all(edge.level != Level.LOW for edge in machine.board.log() if edge.pin == MISO)


def test_flags_and_how_they_are_cleared() -> None:
    """19.5.2: by reading SPSR, then an access to SPDR; a byte that is written too early is dropped."""
    machine = program(
        f"""setup {SPE | MSTR}
        put 0x81
        put 0x42              ; too early
        .rept 40
        nop
        .endr
        in r24, SPDR          ; SPSR was not read: it clears nothing
        keep SPSR
        keep SPSR             ; reading alone clears nothing
        in r24, SPDR
        keep SPSR
        send 0x3C
        keep SPSR"""
    )
    machine.avr.on_edge(MOSI, lambda cycle, level: machine.board.drive(MISO, level, cycle + 1))
    machine.board.run(400)
    assert results(machine, 5) == [SPIF | WCOL, SPIF | WCOL, 0, 0x3C, 0]
    ((_, _, does, why),) = machine.board.notes()
    assert does == "writes to SPDR" and "WCOL" in why


def test_interrupt_clears_the_flag() -> None:
    machine = program(
        f""" ldi r25, 0
        setup {0x80 | SPE | MSTR}
        sei
        put 0x77
        .rept 60
        nop
        .endr
        keep SPSR
        st X+, r25
        rjmp 8f
        .global __vector_17
        __vector_17: inc r25
        reti"""
    )
    machine.board.run(400)
    assert results(machine, 2) == [0, 1]


@pytest.mark.parametrize("late", [False, True])
def test_ss_low_as_an_input_ends_the_master(late: bool) -> None:
    """19.3.2: MSTR is cleared, SPIF set, MOSI and SCK become inputs."""
    machine = program(
        f"setup {SPE | MSTR | 3}\n cbi DDRB, 2\n put 0xFF\n .rept 400\n nop\n .endr\n keep SPCR\n keep SPSR"
    )
    if late:
        machine.board.drive(SS, Level.HIGH)
        machine.board.drive(SS, Level.LOW, at=200)
    machine.board.run(900)
    assert results(machine, 2) == [SPE | 3, SPIF]
    assert machine.board.output(SCK) == machine.board.output(MOSI) == Level.RELEASED
    assert "SS (pin 10)" in machine.board.notes()[0][2]
    assert bool(edges_of(machine.board.log(), SCK)[2:]) == late  # beyond its becoming an output and an input


def test_pins_are_the_ports_again_when_it_is_off() -> None:
    machine = program(f"setup {SPE | MSTR | CPOL}\n send 0xFF\n ldi r24, 0\n out SPCR, r24\n put 1")
    machine.board.run(300)
    assert machine.board.output(SCK) == machine.board.output(MOSI) == Level.LOW
    assert [does for _, _, does, _ in machine.board.notes()] == ["writes to SPDR"]


def test_slave_mode_is_noted() -> None:
    machine = program(f"setup {SPE}")
    machine.board.run(100)
    ((_, _, does, why),) = machine.board.notes()
    assert does == "writes to SPCR" and "slave mode" in why
