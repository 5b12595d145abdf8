"""A run read back from its record on disk."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from boebot.arenas import Arena, ArenaDescription
from boebot.errors import ArenaError
from boebot.files import regular
from boebot.record.blocks import Group
from boebot.record.record import Record
from boebot.record.record_file import NoRecordError, RecordError, RecordReader, RecordWriter, in_words
from boebot.record.recording import BEGIN, END, result_of, say
from boebot.record.run import Run, why
from boebot.record.run_folder import FORMAT, MENDED, RECORD, write_whole

R = TypeVar("R", bound=Run)


class CutError(RecordError):
    """A record lacks a part of its run: it is cut at its end, or damaged inside.

    Attributes:
        lost: what is damaged, in words; empty: nothing, it is cut.
        cut: where it is cut, in words; empty: it is not.
        other: why the run itself ended before its time, as far as the record says.
    """

    def __init__(
        self, sentence: str, lost: Sequence[str] = (), cut: str = "", other: BaseException | None = None
    ) -> None:
        super().__init__(sentence)
        self.lost, self.cut, self.other = lost, cut, other
        self.exit_code = 1 if lost else 0
        self.brief = "record damaged" if lost else "record cut"


@dataclass
class _Finished:
    """The groups of a finished record that are sound (`boebot.record.record.Keeper`)."""

    reader: RecordReader
    up_to_damage: bool

    def groups(self) -> Iterator[Group]:
        """See `Keeper`."""
        return (kept.group for kept in self.reader.groups(up_to_damage=self.up_to_damage))


def read_robots(path: str | Path, kind: type[R], *, up_to_damage: bool = False) -> list[R]:
    """What came of each robot of a run; arguments but `kind`, a class of runs, as of `boebot.result.read_run`.

    Raises:
        BoebotError: there is no record, or it is none of a run, or does not say whose it is.
    """
    file, reader = _opened(path)
    said = _said(reader, file)
    kept = _Finished(reader, up_to_damage)
    world = None if said["arena"] is None else _arena(said["arena"], file)
    count = len(said["robots"])
    prefixes = [""] if count == 1 else [f"robot-{number}/" for number in range(1, count + 1)]
    try:
        results = [
            result_of(kind, facts, Record(kept, prefix), world)
            for facts, prefix in zip(said["robots"], prefixes, strict=True)
        ]
    except (ValueError, TypeError) as error:
        raise NoRecordError(f"{file}: {END} in it does not describe a run: {error}") from None
    # a group that is missing where no byte is wrong: of a record that was mended that was said already
    here = [str(damage) for damage in reader.found.damages if damage.begin < damage.end or not said["lost"]]
    lost, cut = [*said["lost"], *here], said["cut"]
    if reader.found.is_cut:
        end_s = max(result.record.span(result.record.tick_stream)[1] for result in results)
        cut = (
            f"the record is cut: it ends at {end_s:.2f} s of the run, after {reader.found.whole_bytes:,} whole bytes "
            f"of {file.stat().st_size:,} in {file.name}"
        )
    if cut or lost:
        for result in results:
            _lack(result, lost, cut, ends_there=up_to_damage or END not in reader.found.attachments)
    return results


def attachments_of(path: str | Path) -> dict[str, bytes]:
    """What is attached to a record, by name. Raises as `read_robots`."""
    return dict(_opened(path)[1].found.attachments)


def _opened(path: str | Path) -> tuple[Path, RecordReader]:
    """A record, read once."""
    file = Path(path) / RECORD if Path(path).is_dir() else Path(path)
    try:
        return file, RecordReader(regular(file).open("rb"), str(file)).read()
    except OSError as error:
        what = str(error.strerror or error).partition(";")[0]
        what = "there is no record of a run" if error.errno == errno.ENOENT else what
        raise NoRecordError(f"{file}: {what}; expected the folder of a run, or its {RECORD}") from None


def _said(reader: RecordReader, file: Path) -> dict[str, Any]:
    """What was said last of the run."""
    found = reader.found
    text = found.attachments.get(END, found.attachments.get(BEGIN))
    if text is None:
        where = f"; it is cut after {file.stat().st_size} B" if found.is_cut else ""
        sentence = f"{file} does not say whose run it is{where}; expected {BEGIN} in it"
        if found.damages:
            lost = [str(damage) for damage in found.damages]
            raise CutError(f"{sentence}; it is damaged: {in_words(lost)}", lost)
        raise NoRecordError(sentence)
    try:
        said: dict[str, Any] = json.loads(text)
        said["arena"], said["robots"][0]
        version = said["format"]
        said["lost"], said["cut"] = [str(one) for one in said.get("lost", ())], str(said.get("cut", ""))
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise NoRecordError(f"{file}: {BEGIN} in it cannot be read: {error}") from None
    if version != FORMAT:
        raise NoRecordError(f"{file} has format {version}; expected {FORMAT}: read it with the boebot that wrote it")
    return said


def _arena(description: Any, file: Path) -> Arena:
    try:
        return Arena(msgspec.convert(description, ArenaDescription))
    except (ArenaError, msgspec.ValidationError) as error:
        raise NoRecordError(f"{file}: the arena in it cannot be read: {error}") from None


def _lack(result: Run, lost: Sequence[str], cut: str, *, ends_there: bool) -> None:
    """Notes what a result lacks. `ends_there`: what the end of the record would have said is taken from its streams;
    what they do not say is not known."""
    record, other = result.record, result.error
    if ends_there:
        result.run_time, result.steps = record.span(record.tick_stream)[1], record.count("command")
        result.clock_offset = record.clock_offset
        result.link, result.counters = {}, {}
        result.late_steps = result.long_steps = result.resets = result.sessions_lost = None
        result.lost_frames = result.bad_frames = result.wall_time = result.longest_step = None
        if lost and result.layout is None and not record.count("clock"):
            result.world = None  # at which of its times the truth was is lost
    parts = [f"the record is damaged: {in_words(lost)}; figures are of what is left"] if lost else []
    parts += [cut] if cut else []
    parts += [] if other is None else [f"the run ended early: {why(other)}"]
    result.error = CutError("; ".join(parts), lost, cut, other)


def mend(path: Path, robots: Sequence[Run]) -> Path:
    """Makes a record that is cut or damaged whole: what can be read of it, in a new file beside it that has an end.
    `robots`: what was read of it, with a `CutError`. Returns the new file. What was damaged, and where it was cut,
    stays said in it, and groups keep their numbers: so who reads it finds where something is missing.

    Raises:
        BoebotError: it cannot be written.
    """
    mended = path.with_name(MENDED)
    errors = [one.error for one in robots if isinstance(one.error, CutError)]
    end = say(
        [replace(one, error=error.other) for one, error in zip(robots, errors, strict=True)],
        lost=errors[0].lost,
        cut=errors[0].cut,
    )

    def write(part: Path) -> None:
        with path.open("rb") as old, part.open("wb", buffering=0) as file:
            reader, writer = RecordReader(old, str(path)).read(), RecordWriter(file, str(mended))
            for name, data in reader.found.attachments.items():
                if name != END:
                    writer.attach(name, data)
            for kept in reader.groups():
                writer.write(kept.group, kept.end_s, kept.begin_s, kept.number)
            writer.attach(END, end)
            writer.finish()

    return write_whole(mended, write)
