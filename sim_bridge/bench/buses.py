"""Devices on the board's two-wire bus (I2C: A4 is SDA, A5 SCL) and on its SPI, written in Python: a test says what
comes when a byte is asked for, and what becomes of one that is sent. They answer at the bus's edges, within the run.

    class Eeprom(I2cDevice):
        address = 0x50

        def __init__(self) -> None:
            self.cells, self.at, self.first = bytearray(256), 0, True

        def begin(self, reading: bool) -> None:
            self.first = not reading

        def write(self, byte: int) -> bool:
            if self.first:
                self.at, self.first = byte, False
            else:
                self.cells[self.at] = byte
                self.at = (self.at + 1) % 256
            return True

        def read(self) -> int:
            self.at = (self.at + 1) % 256
            return self.cells[self.at - 1]
"""

from __future__ import annotations

from boebot.arguments import whole
from boebot.errors import CallError
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import Level, checked_pin

SDA, SCL = 18, 19  # A4, A5
MOSI, MISO, SCK = 11, 12, 13
DELAY_CYCLES = 5  # of SDA after SCL has fallen: 0.3 us (I2C-bus specification, hold time)


class I2cDevice:
    """A device on the two-wire bus, by its seven bits of address."""

    address = 0

    def begin(self, reading: bool) -> None:
        """It was addressed: to be read, or written."""

    def write(self, byte: int) -> bool:
        """It got a byte; True acknowledges it."""
        del byte
        return False

    def read(self) -> int:
        """It is to send a byte."""
        return 0xFF


class I2c:
    """The bus: both lines have pull-ups, and a device holds SDA low or lets go of it. No device stretches the clock.
    While a test has devices there, those of a robot are off the bus."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._devices: dict[int, I2cDevice] = {}
        self._on: I2cDevice | None = None  # that is spoken to
        self._sda = self._scl = True  # what the board does: True: it lets go
        self._pulls = self._addressed = self._reads = False
        self._bit = -1  # of the byte under way: 0..7, 8 is the acknowledgement; -1: none, the bus is idle
        self._byte = 0

    def add(self, device: I2cDevice) -> None:
        """Puts a device on the bus.

        Raises:
            CallError: its address is none, or another one's.
        """
        address = whole("the address of an I2C device", device.address, CallError, least=0x08, most=0x77)
        if address in self._devices:
            raise CallError(f"there is a device at address 0x{address:02x} already; expected another address")
        if not self._devices:
            for pin, react in ((SDA, self._on_sda), (SCL, self._on_scl)):
                self._bench.drive(pin, Level.HIGH)
                self._bench.on_edge(pin, react)
        self._devices[address] = device

    def _pull(self, low: bool, cycle: int) -> None:
        if low != self._pulls:
            self._pulls = low
            self._bench.drive(SDA, Level.LOW if low else Level.HIGH, cycle + DELAY_CYCLES)

    def _on_sda(self, cycle: int, level: Level) -> None:
        high = level != Level.LOW
        if high == self._sda:
            return
        self._sda = high
        if self._scl and not self._pulls:  # START, or STOP
            self._bit, self._byte, self._on, self._addressed = -1 if high else 0, 0, None, False

    def _on_scl(self, cycle: int, level: Level) -> None:
        high = level != Level.LOW
        if high == self._scl:
            return
        self._scl = high
        if self._bit < 0 or (self._addressed and self._on is None):
            return
        if high:
            self._rises()
        else:
            self._falls(cycle)

    def _rises(self) -> None:
        """SDA is read."""
        sends = self._addressed and self._reads
        if self._bit < 8 and not sends:
            self._byte = self._byte << 1 & 0xFF | self._sda
        elif self._bit == 8 and sends and self._sda and not self._pulls:
            self._on = None  # the board does not acknowledge: that was the last byte
        self._bit += 1

    def _falls(self, cycle: int) -> None:
        """The next bit is put on SDA."""
        if self._bit == 8 and not (self._addressed and self._reads):
            self._pull(self._acknowledges(), cycle)
            return
        if self._bit == 9:
            self._addressed, self._bit, self._byte = True, 0, 0
            if self._on is not None and self._reads:
                self._byte = whole("a byte of an I2C device", self._on.read(), CallError, least=0, most=255)
        sends = self._addressed and self._reads and self._bit < 8
        self._pull(sends and not self._byte >> (7 - self._bit) & 1, cycle)

    def _acknowledges(self) -> bool:
        if self._addressed:
            return self._on is not None and bool(self._on.write(self._byte))
        self._on, self._reads = self._devices.get(self._byte >> 1), bool(self._byte & 1)
        if self._on is not None:
            self._on.begin(self._reads)
        return self._on is not None


class SpiDevice:
    """A device on the SPI that listens while its `select` pin is low. Modes 0 and 3: bits are read as SCK rises, and
    set up as it falls; the most significant one comes first."""

    select = 10

    def begin(self) -> int:
        """It is selected; returns the byte that leaves with the first one that comes."""
        return 0xFF

    def transfer(self, byte: int) -> int:
        """It got a byte; returns the one that leaves with the next."""
        del byte
        return 0xFF


class Spi:
    """The bus, and the devices on it."""

    def __init__(self, bench: Bench) -> None:
        self._bench = bench

    def add(self, device: SpiDevice) -> None:
        """Puts a device on the bus. Raises BoardError where its `select` is no pin."""
        select = checked_pin("the select of an SPI device", device.select)
        of = _Selected(self._bench, device)
        for pin, react in ((select, of.on_select), (MOSI, of.on_mosi), (SCK, of.on_clock)):
            self._bench.on_edge(pin, react)


class _Selected:
    """A device with the byte under way."""

    def __init__(self, bench: Bench, device: SpiDevice) -> None:
        self._bench, self._device = bench, device
        self._on = self._mosi = False
        self._bits = self._in = self._out = 0

    def _put(self, cycle: int) -> None:
        self._bench.drive(MISO, Level.HIGH if self._out & 0x80 else Level.LOW, cycle)

    def _take(self, byte: int) -> None:
        self._out = whole("a byte of an SPI device", byte, CallError, least=0, most=255)

    def on_select(self, cycle: int, level: Level) -> None:
        """It is selected, or no more."""
        if self._on == (level == Level.LOW):
            return
        self._on, self._bits = not self._on, 0
        if self._on:
            self._take(self._device.begin())
            self._put(cycle)
        else:
            self._bench.drive(MISO, Level.RELEASED, cycle)

    def on_mosi(self, cycle: int, level: Level) -> None:
        """What the board says."""
        del cycle
        self._mosi = level != Level.LOW

    def on_clock(self, cycle: int, level: Level) -> None:
        """A bit."""
        if not self._on:
            return
        if level != Level.LOW:
            self._in = self._in << 1 & 0xFF | self._mosi
            self._bits += 1
            return
        if self._bits == 8:
            self._take(self._device.transfer(self._in))
            self._bits = 0
        elif self._bits:
            self._out = self._out << 1 & 0xFF
        self._put(cycle)
