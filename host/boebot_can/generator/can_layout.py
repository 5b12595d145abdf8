"""How messages go over CAN: which bytes stand in which frame (PROTOCOL.md, "On CAN").

A CAN frame carries at most 8 bytes: those of the payload, in its order, without a number split between two frames, and
some that are added in place of what a frame on the serial line has around its payload:

    message of one frame          fields, session
    set-point                     fields, session, sequence; `time_to_live` and `answers_tick` as one byte each
    several frames, with a tick   tick (4 bytes), fields | tick (low byte), part, fields | ... | ..., session
    several frames, without       round, part, fields | round, part, fields | ... | ..., session

`round` counts the messages of that kind, so that frames of two are not taken for one. `session` is the low byte of the
session's number; the handshake and stops have none. A number whose range needs fewer bytes than its type is sent
in as few. Messages without an identifier go by ISO-TP (ISO 15765-2), behind a byte with their id.
"""

from __future__ import annotations

from typing import NamedTuple

import schema

DATA_BYTES = 8
NODES = range(1, 8)  # 0 means all
NODE_SHIFT = 5
CLASS_SHIFT = 8
ISO_TP_IDS = {"to_board": 0x51E, "to_host": 0x51F}  # at node 0, as `can_id`
TIME_TO_LIVE_MS = 10  # one count of a set-point's time to live
CLASSES = (
    "stop",
    "set-point",
    "acknowledgement, event",
    "fast telemetry",
    "slow telemetry",
    "parameters",
    "heartbeat, session",
)

# What is added behind the payload before bytes are chosen from both: see `Frame.choice`.
ROUND, SESSION, SEQUENCE, TIME_TO_LIVE, PART = range(5)


class Place(NamedTuple):
    """Some bytes of a CAN frame.

    Attributes:
        name: of the signal.
        at: first byte in the frame.
        size: bytes.
        field: the message's field of which they are, else None.
        start: first of them in that field.
        source: first of them in the payload, or in what is added behind it.
    """

    name: str
    at: int
    size: int
    field: schema.Field | None
    start: int
    source: int

    @property
    def counts_time_to_live(self) -> bool:
        """Whether it is a set-point's time to live, in counts of 10 ms."""
        return self.field is not None and self.field.name == "time_to_live"

    @property
    def is_low_byte(self) -> bool:
        """Whether it is only the low byte of a longer number."""
        return self.field is not None and self.size == 1 and self.field.greatest > 255


class Frame(NamedTuple):
    """One CAN frame of a message; `part` counts from 1."""

    identifier: int  # at node 0
    name: str
    part: int
    places: list[Place]

    @property
    def size(self) -> int:
        """Data bytes."""
        return sum(place.size for place in self.places)

    @property
    def choice(self) -> list[int]:
        """For each data byte its place in: payload, round, session, sequence, time to live, 0, 1, 2, ... (parts)."""
        return [place.source + i for place in self.places for i in range(place.size)]


def frames(message: schema.Message) -> list[Frame]:
    """The CAN frames of a message; none if it goes by ISO-TP.

    Raises:
        ValueError: its identifier is none for it, or its frames run out of identifiers.
    """
    if not message.can_id:
        return []
    pieces = [piece for field, offset in _fields(message) for piece in _pieces(message, field, offset)]
    pieces += [Place(name, 0, 1, None, 0, message.length + of) for name, of in _endings(message)]
    packed = [pieces] if sum(piece.size for piece in pieces) <= DATA_BYTES else _in_parts(message, pieces)
    found = []
    for part, places in enumerate(packed, start=1):
        name = message.name if len(packed) == 1 else f"{message.name}_{part}"
        at, placed = 0, []
        for place in places:
            placed.append(place._replace(at=at))
            at += place.size
        found.append(Frame(message.can_id + 2 * (part - 1), name, part, placed))
    _check(message, found)
    return found


def payload_choice(message: schema.Message) -> list[int]:
    """For each payload byte its place in the data of the message's frames, one after another, and a NUL behind them.
    Of a set-point's time to live (in counts of 10 ms) and tick the low byte alone is there."""
    data = [source for frame in frames(message) for source in frame.choice]
    chosen = [data.index(source) if source in data else len(data) for source in range(message.length)]
    for field, offset in _fields(message):
        if message.delivery == "set_point" and field.name == "time_to_live":
            chosen[offset] = data.index(message.length + TIME_TO_LIVE)
    return chosen


def session_place(message: schema.Message) -> int:
    """Where the session's byte stands in the data of the message's frames; -1: nowhere."""
    data = [source for frame in frames(message) for source in frame.choice]
    return data.index(message.length + SESSION) if message.length + SESSION in data else -1


def _fields(message: schema.Message) -> list[tuple[schema.Field, int]]:
    """The fields, each with its offset in the payload."""
    offsets = [sum(field.size for field in message.fields[:i]) for i in range(len(message.fields))]
    return list(zip(message.fields, offsets, strict=True))


def _pieces(message: schema.Message, field: schema.Field, offset: int) -> list[Place]:
    """A field in pieces that are not split: one, but for a long text."""
    if message.delivery == "set_point" and field.name == "time_to_live":
        return [Place(field.name, 0, 1, field, 0, message.length + TIME_TO_LIVE)]
    if message.delivery == "set_point" and field.name == "answers_tick":
        return [Place(field.name, 0, 1, field, 0, offset)]
    if field.text_length:
        room = DATA_BYTES - 2
        cuts = range(0, field.text_length, room)
        sizes = [min(room, field.text_length - cut) for cut in cuts]
        return [
            Place(f"{field.name}_{i}", 0, size, field, cut, offset + cut)
            for i, (cut, size) in enumerate(zip(cuts, sizes, strict=True), start=1)
        ]
    size = field.size if field.least < 0 else max(1, (field.greatest.bit_length() + 7) // 8)
    return [Place(field.name, 0, size, field, 0, offset)]


def _endings(message: schema.Message) -> list[tuple[str, int]]:
    """What stands behind a message's fields."""
    if message.delivery in ("handshake", "stop") or message.name == "close":  # close names its session itself
        return []
    return [("session", SESSION), ("sequence", SEQUENCE)][: 2 if message.delivery == "set_point" else 1]


def _in_parts(message: schema.Message, pieces: list[Place]) -> list[list[Place]]:
    """The pieces in several frames, with what each begins with."""
    has_tick = pieces[0].name == "tick" and pieces[0].size == 4
    count = (
        Place("tick", 0, 1, pieces[0].field, 0, 0)
        if has_tick
        else Place("round", 0, 1, None, 0, message.length + ROUND)
    )
    parts: list[list[Place]] = [[]]
    if not has_tick:
        parts[0] = [count, _part_number(message, 1)]
    for piece in pieces:
        if sum(place.size for place in parts[-1]) + piece.size > DATA_BYTES:
            parts.append([count, _part_number(message, len(parts) + 1)])
        parts[-1].append(piece)
    return parts


def _part_number(message: schema.Message, part: int) -> Place:
    return Place("part", 0, 1, None, 0, message.length + PART + part)


def _check(message: schema.Message, found: list[Frame]) -> None:
    """Refuses identifiers that break the rules above."""
    first, last = found[0].identifier, found[-1].identifier
    if first >> NODE_SHIFT & 7 or not 0 < first < len(CLASSES) << CLASS_SHIFT:
        raise ValueError(
            f"message {message.name}: can_id {first:#05x}; expected one of node 0 and of a class below {len(CLASSES)}"
        )
    if first % 2 != (message.direction == "to_host"):
        raise ValueError(
            f"message {message.name}: can_id {first:#05x}; expected an even one to the board, an odd one to the host"
        )
    if first >> NODE_SHIFT != last >> NODE_SHIFT:
        raise ValueError(
            f"message {message.name}: {len(found)} CAN frames from can_id {first:#05x} on run into another class"
        )


def identifiers(spec: schema.Schema) -> dict[int, tuple[schema.Message, Frame]]:
    """Each identifier at node 0 with its message and frame.

    Raises:
        ValueError: two messages share one, or one is that of ISO-TP.
    """
    found: dict[int, tuple[schema.Message, Frame]] = {}
    for message in spec.message:
        for frame in frames(message):
            if frame.identifier in found or frame.identifier in ISO_TP_IDS.values():
                other = found[frame.identifier][0].name if frame.identifier in found else "ISO-TP"
                raise ValueError(
                    f"message {message.name}: its CAN identifier {frame.identifier:#05x} is that of {other}"
                )
            found[frame.identifier] = message, frame
    return dict(sorted(found.items()))
