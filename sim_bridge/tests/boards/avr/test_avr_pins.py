"""Ports of the emulated ATmega328P: what it does to its pins, what it sees of what the outside does."""

from __future__ import annotations

import pytest

from sim_bridge.boards.board import Edge, Level
from sim_bridge.tests.boards.avr.avr_program import Machine, edges_of, gaps

INPUT_LATENCY = 3  # cycles from an edge to the flag of its interrupt


def test_every_change_of_a_pin_is_told() -> None:
    machine = Machine(
        """
        main:
          sbi PORTB, 5
          sbi DDRB, 5
          cbi PORTB, 5
          cbi DDRB, 5
        1: rjmp 1b
        """
    )
    machine.board.run(100)
    log = machine.board.log()
    first = log[0].cycle
    levels = [Level.PULLED_UP, Level.HIGH, Level.LOW, Level.RELEASED]
    assert log == [Edge(first + 2 * i, 13, level) for i, level in enumerate(levels)]
    assert machine.board.output(13) == Level.RELEASED


def test_out_is_one_cycle_and_sbi_two() -> None:
    machine = Machine(
        """
        main:
          ldi r24, 0x20
          out DDRB, r24
          out PORTB, r24
          out PORTB, r1
          sbi PORTB, 5
          sts PORTB + 0, r1
        1: rjmp 1b
        """.replace("PORTB + 0", "0x25")
    )
    machine.board.run(100)
    edges = edges_of(machine.board.log(), 13)
    assert gaps(edges) == [1, 1, 2, 2]


@pytest.mark.parametrize("pin", range(20))
def test_each_pin_is_where_the_board_has_it(pin: int) -> None:
    port, bit = ("D", pin) if pin < 8 else ("B", pin - 8) if pin < 14 else ("C", pin - 14)
    machine = Machine(f"main:\n sbi DDR{port}, {bit}\n sbi PORT{port}, {bit}\n sbic PIN{port}, {bit}\n1: rjmp 1b")
    machine.board.run(100)
    assert [(edge.pin, edge.level) for edge in machine.board.log()] == [(pin, Level.LOW), (pin, Level.HIGH)]


# Reads PIND at each step into r16 and up; NOPs for the synchronizer.
PULL_UP_STEPS = """
main:
  {step_0}
  nop
  in r16, PIND
  sbi PORTD, 7
  nop
  in r17, PIND
  sbi DDRD, 4           ; other pins of the port change direction and level
  sbi PORTD, 4
  cbi PORTD, 4
  nop
  in r18, PIND
  cbi PORTD, 7
  sbi PORTD, 7
  nop
  in r19, PIND
1: rjmp 1b
"""


@pytest.mark.parametrize("level", [Level.LOW, Level.HIGH])
def test_driven_input_stays_driven(level: Level) -> None:
    machine = Machine(PULL_UP_STEPS.format(step_0=""))
    machine.board.drive(7, level)
    machine.board.run(100)
    assert [value >> 7 for value in machine.board.read_memory(16, 4)] == [level] * 4


def test_pull_up_reads_one_and_a_floating_pin_keeps_its_level() -> None:
    machine = Machine(PULL_UP_STEPS.format(step_0=""))
    machine.board.run(100)
    assert [value >> 7 for value in machine.board.read_memory(16, 4)] == [0, 1, 1, 1]


def test_pull_up_rises_when_the_outside_lets_go() -> None:
    machine = Machine("main:\n sbi PORTD, 7\n sbi DDRB, 5\n1: sbis PIND, 7\n rjmp 1b\n sbi PINB, 5\n2: rjmp 2b")
    machine.board.drive(7, Level.LOW)
    machine.board.drive(7, Level.RELEASED, at=1000)
    machine.board.run(2000)
    _, seen = edges_of(machine.board.log(), 13)
    assert 1000 < seen <= 1000 + 8


def test_output_is_read_back_one_cycle_late() -> None:
    machine = Machine(
        """
        main:
          sbi DDRD, 7
          ldi r24, 0x80
          out PORTD, r24
          in r16, PIND          ; still the old level (14.2.4)
          in r17, PIND
        1: rjmp 1b
        """
    )
    machine.board.drive(7, Level.LOW)  # an output wins
    machine.board.run(100)
    assert [value >> 7 for value in machine.board.read_memory(16, 2)] == [0, 1]


PIN_CHANGE = """
.global __vector_3, __vector_4, __vector_5
__vector_3:
  sbi PINB, 5
  reti
__vector_4:
  sbi PINB, 4
  reti
__vector_5:
  sbi PIND, 4
  reti
main:
  ldi r24, 0x30
  out DDRB, r24
  sbi DDRD, 4
  ldi r24, 1
  out SMCR, r24
  ldi r24, 1 << 1
  sts PCMSK0, r24
  ldi r24, 1 << 2
  sts PCMSK1, r24
  ldi r24, 1 << 3
  sts PCMSK2, r24
  ldi r24, 7
  sts PCICR, r24
  sei
1: sleep
  rjmp 1b
"""


@pytest.mark.parametrize(("pin", "shown_on"), [(9, 13), (16, 12), (3, 4)])
def test_pin_change_interrupts(pin: int, shown_on: int) -> None:
    machine = Machine(PIN_CHANGE)
    edges = [1000, 1100, 5003]
    for i, edge in enumerate(edges):
        machine.board.drive(pin, Level.LOW if i % 2 else Level.HIGH, at=edge)
        machine.board.drive(pin - 1, Level.LOW if i % 2 else Level.HIGH, at=edge + 50)  # not enabled
    machine.board.advance(6000)
    log = machine.board.log()
    reactions = edges_of(log, shown_on)[1:]
    assert reactions == [edge + INPUT_LATENCY + 8 + 3 + 2 for edge in edges]
    assert len(log) == 3 + len(edges)


def test_later_edges_of_the_same_pin_are_replaced() -> None:
    board = Machine(PIN_CHANGE).board
    board.drive(9, Level.HIGH, at=1000)
    board.drive(9, Level.LOW, at=2000)
    board.drive(9, Level.HIGH, at=3000)
    board.drive(3, Level.HIGH, at=2500)
    board.drive(9, Level.LOW, at=1500)  # takes 2000 and 3000 away, of this pin only
    board.advance(4000)
    log = board.log()
    delay = INPUT_LATENCY + 8 + 3 + 2
    assert edges_of(log, 13)[1:] == [1000 + delay, 1500 + delay]
    assert edges_of(log, 4)[1:] == [2500 + delay]


EXTERNAL = """
.global __vector_1, __vector_2
__vector_1:
  sbi PINB, 5
  reti
__vector_2:
  sbi PINB, 4
  reti
main:
  ldi r24, 0x30
  out DDRB, r24
  ldi r24, {modes}
  sts EICRA, r24
  ldi r24, 3
  out EIMSK, r24
  sei
1: rjmp 1b
"""


@pytest.mark.parametrize(("mode", "edges"), [(1, 4), (2, 2), (3, 2)])
def test_external_interrupts(mode: int, edges: int) -> None:
    machine = Machine(EXTERNAL.format(modes=mode | mode << 2))
    for pin, start in ((2, 1000), (3, 2000)):
        for i in range(4):
            machine.board.drive(pin, Level.LOW if i % 2 else Level.HIGH, at=start + 200 * i)
    machine.board.advance(4000)
    log = machine.board.log()
    assert len(edges_of(log, 13)) == len(edges_of(log, 12)) == 1 + edges


def test_answer_from_inside_the_run() -> None:
    # The outside answers an output edge 10 cycles later; the program measures it.
    machine = Machine(
        """
        main:
          sbi DDRB, 5
          sbi DDRB, 4
          sbi PINB, 4
          nop
          sbi PINB, 5
        1: sbis PIND, 7
          rjmp 1b
          sbi PINB, 4
        2: rjmp 2b
        """
    )
    machine.avr.on_edge(13, lambda cycle, level: machine.board.drive(7, level, cycle + 10))
    machine.board.run(200)
    log = machine.board.log()
    asked = edges_of(log, 13)[1]
    seen = edges_of(log, 12)[2]
    assert 10 < seen - asked <= 10 + 8


def test_analog_conversion() -> None:
    machine = Machine(
        """
        main:
          sbi DDRB, 5
          ldi r24, 1 << REFS0 | 2
          sts ADMUX, r24
          ldi r24, 1 << ADEN | 7
          sts ADCSRA, r24
          ldi r20, 2
        1: sbi PINB, 5
          ldi r24, 1 << ADEN | 1 << ADSC | 7
          sts ADCSRA, r24
        2: lds r24, ADCSRA
          sbrc r24, ADSC
          rjmp 2b
          sbi PINB, 5
          lds r16, ADCL
          lds r17, ADCH
          dec r20
          brne 1b
        3: rjmp 3b
        """
    )
    machine.board.analog(2, 3.3)
    machine.board.run(10_000)
    assert int.from_bytes(machine.board.read_memory(16, 2), "little") == int(3.3 / 5.0 * 1024)
    _, start_1, end_1, start_2, end_2 = edges_of(machine.board.log(), 13)
    assert 25 * 128 <= end_1 - start_1 < 26 * 128 + 20
    assert 13 * 128 <= end_2 - start_2 < 14 * 128 + 20


# Selects AVCC and a channel, waits, and converts: the result is in r16 and r17. The converter runs at 125 kHz and has
# done its first conversion before.
CONVERT = """
main:
  ldi r24, 1 << ADEN | 1 << ADSC | 7
  sts ADCSRA, r24
1: lds r24, ADCSRA
  sbrc r24, ADSC
  rjmp 1b
  ldi r24, {reference} << REFS0 | {channel}
  sts ADMUX, r24
  ldi r30, lo8({wait} / 4)
  ldi r31, hi8({wait} / 4)
2: sbiw r30, 1
  brne 2b
  ldi r24, 1 << ADEN | 1 << ADSC | 7
  sts ADCSRA, r24
3: lds r24, ADCSRA
  sbrc r24, ADSC
  rjmp 3b
  lds r16, ADCL
  lds r17, ADCH
4: rjmp 4b
"""
AVCC, BAND_GAP_REFERENCE = 1, 3
BAND_GAP_CHANNEL = 14
SETTLED = 70 * 16  # cycles: t_BG is 70 us at most (29.5)


def converted(channel: int, supply: float | None = None, wait: int = 4 * SETTLED, reference: int = AVCC) -> int:
    """The result of a conversion at `channel` that was selected `wait` cycles before; 3.3 V at channel 2."""
    machine = Machine(CONVERT.format(reference=reference, channel=channel, wait=wait))
    machine.board.analog(2, 3.3)
    if supply is not None:
        machine.board.supply(supply)
    machine.board.run(20_000)
    return int.from_bytes(machine.board.read_memory(16, 2), "little")


@pytest.mark.parametrize(("supply", "result"), [(None, 225), (5.0, 225), (4.5, 250), (3.3, 341), (2.7, 417)])
def test_band_gap_tells_the_supply(supply: float | None, result: int) -> None:
    # 1.1 V * 1024 / supply (24.7): 225.28, 250.3, 341.3, 417.2
    assert converted(BAND_GAP_CHANNEL, supply) == result


def test_supply_scales_every_channel() -> None:
    assert converted(2) == 675  # 3.3 * 1024 / 5 = 675.8
    assert converted(2, supply=4.0) == 844  # 844.8
    assert converted(2, supply=3.0) == 1023
    assert converted(15) == converted(15, supply=3.0) == 0  # ground
    assert converted(2, reference=BAND_GAP_REFERENCE) == 1023
    assert converted(BAND_GAP_CHANNEL, supply=4.0, reference=BAND_GAP_REFERENCE) == 1023


def test_band_gap_needs_70_us_from_its_selection() -> None:
    # the sample is held 1.5 to 2.5 cycles of 128 after the start
    early = [converted(BAND_GAP_CHANNEL, wait=wait) for wait in (16, 200, 400, 600)]
    assert early == sorted(early)
    assert 0 < early[0] < early[-1] < 225
    assert converted(BAND_GAP_CHANNEL, wait=SETTLED) == 225
