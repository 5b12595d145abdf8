"""The emulated ATmega328P: `create` makes a board from an image."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot import missing
from boebot.errors import AnalysisError, BoardError
from boebot.image.program import Program, behind_bootloader, read_program
from sim_bridge.boards.board import EmulatedBoard

FLASH_WORDS = 0x4000
FUNCTION_IDS = 64  # id of the first watched function; below are vectors

SPAN = np.dtype(  # avr_span of avr_spans.h; cycles
    [
        ("begin", "<u8"),
        ("executed", "<u8"),
        ("gross", "<u4"),
        ("net", "<u4"),
        ("latency", "<u4"),
        ("id", "<u2"),
        ("depth", "<u2"),
    ]
)
EXTREMES = np.dtype(  # avr_extremes of avr_spans.h; cycles
    [(name, "<u8") for name in ("calls", "shortest", "longest", "shortest_at", "longest_at")]
)


@dataclass(frozen=True, slots=True)
class Watch:
    """What is recorded of a program.

    Attributes:
        functions: entries, in bytes, of the functions whose spans are recorded; ids are FUNCTION_IDS, FUNCTION_IDS + 1,
            ...
        patience: cycles without sleep after which the program hangs; 0: any number.
        only_extremes: of each function how often it was called, its shortest and its longest call, and no spans.
    """

    functions: Sequence[int] = ()
    patience: int = 0
    only_extremes: bool = False


class AvrBoard(EmulatedBoard):
    """An emulated Arduino Uno. `assumed`: a sentence where its program does not say for which chip it is, or ""."""

    _watched = 0  # functions that are recorded

    def __init__(self, program: Program) -> None:
        """Powers on a board with that program in flash."""
        ffi, lib = extension = missing.compiled("sim_bridge.boards.avr._avr")
        flash, eeprom = (ffi.from_buffer("uint8_t[]", part) for part in (program.flash, program.eeprom))
        loaded = (flash, eeprom, program.high_fuse, program.code_end, program.variables_end)
        board = lib.avr_board_create(ffi.new("avr_program *", loaded))
        if not board:
            raise MemoryError("emulated board")
        super().__init__(extension, board, "emulated ATmega328P", elf=program.elf, assumed=program.assumed)
        self.begin = program.begin

    def no_fast_forward(self) -> None:
        """For tests: from now on each instruction by itself, and sleep cycle by cycle. All is the same."""
        self.lib.avr_board_no_fast_forward(self.handle)

    def cover(self) -> NDArray[np.uint8]:
        """What was executed of each word of flash since the first call, which begins to keep it (avr_board.h): bit 0,
        and it went straight on; bit 1, and it went elsewhere."""
        if not (covered := self.lib.avr_board_cover(self.handle)):
            raise MemoryError("coverage of a program")
        return np.frombuffer(self.ffi.buffer(covered, FLASH_WORDS), dtype=np.uint8).copy()

    def debug(self, debugger: Callable[[int], int]) -> Any:
        """Has a debugger called from now on, within the board's run, with a number of avr_halt (avr_debug.h).

        Returns:
            The C struct avr_debug, by which it says where to stop.
        """
        self._debugger = self.ffi.callback("avr_debugger", lambda _, why: debugger(why))
        return self.lib.avr_board_debug(self.handle, self._debugger)

    def check(self, *, strict: bool) -> None:
        """Notes from now on what a bench does not show (avr_checks.h); `strict`: the first of it is a fault."""
        if not self.lib.avr_board_check(self.handle, strict):
            raise MemoryError("notes of a program")
        self.is_strict = strict

    # ---- recorder ----------------------------------------------------------------------------------------------------

    def record(self, watch: Watch) -> None:
        """Records from now on, anew if it did already: the board takes longer, and does the same.

        Raises:
            BoardError: too many functions, or one that begins at no address of flash.
        """
        entries = self.ffi.new("uint32_t[]", list(watch.functions))
        what = self.ffi.new("avr_watch *", (entries, len(watch.functions), watch.patience, watch.only_extremes))
        if not self.lib.avr_board_record(self.handle, what):
            raise BoardError(
                f"record: {len(watch.functions)} functions; expected even addresses below 0x8000, at most "
                f"{self.lib.AVR_FUNCTIONS_MAXIMUM} of them"
            )
        self._watched = len(watch.functions)

    def stop_recording(self) -> None:
        """Forgets all that was recorded; the board is as fast as before."""
        self.lib.avr_board_stop_recording(self.handle)

    def spans(self) -> NDArray[Any]:
        """Takes the spans (dtype SPAN) that have ended since the last call, in the order in which they began."""
        count = self.ffi.new("size_t *")
        spans = self.lib.avr_board_spans(self.handle, count)
        size = count[0] * SPAN.itemsize
        found = np.frombuffer(self.ffi.buffer(spans, size)[:] if size else b"", dtype=SPAN)
        self.lib.avr_board_forget_spans(self.handle)
        return found[np.argsort(found["begin"], kind="stable")]

    def extremes(self) -> NDArray[Any]:
        """Of each function of the watch, which asks for them, what was seen so far (dtype EXTREMES)."""
        found, size = self.lib.avr_board_extremes(self.handle), self._watched * EXTREMES.itemsize
        return np.frombuffer(self.ffi.buffer(found, size)[:] if found and size else b"", dtype=EXTREMES)

    @property
    def lowest_stack(self) -> int:
        """Lowest value of the stack pointer while it records."""
        return int(self.lib.avr_board_lowest_stack(self.handle))


def create(image: Path | None, bootloader: Path | None = None) -> AvrBoard:
    """A board, powered on, with the program of an ELF or HEX file in flash; behind a boot loader, if one is given, and
    then `image` may be None: only that.

    Raises:
        BoardError: a file cannot be read, or is no program for this chip.
    """
    try:
        program = None if image is None else read_program(image)
        if bootloader is not None:
            program = behind_bootloader(bootloader, program)
        assert program is not None
    except AnalysisError as refused:
        raise BoardError(str(refused)) from None
    return AvrBoard(program)
