"""Chunks and attachments of a record, as their checksums prove that they were written (MCAP: mcap.dev/spec)."""

from __future__ import annotations

import io
import struct
import zlib
from functools import partial
from itertools import islice

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.records import Attachment, Chunk, Message
from mcap.stream_reader import breakup_chunk
from zstandard import ZstdDecompressor, ZstdError

from boebot.record.blocks import Kept, unpacked

PIECE = 1 << 16  # B, that are unpacked at a time
_DAMAGES = (McapError, ZstdError, struct.error, ValueError, LookupError, OverflowError, EOFError)


def group(body: bytes, most: int) -> Kept | None:
    """The group of a chunk of up to `most` bytes; None: it is not sound."""
    try:
        stream = ReadDataStream(io.BytesIO(body))
        chunk = Chunk.read(stream)
        with ZstdDecompressor().stream_reader(chunk.data) as parts:  # piece by piece, whatever size it claims
            data = b"".join(islice(iter(partial(parts.read, PIECE), b""), most // PIECE))
        is_whole = (stream.count, len(data), chunk.compression) == (len(body), chunk.uncompressed_size, "zstd")
        if not is_whole or zlib.crc32(data) != chunk.uncompressed_crc:
            return None
        chunk.compression, chunk.data = "", data
        messages = [record for record in breakup_chunk(chunk) if isinstance(record, Message)]
        ((number, begin_ns, end_ns),) = {(one.sequence, one.publish_time, one.log_time) for one in messages}
        return Kept(number, begin_ns / 1e9, end_ns / 1e9, dict(unpacked(one.data) for one in messages))
    except _DAMAGES:
        return None


def attachment(body: bytes) -> dict[str, bytes] | None:
    """An attachment by its name; None: it is not sound."""
    try:
        stream = ReadDataStream(io.BytesIO(body))
        found = Attachment.read(stream)
        is_whole = stream.count == len(body) and zlib.crc32(body[:-4]) == int.from_bytes(body[-4:], "little")
        return {found.name: found.data} if is_whole else None
    except _DAMAGES:
        return None
