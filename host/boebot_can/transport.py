"""A board on a CAN bus as a transport of the link: `can:INTERFACE:CHANNEL?node=2&...`."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping

from boebot.errors import BoardError
from boebot_can.bus import Bus, BusName, PythonCanBus
from boebot_can.frames import NODE_MASK, NODES, STOP, CanFrame, ForeignFrameError
from boebot_can.iso_tp import LongMessages
from boebot_can.load import BusLoad
from boebot_can.translator import HostEnd

_SLICE_S = 0.05  # the end of a bus is noticed within this time


def open_can(url: str) -> CanTransport:
    """Joins the bus that a URL names: `can:` and the bus's name, with the robot's `node` among its settings (else 1).

    Raises:
        BoardError: as `BusName.parse` and `PythonCanBus`; or no such node.
    """
    text = url.removeprefix("can:")
    name = BusName.parse(text)
    settings = dict(name.settings)
    node = check_node(settings.pop("node", 1))
    bitrate = settings.get("bitrate")
    load = BusLoad(bitrate) if isinstance(bitrate, int) and bitrate > 0 else BusLoad()
    plain = re.sub(r"(?<=[?&])node=[^&]*&?", "", text).rstrip("?&")
    return CanTransport(url, PythonCanBus(BusName(plain, name.interface, name.channel, settings)), node, load)


def check_node(node: object) -> int:
    """A robot's number on a bus.

    Raises:
        BoardError: it is none.
    """
    if not isinstance(node, int) or node not in NODES:
        raise BoardError(f"there is no node {node!r} on a CAN bus; expected {NODES[0]} to {NODES[-1]}")
    return node


class CanTransport:
    """The link's bytes to and from the board of one node."""

    realtime = True

    def __init__(self, name: str, bus: Bus, node: int, load: BusLoad | None = None) -> None:
        """Takes over the bus."""
        self.name = name
        self._bus = bus
        self._load = load or BusLoad()
        self._long = LongMessages(node, lambda frame: self._send([frame]), at_board=False)
        self._end = HostEnd(node, self._long.send)
        self._is_shared = False
        self._closed = False

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """What arrived, as soon as there is a whole message, at the latest after `wait_s`."""
        del quiet_s
        if self._closed:
            raise BoardError(f"{self.name} is closed")
        until = self.now() + wait_s
        left = wait_s
        while True:
            frames = self._bus.receive(min(max(left, 0.0), _SLICE_S))
            data = b"".join(self._received(frame) for frame in frames)
            data += b"".join(self._end.long_bytes(datagram) for datagram in self._long.service())
            left = until - self.now()
            if data or left <= 0:
                return data

    def write(self, data: bytes) -> None:
        """Sends bytes of the link, as frames."""
        if self._closed:
            raise BoardError(f"{self.name} is closed")
        frames = self._end.frames(data)
        self._send(self._end.fresh(frames) if self._bus.is_behind else frames)

    def now(self) -> float:
        """The finest clock that never goes back (s), `time.perf_counter()`."""
        return time.perf_counter()

    def close(self) -> None:
        """Leaves the bus."""
        self._closed = True
        self._bus.close()

    def figures(self) -> Mapping[str, float | None]:
        """Of the bus: the share of the last second for which it was busy, stuffed bits counted; error frames; messages
        to this host of which a frame was missing, and those that were of another session."""
        load = self._load.share(self.now())
        return {
            "bus_load": None if load is None else round(load, 4),
            "bus_error_frames": self._bus.errors,
            "bus_lost_messages": self._end.assembler.lost,
            "bus_stale_messages": self._end.stale,
        }

    def _send(self, frames: list[CanFrame]) -> None:
        now = self.now()
        for frame in frames:
            self._load.add(now, frame)
        self._bus.send(frames, now)

    def _received(self, frame: CanFrame) -> bytes:
        """The bytes that a frame completes."""
        self._load.add(self.now(), frame)
        if not self._end.assembler.takes(frame.identifier):
            if self._is_shared or not (self._end.is_open and self._end.assembler.sends(frame.identifier)):
                return b""
            self._is_shared = True  # said once: what ends the run wants its answers
            self._send([CanFrame(STOP | frame.identifier & NODE_MASK, bytes(1))])
            raise BoardError(
                f"another program sends to the board at {self.name}, too (frame {frame.identifier:#05x}); expected "
                "each board to have one host: the motors were stopped"
            )
        if frame.identifier == self._long.listens_to:
            return b"".join(self._end.long_bytes(datagram) for datagram in self._long.receive(frame))
        try:
            return self._end.to_link(frame)
        except ForeignFrameError as error:
            raise BoardError(f"somebody else uses the board's identifiers on {self.name}: {error}") from None
