"""Repeats a simulated run from its record, and compares the two, row by row and bit for bit."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any, cast

from boebot.arenas import load_arena
from boebot.boards import is_live
from boebot.brain import Brain
from boebot.brain.composition import composed
from boebot.brains import PROGRAMS
from boebot.errors import BoebotError, as_utf8
from boebot.record.blocks import Row
from boebot.record.interventions import interventions
from boebot.record.reading import CutError, attachments_of
from boebot.record.recording import BEGIN
from boebot.record.run import Run, why
from boebot.result import RunResult, read_run
from boebot.running.hands import Repeated
from boebot.running.loop import Progress, execute
from boebot.running.replayed import EXPECTED
from boebot.running.sources import arena_file, brain_files, write_copies
from boebot.running.tasks import AS_ASKED, Member, Request

BEYOND_S = 1.0  # by which the repetition of a record that is cut is longer than it
_OUTSIDE = ("inputs", "line_in", "line_out")  # streams that records of before do not have
_OTHER_CLOCKS = ("to_board", "to_host", "event", "truth", "pins", *_OUTSIDE, "waits", "shifts")
"""Streams whose times are of the transport's clock, or near it."""


@dataclass(frozen=True)
class RowDifference:
    """Where the records of two runs differ first."""

    stream: str
    time: float
    """of the run, in s"""
    row: int
    """of the stream, from 0"""
    what: str
    """what differs there, in words: of the first record, and of the second"""

    def __str__(self) -> str:
        return f"stream {self.stream}, {self.time:.4f} s, row {self.row}: {self.what}"


@dataclass(frozen=True, kw_only=True)
class Repetition:
    """What came of repeating a run.

    Attributes:
        steps: of the brains, that were repeated.
        robot: where it differs: number of the robot, from 1.
        difference: where it differs; None: nowhere.
        ends: how both ended, where that differs.
        part: why only the beginning was compared: the record is cut, or Ctrl-C ended the run; None: all was.
    """

    steps: int
    robot: int = 1
    difference: RowDifference | None = None
    ends: tuple[str, str] | None = None
    part: str | None = None

    @property
    def is_equal(self) -> bool:
        """Bit for bit."""
        return self.difference is None and self.ends is None


@dataclass(frozen=True)
class Recorded:
    """A run to repeat.

    Attributes:
        results: of its robots.
        asked: the request, as `Request.said` has it.
        attached: to its record, by name.
    """

    results: Sequence[RunResult]
    asked: Mapping[str, Any]
    attached: Mapping[str, bytes]

    @cached_property
    def foreign(self) -> dict[int, dict[str, bytes]]:
        """Of robots by their numbers, from 1, whose brain is not the file on this computer: what is run in its place,
        the record's files by name. Raises as `brain_files`."""
        brought = {n: Path(one["brain"]) for n, one in enumerate(self.asked["members"], 1) if one["brain"] is not None}
        found = {
            number: brain_files(self.attached, path, number, len(self.results), self.results[number - 1].program)
            for number, path in brought.items()
        }
        return {number: files for number, files in found.items() if files}

    @property
    def warning(self) -> str:
        """What `foreign` means, in words."""
        names = ", ".join(self._foreign_brains)
        return f"the record brings a brain that is not the file on this computer, {names}; it could do all that you may"

    @property
    def needs_trust(self) -> bool:
        """One of `foreign` is run on this computer, and not on an emulated board."""
        return bool(self._foreign_brains)

    @property
    def _foreign_brains(self) -> list[str]:
        return [name for files in self.foreign.values() for name in files if Path(name).suffix.lower() not in PROGRAMS]

    @property
    def seconds(self) -> float:
        """How long it was."""
        return max(result.run_time for result in self.results)

    @property
    def part(self) -> str | None:
        """Why only its beginning can be repeated; None: all can be."""
        for result in self.results:
            if isinstance(result.error, CutError):
                return str(result.error)
            if isinstance(result.error, KeyboardInterrupt):
                return f"the run was ended by Ctrl-C after {result.run_time:.2f} s; it is repeated up to its last step"
        return None


def recorded(path: Path) -> Recorded:
    """The run in a folder.

    Raises:
        CutError: it is damaged inside.
        BoebotError: it cannot be read or repeated: a real or paced run, or a brain that is neither from a file nor all
            described.
    """
    attached = attachments_of(path)
    results = read_run(path).robots
    error = results[0].error
    if isinstance(error, CutError) and error.lost:
        raise CutError(f"{path} cannot be repeated: {error}; expected a record that is not damaged inside", error.lost)
    if not any(result.program or result.record.count("command") for result in results):
        raise BoebotError(f"there is nothing to compare in {path}: the run has no commands; {EXPECTED}")
    asked = json.loads(attached.get(BEGIN, b"{}")).get("request")
    if asked is None:
        raise BoebotError(f"{path} does not say what was asked for; expected a record of this boebot")
    if results[0].world is None or is_live(asked["on"] or ""):
        raise BoebotError(f"{path} is of a real robot, whose run cannot be repeated; expected a simulated run")
    if asked["realtime"]:
        raise BoebotError(f"{path} was run in real time, which no run repeats bit by bit; expected one that was not")
    for result, said in zip(results, asked["members"], strict=True):
        if said["brain"] is None:
            _composed(result)
    return Recorded(results, asked, attached)


def again(run: Recorded, progress: Progress | None = None, *, trust: bool = False) -> Repetition:
    """Repeats a run. `trust`: also where that is to run Python, or a brain's TOML, that came with the record and is not
    the file on this computer.

    Raises:
        BoebotError: it cannot be repeated, as a bundled arena has changed; there is such a file, and no trust.
        KeyboardInterrupt: Ctrl-C.
    """
    if run.needs_trust and not trust:
        raise BoebotError(f"{run.warning}; expected --trust (trust=True) if you know whose it is")
    with tempfile.TemporaryDirectory() as folder:
        files = {said["brain"]: said["brain"] for said in run.asked["members"]}
        for number, brought in run.foreign.items():
            name, copies = run.asked["members"][number - 1]["brain"], Path(folder, f"robot-{number}")
            write_copies(brought, copies)
            files[name] = str(copies / as_utf8(Path(name).name))
        request = _request(run, files, Path(folder))
        repeated = Repeated([interventions(result.record) for result in run.results])
        new = execute(request, progress, onlooker=repeated).robots
    for result in new:
        if isinstance(result.error, KeyboardInterrupt):
            raise result.error
    return _compared(run, new, {copy: original for original, copy in files.items() if copy != original})


def _request(run: Recorded, brains: Mapping[str, str], folder: Path) -> Request:
    """The same request. `brains`: the files to take for those that it names; files of the record come to `folder`."""
    asked = run.asked
    seconds = math.inf if asked["seconds"] is None else asked["seconds"]
    if run.part is not None:
        seconds = min(seconds, run.seconds + BEYOND_S)
    members = [
        Member(
            brain=_composed(result) if said["brain"] is None else brains[said["brain"]],
            robot=result.robot,
            pose=None if said["pose"] is None else tuple(said["pose"]),
            seed=said["seed"],
            period=None if result.program else said["period"],
            without=said["without"],
            parameters=result.parameters,
            imperfections=said["imperfections"],
        )
        for result, said in zip(run.results, asked["members"], strict=True)
    ]
    return Request(
        members=members,
        arena=_arena(run, folder),
        seconds=seconds,
        step_timeout=None if all(result.program for result in run.results) else math.inf,
        **{name: asked[name] for name in AS_ASKED if name in asked},
    )


def _composed(result: RunResult) -> Brain:
    """The brain of a run, made of the kit's parts as its record has it.

    Raises:
        BoebotError: that does not say all of it.
    """
    none: dict[str, Any] = {"undescribed": ["it is no Brain of processes"]}
    made_of = none | cast(dict[str, Any], result.made_of or {})
    if odd := made_of.pop("undescribed"):
        raise BoebotError(
            f"brain {result.brain!r} came from no file, and its record does not hold all of it: {'; '.join(odd)}; "
            "expected a run of a bundled brain, of a file, or of a Brain of the kit's parts"
        )
    return composed(made_of, "the record")


def _arena(run: Recorded, folder: Path) -> str | Path | None:
    """The same arena: a bundled one, its file, or, where that has changed, the record's.

    Raises:
        BoebotError: it is another one now.
    """
    name = run.asked["arena"]
    if name is None:
        return None
    arena = arena_file(run.attached, Path(name), folder) if Path(name).suffix else name
    world = run.results[0].world
    if world is None or load_arena(arena).description != world.description:
        raise BoebotError(f"arena {name} has changed since the run; expected the same one")
    return cast(str | Path, arena)


def _compared(run: Recorded, new: Sequence[RunResult], originals: Mapping[str, str]) -> Repetition:
    """`originals`: for the copy of a brain's file its own place, which errors name."""
    steps, part = sum(result.steps for result in new), run.part
    pairs = list(enumerate(zip(run.results, new, strict=True), 1))
    found = []
    for number, (one, other) in pairs:
        is_cut = isinstance(one.error, CutError)
        difference = record_difference(one, other, is_cut=is_cut, until_s=_comparable_s(one))
        if difference is not None:
            found.append((difference.time, number, difference))
    if found:
        _, number, first = min(found, key=lambda each: each[:2])
        return Repetition(steps=steps, robot=number, difference=first, part=part)
    for number, (one, other) in pairs:
        end = _end(other)
        for copy, original in originals.items():
            end = end.replace(copy, original)
        if part is None and _end(one) != end:
            return Repetition(steps=steps, robot=number, ends=(_end(one), end))
    return Repetition(steps=steps, part=part)


def _comparable_s(result: RunResult) -> float:
    """Up to when a run is a function of its record: all of it, or up to the last step before Ctrl-C."""
    if not isinstance(result.error, KeyboardInterrupt):
        return math.inf
    return result.record.span("readings" if result.program else "command")[1]


def _end(result: RunResult) -> str:
    return "complete" if result.error is None else why(result.error)


def record_difference(one: Run, other: Run, *, is_cut: bool = False, until_s: float = math.inf) -> RowDifference | None:
    """The first row, in time, that two records do not have in common, bit for bit. `is_cut`: the first record is; what
    the second one has beyond its end is no difference. `until_s`: of the run; rows from then on do not count."""
    found = []
    for stream in sorted(one.record.streams() | other.record.streams()):
        if stream in _OUTSIDE and not one.record.count(stream):
            continue
        offset_s = one.clock_offset if stream in _OTHER_CLOCKS else 0.0
        rows = zip_longest(one.record.each_row(stream), other.record.each_row(stream))
        for index, (a, b) in enumerate(rows):
            if a is None and is_cut:
                break
            if a != b:
                time_s = min(row[0] for row in (a, b) if row is not None) - offset_s
                if time_s >= until_s:
                    break
                found.append(RowDifference(stream, time_s, index, _in_words(a, b)))
                break
    return min(found, key=lambda difference: difference.time, default=None)


def _in_words(one: Row | None, other: Row | None) -> str:
    if one is None or other is None:
        return f"only the {'second' if one is None else 'first'} has it"
    if one[0] != other[0]:
        return f"its time is {one[0]!r} s and {other[0]!r} s"
    if len(one[1]) != len(other[1]):
        return f"it has {len(one[1])} B and {len(other[1])} B"
    index = next(index for index, (a, b) in enumerate(zip(one[1], other[1], strict=True)) if a != b)
    return f"its byte {index} is 0x{one[1][index]:02X} and 0x{other[1][index]:02X}"
