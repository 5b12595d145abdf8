"""A run read back from its record on disk."""

from __future__ import annotations

import errno
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from boebot.arenas import Arena, ArenaDescription
from boebot.errors import ArenaError
from boebot.files import regular
from boebot.record.facts import result_of
from boebot.record.keepers import Finished, Keeper, Shared
from boebot.record.record import Record
from boebot.record.record_file import NoRecordError, RecordError, RecordReader, in_words
from boebot.record.recording import BEGIN, END
from boebot.record.run import Run, why
from boebot.record.run_folder import FORMAT, RECORD

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


def read_robots(path: str | Path, kind: type[R], *, up_to_damage: bool = False) -> list[R]:
    """What came of each robot of a run; arguments but `kind`, a class of runs, as of `boebot.result.read_run`.

    Raises:
        BoebotError: there is no record, or it is none of a run, or does not say whose it is.
    """
    file, reader = _opened(path)
    said = _said(reader, file)
    keeper = Finished(reader, str(file), up_to_damage=up_to_damage)
    world = None if said["arena"] is None else _arena(said["arena"], file)
    count = len(said["robots"])
    keepers: list[Keeper] = [keeper] if count == 1 else [Shared(keeper, number) for number in range(1, count + 1)]
    try:
        results = [
            result_of(kind, facts, Record(kept, is_new=False), world)
            for facts, kept in zip(said["robots"], keepers, strict=True)
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
