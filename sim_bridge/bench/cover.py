"""Which lines of a program were executed, and which ways its conditional jumps went, over all runs: from what the
emulated board keeps of each word of flash (AvrBoard.cover), by the image's debugging information; as lcov's text, which
other tools read, and as a table.

A line is executed where one of its instructions was. A conditional jump is an instruction that goes on straight or
elsewhere: a branch by a flag, or a skip (AVR instruction set manual: BRBC, BRBS, CPSE, SBRC, SBRS, SBIC, SBIS). So one
`if` may have several, and one without an effect, to the next instruction, is none. Copies of a function, and two images
with one source file, have theirs each.

Format of lcov's text: geninfo(1), "FILES".
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from boebot.errors import CallError
from boebot.image.elf import Image, read_image
from sim_bridge.bench.text_table import text_table

STRAIGHT, ELSEWHERE = 1, 2  # bits of AvrBoard.cover
CONDITIONAL = ((0xF800, 0xF000), (0xFC00, 0x1000), (0xFC08, 0xFC00), (0xFD00, 0x9900))  # mask, value: see above
TWO_WORDS = ((0xFC0F, 0x9000), (0xFE0C, 0x940C))  # LDS and STS, JMP and CALL
OFFSET = 0x03F8  # of a branch, in words


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
        self._runs: dict[str, tuple[Image, NDArray[np.uint8]]] = {}

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
        key = hashlib.sha256(image.code).hexdigest()
        before = self._runs.get(key)
        self._runs[key] = (image, covered if before is None else covered | before[1])

    def as_dict(self) -> dict[str, str]:
        """What was found so far, for another process, as JSON knows it: the bits of each image, by its path."""
        return {str(Path(image.path).resolve()): covered.tobytes().hex() for image, covered in self._runs.values()}

    def merge(self, found: Mapping[str, str]) -> None:
        """Takes what another process has found (`as_dict`). Raises as `add`."""
        for path, covered in found.items():
            self.add(Path(path), np.frombuffer(bytes.fromhex(covered), np.uint8))

    def lcov(self, root: Path, *, everything: bool = False) -> str:
        """Of the files below `root`, by their paths from there; `everything`: of others, too, by whole paths."""
        return "".join(file.lcov(name) for name, file in self._files(root, everything).items())

    def table(self, root: Path, *, everything: bool = False) -> str:
        """The same for people."""
        counts = {name: file.counts() for name, file in self._files(root, everything).items()}
        counts["in all"] = tuple(sum(each[column] for each in counts.values()) for column in range(4))
        rows = [("file", "lines", "executed", "", "conditional jumps", "both ways", "")]
        for name, (lines, hit, jumps, both) in counts.items():
            rows.append((name, str(lines), str(hit), _share(hit, lines), str(jumps), str(both), _share(both, jumps)))
        return text_table(rows, "<>>>>>>")

    def _files(self, root: Path, everything: bool) -> dict[str, File]:
        """By their names, in the order of these."""
        files: dict[str, File] = defaultdict(File)
        for key, (image, covered) in self._runs.items():
            names = {path: _name(path, root.resolve(), everything) for path, _ in {*image.sources.values()}}
            for at, opcode in instructions(image):
                (path, line), bits = image.sources[at], int(covered[at // 2])
                if (name := names[path]) is None or line == 0:
                    continue
                files[name].lines[line] |= bits > 0
                if is_conditional(opcode):
                    files[name].jumps[line, key, at] = bits
        return dict(sorted(files.items()))


def _name(path: str, root: Path, everything: bool) -> str | None:
    """Of a source file: from the root, or whole; None: it is left out."""
    whole = Path(root, path).resolve()
    return whole.relative_to(root).as_posix() if whole.is_relative_to(root) else path if everything else None


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
