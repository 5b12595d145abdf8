"""A record on disk: an MCAP file (mcap.dev), written while the run goes on, and readable wherever it was cut.

Each group of blocks is a chunk, compressed and with a CRC; each stream is a channel. Sources and figures of the run are
attachments. What each chunk and attachment holds is on the disk once it is written, as far as the disk keeps fsync.
"""

from __future__ import annotations

import contextlib
import os
import queue
import struct
import sys
import threading
from collections.abc import Callable, Iterator
from functools import cache, partial
from typing import IO, Any, cast

from boebot.errors import BoebotError
from boebot.record.blocks import SCHEMA, Group, Rows, group_of, packed, schema, unpacked

LARGEST_CHUNK = 1 << 28  # B, that is read; a second of a run has a hundredth of it
TEXT = "text/plain"


class RecordError(BoebotError):
    """A record cannot be written or read."""


class RecordWriter:
    """Writes a record. A second thread packs, compresses and waits for the disk."""

    def __init__(self, file: IO[bytes], name: str, *, sync: bool = True) -> None:
        """Into an open and empty file; `name`: as errors call it. `sync`: wait until the disk has each group."""
        from mcap.writer import Writer

        self._file, self._name, self._sync = file.fileno(), name, sync
        self._tail = _Tail()
        self._writer: Any = Writer(cast(IO[bytes], self._tail), chunk_size=sys.maxsize)
        self._channels: dict[str, int] = {}
        self._schema = 0
        self._work: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="record", daemon=True)
        self._thread.start()
        self._put(self._start)

    @property
    def waiting(self) -> int:
        """Groups and attachments that wait for the disk."""
        return self._work.qsize()

    def check(self) -> None:
        """Raises RecordError where something could not be written."""
        if self._failure is not None:
            kind = type(self._failure).__name__
            reason = getattr(self._failure, "strerror", None) or f"{kind}: {self._failure}"
            raise RecordError(f"the record cannot be written to {self._name}: {reason}")

    def write(self, rows: Rows, time_s: float) -> None:
        """A group, at that time of the run (s). Raises as `check`."""
        self._put(partial(self._write, rows, max(0, round(time_s * 1e9))))

    def attach(self, name: str, data: bytes, media_type: str = TEXT) -> None:
        """A file within the file. Raises as `check`."""
        self._put(partial(self._attach, name, data, media_type))

    def finish(self) -> None:
        """Ends the record; nothing is written any more. Raises as `check`, and where the file has no name any more."""
        if self._thread.is_alive():
            self._work.put(None)
            self._thread.join()
        self.check()
        if self._sync and os.fstat(self._file).st_nlink == 0:
            raise RecordError(f"the record {self._name} was deleted while the run went on")

    def _put(self, work: Callable[[], None]) -> None:
        self.check()
        self._work.put(work)

    # ---- the writing thread ------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            self._do(work)
        self._do(self._writer.finish)

    def _do(self, work: Callable[[], None]) -> None:
        """What cannot be written whole is not written at all, and nothing after it."""
        if self._failure is not None:
            return
        whole = self._tail.taken
        try:
            work()
            self._writer.flush()
            data = self._tail.take()
            while data:
                data = data[os.write(self._file, data) :]
            if self._sync:
                os.fsync(self._file)
        except Exception as error:  # of any kind: the run is to end by it, not this thread alone
            self._failure = error
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, whole)

    def _start(self) -> None:
        self._writer.start(profile="boebot", library="boebot")
        self._schema = self._writer.register_schema(name=SCHEMA, encoding="protobuf", data=schema())

    def _write(self, rows: Rows, time_ns: int) -> None:
        for stream, block in group_of(rows).items():
            if stream not in self._channels:
                self._channels[stream] = self._writer.register_channel(stream, "protobuf", self._schema)
            self._writer.add_message(self._channels[stream], time_ns, packed(block), time_ns)

    def _attach(self, name: str, data: bytes, media_type: str) -> None:
        self._writer.add_attachment(create_time=0, log_time=0, name=name, media_type=media_type, data=data)


class _Tail:
    """The end of the file, before it is written.

    Attributes:
        taken: how much was taken so far (B).
    """

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = self.taken = 0

    def write(self, data: bytes) -> None:
        """At the end."""
        self._parts.append(bytes(data))
        self._size += len(data)

    def tell(self) -> int:
        """Where the file ends."""
        return self._size

    def flush(self) -> None:
        """It is written by whoever takes it."""

    def take(self) -> memoryview:
        """What is new."""
        self.taken = self._size
        data = memoryview(b"".join(self._parts))
        self._parts.clear()
        return data


class RecordReader:
    """Reads a record from its beginning to its end, or to where it is cut.

    Attributes:
        is_cut: it ends before its end; known once it was read so far.
        whole_bytes: of the file, up to the end of the last whole chunk or attachment that was read.
        attachments: those that were read so far.
    """

    def __init__(self, file: IO[bytes], name: str) -> None:
        """A file that can be read anew from its beginning; `name`: as errors call it.

        Raises:
            RecordError: it is no MCAP file.
        """
        self._file, self._name = file, name
        self.is_cut = False
        self.whole_bytes = 0
        self.attachments: dict[str, bytes] = {}
        from mcap.writer import MCAP0_MAGIC

        file.seek(0)
        begin = file.read(len(MCAP0_MAGIC))
        if not MCAP0_MAGIC.startswith(begin):
            raise RecordError(f"{name} is no record of a run; expected an MCAP file")

    def read(self) -> RecordReader:
        """Passes over all of it, for what it says of itself."""
        for _ in self._records():
            pass
        return self

    def groups(self) -> Iterator[Group]:
        """The groups, oldest first."""
        from mcap.records import Channel, Chunk, Message
        from mcap.stream_reader import breakup_chunk

        topics: dict[int, str] = {}
        for record in self._records():
            if not isinstance(record, Chunk):
                continue
            try:
                _check_size(record)
                group = {}
                for one in breakup_chunk(record, validate_crc=True):
                    if isinstance(one, Channel):
                        topics[one.id] = one.topic
                    elif isinstance(one, Message):
                        group[topics[one.channel_id]] = unpacked(one.data)
            except _damages():
                self.is_cut = True
                return
            yield group

    def _records(self) -> Iterator[Any]:
        from mcap.records import Attachment, Chunk
        from mcap.stream_reader import StreamReader

        self.is_cut, self.attachments = False, {}
        whole = _Whole(self._file)
        file = cast(IO[bytes], whole)
        try:
            for record in StreamReader(file, emit_chunks=True, record_size_limit=2 * LARGEST_CHUNK).records:
                if isinstance(record, Attachment):
                    self.attachments[record.name] = record.data
                if isinstance(record, Attachment | Chunk):
                    self.whole_bytes = whole.read_bytes
                yield record
        except _damages():
            self.is_cut = True


class _Whole:
    """A file of which nothing is read in part: a shorter rest is its end. Several can read the same file in turns.

    Attributes:
        read_bytes: from its beginning.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.read_bytes = 0

    def read(self, size: int) -> bytes:
        """Raises EOFError."""
        self._file.seek(self.read_bytes)
        data = self._file.read(size)
        if len(data) < size:
            raise EOFError
        self.read_bytes += size
        return data


def _check_size(chunk: Any) -> None:
    import zstandard

    sizes = [chunk.uncompressed_size]
    if chunk.compression == "zstd":
        sizes.append(zstandard.frame_content_size(chunk.data))
    if max(sizes) > LARGEST_CHUNK:
        raise ValueError(f"a chunk of {max(sizes):,} B")


@cache
def _damages() -> tuple[type[Exception], ...]:
    from mcap.exceptions import McapError
    from zstandard import ZstdError

    return (McapError, ZstdError, struct.error, ValueError, KeyError, IndexError, OverflowError, EOFError)
