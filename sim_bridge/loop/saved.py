"""A simulation as bytes: what it was built of, all that came from outside up to a cycle, and a hash of its state.

A run is a function of these, bit for bit (docs/explanation/world.md), so that the state is not written down but gone to
again: the inputs are played to a simulation that was built alike, and the hash tells that it came to the same state.
The layout is

    MAGIC, length of the heading (4 bytes, little-endian), heading (JSON), inputs (inputs.c), SHA-256 of all that
"""

from __future__ import annotations

import hashlib
from typing import Any

import msgspec

from boebot.errors import BoebotError

MAGIC = b"boebot simulation\n"
FORMAT = 1
_LENGTH = 4
_DIGEST = 32


class SavedStateError(BoebotError):
    """A simulation cannot be saved, or bytes cannot be restored."""


class SavedRobot(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One robot of a saved simulation."""

    number: int
    name: str
    built: str
    """fingerprint of its description, start and imperfections"""
    firmware: str
    """SHA-256 of the firmware; empty for a robot without a board"""
    waiting: int
    """bytes that had come from its board and were not yet taken"""


class Heading(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What a saved simulation was built of, and where it stood."""

    format: int
    cycle: int
    state: str
    """hash of the state at that cycle"""
    seed: int
    noise: bool
    record: bool
    step_cycles: int
    arena: str
    arena_fingerprint: str
    robots: list[SavedRobot]


def fingerprint_of(*parts: Any) -> str:
    """A number that two descriptions share only if they are equal."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def encode(heading: Heading, inputs: bytes) -> bytes:
    """The bytes of a simulation."""
    head = msgspec.json.encode(heading)
    data = MAGIC + len(head).to_bytes(_LENGTH, "little") + head + inputs
    return data + hashlib.sha256(data).digest()


def decode(data: bytes) -> tuple[Heading, bytes]:
    """Heading and inputs.

    Raises:
        SavedStateError: these are no such bytes, or they are damaged, or of another format.
    """
    if not isinstance(data, bytes | bytearray | memoryview) or not bytes(data).startswith(MAGIC):
        raise SavedStateError("this is no saved simulation; expected what Sim.save() gave")
    body, digest = bytes(data[:-_DIGEST]), bytes(data[-_DIGEST:])
    if hashlib.sha256(body).digest() != digest:
        raise SavedStateError("the saved simulation is damaged or cut short: its checksum is wrong")
    at = len(MAGIC) + _LENGTH
    end = at + int.from_bytes(body[len(MAGIC) : at], "little")
    try:
        form = msgspec.json.decode(body[at:end], type=dict[str, Any]).get("format")
        if form != FORMAT:
            raise SavedStateError(f"the simulation was saved in format {form}; expected format {FORMAT}")
        return msgspec.json.decode(body[at:end], type=Heading), body[end:]
    except msgspec.DecodeError as error:
        raise SavedStateError(f"the heading of the saved simulation is wrong: {error}") from None


def check_alike(saved: Heading, here: Heading) -> None:
    """Refuses to restore a simulation that was built otherwise.

    Raises:
        SavedStateError: one sentence names the first difference.
    """
    if saved.arena_fingerprint != here.arena_fingerprint:
        raise SavedStateError(_another("arena", saved.arena, here.arena))
    for what in ("seed", "noise", "record", "step_cycles"):
        if getattr(saved, what) != getattr(here, what):
            raise SavedStateError(_another(what, getattr(saved, what), getattr(here, what)))
    theirs, ours = ([robot.number for robot in heading.robots] for heading in (saved, here))
    if theirs != ours:
        raise SavedStateError(_another("robots with the numbers", theirs, ours))
    for there, robot in zip(saved.robots, here.robots, strict=True):
        if there.built != robot.built:
            what = f"robot {robot.number}, with its description, start and imperfections,"
            raise SavedStateError(_another(what, there.name, robot.name))
        if there.firmware != robot.firmware:
            raise SavedStateError(f"robot {robot.number} of the saved simulation ran another firmware image")


def _another(what: str, there: object, here: object) -> str:
    """The sentence about something that is different; two of one name may be."""
    if there == here:
        return f"{what} {there!r} of the saved simulation differs from the one here"
    return f"the saved simulation has {what} {there!r}; this one has {here!r}"
