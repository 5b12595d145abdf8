"""UART, ADC, EEPROM, two-wire interface and watchdog as the firmware uses them.

The EEPROM's rows write back what they read, in its last cell: a robot's parameters stay.
"""

from __future__ import annotations

from functools import partial

from tools.tests.calibration.interrupts import ENTRY, JMP
from tools.tests.calibration.rows import CPU_HZ, STAMP_CYCLES, Row

WAKE_UP = 4
OWN_OSCILLATOR = "timed by an oscillator of the chip's own"
PULL_UPS = "weak pull-ups make the lines slow"
FROM_IDLE = ENTRY + WAKE_UP + JMP
STS, SBI = 2, 2

# ---- UART: 8N1, double speed, UBRR0 = 3: 500,000 baud ----

BIT = 8 * (3 + 1)
BYTE = 10 * BIT
uart = partial(Row, group="UART, 500,000 baud")
UART_ON = "store UCSR0B, 1 << RXEN0 | 1 << TXEN0"


def overrun(count: int) -> str:
    """Asks for bytes and reads none until 20 ms after the first; then r20: how many can be read, r21: DOR0 was set."""
    return f"""
      ask {count}
    4: lds r24, UCSR0A
      sbrs r24, RXC0
      rjmp 4b
      ldi r18, 5
      sbi TIFR1, TOV1
    1: sbis TIFR1, TOV1
      rjmp 1b
      sbi TIFR1, TOV1
      dec r18
      brne 1b
      clr r20
      clr r21
    2: lds r18, UCSR0A
      sbrs r18, RXC0
      rjmp 3f
      sbrc r18, DOR0
      ldi r21, 1
      lds r19, UDR0
      inc r20
      rjmp 2b
    3: clr r25
    """


UART = [
    uart(
        what="bytes sent without a gap: UDRE0 to UDRE0",
        expected=BYTE,
        source="20.4, table 20-1: 10 bits of 8 (UBRR0 + 1) cycles",
        code=f"""
          clr r8
          ldi r24, 'U'
          mov r9, r24
          store UCSR0B, 1 << TXEN0 | 1 << UDRIE0
          sleep_until 4
          movw r2, r4
          sleep_until 5
          {UART_ON}
        """,
    ),
    uart(
        what="one byte into an idle transmitter: UDR0 written to TXC0",
        expected=(BYTE, BYTE + BIT),
        source="20.6: begins with the next clock of the transmitter",
        code=f"""
          clr r8
          store UCSR0A, 1 << TXC0 | 1 << U2X0
          store UCSR0B, 1 << TXEN0 | 1 << TXCIE0
          ldi r24, 'U'
          begin
          sts UDR0, r24
          sleep_until 1
          {UART_ON}
        """,
        around=STAMP_CYCLES + STS + FROM_IDLE,
    ),
    uart(
        what="bytes received without a gap: RXC0 to RXC0",
        expected=BYTE,
        source="20.4, table 20-1",
        code=f"""
          clr r8
          ask 6
          store UCSR0B, 1 << TXEN0 | 1 << RXEN0 | 1 << RXCIE0
          sleep_until 4
          movw r2, r4
          sleep_until 5
          movw r12, r4
          sleep_until 6
          movw r4, r12
          {UART_ON}
        """,
        edges=(-3, -2),
        board_only_shown="the computer's serial adapter decides",
    ),
    *(
        uart(
            what=f"{count} bytes left unread for 20 ms: {'DOR0' if flag else 'bytes kept'}",
            expected=int(count > 3) if flag else 3,
            source="20.7.4: 2 in the buffer, 1 in the shift register",
            code=f"{overrun(count)}\nmov r24, {'r21' if flag else 'r20'}",
            is_number=True,
            unit="flag" if flag else "bytes",
        )
        for count, flag in ((3, False), (3, True), (4, True))
    ),
]

# ---- UART: bits at the TX pin, which is pin 1; read at PIND, and by its pin-change interrupt ----

tx_bits = partial(Row, group="UART, bits at the TX pin")
SAMPLE = 2  # cycles of SBIC or SBIS with an INC that it may skip


def uart_mode(divider: int, ubrr: int) -> str:
    """The transmitter's mode, with nothing under way and TXC0 cleared; `divider`: 8 at double speed, else 16."""
    return f"""
      store UBRR0L, {ubrr}
      store UCSR0A, 1 << TXC0 | {int(divider == 8)} << U2X0
    """


# The listener may take slower bits for a byte that ends later: it gets the time of two.
UART_MODE_ENDS = f"""
    7: lds r18, UCSR0A
      sbrs r18, TXC0
      rjmp 7b
      {uart_mode(8, 3)}
      ldi r18, {2 * BYTE // 3}
    8: dec r18
      brne 8b
"""


def bit_at_pin(what: str, byte: int, frames: int, high: bool, window: tuple[float, float], divider: int) -> Row:
    """One bit, in samples of two cycles: each that sees its level counts, in a window that has no other bit of it.

    `window`: in bits from the writing of UDR0.
    """
    bit = divider * (3 + 1)
    begin, end = (round(bit * edge) for edge in window)
    wait = begin // 3  # cycles of DEC and BRNE, at most 255 times
    return tx_bits(
        what=f"{what}, {divider} (UBRR0 + 1), UBRR0 = 3",
        expected=bit,
        source="table 20-1",
        code=f"""
          {uart_mode(divider, 3)}
          clr r21
          ldi r19, 0x{byte:02X}
          ldi r20, {max(wait, 1)}
          {"sts UDR0, r19" * (frames > 1)}
          sts UDR0, r19
          {"8: dec r20" * (wait > 0)}
          {"brne 8b" * (wait > 0)}
          .rept {(end - begin) // SAMPLE}
          {"sbic" if high else "sbis"} PIND, 1
          inc r21
          .endr
          {UART_MODE_ENDS}
          clr r25
          mov r24, r21
          lsl r24
        """,
        is_number=True,
    )


def seven_bits(divider: int, ubrr: int) -> Row:
    """From the second edge of 0x0E, the first that comes in sleep, to the fourth: all data bits but the first."""
    return tx_bits(
        what=f"seven data bits, {divider} (UBRR0 + 1), UBRR0 = {ubrr}: from edge to edge",
        expected=7 * divider * (ubrr + 1),
        source="table 20-1, figure 20-4",
        code=f"""
          {uart_mode(divider, ubrr)}
          store PCMSK2, 1 << PCINT17
          sbi PCIFR, PCIF2
          store PCICR, 1 << PCIE2
          clr r8
          ldi r19, 0x0E
          sts UDR0, r19
          sleep_until 2
          movw r2, r4
          sleep_until 4
          sts PCICR, r1
          sts PCMSK2, r1
          {UART_MODE_ENDS}
        """,
        edges=(-3, -1),
    )


UART_BITS = [
    *(
        row
        for divider in (8, 16)
        for row in (
            bit_at_pin("start bit", 0xFF, 1, False, (0, 2.5), divider),
            bit_at_pin("data bit, the fifth", 0x10, 1, True, (3, 7.5), divider),
            bit_at_pin("stop bit, before the next start bit", 0x00, 2, True, (6, 13), divider),
            seven_bits(divider, 3),
        )
    ),
    seven_bits(8, 16),
]

# ---- ADC, clk/128 ----

adc = partial(Row, group="ADC, clk/128")
ADC_CLOCK = 128
ADC_ON = "1 << ADEN | 7"
ADC = [
    adc(
        what="first conversion, switched on with it: 25 clocks, begun with the next one",
        expected=(25 * ADC_CLOCK, 26 * ADC_CLOCK),
        source="table 24-1",
        code=f"""
          clr r8
          store ADMUX, 1 << REFS0
          ldi r24, {ADC_ON} | 1 << ADSC | 1 << ADIE
          begin
          sts ADCSRA, r24
          sleep_until 1
        """,
        around=STAMP_CYCLES + STS + FROM_IDLE,
    ),
    adc(
        what="conversion: 13 clocks, begun with the next one",
        expected=(13 * ADC_CLOCK, 14 * ADC_CLOCK),
        source="table 24-1",
        code=f"""
          clr r8
          ldi r24, {ADC_ON} | 1 << ADSC | 1 << ADIE
          begin
          sts ADCSRA, r24
          sleep_until 1
        """,
        around=STAMP_CYCLES + STS + FROM_IDLE,
    ),
    adc(
        what="free running: conversion to conversion, 13 clocks",
        expected=13 * ADC_CLOCK,
        source="table 24-1, figure 24-7",
        code=f"""
          clr r8
          sts ADCSRB, r1
          store ADCSRA, {ADC_ON} | 1 << ADSC | 1 << ADIE | 1 << ADATE
          sleep_until 2
          movw r2, r4
          sleep_until 3
          sts ADCSRA, r1
        """,
    ),
]

# ---- EEPROM ----

eeprom = partial(Row, group="EEPROM")
CELL = """
  ldi r24, lo8(1023)
  out EEARL, r24
  ldi r24, hi8(1023)
  out EEARH, r24
  sbi EECR, EERE
"""
EEPROM_IDLE = "7: sbic EECR, EEPE\nrjmp 7b"


def window(nops: int) -> Row:
    """EEPE is set `nops` + 2 cycles after EEMPE."""
    begun = nops + SBI <= 4
    return eeprom(
        what=f"EEPE {nops + SBI} cycles after EEMPE: a write begins",
        expected=int(begun),
        source="8.6.3: within four clock cycles",
        code=f"""
          {CELL}
          sbi EECR, EEMPE
          .rept {nops}
          nop
          .endr
          sbi EECR, EEPE
          clr r25
          clr r24
          sbic EECR, EEPE
          ldi r24, 1
          {EEPROM_IDLE}
          cbi EECR, EEMPE
        """,
        is_number=True,
        unit="flag",
    )


EEPROM = [
    eeprom(
        what="reading a byte: OUT and the CPU's halt",
        expected=1 + 4,
        source="8.6.3: halted for four cycles",
        code=f"{CELL}\nldi r24, 1 << EERE\nbegin\nout EECR, r24\nfinish",
        around=STAMP_CYCLES,
    ),
    eeprom(
        what="beginning a write: SBI and the CPU's halt",
        expected=SBI + 2,
        source="8.6.3: halted for two cycles",
        code=f"{CELL}\nbegin\nsbi EECR, EEMPE\nsbi EECR, EEPE\nfinish\n{EEPROM_IDLE}",
        around=STAMP_CYCLES + SBI,
    ),
    eeprom(
        what="erasing and writing a byte, 3.4 ms, by the chip's own oscillator",
        expected=CPU_HZ * 34 // 10_000,
        source="table 8-1",
        code=f"""
          {CELL}
          clr r8
          begin
          sbi EECR, EEMPE
          sbi EECR, EEPE
          sbi EECR, EERIE
          sleep_until 1
        """,
        around=STAMP_CYCLES + SBI + SBI + FROM_IDLE,
        board_only_shown=OWN_OSCILLATOR,
    ),
    window(2),
    window(3),
]

# ---- two-wire interface, TWBR = 72: 100 kHz; nobody answers ----

two_wire = partial(Row, group="Two-wire interface, 100 kHz")
TWI_BIT = 16 + 2 * 72
TWI_COMMAND = "1 << TWINT | 1 << TWEN | 1 << TWIE"
TWI_START = f"""
  sbi PORTC, 4
  sbi PORTC, 5
  clr r8
  store TWBR, 72
  sts TWSR, r1
  store TWCR, {TWI_COMMAND} | 1 << TWSTA
  sleep_until 1
  store TWDR, 0x02
"""
TWI_STOP = "store TWCR, 1 << TWINT | 1 << TWEN | 1 << TWSTO\n7: lds r24, TWCR\nsbrc r24, TWSTO\nrjmp 7b\nsts TWCR, r1"
TWO_WIRE = [
    two_wire(
        what="address and answer: 9 bits, from TWINT cleared to TWINT set",
        expected=(9 * TWI_BIT, 9 * TWI_BIT + TWI_BIT // 2),
        source="22.5.2, figure 22-9: SCL is low before the first bit",
        code=f"""
          {TWI_START}
          ldi r24, {TWI_COMMAND}
          begin
          sts TWCR, r24
          sleep_until 2
          {TWI_STOP}
        """,
        around=STAMP_CYCLES + STS + FROM_IDLE,
        board_only_shown=PULL_UPS,
    ),
    two_wire(
        what="period of SCL, by the pin-change interrupt of A5",
        expected=TWI_BIT,
        source="22.5.2: 16 + 2 TWBR",
        code=f"""
          {TWI_START}
          sbi PCIFR, PCIF1
          store PCMSK1, 1 << PCINT13
          store PCICR, 1 << PCIE1
          clr r8
          store TWCR, 1 << TWINT | 1 << TWEN
          sleep_until 4
          movw r2, r4
          sleep_until 6
          sts PCICR, r1
          sts PCMSK1, r1
        8: lds r24, TWCR
          sbrs r24, TWINT
          rjmp 8b
          {TWI_STOP}
        """,
        edges=(-3, -1),
        board_only_shown=PULL_UPS,
    ),
]

# ---- watchdog: interrupt only; Timer 1 counts by 64 ----

watchdog_row = partial(Row, group="Watchdog, 128 kHz by its own oscillator")
WATCHDOG_CYCLES = CPU_HZ // 128_000 * 2048
WATCHDOG_OFF = """
  wdr
  store WDTCSR, 1 << WDCE | 1 << WDE
  sts WDTCSR, r1
"""


def watchdog(step: int) -> Row:
    """From time-out to time-out, at most four seconds."""
    return watchdog_row(
        what=f"time-out to time-out, {16 << step} ms nominal",
        expected=WATCHDOG_CYCLES << step,
        source="table 11-2: 2048 cycles and doublings",
        code=f"""
          clr r8
          store TCCR1B, 1 << CS11 | 1 << CS10
          wdr
          store WDTCSR, 1 << WDCE | 1 << WDE
          store WDTCSR, 1 << WDIE | {step}
          sleep_until 1
          movw r2, r4
          sleep_until 2
          {WATCHDOG_OFF}
          store TCCR1B, 1 << CS10
        """,
        scale=64,
        board_only_shown=OWN_OSCILLATOR,
    )


WATCHDOG = [watchdog(step) for step in (0, 1, 2, 3)]

ROWS = [*UART, *ADC, *EEPROM, *TWO_WIRE, *WATCHDOG, *UART_BITS]
