"""A record on disk: an MCAP file (mcap.dev), written while the run goes on, and readable wherever it was cut.

Each group of blocks is a chunk, compressed and with a CRC; each stream is a channel. Sources and figures of the run are
attachments, with a CRC as well. What each chunk and attachment holds is on the disk once it is written, as far as the
disk keeps fsync.

A reader believes no byte whose CRC is wrong or missing. What is damaged it names and leaves out, and it goes on with
the next sound chunk or attachment. The messages of a chunk have the number of their group, from 0, as `sequence`, and
the times of the run (ns) that it lies between as `publish_time` and `log_time`: so a chunk that is missing is noticed.
The CRC of all data, which the end of a record that is not cut has, covers what lies between them.
(MCAP's records: mcap.dev/spec)
"""

from __future__ import annotations

import contextlib
import io
import math
import os
import queue
import re
import struct
import sys
import threading
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

from boebot.errors import BoebotError
from boebot.record.blocks import SCHEMA, Group, Kept, Rows, group_of, packed, schema, unpacked

WAITING = 4  # groups at most that wait for a disk, where time can stand still
PAUSE_S = 0.005  # between two looks whether it is done
LARGEST_CHUNK = 1 << 28  # B, that is read; a second of a run has a hundredth of it
PIECE = 1 << 16  # B, that are read at a time
TRIES, SPARE = 8, 1 << 26  # times its size, and B more, that a file is looked at for what is sound
LONGEST_NAME = 200  # B, of an attachment that is named
NAMED = 3  # damages, one by one; of more it is said how many


class RecordError(BoebotError):
    """A record cannot be written or read."""


class NoRecordError(RecordError):
    """A file is no record of a run."""

    exit_code = 2


class RecordWriter:
    """Writes a record. A second thread packs, compresses and waits for the disk."""

    def __init__(self, file: IO[bytes], name: str, *, waits: bool = False) -> None:
        """Into an open and empty file; `name`: as errors call it. `waits`: for a slow disk; else groups wait for it in
        memory, as on a robot that must not wait."""
        from mcap.writer import Writer

        self._file, self._name, self._waits = file, name, waits
        self._end = _File(file.fileno())
        self._writer: Any = Writer(cast(IO[bytes], self._end), chunk_size=sys.maxsize, enable_data_crcs=True)
        self._channels: dict[str, int] = {}
        self._schema = self._groups = 0
        self._until_s = 0.0
        self._work: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="record", daemon=True)
        self._thread.start()
        self._put(self._start)

    def check(self) -> None:
        """Raises RecordError where something could not be written."""
        if self._failure is not None:
            kind = type(self._failure).__name__
            reason = getattr(self._failure, "strerror", None) or f"{kind}: {self._failure}"
            raise RecordError(f"the record cannot be written to {self._name}: {reason}")

    def write(self, rows: Rows, time_s: float, begin_s: float | None = None, number: int | None = None) -> None:
        """A group, up to that time of the run (s). Raises as `check`. `begin_s`, `number`: of one that was read from
        another record; None: it follows the last one."""
        while self._waits and self._work.qsize() >= WAITING:
            time.sleep(PAUSE_S)
        number = self._groups if number is None else number
        times = (self._until_s if begin_s is None else begin_s, time_s)
        self._groups, self._until_s = number + 1, time_s
        self._put(partial(self._write, rows, number, *(max(0, round(each * 1e9)) for each in times)))

    def attach(self, name: str, data: bytes) -> None:
        """A file within the file. Raises as `check`."""
        self._put(partial(self._attach, name, data))

    def groups(self) -> Iterator[Group]:
        """What was written so far, oldest first, read from the file.

        Raises:
            RecordError: it cannot be read.
        """
        self._work.join()
        try:
            with Path(self._file.name).open("rb") as file:
                for kept in RecordReader(file, self._name).groups():
                    yield kept.group
        except OSError as error:
            raise RecordError(f"the record {self._name} cannot be read: {error.strerror}") from None

    def finish(self) -> None:
        """Ends the record; nothing is written any more. Raises as `check`, and where the file has no name any more."""
        if self._thread.is_alive():
            self._work.put(None)
            self._thread.join()
        self.check()
        if os.fstat(self._file.fileno()).st_nlink == 0:
            raise RecordError(f"the record {self._name} was deleted while the run went on")

    def _put(self, work: Callable[[], None]) -> None:
        self.check()
        self._work.put(work)

    # ---- the writing thread ------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            self._do(work)
            self._work.task_done()
        self._do(self._writer.finish)
        self._work.task_done()

    def _do(self, work: Callable[[], None]) -> None:
        """What cannot be written whole is not written at all, and nothing after it."""
        if self._failure is not None:
            return
        whole = self._end.size
        try:
            work()
            self._writer.flush()
            os.fsync(self._file.fileno())
        except Exception as error:  # of any kind: the run is to end by it, not this thread alone
            self._failure = error
            with contextlib.suppress(OSError):
                os.ftruncate(self._file.fileno(), whole)

    def _start(self) -> None:
        self._writer.start(profile="boebot", library="boebot")
        self._schema = self._writer.register_schema(name=SCHEMA, encoding="protobuf", data=schema())

    def _write(self, rows: Rows, number: int, begin_ns: int, time_ns: int) -> None:
        for stream, block in group_of(rows).items():
            if stream not in self._channels:
                self._channels[stream] = self._writer.register_channel(stream, "protobuf", self._schema)
            data = packed(block, stream)
            self._writer.add_message(self._channels[stream], time_ns, data, begin_ns, sequence=number)

    def _attach(self, name: str, data: bytes) -> None:
        media_type = "application/json" if name.endswith(".json") else "text/plain"
        self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)


class _File:
    """What MCAP's writer writes to: all that it is given, or an OSError.

    Attributes:
        size: so far (B).
    """

    def __init__(self, number: int) -> None:
        """`number`: the file's descriptor."""
        self._number, self.size = number, 0

    def write(self, data: bytes) -> None:
        """At the end."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._number, rest) :]
        self.size += len(data)

    def tell(self) -> int:
        """Where the file ends."""
        return self.size

    def flush(self) -> None:
        """It is written already."""


class Damage(NamedTuple):
    """What of a record is not as it was written.

    Attributes:
        begin, end: of the bytes in the file (B) that are left out.
        after_s, before_s: of the run, between which they lie; infinite: up to its end.
        what: is wrong, in words; "": a part of the run is lost.
    """

    begin: int
    end: int
    after_s: float
    before_s: float
    what: str

    def __str__(self) -> str:
        until = "its end" if math.isinf(self.before_s) else f"{self.before_s:.2f} s"
        what = self.what or f"the run from {self.after_s:.2f} s to {until} is lost"
        return f"bytes {self.begin:,} to {self.end:,}: {what}"


@dataclass
class Found:
    """What one pass over a record has found so far.

    Attributes:
        damages: oldest first.
        is_cut: the record ends before its end.
        whole_bytes: of the file, up to the end of the last sound chunk or attachment.
        attachments: by name.
    """

    damages: list[Damage] = field(default_factory=list)
    is_cut: bool = False
    whole_bytes: int = 0
    attachments: dict[str, bytes] = field(default_factory=dict)


class RecordReader:
    """Reads what is sound of a record, from its beginning to its end or to where it is cut.

    Attributes:
        found: when all of it was read first; no later pass changes it.
    """

    def __init__(self, file: IO[bytes], name: str) -> None:
        """A file that can be read anew from its beginning; `name`: as errors call it.

        Raises:
            NoRecordError: it is no MCAP file.
        """
        self._file, self._name = file, name
        self.found = Found()
        if not _MAGIC.startswith(self._at(0, len(_MAGIC))):
            raise NoRecordError(f"{name} is no record of a run; expected an MCAP file")

    def read(self) -> RecordReader:
        """Passes over all of it, for what it says of itself."""
        found = Found()
        for _ in self._pass(found):
            pass
        self.found = found
        return self

    def groups(self, *, up_to_damage: bool = False) -> Iterator[Kept]:
        """The groups, oldest first; `up_to_damage`: those before the first one that is missing.

        Raises:
            RecordError: damage was found that was not there, or not looked for, when the record was read first.
        """
        found = Found()
        for number, kept in enumerate(self._pass(found)):
            if up_to_damage and kept.number != number:
                return
            yield kept
        if new := [str(damage) for damage in found.damages if damage not in self.found.damages]:
            raise RecordError(f"the record {self._name} is damaged: {in_words(new)}; expected what was written")

    def _pass(self, found: Found) -> Iterator[Kept]:
        """The groups that are sound; all else goes to `found`."""
        size = self._file.seek(0, io.SEEK_END)
        limit, crc = self._end(size) or (size, None)
        found.is_cut = crc is None and self._at(max(size - len(_MAGIC), len(_MAGIC)), size) != _MAGIC
        found.whole_bytes = len(_MAGIC)
        place, budget = _BEGIN, TRIES * size + SPARE
        last, hole = Kept(-1, 0.0, 0.0, {}), -1  # where bytes begin that are not sound; -1: all are
        while place < limit and budget > 0:
            end, what = self._record(place, limit)
            number = what.number if isinstance(what, Kept) else last.number + 1
            if what is None or number <= last.number:
                hole = place if hole < 0 else hole
                budget -= end - place + PIECE
                place = self._likely(place + 1)
                continue
            if hole >= 0 or number > last.number + 1:
                before_s = what.begin_s if isinstance(what, Kept) else math.inf
                found.damages.append(self._damage(hole if hole >= 0 else place, place, last.end_s, before_s))
                hole = -1
            place = found.whole_bytes = end
            if isinstance(what, Kept):
                place += _INDEX * len(what.group)
                last = what
                yield what
            else:
                found.attachments |= what
        if (hole >= 0 or crc is None) and not found.is_cut:
            found.damages.append(self._damage(max(hole, found.whole_bytes), limit, last.end_s, math.inf))
        elif crc is not None and not found.damages and self._crc(limit) != crc:
            found.damages.append(Damage(0, limit, 0.0, math.inf, "something beside the run is wrong in these"))

    def _at(self, begin: int, size: int) -> bytes:
        """Some bytes of the file, as far as it goes. Several can read the same file in turns."""
        self._file.seek(begin)
        return self._file.read(size)

    def _crc(self, end: int) -> int:
        crc = 0
        for begin in range(0, end, PIECE):
            crc = zlib.crc32(self._at(begin, min(PIECE, end - begin)), crc)
        return crc

    def _end(self, size: int) -> tuple[int, int] | None:
        """Where the data ends, and its CRC, as the end of the file says; None: that is not sound."""
        try:
            *kind, begin, _, crc, magic = _FOOTER.unpack(self._at(max(0, size - _FOOTER.size), size))
            index = self._at(min(begin, size), size)
            *end, data_crc = _DATA_END.unpack(self._at(max(0, size - len(index) - _DATA_END.size), _DATA_END.size))
        except struct.error:
            return None
        is_sound = (*kind, *end, magic) == (2, 20, 15, 4, _MAGIC) and zlib.crc32(index[:-12]) == crc
        return (begin - _DATA_END.size, data_crc) if is_sound else None

    def _likely(self, begin: int) -> int:
        """Where the next chunk or attachment may begin; else the end of the file."""
        while data := self._at(begin, PIECE):
            if found := _LIKELY.search(data):
                return begin + found.start()
            begin += max(len(data) - _LIKELY_SIZE, 1)
        return begin

    def _record(self, begin: int, limit: int) -> tuple[int, Kept | dict[str, bytes] | None]:
        """Where the chunk or attachment that begins there ends, at `limit` at most, and what is in it; None: it is not
        sound."""
        kind, length = _HEAD.unpack(self._at(begin, _HEAD.size).ljust(_HEAD.size, b"\0"))
        end = begin + _HEAD.size + length
        if end > limit or length > 2 * LARGEST_CHUNK or kind not in (_CHUNK, _ATTACHMENT):
            return min(end, limit), None
        return end, _sound(kind, self._at(begin + _HEAD.size, length))

    def _damage(self, begin: int, end: int, after_s: float, before_s: float) -> Damage:
        """What begins there, as far as its bytes can be believed."""
        head = self._at(begin, 29 + LONGEST_NAME)
        name = head[29 : 29 + int.from_bytes(head[25:29], "little")].decode(errors="replace")
        is_attachment = begin < end and head[:1] == bytes([_ATTACHMENT])
        return Damage(begin, end, after_s, before_s, f"attachment {name!r} is lost" if is_attachment else "")


def _sound(kind: int, body: bytes) -> Kept | dict[str, bytes] | None:
    """The group of a chunk, or an attachment by its name, as its checksum proves that it was written; None: it is not
    sound (mcap.dev/spec)."""
    from mcap.data_stream import ReadDataStream  # here, as this library takes a while: no other command should wait
    from mcap.exceptions import McapError
    from mcap.records import Attachment, Chunk, Message
    from mcap.stream_reader import breakup_chunk
    from zstandard import ZstdDecompressor, ZstdError

    stream = ReadDataStream(io.BytesIO(body))
    try:
        if kind == _ATTACHMENT:
            found = Attachment.read(stream)
            is_whole = stream.count == len(body) and zlib.crc32(body[:-4]) == int.from_bytes(body[-4:], "little")
            return {found.name: found.data} if is_whole else None
        chunk = Chunk.read(stream)
        with ZstdDecompressor().stream_reader(chunk.data) as parts:  # piece by piece, whatever size it claims
            data = b"".join(islice(iter(partial(parts.read, PIECE), b""), LARGEST_CHUNK // PIECE))
        is_whole = (stream.count, len(data), chunk.compression) == (len(body), chunk.uncompressed_size, "zstd")
        if not is_whole or zlib.crc32(data) != chunk.uncompressed_crc:
            return None
        chunk.compression, chunk.data = "", data
        messages = [record for record in breakup_chunk(chunk) if isinstance(record, Message)]
        ((number, begin_ns, end_ns),) = {(one.sequence, one.publish_time, one.log_time) for one in messages}
        return Kept(number, begin_ns / 1e9, end_ns / 1e9, dict(unpacked(one.data) for one in messages))
    except (McapError, ZstdError, struct.error, ValueError, LookupError, OverflowError, EOFError):
        return None


_MAGIC = b"\x89MCAP0\r\n"
_BEGIN = len(_MAGIC) + 29  # of what is written, behind magic and header
_CHUNK, _ATTACHMENT = 6, 9  # kinds of MCAP's records
_INDEX = 31  # B, behind a chunk for each stream that it has
_HEAD = struct.Struct("<BQ")  # kind, B that follow
_DATA_END = struct.Struct("<BQI")  # kind, B that follow, CRC of all before it
_FOOTER = struct.Struct("<BQQQI8s")  # kind, B that follow, where the index and its offsets begin, its CRC, magic
_LIKELY = re.compile(rb"\x06(?=.{36}\x04\0\0\0zstd)|\x09(?=.{8}\0{16})", re.DOTALL)  # begin of chunk, attachment
_LIKELY_SIZE = 44


def in_words(damages: Sequence[str]) -> str:
    """The first of them by themselves."""
    more = len(damages) - NAMED
    return "; ".join(damages[:NAMED]) + (f"; and {more} more places" if more > 0 else "")
