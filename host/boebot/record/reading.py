"""A run read back from its record on disk."""

from __future__ import annotations

import errno
import json
from pathlib import Path
from typing import IO, Any

import msgspec

from boebot.arenas import Arena, ArenaDescription
from boebot.errors import ArenaError
from boebot.record.facts import result_of
from boebot.record.keepers import Finished, Keeper, Shared
from boebot.record.record import Record
from boebot.record.record_file import RecordError, RecordReader
from boebot.record.recording import BEGIN, END
from boebot.record.result import RunResult, TogetherResult
from boebot.record.run_folder import FORMAT, RECORD


class CutError(RecordError):
    """A record ends before its run did."""


def read_run(path: str | Path) -> RunResult | TogetherResult:
    """The run in a folder, or in the file of its record. Of a record that is cut the run has ended there, with a
    `CutError` that says so.

    Raises:
        BoebotError: there is no record, or it is none of a run, or too short to say whose it is.
    """
    file, opened = _opened(path)
    reader = RecordReader(opened, str(file)).read()
    said = _said(reader, file)
    keeper = Finished(opened, str(file))
    world = None if said["arena"] is None else _arena(said["arena"], file)
    count = len(said["robots"])
    keepers: list[Keeper] = [keeper] if count == 1 else [Shared(keeper, number) for number in range(1, count + 1)]
    try:
        results = [
            result_of(facts, Record(kept, is_new=False), world)
            for facts, kept in zip(said["robots"], keepers, strict=True)
        ]
    except (ValueError, TypeError) as error:
        raise RecordError(f"{file}: {END} in it does not describe a run: {error}") from None
    if reader.is_cut:
        for result in results:
            _cut(result, reader, file)
    if count == 1:
        return results[0]
    ended = next((result.error for result in results if result.error is not None), None)
    return TogetherResult(robots=results, error=ended)


def robots_of(result: RunResult | TogetherResult, number: int | None = None) -> dict[int, RunResult]:
    """A run's robots by their numbers, from 1: all of them, or one.

    Raises:
        RecordError: there is no robot of that number.
    """
    robots = dict(enumerate([result] if isinstance(result, RunResult) else result.robots, 1))
    if number is None:
        return robots
    if number not in robots:
        expected = "1, or none" if len(robots) == 1 else f"1 to {len(robots)}"
        raise RecordError(f"there is no robot {number} in the run; expected {expected}")
    return {number: robots[number]}


def attachments_of(path: str | Path) -> dict[str, bytes]:
    """What is attached to a record, by name. Raises as `read_run`."""
    file, opened = _opened(path)
    with opened:
        return dict(RecordReader(opened, str(file)).read().attachments)


def _opened(path: str | Path) -> tuple[Path, IO[bytes]]:
    file = Path(path) / RECORD if Path(path).is_dir() else Path(path)
    try:
        return file, file.open("rb")
    except OSError as error:
        what = "there is no record of a run" if error.errno == errno.ENOENT else error.strerror or error
        raise RecordError(f"{file}: {what}; expected the folder of a run, or its {RECORD}") from None


def _said(reader: RecordReader, file: Path) -> dict[str, Any]:
    """What was said last of the run."""
    text = reader.attachments.get(END, reader.attachments.get(BEGIN))
    if text is None:
        where = f"; it is cut after {file.stat().st_size} B" if reader.is_cut else ""
        raise RecordError(f"{file} does not say whose run it is{where}; expected {BEGIN} in it")
    try:
        said: dict[str, Any] = json.loads(text)
        said["arena"], said["robots"][0]
        version = said["format"]
    except (ValueError, LookupError, TypeError) as error:
        raise RecordError(f"{file}: {BEGIN} in it cannot be read: {error}") from None
    if version != FORMAT:
        raise RecordError(f"{file} has format {version}; expected {FORMAT}: read it with the boebot that wrote it")
    return said


def _arena(description: Any, file: Path) -> Arena:
    try:
        return Arena(msgspec.convert(description, ArenaDescription))
    except (ArenaError, msgspec.ValidationError) as error:
        raise RecordError(f"{file}: the arena in it cannot be read: {error}") from None


def _cut(result: RunResult, reader: RecordReader, file: Path) -> None:
    """What the end of a record would have said, as far as its streams say it."""
    record = result.record
    times = record.times_of("telemetry") if record.count("telemetry") else record.times_of("readings")
    end_s = float(times[-1]) if len(times) else 0.0
    result.run_time, result.steps = end_s, record.count("command")
    result.clock_offset = record.clock_offset
    result.error = CutError(
        f"the record is cut: it ends at {end_s:.2f} s of the run, after {reader.whole_bytes:,} whole bytes of "
        f"{file.stat().st_size:,} in {file.name}"
    )
