"""Repeats a simulated run from its record, and compares the two, row by row and bit for bit."""

from __future__ import annotations

import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from boebot.arenas import load_arena
from boebot.errors import BoebotError
from boebot.record.compare import RowDifference, record_difference
from boebot.record.reading import CutError, attachments_of, read_run
from boebot.record.recording import BEGIN
from boebot.record.result import RunResult, TogetherResult, why
from boebot.running.driver import Progress
from boebot.running.runner import execute
from boebot.running.tasks import Member, Request
from boebot.running.together import execute_together

BEYOND_S = 1.0  # by which the repetition of a record that is cut is longer than it


@dataclass(frozen=True, kw_only=True)
class Repetition:
    """What came of repeating a run.

    Attributes:
        steps: of the brains, that were repeated.
        robot: where it differs: number of the robot, from 1.
        difference: where it differs; None: nowhere.
        ends: how both ended, where that differs.
        cut: why only the beginning could be compared; None: all was.
    """

    steps: int
    robot: int = 1
    difference: RowDifference | None = None
    ends: tuple[str, str] | None = None
    cut: str | None = None

    @property
    def is_equal(self) -> bool:
        """Bit for bit."""
        return self.difference is None and self.ends is None


def again(path: Path, progress: Progress | None = None) -> Repetition:
    """Repeats the run in a folder.

    Raises:
        BoebotError: it cannot be read or repeated: a real or paced run, one that Ctrl-C ended, a brain from no file, an
            arena that has changed.
    """
    attached = attachments_of(path)
    recorded = _robots(read_run(path))
    asked = json.loads(attached.get(BEGIN, b"{}")).get("request")
    if asked is None:
        raise BoebotError(f"{path} does not say what was asked for; expected a record of this boebot")
    _check(path, recorded, asked)
    with tempfile.TemporaryDirectory() as folder:
        request = _request(recorded, asked, attached, Path(folder))
        new = _robots((execute if len(recorded) == 1 else execute_together)(request, progress))
    return _compared(recorded, new)


def _robots(result: RunResult | TogetherResult) -> Sequence[RunResult]:
    return [result] if isinstance(result, RunResult) else result.robots


def _check(path: Path, recorded: Sequence[RunResult], asked: Mapping[str, Any]) -> None:
    """Raises BoebotError where the run is no function of its record."""
    world = recorded[0].world
    if world is None:
        raise BoebotError(f"{path} is of a real robot, whose run cannot be repeated; expected a simulated run")
    if asked["realtime"]:
        raise BoebotError(f"{path} was run in real time, which no run repeats bit by bit; expected one that was not")
    if any(isinstance(result.error, KeyboardInterrupt) for result in recorded):
        raise BoebotError(f"{path} was ended by Ctrl-C, at a moment that cannot be repeated; expected a whole run")
    if asked["arena"] is not None and load_arena(asked["arena"]).description != world.description:
        raise BoebotError(f"arena {asked['arena']} has changed since the run in {path}; expected the same one")


def _request(
    recorded: Sequence[RunResult], asked: Mapping[str, Any], attached: Mapping[str, bytes], folder: Path
) -> Request:
    """The same request; brains that have changed since come from the record, by way of the folder."""
    seconds = math.inf if asked["seconds"] is None else asked["seconds"]
    if any(isinstance(result.error, CutError) for result in recorded):
        seconds = min(seconds, max(result.run_time for result in recorded) + BEYOND_S)
    members = [
        Member(
            brain=_brain(result, said["brain"], attached, folder),
            robot=result.robot,
            pose=None if said["pose"] is None else tuple(said["pose"]),
            seed=said["seed"],
            period=said["period"],
            without=said["without"],
        )
        for result, said in zip(recorded, asked["members"], strict=True)
    ]
    return Request(
        members=members,
        arena=asked["arena"],
        on=asked["on"],
        seconds=seconds,
        seed=asked["seed"],
        step_timeout=math.inf,
        force_timing=asked["force_timing"],
    )


def _brain(result: RunResult, source: str | None, attached: Mapping[str, bytes], folder: Path) -> str | Path:
    """A bundled name, the brain's file, or, where that has changed, its source in the record as a file.

    Raises:
        BoebotError: the brain came from no file.
    """
    if source is None:
        raise BoebotError(f"brain {result.brain!r} came from no file; expected a run of a bundled brain or of a file")
    path = Path(source)
    recorded = attached.get(path.name)
    if recorded is None or (path.is_file() and path.read_bytes() == recorded):
        return source
    copy = folder / path.name
    copy.write_bytes(recorded)
    return copy


def _compared(recorded: Sequence[RunResult], new: Sequence[RunResult]) -> Repetition:
    steps = sum(result.steps for result in new)
    cut = next((str(result.error) for result in recorded if isinstance(result.error, CutError)), None)
    found = []
    for number, (one, other) in enumerate(zip(recorded, new, strict=True), 1):
        difference = record_difference(one, other, is_cut=cut is not None)
        if difference is not None:
            found.append((difference.time, number, difference))
    if found:
        _, number, first = min(found, key=lambda each: each[:2])
        return Repetition(steps=steps, robot=number, difference=first, cut=cut)
    for number, (one, other) in enumerate(zip(recorded, new, strict=True), 1):
        ends = _end(one), _end(other)
        if cut is None and ends[0] != ends[1]:
            return Repetition(steps=steps, robot=number, ends=ends)
    return Repetition(steps=steps, cut=cut)


def _end(result: RunResult) -> str:
    return "complete" if result.error is None else why(result.error)
