"""The two-wire interface of the emulated ATmega328P as a master, measured on its lines (data sheet, section 22)."""

from __future__ import annotations

import itertools

import pytest

from sim_bridge.boards.board import Edge, Level
from sim_bridge.tests.boards.avr.avr_program import Machine, edges_of, gaps

SDA, SCL, MARK = 18, 19, 13

# `step` writes TWCR, waits for TWINT and keeps the status at X; `stop` waits until STOP has been sent.
MACROS = """
.macro step control
  ldi r24, \\control
  sts TWCR, r24
9: lds r24, TWCR
  sbrs r24, TWINT
  rjmp 9b
  lds r24, TWSR
  st X+, r24
.endm
.macro send value
  ldi r24, \\value
  sts TWDR, r24
  step 1 << TWINT | 1 << TWEN
.endm
.macro take acknowledge
  step 1 << TWINT | 1 << TWEN | \\acknowledge << TWEA
  lds r24, TWDR
  st X+, r24
.endm
.macro start
  step 1 << TWINT | 1 << TWSTA | 1 << TWEN
.endm
.macro stop
  ldi r24, 1 << TWINT | 1 << TWSTO | 1 << TWEN
  sts TWCR, r24
9: lds r24, TWCR
  sbrc r24, TWSTO
  rjmp 9b
.endm
.macro setup rate, prescaler
  ldi XL, 0
  ldi XH, 2
  sbi DDRB, 5
  ldi r24, \\rate
  sts TWBR, r24
  ldi r24, \\prescaler
  sts TWSR, r24
.endm
"""
RESULTS = 0x200


class Bus:
    """A program on a board with pull-ups at its two-wire bus."""

    def __init__(self, program: str, cycles: int, pulled_up: bool = True) -> None:
        self.program, self.cycles = program, cycles
        self.machine = Machine(MACROS + f"main:\n{program}\n8: rjmp 8b\n")
        if pulled_up:
            for pin in (SDA, SCL):
                self.machine.board.drive(pin, Level.HIGH)

    def run(self) -> list[Edge]:
        self.machine.board.run(self.cycles)
        return self.machine.board.log()

    def results(self, count: int) -> list[int]:
        return list(self.machine.board.read_memory(RESULTS, count))


def falls(log: list[Edge]) -> list[int]:
    """Cycles at which the board pulls SCL low."""
    return [edge.cycle for edge in log if edge.pin == SCL and edge.level == Level.LOW]


def rises(log: list[Edge]) -> list[int]:
    return [edge.cycle for edge in log if edge.pin == SCL and edge.level != Level.LOW]


def sda_at(log: list[Edge], cycle: int) -> int:
    """What the board does to SDA at that cycle: 0 low, 1 let go."""
    before = [edge for edge in log if edge.pin == SDA and edge.cycle <= cycle]
    return int(not before or before[-1].level != Level.LOW)


def acknowledging(program: str, cycles: int, bits: dict[int, str]) -> Bus:
    """A bus on which a device sends bits: for each byte (by number) the nine of them, "1" and "." let go.

    The program's timing does not depend on the bits: a dry run shows when SCL falls.
    """
    dry = falls(Bus(program, cycles).run())
    bus = Bus(program, cycles)
    for byte, text in bits.items():
        for bit, level in enumerate(text):
            if level == "0":
                fall = dry[byte * 9 + bit]  # the one before this bit
                bus.machine.board.drive(SDA, Level.LOW, at=fall + 6)
                bus.machine.board.drive(SDA, Level.HIGH, at=dry[byte * 9 + bit + 1] + 6)
    return bus


ACK = "........0"


@pytest.mark.parametrize(("rate", "prescaler"), [(72, 0), (12, 0), (0, 0), (32, 1), (10, 2), (3, 3), (255, 0)])
def test_period_of_the_clock(rate: int, prescaler: int) -> None:
    """16 MHz / (16 + 2 TWBR 4^TWPS), (22.5.2), half of it low; the address goes out with its highest bit first."""
    period = 16 + 2 * rate * 4**prescaler
    bus = Bus(f"setup {rate}, {prescaler}\n start\n send 0x3C", 14 * period + 400)
    log = bus.run()
    clock = falls(log)
    assert gaps(clock[1:]) == [period] * 8  # the first low half waits for the program
    assert [fall - rise for rise, fall in zip(rises(log), clock[1:], strict=True)] == [period // 2] * 9
    assert [sda_at(log, rise) for rise in rises(log)] == [0, 0, 1, 1, 1, 1, 0, 0, 1]
    assert bus.results(2) == [0x08 | prescaler, 0x20 | prescaler]


def test_sda_changes_only_while_the_clock_is_low() -> None:
    log = Bus("setup 12, 0\n start\n send 0xA5\n send 0x5A\n stop", 2000).run()
    level = {SDA: 1, SCL: 1}
    moved = []
    for edge in log:
        if edge.pin not in level:
            continue
        level[edge.pin] = int(edge.level != Level.LOW)
        if edge.pin == SDA and level[SCL]:
            moved.append(level[SDA])
    assert moved == [0, 1]  # START and STOP


def test_start_and_stop() -> None:
    """START: SDA falls, SCL half a period later. STOP: SCL rises, SDA half a period later."""
    log = Bus("setup 12, 0\n start\n send 0x3C\n stop", 2000).run()
    sda, scl = (edges_of(log, pin) for pin in (SDA, SCL))
    assert scl[0] - sda[0] == 20
    assert sda[-1] - scl[-1] == 20


def test_master_transmitter() -> None:
    program = "setup 12, 0\n start\n send 0x3C\n send 0x02\n send 0x81\n stop\n sbi PINB, 5"
    bus = acknowledging(program, 4000, {0: ACK, 1: ACK})
    log = bus.run()
    assert bus.results(4) == [0x08, 0x18, 0x28, 0x30]
    sent = [sda_at(log, rise) for rise in rises(log)]
    assert sent[9:18] == [0, 0, 0, 0, 0, 0, 1, 0, 1]
    assert sent[18:27] == [1, 0, 0, 0, 0, 0, 0, 1, 1]
    assert len(edges_of(log, MARK)) == 2


def test_master_receiver_and_repeated_start() -> None:
    program = "setup 20, 0\n start\n send 0x3C\n start\n send 0x3D\n take 1\n take 0\n stop\n sbi PINB, 5"
    # the repeated START costs one fall: its nine bits come one fall later
    dry = falls(Bus(program, 6000).run())
    assert len(dry) == 1 + 9 + 1 + 27
    bus = Bus(program, 6000)
    drive = bus.machine.board.drive
    for first, bits in ((0, ACK), (10, ACK), (19, "10100101."), (28, "01000010.")):
        for bit, level in enumerate(bits):
            if level == "0":
                drive(SDA, Level.LOW, at=dry[first + bit] + 6)
                drive(SDA, Level.HIGH, at=dry[first + bit + 1] + 6)
    log = bus.run()
    assert bus.results(8) == [0x08, 0x18, 0x10, 0x40, 0x50, 0b10100101, 0x58, 0b01000010]
    answers = [sda_at(log, rise) for rise in rises(log)]
    assert answers[-10 - 1] == 0  # acknowledged
    assert answers[-2] == 1  # the last one not
    assert len(edges_of(log, MARK)) == 2


def test_a_device_may_stretch_the_clock() -> None:
    """The high half begins when the line is high; nothing else is late."""
    program = "setup 12, 0\n start\n send 0x3C"
    dry = falls(Bus(program, 2000).run())
    bus = Bus(program, 2000)
    held_until = dry[4] + 333
    bus.machine.board.drive(SCL, Level.LOW, at=dry[4] + 5)
    bus.machine.board.drive(SCL, Level.HIGH, at=held_until)
    clock = falls(bus.run())
    assert clock[:5] == dry[:5]
    assert clock[5] == held_until + 20
    assert gaps(clock[5:]) == [40] * 4
    assert bus.results(2) == [0x08, 0x20]


def test_another_master_wins() -> None:
    program = "setup 12, 0\n start\n send 0xFF\n start"
    dry = falls(Bus(program, 2000).run())
    bus = Bus(program, 2000)
    bus.machine.board.drive(SDA, Level.LOW, at=dry[3] + 6)
    bus.machine.board.drive(SDA, Level.HIGH, at=dry[3] + 500)
    log = bus.run()
    assert bus.results(3) == [0x08, 0x38, 0x08]  # lost in the fourth bit; and again once the bus is free
    assert len(falls(log)) == 1 + 3 + 1


@pytest.mark.parametrize(("pull_ups", "starts"), [("", False), ("sbi PORTC, 4\n sbi PORTC, 5", True)])
def test_a_bus_without_pull_ups_is_never_free(pull_ups: str, starts: bool) -> None:
    bus = Bus(f"{pull_ups}\n setup 12, 0\n start", 2000, pulled_up=False)
    assert bool(falls(bus.run())) == starts
    assert bus.results(1) == [0x08] or not starts


def test_interrupt_comes_with_the_flag_and_stays_with_it() -> None:
    bus = Bus(
        """
        setup 12, 0
        ldi r24, 1 << TWINT | 1 << TWSTA | 1 << TWEN | 1 << TWIE
        sts TWCR, r24
        sei
      7: rjmp 7b
        .global __vector_24
      __vector_24:
        sbi PINB, 5
        reti              ; the flag is still set: the interrupt comes again
        """,
        600,
    )
    log = bus.run()
    marks = edges_of(log, MARK)
    first = falls(log)[0]
    # The jump of 2 cycles that runs, entry (4), the vector's jmp (3), sbi (2).
    assert 0 < marks[1] - first <= 2 + 4 + 3 + 2
    assert len(marks) > 5
    assert set(gaps(marks[1:])) == {4 + 3 + 2 + 4 + 2}  # and one instruction, rjmp, between two


def test_data_written_at_the_wrong_time_is_told() -> None:
    bus = Bus(
        """
        setup 12, 0
        ldi r24, 1 << TWINT | 1 << TWSTA | 1 << TWEN
        sts TWCR, r24
        ldi r24, 0x55
        sts TWDR, r24     ; no flag yet
        lds r16, TWCR
        lds r17, TWDR
      7: lds r24, TWCR
        sbrs r24, TWINT
        rjmp 7b
        sts TWDR, r24
        lds r18, TWCR
        """,
        600,
    )
    bus.run()
    collided, kept, clean = bus.machine.board.read_memory(16, 3)
    assert collided & 0x08 and kept == 0xFF and not clean & 0x08


def test_switching_off_gives_the_pins_back() -> None:
    bus = Bus("setup 12, 0\n start\n sts TWCR, r1\n sbi DDRC, 5\n sbi PORTC, 5", 600)
    log = [edge for edge in bus.run() if edge.pin == SCL]
    assert [edge.level for edge in log][-3:] == [Level.RELEASED, Level.LOW, Level.HIGH]


def test_stop_and_start_in_one() -> None:
    bus = Bus(
        """
        setup 12, 0
        start
        send 0x3C
        step 1 << TWINT | 1 << TWSTA | 1 << TWSTO | 1 << TWEN
        """,
        2000,
    )
    log = bus.run()
    assert bus.results(3) == [0x08, 0x20, 0x08]
    sda = [edge for edge in log if edge.pin == SDA]
    assert [edge.level == Level.LOW for edge in sda[-3:]] == [True, False, True]


def test_reset_in_mid_byte_lets_go_of_the_lines() -> None:
    bus = Bus("setup 72, 0\n start\n send 0x3C", 900)
    bus.run()
    assert bus.machine.board.output(SCL) == Level.LOW or bus.machine.board.output(SDA) == Level.LOW
    bus.machine.board.reset()
    bus.machine.board.run(1)
    assert bus.machine.board.output(SCL) == bus.machine.board.output(SDA) == Level.RELEASED


def test_run_does_not_depend_on_how_it_is_cut() -> None:
    program = "setup 12, 0\n start\n send 0x3C\n send 0x02\n start\n send 0x3D\n stop"
    whole = Bus(program, 3000).run()
    pieces = Bus(program, 3000)
    log: list[Edge] = []
    for cycles in itertools.cycle((1, 7, 40, 3)):
        if pieces.machine.board.now >= 3000:
            break
        pieces.machine.board.run(cycles)
        log += pieces.machine.board.log()
    assert [edge for edge in log if edge.cycle <= 2900] == [edge for edge in whole if edge.cycle <= 2900]
