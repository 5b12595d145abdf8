"""Messages as CAN frames, and CAN frames as messages (protocol/PROTOCOL.md, "On CAN").

Which bytes stand where is in `layout`, made from protocol/messages.toml. A message's frames are sent one after another;
the receiver counts those of which a part is missing.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from typing import NamedTuple

from boebot.link import messages
from boebot_can.layout import (
    ISO_TP_TO_BOARD,
    ISO_TP_TO_HOST,
    LAYOUTS,
    NODE_SHIFT,
    TIME_TO_LIVE_MS,
    Layout,
)

NODES = range(1, 8)
ALL_NODES = 0
NODE_MASK = 7 << NODE_SHIFT
_PARTS = bytes(range(17))
_ANSWERED = struct.Struct("<HH")  # the end of a set-point: time to live (ms), low 16 bits of the answered tick


class CanFrame(NamedTuple):
    """One CAN frame with an identifier of 11 bits."""

    identifier: int
    data: bytes


class CanMessage(NamedTuple):
    """A message that came in CAN frames.

    Attributes:
        id: of the message.
        payload: as on the serial line; of a set-point's tick only the low byte, see `whole_tick`.
        session: low byte of the session's number; None: the message has none.
        sequence: of a set-point, else None.
        node: 1 to 7; 0: to all.
    """

    id: int
    payload: bytes
    session: int | None
    sequence: int | None
    node: int


class ForeignFrameError(Exception):
    """A frame with one of our identifiers that none of our programs sends."""


@dataclass
class FrameMaker:
    """Makes the frames of one end.

    Attributes:
        node: of the board that they come from or go to.
    """

    node: int
    _rounds: dict[int, int] = field(default_factory=dict)

    def frames(self, message_id: int, payload: bytes, session: int, sequence: int) -> list[CanFrame]:
        """The frames of a message; none if it goes by ISO-TP.

        Args:
            message_id: of the message.
            payload: as on the serial line.
            session: the session's number, or its low byte.
            sequence: of the frame on the serial line; set-points carry it.
        """
        layout = LAYOUTS.get(message_id)
        if layout is None:
            return []
        count = self._rounds[message_id] = (self._rounds.get(message_id, 0) + 1) & 0xFF
        time_to_live = 0
        if layout.is_set_point:
            wanted, _ = _ANSWERED.unpack_from(payload, layout.length - _ANSWERED.size)
            time_to_live = max(wanted // TIME_TO_LIVE_MS, 1) if wanted else 0  # 0: the board's own; never longer
        added = bytes((count, session & 0xFF, sequence, min(time_to_live, 0xFF)))
        source = (payload + added + _PARTS).ljust(256)  # each place that a choice names becomes the byte there
        base = self.node << NODE_SHIFT
        return [
            CanFrame(base + identifier, choice.translate(source))
            for identifier, choice in zip(layout.identifiers, layout.choices, strict=True)
        ]


class _Part(NamedTuple):
    """What an identifier at node 0 stands for."""

    message_id: int
    layout: Layout
    place: int  # among the message's frames
    size: int
    number: int | None  # the part's number in the second byte; None: it has none


def _parts() -> dict[int, _Part]:
    found = {}
    for message_id, layout in LAYOUTS.items():
        extra = layout.length + 4  # behind round, session, sequence and time to live: the numbers 0, 1, 2, ...
        for place, (identifier, choice) in enumerate(zip(layout.identifiers, layout.choices, strict=True)):
            number = place + 1 if len(choice) > 1 and choice[1] == extra + place + 1 else None
            found[identifier] = _Part(message_id, layout, place, len(choice), number)
    return found


PARTS = _parts()
SET_POINTS = frozenset(identifier for identifier, part in PARTS.items() if part.layout.is_set_point)
(STOP,) = LAYOUTS[messages.Stop.ID].identifiers  # the one message that may go to all nodes
_ASKING = LAYOUTS[messages.Open.ID].identifiers + LAYOUTS[messages.Describe.ID].identifiers


@dataclass
class Assembler:
    """Puts the frames of one direction together again.

    Attributes:
        to_board: takes the frames to the board, else those to the host.
        nodes: takes frames of these nodes.
        lost: messages of which a frame was missing.
    """

    to_board: bool
    nodes: frozenset[int]
    lost: int = 0
    _begun: dict[int, list[bytes]] = field(default_factory=dict)  # first identifier with its node -> frames so far

    def takes(self, identifier: int) -> bool:
        """Whether a frame of that identifier is for this end."""
        node, own = identifier >> NODE_SHIFT & 7, identifier & ~NODE_MASK
        if identifier & 1 == self.to_board or node not in self.nodes or (node == ALL_NODES and own != STOP):
            return False
        return own in PARTS or own in (ISO_TP_TO_BOARD, ISO_TP_TO_HOST)

    def sends(self, identifier: int) -> bool:
        """Whether frames of that identifier come from this end alone: those of its node in the other direction, but
        for the handshake's. Several hosts may ask for a session at a time."""
        node, own = identifier >> NODE_SHIFT & 7, identifier & ~NODE_MASK
        if identifier & 1 != self.to_board or node == ALL_NODES or node not in self.nodes:
            return False
        return (own in PARTS and own not in _ASKING) or own == ISO_TP_TO_HOST

    def add(self, frame: CanFrame) -> CanMessage | None:
        """Takes a frame; the message that it completes, if any.

        Raises:
            ForeignFrameError: the frame has not the form that its identifier demands.
        """
        node = frame.identifier >> NODE_SHIFT & 7
        message_id, layout, place, size, number = PARTS[frame.identifier & ~NODE_MASK]
        data = frame.data
        if len(data) != size or (number is not None and data[1] != number):
            raise ForeignFrameError(
                f"a frame {frame.identifier:#05x} with {len(data)} bytes; expected {size}"
                if len(data) != size
                else f"a frame {frame.identifier:#05x} that calls itself part {data[1]}; expected {number}"
            )
        if len(layout.identifiers) > 1:
            key = layout.identifiers[0] + (node << NODE_SHIFT)
            begun = self._begun.get(key, [])
            if place == 0:
                self.lost += bool(begun)
                self._begun[key] = [data]
                return None
            if place != len(begun) or begun[0][0] != data[0]:
                self.lost += bool(begun)
                self._begun.pop(key, None)
                return None
            begun.append(data)
            if place + 1 < len(layout.identifiers):
                return None
            del self._begun[key]
            data = b"".join(begun)
        return _message(message_id, layout, data, node)


def _message(message_id: int, layout: Layout, data: bytes, node: int) -> CanMessage:
    payload = layout.payload.translate(data.ljust(256, b"\0"))
    session = data[layout.session] if layout.session >= 0 else None
    if not layout.is_set_point:
        return CanMessage(message_id, payload, session, None, node)
    count, tick = _ANSWERED.unpack_from(payload, layout.length - _ANSWERED.size)
    payload = payload[: -_ANSWERED.size] + _ANSWERED.pack(count * TIME_TO_LIVE_MS, tick)
    return CanMessage(message_id, payload, session, data[layout.session + 1], node)


def whole_tick(payload: bytes, newest_tick: int) -> bytes:
    """A set-point's payload with 16 bits of its tick in place of 8: the latest one up to the board's newest.

    Args:
        payload: with the low byte of the tick alone.
        newest_tick: of the board's telemetry.
    """
    wanted, low = _ANSWERED.unpack_from(payload, len(payload) - _ANSWERED.size)
    tick = newest_tick - ((newest_tick - low) & 0xFF)
    return payload[: -_ANSWERED.size] + _ANSWERED.pack(wanted, tick & 0xFFFF)
