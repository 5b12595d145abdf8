"""Saved states of worlds without boards: what `Vehicle` and `Batch` give by `save()` and go on from by `restore()`.

The layout is

    MAGIC, length of the heading (4 bytes, little-endian), heading (JSON), numbers (vehicles/snapshot.c), SHA-256 of
    all that
"""

from __future__ import annotations

import hashlib
from typing import Any

import msgspec

from boebot.arguments import shown
from boebot.errors import BoebotError

MAGIC = b"boebot saved state\n"
FORMAT = 3  # changes with the headings, and with what follows them
_LENGTH = 4
_DIGEST = 32


class SavedStateError(BoebotError):
    """Bytes from which no world goes on."""


class World(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What a saved world was built of."""

    format: int
    model: str
    """fingerprint of the vehicle's model"""
    arena: str
    arena_fingerprint: str
    state_bytes: int
    """memory of the compiled brain"""


def fingerprint_of(*parts: Any) -> str:
    """A number that two descriptions share only if they are equal."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def encode(heading: World, rest: bytes) -> bytes:
    """The bytes of a state; `rest` follows the heading."""
    head = msgspec.json.encode(heading)
    data = MAGIC + len(head).to_bytes(_LENGTH, "little") + head + rest
    return data + hashlib.sha256(data).digest()


def decode(data: Any) -> tuple[World, bytes]:
    """The heading and what follows it.

    Raises:
        SavedStateError: this is no saved state, or one of another format, or it is damaged.
    """
    if not isinstance(data, bytes | bytearray | memoryview) or not bytes(data).startswith(MAGIC):
        raise SavedStateError(f"{shown(data)} is no saved state; expected the bytes that save() gave")
    body, digest = bytes(data[:-_DIGEST]), bytes(data[-_DIGEST:])
    if hashlib.sha256(body).digest() != digest:
        raise SavedStateError("the saved state is damaged or cut short: its checksum is wrong")
    at = len(MAGIC) + _LENGTH
    end = at + int.from_bytes(body[len(MAGIC) : at], "little")
    try:
        heading = msgspec.json.decode(body[at:end], type=dict[str, Any])
        if heading.get("format") != FORMAT:
            raise SavedStateError(f"the state was saved in format {heading.get('format')}; expected format {FORMAT}")
        return msgspec.json.decode(body[at:end], type=World), body[end:]
    except msgspec.DecodeError as error:
        raise SavedStateError(f"the heading of the saved state is wrong: {error}") from None
