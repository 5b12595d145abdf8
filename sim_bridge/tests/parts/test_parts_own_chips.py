"""Chips of a test's own on the two-wire bus and on SPI: what programs for the ATmega328P get from them, by the status
codes and registers of its data sheet (22.7, 19)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from boebot.errors import BoardError, CallError
from boebot.image.data import read_variables
from sim_bridge.bench.bench import Bench
from sim_bridge.bench.buses import I2c, I2cDevice, Spi, SpiDevice
from sim_bridge.bench.symbols import Symbol
from sim_bridge.bench.uno import Wanted, open_uno
from sim_bridge.bench.waiting import Cannot
from sim_bridge.tests.boards.avr.avr_program import compiled

TWO_WIRE = """
#include <avr/io.h>
#include <stdint.h>
volatile uint8_t states[20], got[2], count, done;
static void bus(uint8_t control) {
  TWCR = control | _BV(TWINT) | _BV(TWEN);
  while (!(TWCR & _BV(TWINT))) {}
  states[count++] = TWSR & 0xF8;
}
static void put(uint8_t byte) { TWDR = byte; bus(0); }
static void stop(void) { TWCR = _BV(TWINT) | _BV(TWEN) | _BV(TWSTO); while (TWCR & _BV(TWSTO)) {} }
int main(void) {
  TWBR = RATE;
  bus(_BV(TWSTA)); put(0x50 << 1); put(5); put(0x42); put(0x99); stop();
  bus(_BV(TWSTA)); put(0x50 << 1); put(5);
  bus(_BV(TWSTA)); put(0x50 << 1 | 1); bus(_BV(TWEA)); got[0] = TWDR; bus(0); got[1] = TWDR; stop();
  bus(_BV(TWSTA)); put(0x51 << 1); stop();
  bus(_BV(TWSTA)); put(0x52 << 1); put(7); stop();
  done = 1;
  for (;;) {}
}
"""
START, AGAIN, SLA_W, SLA_W_NO, SENT, SENT_NO, SLA_R, TAKEN, TAKEN_LAST = (
    *(0x08, 0x10, 0x18, 0x20, 0x28, 0x30, 0x40, 0x50, 0x58),
)
STATES = [
    *(START, SLA_W, SENT, SENT, SENT),
    *(START, SLA_W, SENT, AGAIN, SLA_R, TAKEN, TAKEN_LAST),
    *(START, SLA_W_NO),
    *(START, SLA_W, SENT_NO),
]

SPI = """
#include <avr/io.h>
#include <stdint.h>
volatile uint8_t got[3], loose = 7, done;
static uint8_t spi(uint8_t byte) { SPDR = byte; while (!(SPSR & _BV(SPIF))) {} return SPDR; }
int main(void) {
  DDRB = _BV(1) | _BV(2) | _BV(3) | _BV(5);
  PORTB = _BV(1) | _BV(2);
  SPCR = _BV(SPE) | _BV(MSTR) | (MODE & 2 ? _BV(CPOL) : 0) | (MODE & 1 ? _BV(CPHA) : 0) | RATE;
  PORTB &= ~_BV(2);
  for (uint8_t i = 0; i < 3; i++) got[i] = spi(0xA1 + i);
  PORTB |= _BV(2);
  done = 1;
  for (;;) {}
}
"""
BY_HAND = """
#include <avr/io.h>
#include <stdint.h>
volatile uint8_t got[3], done;
static uint8_t spi(uint8_t byte) {
  for (uint8_t i = 0; i < 8; i++) {
    if (byte & 0x80) PORTB |= _BV(3); else PORTB &= ~_BV(3);
    byte <<= 1;
    PORTB |= _BV(5);
    if (PINB & _BV(4)) byte |= 1;
    PORTB &= ~_BV(5);
  }
  return byte;
}
int main(void) {
  PORTB = _BV(2);
  DDRB = _BV(2) | _BV(3) | _BV(5);
  PORTB &= ~_BV(2);
  for (uint8_t i = 0; i < 3; i++) got[i] = spi(0xA1 + i);
  PORTB |= _BV(2);
  done = 1;
  for (;;) {}
}
"""


class Eeprom(I2cDevice):
    address = 0x50

    def __init__(self) -> None:
        self.cells = bytearray(256)
        self.place, self.expects_place = 0, False

    def begin(self, reading: bool) -> None:
        self.expects_place = not reading

    def write(self, byte: int) -> None:
        if self.expects_place:
            self.place, self.expects_place = byte, False
        else:
            self.cells[self.place] = byte
            self.place += 1

    def read(self) -> int:
        self.place += 1
        return self.cells[self.place - 1]


class Deaf(I2cDevice):
    address = 0x52

    def write(self, byte: int) -> bool:
        return False


class Converter(SpiDevice):
    """It sends 0x5A first, then each byte turned over."""

    select: int | str = 10

    def __init__(self, mode: int = 0) -> None:
        self.mode = mode
        self.got: list[int] = []

    def begin(self) -> int:
        return 0x5A

    def transfer(self, byte: int) -> int:
        self.got.append(byte)
        return byte ^ 0xFF


def bench_of(folder: Path, source: str, *flags: str) -> Bench:
    return Bench(compiled(source, folder / "own.elf", *flags))


def value(bench: Bench, folder: Path, name: str) -> object:
    found = Symbol(bench.pins, read_variables(folder / "own.elf").find(name)).value
    return found.tolist() if isinstance(found, np.ndarray) else found


@pytest.mark.parametrize("rate", [72, 12])  # 100 and 400 kHz
def test_a_chip_on_the_two_wire_bus(tmp_path: Path, rate: int) -> None:
    with bench_of(tmp_path, TWO_WIRE, f"-DRATE={rate}") as bench:
        bus, eeprom = I2c(bench.robot), Eeprom()
        bus.add(eeprom)
        bus.add(Deaf())
        bench.run_until(100_000)
        assert value(bench, tmp_path, "done") == 1
        assert bytes(eeprom.cells[4:8]) == b"\x00\x42\x99\x00"
        assert value(bench, tmp_path, "got") == [0x42, 0x99]
        assert value(bench, tmp_path, "states") == STATES + [0] * (20 - len(STATES))


@pytest.mark.parametrize(("mode", "rate"), [(0, 0), (1, 0), (2, 0), (3, 0), (0, 2)])  # 4 MHz, 250 kHz
def test_a_chip_on_spi(tmp_path: Path, mode: int, rate: int) -> None:
    with bench_of(tmp_path, SPI, f"-DMODE={mode}", f"-DRATE={rate}") as bench:
        chip, other = Converter(mode), Converter(mode)
        other.select = 9  # stays high
        bus = Spi(bench.robot)
        bus.add(other)
        bus.add(chip)
        bench.run_until(20_000)
        assert value(bench, tmp_path, "done") == 1
        assert chip.got == [0xA1, 0xA2, 0xA3] and other.got == []
        assert value(bench, tmp_path, "got") == [0x5A, 0xA1 ^ 0xFF, 0xA2 ^ 0xFF]


def test_a_program_that_moves_the_pins_of_spi_itself(tmp_path: Path) -> None:
    with bench_of(tmp_path, BY_HAND) as bench:
        chip = Converter()
        Spi(bench.robot).add(chip)
        bench.run_until(20_000)
        assert chip.got == [0xA1, 0xA2, 0xA3]
        assert value(bench, tmp_path, "got") == [0x5A, 0xA1 ^ 0xFF, 0xA2 ^ 0xFF]


def test_what_a_chip_raises_comes_out_of_the_run(tmp_path: Path) -> None:
    class Broken(Eeprom):
        def write(self, byte: int) -> None:
            raise ZeroDivisionError

    class Large(Converter):
        def transfer(self, byte: int) -> int:
            return 256

    with bench_of(tmp_path, TWO_WIRE, "-DRATE=72") as bench:
        I2c(bench.robot).add(Broken())
        with pytest.raises(ZeroDivisionError):
            bench.run_until(100_000)
        assert bench.now < 20_000
    with bench_of(tmp_path, SPI, "-DMODE=0", "-DRATE=0") as bench:
        Spi(bench.robot).add(Large())
        with pytest.raises(CallError, match="what Large sends is 256; expected a whole number from 0 to 255"):
            bench.run_until(20_000)


def test_chips_that_cannot_be_there(tmp_path: Path) -> None:
    with bench_of(tmp_path, TWO_WIRE, "-DRATE=72") as bench:
        bus = I2c(bench.robot)
        with pytest.raises(CallError, match="the address of I2cDevice is None; expected a whole number from 8 to 119"):
            bus.add(I2cDevice())
        bus.add(Eeprom())
        with pytest.raises(CallError, match="there is a device at address 0x50 already; expected another address"):
            bus.add(Eeprom())
        nowhere = Converter()
        nowhere.select = 20
        with pytest.raises(CallError, match="select of Converter: there is no pin 20"):
            Spi(bench.robot).add(nowhere)
        with pytest.raises(CallError, match="the mode of Converter is 4; expected a whole number from 0 to 3"):
            Spi(bench.robot).add(Converter(4))


def test_boards_whose_bus_is_another_ones() -> None:
    with (
        Bench(robot="boebot") as bench,
        pytest.raises(BoardError, match=r"a chip at pins A4, A5 cannot be joined .*: another device"),
    ):
        I2c(bench.robot).add(Eeprom())
    with (
        open_uno("native", Wanted(robot="shieldbot")) as uno,
        pytest.raises(Cannot, match="the native board shows no I2C bus"),
    ):
        uno.i2c.add(Eeprom())
