"""The emulated ATmega328P: `create` makes a board from an ELF image.

The extension behind it contains simavr and is GPL-3.0-or-later; this module imports without it.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from boebot.errors import BoardError
from sim_bridge.boards.board import BoardAccess

ERROR_SIZE = 200


def _extension() -> Any:
    try:
        return import_module("sim_bridge.boards.avr._avr")
    except ImportError as error:
        if any(Path(__file__).parent.glob("_avr.*.so")):
            raise BoardError(f"the AVR emulator cannot be loaded: {error}") from error
        raise BoardError(
            "the AVR emulator is not built; run `make setup` in a checkout, or choose the native board (--on native)"
        ) from error


class AvrBoard:
    """An emulated Arduino Uno. `pointer` is its `board *` as an integer, valid until `close` or the end of this
    object: whoever uses the pointer keeps this object.
    """

    def __init__(self, elf: bytes, name: str) -> None:
        """Powers on a board whose flash holds the program of an ELF file; `name` is for errors."""
        extension = _extension()
        self._ffi, self._lib = extension.ffi, extension.lib
        error = self._ffi.new("char[]", ERROR_SIZE)
        self._board = self._lib.avr_board_create(elf, len(elf), error, ERROR_SIZE)
        if self._board == self._ffi.NULL:
            raise BoardError(f"the firmware image {name} cannot be loaded: {self._ffi.string(error).decode()}")

    @property
    def pointer(self) -> int:
        """The address of the board."""
        if self._board == self._ffi.NULL:
            raise BoardError("this board is closed")
        return int(self._ffi.cast("uintptr_t", self._board))

    def access(self) -> BoardAccess:
        """The board's operations, for use without a simulated world."""
        return BoardAccess(self._lib, self._ffi, self._ffi.cast("board *", self.pointer), owner=self)

    def data(self, address: int, size: int = 1) -> bytes:
        """Bytes of the data space: registers from 0, I/O registers from 0x20 as last written, RAM from 0x100."""
        if address < 0 or size < 0 or address + size > 0x900:
            raise ValueError(f"no data at 0x{address:X}..0x{address + size - 1:X}; the data space ends at 0x8FF")
        board = self._ffi.cast("board *", self.pointer)
        return bytes(self._ffi.buffer(self._lib.avr_board_data(board) + address, size))

    def close(self) -> None:
        """Frees the board."""
        if self._board != self._ffi.NULL:
            self._lib.avr_board_destroy(self._board)
            self._board = self._ffi.NULL

    def __del__(self) -> None:
        if getattr(self, "_board", None) is not None:
            self.close()


def create(elf: Path) -> AvrBoard:
    """A board, powered on, with the program of an ELF file in flash."""
    try:
        image = elf.read_bytes()
    except OSError as error:
        raise BoardError(f"the firmware image {elf} cannot be read: {error.strerror}") from error
    return AvrBoard(image, str(elf))
