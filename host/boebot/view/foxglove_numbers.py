"""Rows of numbers as Protobuf messages of doubles, for foxglove.mcap: what Foxglove can plot over time.

A row's bytes are made by numpy, thousands of rows at once: each field is its tag and eight bytes, so that all messages
of a kind have the same length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_DOUBLE = 1  # Protobuf's wire type of 64-bit numbers
_ONE_BYTE_TAGS = 16  # fields from this number on have a tag of two bytes


def descriptor(name: str, fields: Sequence[str]) -> Any:
    """Of the message `boebot.NAME`, whose fields are doubles."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto
    from google.protobuf.descriptor_pool import DescriptorPool

    name = "".join(letter if letter.isascii() else "_" for letter in name)  # as Protobuf's names are
    file = FileDescriptorProto(name=f"boebot/{name}.proto", package="boebot", syntax="proto3")
    message = file.message_type.add(name=name)
    kinds = FieldDescriptorProto
    for number, field in enumerate(fields, 1):
        message.field.add(name=field, number=number, label=kinds.LABEL_OPTIONAL, type=kinds.TYPE_DOUBLE)
    pool = DescriptorPool()
    pool.Add(file)
    return pool.FindMessageTypeByName(f"boebot.{name}")


def packed(columns: Mapping[str, NDArray[Any]]) -> list[bytes]:
    """A message for each row of these columns of equal length, whose order is that of `descriptor`'s fields."""
    tags = [_tag(number) for number in range(1, len(columns) + 1)]
    parts = [part for tag in tags for part in ((f"tag_{tag.hex()}", f"V{len(tag)}"), (f"value_{tag.hex()}", "<f8"))]
    rows = np.empty(len(next(iter(columns.values()))), dtype=np.dtype(parts))
    for tag, values in zip(tags, columns.values(), strict=True):
        rows[f"tag_{tag.hex()}"] = np.void(tag)
        rows[f"value_{tag.hex()}"] = values
    data, size = rows.tobytes(), rows.dtype.itemsize
    return [data[begin : begin + size] for begin in range(0, len(data), size)]


def _tag(number: int) -> bytes:
    tag = number << 3 | _DOUBLE
    return bytes([tag]) if number < _ONE_BYTE_TAGS else bytes([tag & 0x7F | 0x80, tag >> 7])
