"""Devices in Python on the board's buses, spoken to by small programs."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.errors import CallError
from sim_bridge.bench.buses import SpiDevice
from sim_bridge.bench.uno import Uno, Wanted, open_uno
from sim_bridge.tests.boards.avr.avr_program import compiled
from sim_bridge.tests.parts.test_parts_own_chips import Eeprom

SERIAL = """
#include <avr/io.h>
static void put(uint8_t byte) {
  while (!(UCSR0A & 1 << UDRE0)) {
  }
  UDR0 = byte;
}
"""
# 24C02: writes 0xA5, 0x5A to cells 3 and 4, reads both back (data sheet, byte write and sequential read); 100 kHz.
TWO_WIRE = (
    SERIAL
    + """
static uint8_t step(uint8_t control) {
  TWCR = control | 1 << TWINT | 1 << TWEN;
  while (!(TWCR & 1 << TWINT)) {
  }
  return TWSR & 0xF8;
}
static uint8_t put_byte(uint8_t byte) {
  TWDR = byte;
  return step(0);
}
int main(void) {
  UCSR0B = 1 << TXEN0;
  UBRR0 = 1;
  TWBR = 72;
  step(1 << TWSTA);
  put(put_byte(0x50 << 1));
  put_byte(3);
  put_byte(0xA5);
  put(put_byte(0x5A));
  step(1 << TWSTA);
  put_byte(0x50 << 1);
  put_byte(3);
  step(1 << TWSTA);
  put_byte(0x50 << 1 | 1);
  step(1 << TWEA);
  put(TWDR);
  step(0);
  put(TWDR);
  step(1 << TWSTA);
  put(put_byte(0x51 << 1)); /* no chip has this address */
  TWCR = 1 << TWINT | 1 << TWEN | 1 << TWSTO;
  for (;;) {
  }
}
"""
)
SPI = (
    SERIAL
    + """
int main(void) {
  UCSR0B = 1 << TXEN0;
  UBRR0 = 1;
  DDRB = 1 << 2 | 1 << 3 | 1 << 5;
  PORTB = 1 << 2;
  SPCR = 1 << SPE | 1 << MSTR;
  SPSR = 1 << SPI2X;
  PORTB = 0;
  for (uint8_t i = 0; i < 3; i++) {
    SPDR = 0xC1 + i;
    while (!(SPSR & 1 << SPIF)) {
    }
    put(SPDR);
  }
  PORTB = 1 << 2;
  for (;;) {
  }
}
"""
)


def opened(source: str, folder: Path) -> Uno:
    return open_uno("avr", Wanted(image=compiled(source, folder / "own.elf")))


def test_an_eeprom_is_written_and_read(tmp_path: Path) -> None:
    """What comes back is what was written, and TWSR says what the data sheet does (22.7: 0x18 SLA+W acknowledged, 0x28
    data acknowledged, 0x20 SLA+W not)."""
    with opened(TWO_WIRE, tmp_path) as uno:
        eeprom = Eeprom()
        uno.i2c.add(eeprom)
        uno.serial.expect(b"\x18\x28\xa5\x5a\x20", within=0.01)
        assert eeprom.cells[3:5] == b"\xa5\x5a"
        with pytest.raises(CallError, match="device at address 0x50 already"):
            uno.i2c.add(Eeprom())


class Adder(SpiDevice):
    """Sends what it got, and one more."""

    def __init__(self) -> None:
        self.heard: list[int] = []

    def begin(self) -> int:
        return 0x81

    def transfer(self, byte: int) -> int:
        self.heard.append(byte)
        return byte + 1


def test_an_spi_device_answers_byte_by_byte(tmp_path: Path) -> None:
    """Each byte comes back with the next one, at half the clock, the fastest."""
    with opened(SPI, tmp_path) as uno:
        adder = Adder()
        uno.spi.add(adder)
        uno.serial.expect(b"\x81\xc2\xc3", within=0.01)
        uno.run(0.001)
        assert adder.heard[:2] == [0xC1, 0xC2]
