"""Blocks: consecutive rows (time, bytes) of one stream of a record, as they are kept in memory and on disk.

On disk a block is a Protobuf message, `boebot.Block`; its schema, which goes into each file, is made here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Row = tuple[float, bytes]
SCHEMA = "boebot.Block"


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Rows of one stream, oldest first.

    Attributes:
        times: of each row (s), shape (n,).
        data: the bytes of all rows, one after another.
        sizes: of each row's bytes (B), shape (n,); shape (1,): all rows have that size.
    """

    times: NDArray[np.float64]
    data: bytes
    sizes: NDArray[np.uint32]

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Block:
        """Of one row or more."""
        sizes = [len(data) for _, data in rows]
        if sizes.count(sizes[0]) == len(sizes):
            del sizes[1:]
        return cls(
            np.array([time for time, _ in rows]), b"".join([data for _, data in rows]), np.array(sizes, np.uint32)
        )

    def __len__(self) -> int:
        return len(self.times)

    def table(self, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Its rows, which all have this form, shape (n,).

        Raises:
            ValueError: they have not.
        """
        if len(self) and self.sizes.tolist() != [dtype.itemsize]:
            raise ValueError(f"rows of other than {dtype.itemsize} B")
        return np.frombuffer(self.data, dtype=dtype)

    def part(self, begin: int, end: int) -> Block:
        """Its rows from `begin` to before `end`."""
        if len(self.sizes) == 1:
            size = int(self.sizes[0])
            return Block(self.times[begin:end], self.data[begin * size : end * size], self.sizes)
        ends = np.concatenate(([0], np.cumsum(self.sizes, dtype=np.int64)))
        return Block(self.times[begin:end], self.data[ends[begin] : ends[end]], self.sizes[begin:end])

    def rows(self) -> list[Row]:
        """Each row by itself."""
        ends = np.cumsum(np.broadcast_to(self.sizes, len(self.times)), dtype=np.int64).tolist()
        begins = [0, *ends][:-1]
        times = self.times.tolist()
        return [(time, self.data[begin:end]) for time, begin, end in zip(times, begins, ends, strict=True)]


EMPTY = Block(np.empty(0), b"", np.zeros(1, np.uint32))
Group = Mapping[str, Block]
"""What came in one stretch of a run, at most a second of the wall clock: a block of each stream that had rows."""


class Kept(NamedTuple):
    """A group as a record has it: its number from 0, and the times of the run (s) that it lies between."""

    number: int
    begin_s: float
    end_s: float
    group: Group


Rows = Mapping[str, Sequence[Row] | Block]
"""The same, as it comes."""


def group_of(rows: Rows) -> Group:
    """Its blocks."""
    return {name: some if isinstance(some, Block) else Block.of(some) for name, some in rows.items() if some}


def joined(*blocks: Block | None) -> Block:
    """One block after another; at least one is there."""
    there = [block for block in blocks if block is not None]
    if len(there) == 1:
        return there[0]
    sizes = there[0].sizes
    if any(len(block.sizes) != 1 or block.sizes[0] != sizes[0] for block in there):
        each = [np.broadcast_to(block.sizes, len(block)) for block in there]
        sizes = np.concatenate(each).astype(np.uint32)
    return Block(np.concatenate([block.times for block in there]), b"".join(block.data for block in there), sizes)


def merged(groups: Sequence[Group]) -> Group:
    """Groups that follow each other, as one."""
    names = dict.fromkeys(name for group in groups for name in group)
    return {name: joined(*chain(groups, name)) for name in names}


def few(count: int, most: int | None) -> NDArray[np.intp]:
    """Indices of about `most` of that many rows, evenly, the first and the last among them; None: of all."""
    stride = 1 if most is None else max(1, -(-count // max(1, most)))
    return np.unique(np.append(np.arange(0, count, stride), np.arange(count)[-1:]))


def schema() -> bytes:
    """Of a block on disk: a FileDescriptorSet, as MCAP wants it for Protobuf."""
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    return FileDescriptorSet(file=[_descriptor()]).SerializeToString()


def packed(block: Block, stream: str = "") -> bytes:
    """A block as it stands on disk, with the name of its stream: MCAP says that once for all, in a chunk that may be
    lost."""
    message = _message_class()(data=block.data, stream=stream)
    message.time.extend(block.times.tolist())
    message.size.extend(block.sizes.tolist())
    packed: bytes = message.SerializeToString()
    return packed


def unpacked(data: bytes) -> tuple[str, Block]:
    """Its stream and the block of those bytes.

    Raises:
        ValueError: they are none.
    """
    from google.protobuf.message import DecodeError

    try:
        message = _message_class().FromString(data)
    except DecodeError as error:
        raise ValueError(f"no block: {error}") from None
    block = Block(np.array(message.time, dtype=np.float64), message.data, np.array(message.size, dtype=np.uint32))
    count = len(block)
    is_sound = count > 0 and len(block.sizes) in (1, count)
    if not is_sound or int(np.broadcast_to(block.sizes, count).sum()) != len(block.data):
        raise ValueError(f"no block: {count} times, {len(block.sizes)} sizes and {len(block.data)} bytes")
    return message.stream, block


def chain(groups: Iterable[Group], stream: str) -> Iterator[Block]:
    """The blocks of one stream."""
    for group in groups:
        if stream in group:
            yield group[stream]


@cache
def _descriptor() -> Any:
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto

    file = FileDescriptorProto(name="boebot/block.proto", package="boebot", syntax="proto3")
    message = file.message_type.add(name="Block")
    kinds = FieldDescriptorProto
    message.field.add(name="time", number=1, label=kinds.LABEL_REPEATED, type=kinds.TYPE_DOUBLE)
    message.field.add(name="data", number=2, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_BYTES)
    message.field.add(name="size", number=3, label=kinds.LABEL_REPEATED, type=kinds.TYPE_UINT32)
    message.field.add(name="stream", number=4, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_STRING)
    return file


@cache
def _message_class() -> Any:
    from google.protobuf import message_factory
    from google.protobuf.descriptor_pool import DescriptorPool

    pool = DescriptorPool()
    pool.Add(_descriptor())
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(SCHEMA))
