"""Emulated boards by kind, and the firmware that they load: the native library or the AVR image of a pin map."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Any

from boebot import resources
from boebot.errors import BoardError
from boebot.files import regular
from sim_bridge._core import ffi, lib
from sim_bridge.boards.board import fault_of


class EmulatedBoard:
    """A board by its address, and whatever must live as long as it does."""

    def __init__(
        self,
        address: int,
        description: str,
        release: Callable[[], None],
        keep: Any = None,
        elf: Path | None = None,
        assumed: str = "",
    ) -> None:
        """`release` frees the board; `elf` is the file that says where in the source an address comes from, `assumed`
        what it does not say and was assumed.
        """
        self._address = address
        self.description = description
        self.elf = elf
        self.assumed = assumed
        self._release: Callable[[], None] | None = release
        self._free = weakref.finalize(self, release)  # for one that is dropped; at the exit its world may still hold it
        self._free.atexit = False
        self._keep = keep
        self.is_in_use: Callable[[], bool] = _in_no_simulation
        """whether a simulation runs it"""

    @property
    def address(self) -> int:
        """Of the board in C.

        Raises:
            BoardError: it is closed.
        """
        if self._release is None:
            raise BoardError(f"the {self.description} is closed; expected one that is open")
        return self._address

    def fault(self) -> str:
        """What is wrong after a crash, with function and line where they are known."""
        return fault_of(lib, ffi, ffi.cast("board *", self.address), self.elf) or "unknown fault"

    def close(self) -> None:
        """Frees the board. May be called twice.

        Raises:
            BoardError: a simulation runs it.
        """
        if self.is_in_use():
            raise BoardError(f"the {self.description} is in a simulation; expected Sim.close()")
        self._release = None
        self._free()


def _in_no_simulation() -> bool:
    return False


def native_library(pin_map: str) -> Path:
    """The firmware for this computer.

    Raises:
        BoardError: it was not built.
    """
    folder = Path(__file__).resolve().parents[1] / "images"
    for suffix in (".so", ".dll"):
        path = folder / f"firmware-{pin_map}{suffix}"
        if path.is_file():
            return path
    raise BoardError(f"there is no firmware for this computer for pin map {pin_map!r}; {resources.remedy('setup')}")


def native_board(library: Path) -> EmulatedBoard:
    """A native board that runs that firmware library.

    Raises:
        BoardError: it is no firmware library.
    """
    error = ffi.new("char[]", 512)
    try:
        image = regular(library).read_bytes()
    except OSError as refused:
        raise BoardError(f"the firmware library {library} cannot be read: {refused.strerror}") from None
    board = lib.native_board_create(image, len(image), error, 512)
    if board == ffi.NULL:
        raise BoardError(f"{library.name}: {ffi.string(error).decode(errors='replace')}")
    address = int(ffi.cast("uintptr_t", board))
    return EmulatedBoard(
        address,
        "emulated native board",
        lambda: lib.board_free(board),
    )


def avr_board(image: Path) -> EmulatedBoard:
    """An emulated ATmega328P that runs that ELF file.

    Raises:
        BoardError: the emulator is not installed, or the file is no such image.
    """
    from sim_bridge.boards import avr

    board = avr.create(image)
    return EmulatedBoard(
        board.pointer,
        "emulated ATmega328P",
        board.close,
        keep=board,
        elf=image,
        assumed=board.assumed_chip,
    )


def avr_image(pin_map: str) -> Path:
    """The image that would be flashed.

    Raises:
        BoardError: it was not built.
    """
    image = resources.folder("images") / f"{pin_map}.elf"
    if not image.is_file():
        raise BoardError(f"there is no firmware image {image.name}; {resources.remedy('firmware')}")
    return image


def image_file(image: str) -> Path:
    """The firmware that the user named. Raises BoardError if it is not there."""
    path = Path(image)
    if not path.is_file():
        raise BoardError(f"there is no firmware image {image}")
    return path
