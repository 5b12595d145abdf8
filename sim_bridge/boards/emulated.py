"""The native board, and the firmware that boards load: the native library or the AVR image of a pin map."""

from __future__ import annotations

from pathlib import Path

from boebot import missing, resources
from boebot.errors import BoardError
from boebot.files import regular
from sim_bridge.boards.board import EmulatedBoard
from sim_bridge.compiled import ffi, lib

LIBRARIES = Path(__file__).resolve().parents[1] / "images"


def native_library(pin_map: str) -> Path:
    """The firmware for this computer.

    Raises:
        BoardError: it was not built.
    """
    for suffix in (".so", ".dll", ".dylib"):
        path = LIBRARIES / f"firmware-{pin_map}{suffix}"
        if path.is_file():
            return path
    raise BoardError(f"there is no firmware for this computer for pin map {pin_map!r}; {missing.built('setup')}")


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
    wrong = missing.unloadable(library)
    board = ffi.NULL if wrong else lib.native_board_create(image, len(image), error, 512)
    if board == ffi.NULL:
        wrong = wrong or ffi.string(error).decode(errors="replace")
        way = missing.again(library) if library.parent == LIBRARIES else "expected one for this computer"
        raise BoardError(f"the firmware library {library} cannot be loaded: {wrong}; {way}")
    return EmulatedBoard((ffi, lib), board, "emulated native board")


def avr_image(pin_map: str) -> Path:
    """The image that would be flashed.

    Raises:
        BoardError: it was not built.
    """
    image = resources.folder("images") / f"{pin_map}.elf"
    if not image.is_file():
        raise BoardError(f"there is no firmware image {image.name}; {missing.built('firmware')}")
    return image


def image_file(image: str) -> Path:
    """The firmware that the user named. Raises BoardError if it is not there."""
    path = Path(image)
    if not path.is_file():
        raise BoardError(f"there is no firmware image {image}")
    return path
