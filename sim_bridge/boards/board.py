"""Emulated boards as Python has them: reactions to their edges, what they remember, places in their programs."""

from __future__ import annotations

import weakref
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Sequence
from enum import IntEnum
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import whole
from boebot.boards import WatchdogReset
from boebot.errors import BoardError

CLOCK_HZ = 16_000_000
PINS = 20  # Arduino numbers 0..19, BOARD_PIN_COUNT of board.h
DATA_SIZE = 0x900
EEPROM_SIZE = 1024

EDGE = np.dtype(  # board_edge of board.h
    {"names": ["cycle", "pin", "level"], "formats": ["<u8", "u1", "u1"], "offsets": [0, 8, 9], "itemsize": 16}
)
FRAME = np.dtype(  # board_frame of board.h
    {
        "names": ["start", "bit_time", "bits", "byte"],
        "formats": ["<u8", "<u8", "u1", "u1"],
        "offsets": [0, 8, 16, 17],
        "itemsize": 24,
    }
)
FRACTION = 1 << 16  # of a cycle, in frames


class Level(IntEnum):
    """What the firmware does to a pin; the first three are also what the outside can do to it."""

    LOW = 0
    HIGH = 1
    RELEASED = 2
    PULLED_UP = 3


LEVELS = tuple(Level)


class ResetCause(IntEnum):
    """Why the microcontroller is reset."""

    POWER = 0
    EXTERNAL = 1
    BROWN_OUT = 2
    WATCHDOG = 3


class Damage(IntEnum):
    """What a cell of the EEPROM holds after the supply failed while it was being written."""

    ERASED = 0
    OLD = 1
    NEW = 2
    GARBAGE = 3


class Edge(NamedTuple):
    """The firmware changed what it does to a pin."""

    cycle: int
    pin: int
    level: Level


class Closes(Protocol):
    """What can be closed."""

    def close(self) -> None:
        """May be called twice."""


Reaction = Callable[[int, Level], object]
"""To an edge: its cycle, and what the firmware does to the pin from then on."""


class EmulatedBoard:
    """A board in C (boards/board.h). It is freed when nobody holds it any more, or by `close`.

    Attributes:
        ffi, lib: of the extension that made it.
        description: what kind of board it is.
        begin: where a reset leads in its flash (bytes).
        elf: the file that says where in the source an address comes from.
        assumed: what that file does not say and was assumed.
        is_in_use: whether a simulation runs it.
        debugger: what is closed before it.
        ended: why a debugger or a reaction has ended its run.
        reacts_at: cycle of the edge to which something reacts just now.
        called_by_c: what else C calls within a run, and so has to live as long.
        is_strict: what a bench does not show of a program ends its run.
        stood_still_s: how long the program has stood still in a debugger, by the wall clock.
    """

    begin = 0

    def __init__(
        self, extension: Any, board: Any, description: str, *, elf: Path | None = None, assumed: str = ""
    ) -> None:
        """`board`: a C `board *` of that extension (`ffi`, `lib`)."""
        self.ffi, self.lib = extension
        self._board = board
        self.description, self.elf, self.assumed = description, elf, assumed
        self._free = weakref.finalize(self, board.op.destroy, board)
        self._free.atexit = False  # its world may still hold it
        self.is_in_use: Callable[[], bool] = lambda: False
        self.debugger: Closes | None = None
        self.ended: BaseException | None = None
        self.reacts_at: int | None = None
        self._reactions: dict[int, list[Reaction]] = {}
        self._in_c: Any = None  # what C calls at an edge
        self.called_by_c: list[Any] = []
        self.is_strict = False
        self.stood_still_s = 0.0

    @property
    def handle(self) -> Any:
        """The board in C.

        Raises:
            BoardError: it is closed.
        """
        if not self._free.alive:
            raise BoardError(f"the {self.description} is closed; expected one that is open")
        return self._board

    @property
    def is_closed(self) -> bool:
        """It was freed."""
        return not self._free.alive

    @property
    def address(self) -> int:
        """Of the board in C; raises as `handle`."""
        return int(self.ffi.cast("uintptr_t", self.handle))

    def extension(self, name: str, kind: str) -> Any:
        """What only some kinds of boards offer, by its name in board.h, as a pointer to that C type; None: not this
        one."""
        found = self.handle.op.extension(self.handle, name.encode())
        return self.ffi.cast(f"{kind} *", found) if found else None

    def fault(self) -> str | None:
        """What is wrong after a crash, with function and line where they are known, or None."""
        text = self.handle.op.fault(self.handle)
        if not text:
            return None
        data, at = self.extension("data", "uint8_t"), self.extension("fault address", "uint32_t")
        z = 0 if data is None else data[30] | data[31] << 8
        return with_place(self.ffi.string(text).decode(), self.elf, -1 if at is None else at[0], z)

    # ---- at its edges ------------------------------------------------------------------------------------------------

    def on_edge(self, pin: int, react: Reaction) -> None:
        """From now on `react(cycle, level)` is called at each edge of what the firmware does to a pin, within the run
        and at its cycle: what it drives or sends comes when it says, however the run is cut. It cannot let time pass.
        What it raises ends the run, and is raised by the call that runs the board."""
        board = self.handle
        self._reactions.setdefault(checked_pin("on_edge", pin), []).append(react)
        if self._in_c is None:
            self._in_c = self.ffi.callback("board_reaction", self._react, error=1, onerror=self.failed)
            board.react = self._in_c
        board.reacts |= 1 << pin

    def _react(self, _: Any, cycle: int, pin: int, level: int) -> int:
        if self.ended is not None:
            return 1
        self.reacts_at = cycle
        for react in self._reactions[pin]:
            react(cycle, LEVELS[level])
        self.reacts_at = None
        return 0

    def failed(self, _: object, error: BaseException, trace: TracebackType) -> None:
        """What C has called, from within the run, has raised: the run ends."""
        self.reacts_at, self.ended, self.handle.paused = None, error.with_traceback(trace), True

    def stop_at(self, pins: Collection[int]) -> None:
        """From now on an edge of one of these pins ends a run, behind the instruction in which it happens."""
        self.handle.stops = sum(1 << checked_pin("stop_at", pin) for pin in set(pins))

    def raise_ended(self) -> None:
        """Raises why a debugger or a reaction has ended its run, if one has: once."""
        ended, self.ended = self.ended, None
        if ended is not None:
            raise ended

    def close(self) -> None:
        """Frees the board. May be called twice.

        Raises:
            BoardError: a simulation runs it.
        """
        if self.is_in_use():
            raise BoardError(f"the {self.description} is in a simulation; expected Sim.close()")
        if self.debugger is not None:
            self.debugger.close()
        self._free()


class BoardMemory(ABC):
    """What lies inside a board: the data space of an AVR, the EEPROM of every kind of microcontroller, the log of its
    watchdog."""

    @property
    @abstractmethod
    def board(self) -> EmulatedBoard:
        """Whose memory it is.

        Raises:
            BoardError: there is no board any more.
        """

    def output(self, pin: int) -> Level:
        """What the firmware does to a pin now."""
        board = self.board.handle
        return Level(board.op.output(board, checked_pin("output", pin)))

    def counters(self) -> dict[str, int]:
        """What the board counted since power-on."""
        board, out = self.board.handle, self.board.ffi.new("board_counters *")
        board.op.counters(board, out)
        return {name: int(getattr(out, name)) for name, _ in self.board.ffi.typeof(out[0]).fields}

    def _data(self, address: int, count: int) -> Any:
        board = self.board
        check_range("data", address, count, DATA_SIZE)
        data = board.extension("data", "uint8_t")
        if data is None:
            raise BoardError("this kind of board has no data memory to look into; only the emulated ATmega328P has")
        return board.ffi.buffer(data + address, count)

    def read_memory(self, address: int, count: int) -> bytes:
        """Bytes of the data space: registers from 0, I/O registers from 0x20 as last written, RAM from 0x100.

        Raises:
            BoardError: this kind of board has none.
        """
        return bytes(self._data(address, count))

    def write_memory(self, address: int, data: bytes | Iterable[int]) -> None:
        """Puts bytes into the data space; an I/O register does not notice.

        Raises:
            BoardError: this kind of board has none.
        """
        data = bytes(data)
        self._data(address, len(data))[:] = data

    def _eeprom(self) -> Any:
        eeprom = self.board.extension("eeprom", "board_eeprom")
        if eeprom is None:
            raise BoardError("this kind of board has no EEPROM")
        return eeprom

    def read_eeprom(self) -> bytes:
        """The whole EEPROM; a cell changes when its write is complete."""
        return bytes(self.board.ffi.buffer(self._eeprom().bytes, EEPROM_SIZE))

    def write_eeprom(self, address: int, data: bytes | Iterable[int]) -> None:
        """Puts bytes into the EEPROM at once."""
        data = bytes(data)
        check_range("EEPROM", address, len(data), EEPROM_SIZE)
        self.board.ffi.buffer(self._eeprom().bytes + address, len(data))[:] = data

    def eeprom_damage(self, damage: Damage, garbage: int = 0x5A) -> None:
        """What becomes of a cell whose write is cut short by a power-on or brown-out reset; `garbage`: for GARBAGE."""
        eeprom = self._eeprom()
        garbage = whole("eeprom_damage: garbage", garbage, BoardError, least=0, most=255)
        eeprom.damage, eeprom.garbage = int(damage), garbage

    def watchdog_log(self) -> list[tuple[int, int]]:
        """Cycle and address (bytes) at which its watchdog found the program, for each of its resets since power-on,
        oldest first (board.h); empty where the board has no watchdog, and of resets in its name from outside."""
        log = self.board.extension("watchdog log", "board_watchdog_log")
        if log is None:
            return []
        return [(int(log.resets[i].cycle), int(log.resets[i].address)) for i in range(log.end)]

    def levels(self) -> bytes:
        """Of each pin the level, 0 or 1, as the program would read it; empty of a board that cannot be seen into."""
        found = self.board.extension("pin levels", "uint8_t")
        return b"" if found is None else bytes(self.board.ffi.buffer(found, PINS))

    def log_outside(self) -> None:
        """From now on what the outside does to the pins, and what is on the line, is kept for `outside_log`."""
        if (log := self.board.extension("outside log", "board_outside_log")) is not None:
            log.on = True

    def outside_log(self) -> dict[str, NDArray[Any]]:
        """What the outside has done since the last call: `driven`, edges of pins (dtype EDGE); `to_board` and
        `from_board`, frames on the line (dtype FRAME). Empty of a board that cannot be seen into."""
        log, found = self.board.extension("outside log", "board_outside_log"), {}
        for name, dtype in () if log is None else (("driven", EDGE), ("to_board", FRAME), ("from_board", FRAME)):
            one = getattr(log, name)
            rows = self.board.ffi.buffer(one.items + one.first, (one.end - one.first) * dtype.itemsize)[:]
            found[name] = np.frombuffer(rows, dtype)
            one.first = one.end
        return found

    def notes(self, since: int = 0) -> list[tuple[int, int, str, str]]:
        """Cycle, address (bytes), what the program did there and why that is not what it seems (board.h): each once,
        oldest first, without the first `since`; empty of a board that cannot be seen into."""
        log, text = self.board.extension("notes", "board_notes"), self.board.ffi.string
        if log is None:
            return []
        found = (log.notes[i] for i in range(since, log.count))
        words = ((note, *(text(part).decode() for part in (note.does, note.what, note.why))) for note in found)
        return [(note.cycle, note.address, f"{does} {what}", why) for note, does, what, why in words]


def checked_pin(what: str, pin: object) -> int:
    """An Arduino number, else raises BoardError; `what` names who asks."""
    return whole(f"{what}: the pin", pin, BoardError, least=0, most=PINS - 1)


def check_range(what: str, address: int, count: int, size: int) -> None:
    """Raises ValueError where those are no addresses of a memory of that size."""
    if address < 0 or count < 0 or address + count > size:
        raise ValueError(f"no {what} at 0x{address:X}..0x{address + count - 1:X}; the last address is 0x{size - 1:X}")


# ---- places in the program: its ELF file is read only where something went wrong ------------------------------------

PROLOGUE = "__prologue_saves__"  # of libgcc, without source lines: -mcall-prologues


def places(elf: Path | None, addresses: Iterable[int]) -> dict[int, str]:
    """Function and source line of each address; empty where there is no file that can be read."""
    if elf is None:
        return {}
    from boebot.errors import AnalysisError
    from boebot.image.elf import read_image
    from boebot.image.places import place

    try:
        image = read_image(elf)
    except AnalysisError:
        return {}
    return {address: place(image, address) for address in addresses}


def with_place(fault: str, elf: Path | None, address: int, z: int = 0) -> str:
    """What went wrong, with the place of that address behind it, by the image's file; without where there is none.

    `z`: the register Z then, by which a function says where it goes on to the code that saves registers for all.
    """
    if address < 0:
        return fault
    found = places(elf, (address, 2 * z))
    where = found.get(address, "")
    if where == f"in {PROLOGUE}" and (caller := found[2 * z]):
        where += f" of {caller.removeprefix('in ')}"
    return f"{fault} {where}".rstrip()


def note_sentences(notes: Sequence[tuple[int, int, str, str]], elf: Path | None) -> list[str]:
    """For people: the notes of a board (`BoardMemory.notes`), with places by the image's file."""
    found = places(elf, [address for _, address, _, _ in notes]) if notes else {}
    return [
        f"the program {does} at address 0x{address:04X} in cycle {cycle} {found.get(address, '')}".rstrip() + f": {why}"
        for cycle, address, does, why in notes
    ]


def watchdog_resets(log: Sequence[tuple[int, int]], elf: Path | None) -> list[WatchdogReset]:
    """What the log of a board's watchdog says (`BoardMemory.watchdog_log`), with places by the image's file."""
    found = places(elf, [address for _, address in log]) if log else {}
    return [
        WatchdogReset(cycle=cycle, time_s=cycle / CLOCK_HZ, address=address, place=found.get(address, ""))
        for cycle, address in log
    ]
