"""Messages that are longer than CAN frames, by ISO-TP (ISO 15765-2): their id and payload as one datagram.

The identity goes this way. The protocol itself is can-isotp's.
"""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from typing import Any

from boebot_can.extra import import_extra
from boebot_can.frames import CanFrame
from boebot_can.layout import ISO_TP_TO_BOARD, ISO_TP_TO_HOST, NODE_SHIFT

_LONGEST = 255  # bytes of a datagram
_PARAMETERS = {
    "stmin": 0,  # no pause between frames
    "blocksize": 0,  # no further flow control
    "max_frame_size": _LONGEST,
    "rx_consecutive_frame_timeout": 500,  # ms
    "rx_flowcontrol_timeout": 500,
    "blocking_send": False,
}


class LongMessages:
    """One end of the datagrams between a host and the board of a node."""

    def __init__(self, node: int, send: Callable[[CanFrame], None], *, at_board: bool) -> None:
        """`send` puts a frame on the bus; `at_board`: this is the board's end."""
        own, other = (ISO_TP_TO_HOST, ISO_TP_TO_BOARD) if at_board else (ISO_TP_TO_BOARD, ISO_TP_TO_HOST)
        self._sends_as = own + (node << NODE_SHIFT)
        self.listens_to = other + (node << NODE_SHIFT)
        self._send_frame = send
        self._received: deque[CanFrame] = deque()
        self._layer: Any = None
        self.failed = 0  # datagrams that broke off

    def send(self, data: bytes) -> None:
        """Begins to send a datagram; `service` goes on."""
        self._opened().send(bytearray(data))
        self.service()

    def receive(self, frame: CanFrame) -> list[bytes]:
        """Takes a frame of `listens_to`; the datagrams that it completes."""
        self._opened()
        self._received.append(frame)
        return self.service()

    def service(self) -> list[bytes]:
        """Sends what is due; the datagrams that have come."""
        if self._layer is None:
            return []
        self._layer.process()
        found = []
        while self._layer.available():
            found.append(bytes(self._layer.recv()))
        return found

    def _opened(self) -> Any:
        if self._layer is None:
            isotp = import_extra("isotp")
            logging.getLogger("isotp").addHandler(logging.NullHandler())  # else its remarks go to standard error

            def take(_: float) -> Any:
                if not self._received:
                    return None
                frame = self._received.popleft()
                return isotp.CanMessage(arbitration_id=frame.identifier, data=bytearray(frame.data))

            def give(message: Any) -> None:
                self._send_frame(CanFrame(message.arbitration_id, bytes(message.data)))

            def fail(_: Exception) -> None:
                self.failed += 1

            address = isotp.Address(isotp.AddressingMode.Normal_11bits, txid=self._sends_as, rxid=self.listens_to)
            self._layer = isotp.TransportLayerLogic(take, give, address, fail, dict(_PARAMETERS))
        return self._layer
