"""The ADC of the emulated ATmega328P: when it samples, how long it takes, what it reads (data sheet, section 24)."""

from __future__ import annotations

import pytest

from sim_bridge.tests.boards.avr.avr_program import Machine, edges_of, gaps

# Two conversions of a channel; PINB5 toggles at the start of each and when its interrupt comes. The CPU sleeps
# meanwhile, so that the interrupt comes at once: 4 + 4 cycles, jmp 3, sbi 2.
TIMED = """
.global __vector_21
__vector_21:
  sbi PINB, 5
  reti
main:
  sbi DDRB, 5
  ldi r24, 1
  out SMCR, r24
  ldi r24, 1 << REFS0 | {channel}
  sts ADMUX, r24
  ldi r24, 1 << ADEN | 1 << ADIE | {prescaler}
  sts ADCSRA, r24
  sei
  ldi r20, 2
1: ldi r24, 1 << ADEN | 1 << ADSC | 1 << ADIE | {prescaler}
  sts ADCSRA, r24
  sbi PINB, 5
  sleep
  nop
  lds r16, ADCL
  lds r17, ADCH
  dec r20
  brne 1b
3: rjmp 3b
"""
WAKE_AND_MARK = 4 + 4 + 3 + 2
START_TO_MARK = 2  # sbi after the sts that starts


@pytest.mark.parametrize(
    ("prescaler", "divider"), [(0, 2), (1, 2), (2, 4), (3, 8), (4, 16), (5, 32), (6, 64), (7, 128)]
)
def test_a_conversion_takes_13_clocks_and_the_first_25(prescaler: int, divider: int) -> None:
    """From the converter's clock edge after the start, 24.4, table 24-1."""
    machine = Machine(TIMED.format(channel=1, prescaler=prescaler))
    machine.board.analog(1, 2.0)
    machine.board.run(40 * divider + 400)
    _, start_1, end_1, start_2, end_2 = edges_of(machine.board.log(), 13)
    for start, end, clocks in ((start_1, end_1, 25), (start_2, end_2, 13)):
        elapsed = end - WAKE_AND_MARK - (start - START_TO_MARK)
        assert clocks * divider < elapsed + 1 and elapsed <= (clocks + 1) * divider + 1
    assert int.from_bytes(machine.board.read_memory(16, 2), "little") == int(2.0 * 1024 / 5.0)


@pytest.mark.parametrize("channel", range(6))
@pytest.mark.parametrize("volts", [0.0, 0.0048, 0.0049, 1.0, 2.4, 2.5, 3.141, 4.9951, 4.9952, 5.0, 9.0])
def test_a_channel_reads_its_voltage(channel: int, volts: float) -> None:
    """floor(V * 1024 / Vref), at most 1023 (24.7)."""
    machine = Machine(TIMED.format(channel=channel, prescaler=4))
    for other in range(6):
        machine.board.analog(other, 1.7)
    machine.board.analog(channel, volts)
    machine.board.run(2000)
    assert int.from_bytes(machine.board.read_memory(16, 2), "little") == min(1023, int(volts * 1024 / 5.0))


def test_channel_is_fixed_when_the_conversion_has_begun() -> None:
    """24.5: a new channel counts for the next conversion."""
    program = """
    main:
      ldi r24, 1 << REFS0 | 1
      sts ADMUX, r24
      ldi r24, 1 << ADEN | 1 << ADSC | 5
      sts ADCSRA, r24
      ldi r20, 12
    1: dec r20          ; 36 cycles: more than one clock of 32
      brne 1b
      ldi r24, 1 << REFS0 | 2
      sts ADMUX, r24
    2: lds r24, ADCSRA
      sbrc r24, ADSC
      rjmp 2b
      lds r16, ADCL
      lds r17, ADCH
    3: rjmp 3b
    """
    machine = Machine(program)
    machine.board.analog(1, 1.0)
    machine.board.analog(2, 4.0)
    machine.board.run(4000)
    assert int.from_bytes(machine.board.read_memory(16, 2), "little") == 204  # 1 V


def test_free_running_converts_every_13_clocks() -> None:
    program = """
    .global __vector_21
    __vector_21:
      sbi PINB, 5
      reti
    main:
      sbi DDRB, 5
      ldi r24, 1
      out SMCR, r24
      sei
      ldi r24, 1 << ADEN | 1 << ADSC | 1 << ADATE | 1 << ADIE | 4
      sts ADCSRA, r24
    1: sleep
      rjmp 1b
    """
    machine = Machine(program)
    machine.board.run(6000)
    edges = edges_of(machine.board.log(), 13)[2:]
    assert len(edges) > 20
    assert set(gaps(edges)) == {13 * 16}


@pytest.mark.parametrize("first", ["ADCSRA", "ADCSRB"])
@pytest.mark.parametrize("trigger", [1, 3, 7])
def test_other_triggers_are_told_and_never_come(trigger: int, first: str) -> None:
    values = {"ADCSRA": "1 << ADEN | 1 << ADSC | 1 << ADATE | 2", "ADCSRB": str(trigger)}
    order = [first, *(name for name in values if name != first)]
    program = "main:\n" + "".join(f" ldi r24, {values[name]}\n sts {name}, r24\n" for name in order) + "1: rjmp 1b"
    machine = Machine(program.replace("1:", " ldi r24, 0xC1\n sts ADMUX, r24\n1: lds r24, ADCSRA\n"))
    machine.board.run(1000)
    assert machine.board.read_memory(24, 1)[0] & 0x50 == 0x10  # one conversion, and no more
    assert "writes to ADCSRB" in [does for _, _, does, _ in machine.board.notes()]
