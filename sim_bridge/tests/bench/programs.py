"""Programs in C for tests of benches: compiled by avr-gcc once a run of the tests."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

from sim_bridge.tests.boards.avr.avr_program import compiled

FOLDER = tempfile.TemporaryDirectory()

HEAD = """
#include <avr/io.h>
#include <avr/interrupt.h>
#include <util/delay.h>
#include <util/delay_basic.h>
"""


@cache
def image(source: str) -> Path:
    """The ELF file of a C program, which need not include avr-libc's headers."""
    name = f"program_{len(list(Path(FOLDER.name).iterdir()))}.elf"
    return compiled(HEAD + source, Path(FOLDER.name, name))


# Servo pulses of exactly 24,000 cycles (1,500 us) every 320,000 on pin 9, by timer 1 in fast PWM (16.9.3): the count
# goes 0..TOP, the output is set at 0 and cleared behind the match. ICR1 can be written in such a mode only (16.11.7),
# and OCR1A comes into force at once in others only.
SERVO = """
int main(void) {
  DDRB = 1 << 1;
  OCR1A = 3000 - 1;
  TCCR1A = 1 << COM1A1 | 1 << WGM11;
  TCCR1B = 1 << WGM13 | 1 << WGM12;
  ICR1 = 40000 - 1;
  TCCR1B |= 1 << CS11;
  for (;;) {}
}
"""

# While pin 2 (pulled up) is low pin 13 is high.
BUTTON = """
int main(void) {
  PORTD = 1 << 2;
  DDRB = 1 << 5;
  for (;;) {
    if (PIND & 1 << 2) PORTB &= ~(1 << 5); else PORTB |= 1 << 5;
  }
}
"""

# A HC-SR04's user: triggers on pin 7 every 2 ms, measures the echo on pin 6 by timer 1, in cycles; says its length on
# the line (500,000 baud), the lower byte first.
PING = """
int main(void) {
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0;
  DDRD = 1 << 7;
  TCCR1B = 1 << CS10;
  for (;;) {
    PORTD |= 1 << 7;
    _delay_us(10);
    PORTD &= ~(1 << 7);
    while (!(PIND & 1 << 6)) {}
    uint16_t begin = TCNT1;
    while (PIND & 1 << 6) {}
    uint16_t width = TCNT1 - begin;
    UDR0 = (uint8_t)width;
    while (!(UCSR0A & 1 << UDRE0)) {}
    UDR0 = (uint8_t)(width >> 8);
    _delay_ms(2);
  }
}
"""

# Says what it hears, one more.
ECHO = """
int main(void) {
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0 | 1 << RXEN0;
  for (;;) {
    while (!(UCSR0A & 1 << RXC0)) {}
    UDR0 = (uint8_t)(UDR0 + 1);
  }
}
"""

# The upper eight bits of what the converter reads at channel 0, on the line.
VOLTAGE = """
int main(void) {
  UBRR0 = 1;
  UCSR0B = 1 << TXEN0;
  ADMUX = 1 << REFS0 | 1 << ADLAR;
  ADCSRA = 1 << ADEN | 7;
  for (;;) {
    ADCSRA |= 1 << ADSC;
    while (ADCSRA & 1 << ADSC) {}
    UDR0 = ADCH;
  }
}
"""
