"""Saved states: what `Sim`, `Vehicle` and `Batch` give by `save()` and go on from by `restore()`.

One format for both kinds. The state of a *world* without boards is its numbers (vehicles/snapshot.c). A *simulation*
with boards is all that came from outside up to a cycle (loop/inputs.c), and a hash of its state: a run is a function of
these, bit for bit (docs/explanation/world.md), so the inputs are replayed to a simulation that was built alike, and the
hash shows that it came to the same state. The layout is

    MAGIC, length of the heading (4 bytes, little-endian), heading (JSON), numbers or inputs, SHA-256 of all that
"""

from __future__ import annotations

import hashlib
from typing import Any, TypeVar

import msgspec

from boebot.arguments import shown
from boebot.errors import BoebotError

MAGIC = b"boebot saved state\n"
FORMAT = 2  # changes with the headings, and with what follows them
_LENGTH = 4
_DIGEST = 32


class SavedStateError(BoebotError):
    """A state cannot be saved, or bytes cannot be restored."""


class World(msgspec.Struct, forbid_unknown_fields=True, frozen=True, tag_field="kind", tag="world"):
    """What a saved world was built of."""

    format: int
    model: str
    """fingerprint of the vehicle's model"""
    arena: str
    arena_fingerprint: str
    state_bytes: int
    """memory of the compiled brain"""


class SavedRobot(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One robot of a saved simulation."""

    number: int
    name: str
    built: str
    """fingerprint of its description, start and imperfections"""
    firmware: str
    """SHA-256 of the firmware; empty for a robot without a board"""
    waiting: int
    """bytes that had come from its board and were not yet read"""


class Simulation(msgspec.Struct, forbid_unknown_fields=True, frozen=True, tag_field="kind", tag="simulation"):
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


Heading = TypeVar("Heading", World, Simulation)


def encode(heading: World | Simulation, rest: bytes) -> bytes:
    """The bytes of a state; `rest` follows the heading."""
    head = msgspec.json.encode(heading)
    data = MAGIC + len(head).to_bytes(_LENGTH, "little") + head + rest
    return data + hashlib.sha256(data).digest()


def decode(data: Any, kind: type[Heading]) -> tuple[Heading, bytes]:
    """The heading, of that kind, and what follows it.

    Raises:
        SavedStateError: this is no saved state, or one of another kind or format, or it is damaged.
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
        wanted = kind.__struct_config__.tag
        if heading.get("kind") != wanted:
            raise SavedStateError(f"this is the saved state of a {heading.get('kind')}; expected that of a {wanted}")
        return msgspec.json.decode(body[at:end], type=kind), body[end:]
    except msgspec.DecodeError as error:
        raise SavedStateError(f"the heading of the saved state is wrong: {error}") from None


def check_alike(saved: Simulation, here: Simulation) -> None:
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
