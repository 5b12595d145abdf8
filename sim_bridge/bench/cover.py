"""Which lines of a program were executed, and which ways its conditional jumps went, over all runs: from what the
emulated board keeps of each word of flash (AvrBoard.cover), by the image's debugging information; as lcov's text, which
other tools read, and as a table.

A line is executed where one of its instructions was. A conditional jump is an instruction that goes on straight or
elsewhere: a branch by a flag, or a skip (AVR instruction set manual: BRBC, BRBS, CPSE, SBRC, SBRS, SBIC, SBIS). So one
`if` may have several, and a jump to the next instruction does not count. Copies of a function, and two images
with one source file, have theirs each.

Format of lcov's text: geninfo(1), "FILES".
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from boebot.errors import CallError
from boebot.image.elf import Image, read_image
from sim_bridge.bench.text_table import text_table

STRAIGHT, ELSEWHERE = 1, 2  # bits of AvrBoard.cover
CONDITIONAL = ((0xF800, 0xF000), (0xFC00, 0x1000), (0xFC08, 0xFC00), (0xFD00, 0x9900))  # mask, value: see above
TWO_WORDS = ((0xFC0F, 0x9000), (0xFE0C, 0x940C))  # LDS and STS, JMP and CALL
OFFSET = 0x03F8  # of a branch, in words

Place = tuple[str, int, int, bool]
"""Of an instruction: its source file and line, its address, whether it is a conditional jump."""


class File:
    """Of one source file: by line whether it was executed, and the ways of its conditional jumps (bits), by image and
    address."""

    def __init__(self) -> None:
        self.lines: dict[int, bool] = defaultdict(bool)
        self.jumps: dict[tuple[int, str, int], int] = {}

    def lcov(self, path: str) -> str:
        """As a record of lcov's text."""
        jumps, number, (_, hit, _, _) = [], Counter[int](), self.counts()
        for (line, *_), bits in sorted(self.jumps.items()):
            for way, bit in enumerate((STRAIGHT, ELSEWHERE)):
                jumps.append(f"BRDA:{line},{number[line]},{way},{int(bits & bit > 0) if bits else '-'}")
            number[line] += 1
        taken = sum(jump.endswith(",1") for jump in jumps)
        lines = [f"DA:{line},{int(ran)}" for line, ran in sorted(self.lines.items())]
        sums = f"BRF:{len(jumps)}", f"BRH:{taken}", f"LF:{len(lines)}", f"LH:{hit}"
        return "\n".join(("TN:", f"SF:{path}", *jumps, *sums[:2], *lines, *sums[2:], "end_of_record\n"))

    def counts(self) -> tuple[int, ...]:
        """Lines, those executed, conditional jumps, those that went both ways."""
        both = sum(bits == STRAIGHT | ELSEWHERE for bits in self.jumps.values())
        return len(self.lines), sum(self.lines.values()), len(self.jumps), both


class Coverage:
    """Over all runs, of one image or several."""

    def __init__(self) -> None:
        self._runs: dict[str, tuple[Sequence[Place], NDArray[np.uint8]]] = {}  # by image
        self.not_counted: set[str] = set()
        """Why a run is not among them, in sentences."""

    def add(self, path: Path, covered: NDArray[np.uint8]) -> None:
        """Another run: its ELF file, and what the board kept.

        Raises:
            AnalysisError: it is no ELF file of a program.
            CallError: it says nothing of source lines.
        """
        image = read_image(path)
        main = [each.address for each in image.symbols if each.name == "main"]
        if not any(address in image.sources for address in main or image.sources):  # libgcc's code has lines
            raise CallError(f"{path} says nothing of source lines; expected a program built with avr-gcc -gdwarf-4")
        places: Sequence[Place]
        places, before = self._runs.get(key := hashlib.sha256(image.code).hexdigest(), ((), covered))
        places = places or [(*image.sources[at], at, is_conditional(opcode)) for at, opcode in instructions(image)]
        self._runs[key] = (places, covered | before)

    def as_dict(self) -> dict[str, Any]:
        """What was found so far, for another process, as JSON knows it: the file of an image may have gone by then."""
        runs = {key: (places, covered.tobytes().hex()) for key, (places, covered) in self._runs.items()}
        return {"runs": runs, "not_counted": sorted(self.not_counted)}

    def merge(self, found: Mapping[str, Any]) -> None:
        """Adds what another process has found (`as_dict`)."""
        self.not_counted.update(found["not_counted"])
        for key, (places, bits) in found["runs"].items():
            covered = np.frombuffer(bytes.fromhex(bits), np.uint8)
            self._runs[key] = (places, covered | self._runs.get(key, ((), covered))[1])

    def lcov(self, root: Path) -> str:
        """Of the files below `root`, by their paths from there."""
        return "".join(file.lcov(name) for name, file in self._files(root).items() if not Path(name).is_absolute())

    def table(self, root: Path) -> str:
        """The same for people, and how much lies outside of `root`."""
        counts = {name: file.counts() for name, file in self._files(root).items()}
        outside = {name: counts.pop(name)[0] for name in [*counts] if Path(name).is_absolute()}
        counts["in all"] = tuple(sum(each[column] for each in counts.values()) for column in range(4))
        rows = [("file", "lines", "executed", "", "conditional jumps", "both ways", "")]
        for name, (lines, hit, jumps, both) in counts.items():
            rows.append((name, str(lines), str(hit), _share(hit, lines), str(jumps), str(both), _share(both, jumps)))
        missing = sorted(self.not_counted)
        if outside:
            most = max(outside, key=lambda name: outside[name])
            missing.append(f"{sum(outside.values()):,} lines outside of {root}, most of them in {most}")
        return "\n".join([text_table(rows, "<>>>>>>"), *(f"not counted: {what}" for what in missing)])

    def _files(self, root: Path) -> dict[str, File]:
        """Those below `root` by their paths from there, others by their whole paths; in the order of these."""
        files: dict[str, File] = defaultdict(File)
        for key, (places, covered) in self._runs.items():
            names = {path: _name(path, root.resolve()) for path in {path for path, *_ in places}}
            for path, line, at, is_jump in places:
                if line == 0:
                    continue
                file, bits = files[names[path]], int(covered[at // 2])
                file.lines[line] |= bits > 0
                if is_jump:
                    file.jumps[line, key, at] = bits
        return dict(sorted(files.items()))


def _name(path: str, root: Path) -> str:
    whole = Path(root, path).resolve()
    return whole.relative_to(root).as_posix() if whole.is_relative_to(root) else str(whole)


def instructions(image: Image) -> Iterator[tuple[int, int]]:
    """Address and first word of each instruction that has a source line."""
    at = 0
    while at + 1 < len(image.code):
        opcode = image.code[at] | image.code[at + 1] << 8
        if at in image.sources:
            yield at, opcode
        at += 4 if at in image.sources and _is_one_of(TWO_WORDS, opcode) else 2


def is_conditional(opcode: int) -> bool:
    """A conditional jump that can go two ways."""
    without_effect = opcode & 0xF800 == 0xF000 and opcode & OFFSET == 0
    return _is_one_of(CONDITIONAL, opcode) and not without_effect


def _is_one_of(kinds: tuple[tuple[int, int], ...], opcode: int) -> bool:
    return any(opcode & mask == value for mask, value in kinds)


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "-"
