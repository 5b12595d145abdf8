"""The calibration program written into a board by avrdude itself: over a pseudo-terminal, into what answers as the
bootloader of the Uno does (Atmel, application note AVR061, "STK500 Communication Protocol").

The emulated board itself is started with its image in flash and has no bootloader; so the far end is this one.
"""

from __future__ import annotations

import os
import select
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from boebot.errors import BoardError
from hil_tests.calibration import board
from hil_tests.calibration.program import flash_hex

pytestmark = pytest.mark.emulated

IN_SYNC, OK, END = b"\x14", b"\x10", 0x20
SIGNATURE = b"\x1e\x95\x0f"  # of the ATmega328P (data sheet, table 28-4)
PROGRAM_PAGE, READ_PAGE = 0x64, 0x74
# Bytes behind each command, the end of packet not counted.
LENGTHS = {0x30: 0, 0x41: 1, 0x42: 20, 0x45: 5, 0x50: 0, 0x51: 0, 0x55: 2, 0x56: 4, 0x75: 0, READ_PAGE: 3}
FLASH = 0x8000


class Bootloader:
    """Answers on a descriptor until it is stopped; `flash` is what was written."""

    def __init__(self, descriptor: int, signature: bytes = SIGNATURE) -> None:
        self.flash = bytearray(b"\xff" * FLASH)
        self.stopped = threading.Event()
        self._descriptor, self._signature = descriptor, signature
        self._address = 0  # in words

    def serve(self) -> None:
        """Command after command."""
        while (command := self._read(1)) != b"":
            code = command[0]
            if code == PROGRAM_PAGE:
                size = int.from_bytes(self._read(2), "big")
                self._answer(self._write(self._read(1 + size)[1:]))
            elif code in LENGTHS:
                self._answer(self._done(code, self._read(LENGTHS[code])))

    def _done(self, code: int, argument: bytes) -> bytes:
        if code == 0x55:
            self._address = int.from_bytes(argument, "little")
        if code == READ_PAGE:
            return bytes(self.flash[2 * self._address : 2 * self._address + int.from_bytes(argument[:2], "big")])
        return {0x41: b"\x03", 0x56: b"\x00", 0x75: self._signature}.get(code, b"")

    def _write(self, page: bytes) -> bytes:
        self.flash[2 * self._address : 2 * self._address + len(page)] = page
        return b""

    def _answer(self, data: bytes) -> None:
        end = self._read(1)
        if end and end[0] == END:
            os.write(self._descriptor, IN_SYNC + data + OK)

    def _read(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            if self.stopped.is_set():
                return b""
            if select.select([self._descriptor], [], [], 0.05)[0]:
                data += os.read(self._descriptor, count - len(data))
        return data


@contextmanager
def bootloader(signature: bytes = SIGNATURE) -> Iterator[tuple[str, Bootloader]]:
    """The port of one, and it."""
    master, slave = os.openpty()
    tty.setraw(slave)
    loader = Bootloader(master, signature)
    thread = threading.Thread(target=loader.serve)
    thread.start()
    try:
        yield os.ttyname(slave), loader
    finally:
        loader.stopped.set()
        thread.join()
        os.close(slave)
        os.close(master)


def written(text: str) -> bytes:
    """The flash after an Intel hex file (Intel, "Hexadecimal Object File Format Specification", 1988)."""
    flash = bytearray(b"\xff" * FLASH)
    for line in text.splitlines():
        record = bytes.fromhex(line[1:])
        assert sum(record) % 256 == 0, "its checksum"
        if record[3] == 0:
            start = int.from_bytes(record[1:3], "big")
            flash[start : start + record[0]] = record[4 : 4 + record[0]]
    return bytes(flash)


def test_avrdude_writes_the_program() -> None:
    with bootloader() as (port, loader):
        board.flash(port)
    expected = written(flash_hex())
    assert expected != b"\xff" * FLASH
    assert bytes(loader.flash) == expected


def test_another_chip_is_not_written() -> None:
    with bootloader(b"\x1e\x98\x01") as (port, loader), pytest.raises(BoardError, match=f"could not flash .* {port}"):
        board.flash(port)  # an ATmega2560
    assert bytes(loader.flash) == b"\xff" * FLASH
