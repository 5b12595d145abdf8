"""How long functions of a program take: the shortest and the longest call that were seen, in cycles and exact, beside
the most that a call can take, as far as a package is installed that works it out from the machine code (entry points of
the group `boebot.bounds`); and a baseline, the file with what they took before.

A call lasts from the function's first instruction to the end of its return, what it calls included, interrupts that
came in between not. A call that a reset cuts short, or that has not returned yet, does not count; one that `longjmp`
leaves ends there.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import msgspec

from boebot.errors import BoardError, CallError, did_you_mean
from boebot.guests import BOUNDS, guests
from boebot.image.elf import Symbol, read_image
from boebot.image.places import is_of
from boebot.record.run_folder import write_whole
from sim_bridge.bench.text_table import text_table
from sim_bridge.boards.avr import AvrBoard, Watch
from sim_bridge.boards.board import CLOCK_HZ

PARTS = (".part.", ".cold")  # in the names of what the compiler took out of a function


@dataclass(frozen=True, slots=True)
class FunctionCycles:
    """What was seen of a function. `shortest_at`, `longest_at`: the board's cycle at which the first such call began.
    `bound`: cycles of a call at most; None: there is none, and `why`."""

    name: str
    calls: int
    shortest: int
    longest: int
    shortest_at: int
    longest_at: int
    bound: int | None
    why: str


class Cycles:
    """Of functions of the program on an emulated board."""

    def __init__(self, board: AvrBoard, image: Path, functions: Iterable[str]) -> None:
        """Records from now on; what the board's recorder had is gone. `image`: the ELF file of its program.

        Raises:
            AnalysisError: it cannot be read.
            CallError: it has no symbols, no such function, or copies or parts of it.
            BoardError: too many functions.
        """
        self._board, self._image = board, image
        labels = [each for each in read_image(image).symbols if each.kind != "STT_OBJECT"]
        if not labels:
            raise CallError(f"{image.name} has no symbols; expected an ELF file that is not stripped")
        self._entries = {name: self._entry(labels, name) for name in functions}
        board.record(Watch([*self._entries.values()], only_extremes=True))

    def _entry(self, labels: Iterable[Symbol], name: str) -> int:
        """Where a function begins."""
        found = {each.address: each.name for each in labels if is_of(each.name, name)}
        if len(found) == 1 and not any(part in each for each in found.values() for part in PARTS):
            return next(iter(found))
        has = f"has {name} as {', '.join(sorted(found.values()))}" if found else f"has no function {name}"
        hint = did_you_mean(name, [each.name for each in labels])
        expected = "expected one that the compiler keeps whole and apart: __attribute__((noinline))"
        raise CallError(f"{self._image.name} {has}; {expected}{hint}")

    def __getitem__(self, name: str) -> FunctionCycles:
        """What was seen so far.

        Raises:
            CallError: that function is not recorded.
            BoardError: no call of it has ended.
        """
        if (found := {each.name: each for each in self.seen()}.get(name)) is None:
            raise CallError(f"cycles of {name} are not recorded; expected cycles=({name!r},) in the mark of the test")
        if not found.calls:
            now = self._board.handle.op.now(self._board.handle)
            raise BoardError(
                f"no call of {name} has ended by {now / CLOCK_HZ:.6f} s; expected one (the compiler may have put its "
                "code into its callers: __attribute__((noinline)))"
            )
        return found

    def seen(self) -> list[FunctionCycles]:
        """Of all functions, in their order; where no call has ended `calls` is 0, and its other figures are none."""
        found = []
        for (name, entry), numbers in zip(self._entries.items(), self._board.extremes().tolist(), strict=True):
            bound = self._bounds[entry]
            whether = (bound, "") if isinstance(bound, int) else (None, bound)
            found.append(FunctionCycles(name, *numbers, *whether))
        return found

    @cached_property
    def _bounds(self) -> Mapping[int, int | str]:
        entries = [*self._entries.values()]
        for guest in guests(BOUNDS).values():
            bounds: Mapping[int, int | str] = guest.load()(self._image, entries)
            return bounds
        return dict.fromkeys(entries, "no package is installed that works bounds out")


def table_of(seen: Mapping[str, Sequence[FunctionCycles]]) -> str:
    """For people: what was seen of functions in each test; cycles of 1/16 us."""
    rows: list[tuple[str, ...]] = [("function", "calls", "shortest", "longest", "bound", "test")]
    for test, functions in seen.items():
        for each in functions:
            shortest, longest = (each.shortest, each.longest) if each.calls else (None, None)
            figures = (each.calls, shortest, longest, each.bound)
            rows.append((each.name, *("-" if figure is None else f"{figure:,}" for figure in figures), test))
    return text_table(rows, "<>>>><")


class Baseline:
    """A file with what functions took, by test: `{"cycles": {test: {function: [shortest, longest]}}}`."""

    def __init__(self, path: Path, *, updates: bool = False) -> None:
        """`updates`: it will be written, and need not be there yet; nothing is compared with it.

        Raises:
            CallError: there is none, it is none of these, or its folder cannot be written to.
        """
        self.path, self.updates = path, updates
        try:
            text = '{"cycles": {}}' if updates and not path.exists() else path.read_text(encoding="utf-8")
            self._tests = msgspec.json.decode(text, type=_File).cycles
        except (OSError, ValueError, msgspec.MsgspecError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            raise CallError(
                f"{path} is no baseline of cycles: {reason}; expected a file as an update writes it"
            ) from None
        if updates and not os.access(path.parent, os.W_OK):
            raise CallError(f"the folder {path.parent} cannot be written to; expected it, for {path.name}")

    def functions(self, test: str) -> list[str]:
        """Those with which a test is compared."""
        return [] if self.updates else sorted(self._tests.get(test, {}))

    def changes(self, test: str, seen: Iterable[FunctionCycles]) -> list[str]:
        """What is other than in the file, a sentence for each."""
        before, rows, found = self._tests.get(test, {}), _rows(seen), list[str]()
        for name in () if self.updates else sorted({*before, *rows}):
            old, new = before.get(name), rows.get(name)
            if old is None:
                found.append(f"{name} took {_span(new)}, and is not in {self.path}")
            elif new is None:
                found.append(f"no call of {name} has ended; in {self.path} it took {_span(old)}")
            elif old != new:
                found.append(f"{name} took {_span(new)}; in {self.path} {_span(old)}")
        return found

    def put(self, test: str, seen: Iterable[FunctionCycles]) -> None:
        """Takes what a test saw in place of what the file says of it."""
        self._tests[test] = dict(sorted(_rows(seen).items()))

    def write(self) -> None:
        """Raises BoebotError where the folder cannot be written to."""
        text = json.dumps({"cycles": dict(sorted(self._tests.items()))}, indent=1) + "\n"
        write_whole(self.path, lambda part: part.write_text(text, encoding="utf-8"), "the baseline")


class _File(msgspec.Struct):
    cycles: dict[str, dict[str, tuple[int, int]]]


def _rows(seen: Iterable[FunctionCycles]) -> dict[str, tuple[int, int]]:
    """Shortest and longest call by function, in cycles."""
    return {each.name: (each.shortest, each.longest) for each in seen if each.calls}


def _span(row: tuple[int, int] | None) -> str:
    shortest, longest = row or (0, 0)
    return f"{shortest:,} cycles" if shortest == longest else f"{shortest:,} to {longest:,} cycles"
