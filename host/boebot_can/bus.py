"""CAN buses by name: those of python-can, whatever its interface.

    INTERFACE:CHANNEL[?KEY=VALUE&...]       socketcan:can0, virtual:lab, socketcand:can0?host=localhost&port=29536

The keys are the interface's own, as python-can names them.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import select
import socket
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import unquote

from boebot.errors import BoardError, did_you_mean
from boebot.link.ports import CONNECT_S, why_not_connected
from boebot_can.extra import import_extra
from boebot_can.frames import CanFrame

_ERR_ACK = 0x20  # error frame of SocketCAN: nobody acknowledged (linux/can/error.h)
_ERR_BUS_OFF = 0x40
_AT_ONCE = 1000  # most frames of one look: a flood must not keep the board unheard
BEHIND_S = 1.0
_LEAVE_S = 0.2  # that the other side has to close a connection
_READ_BYTES = 65536
_ECHOES = 4096  # newest own frames that are known again where an interface brings them back
_DEFAULTS: dict[str, dict[str, Any]] = {
    "udp_multicast": {"hop_limit": 0},  # they stay on this computer
    "socketcand": {"host": "localhost", "tcp_tune": True},
}


class Bus(Protocol):
    """Frames to and from everybody on a bus."""

    @property
    def name(self) -> str:
        """How people call it."""

    @property
    def errors(self) -> int:
        """Error frames seen."""

    @property
    def is_behind(self) -> bool:
        """Whether frames wait faster than `receive` fetches them: the next one may be older than `BEHIND_S`."""

    def send(self, frames: Iterable[CanFrame], stamp_s: float) -> None:
        """Puts frames on the bus; `stamp_s`: since when they were there, where the bus keeps stamps.

        Raises:
            BoardError: the bus has gone, or nobody acknowledges.
        """

    def receive(self, wait_s: float) -> list[CanFrame]:
        """The frames of others, as soon as there are some, at the latest after `wait_s`.

        Raises:
            BoardError: as `send`.
        """

    def close(self) -> None:
        """Leaves the bus. May be called twice."""


@dataclass(frozen=True)
class BusName:
    """A bus by its name, in parts."""

    text: str
    interface: str
    channel: str
    settings: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> BusName:
        """Reads a name.

        Raises:
            BoardError: it has another form, or python-can knows no such interface.
        """
        address, _, query = text.partition("?")
        match = re.fullmatch(r"([\w-]+):(.+)", address)
        if match is None:
            raise BoardError(
                f"{text!r} names no CAN bus; expected INTERFACE:CHANNEL, as in socketcan:can0 or virtual:lab"
            )
        can = import_extra("can")
        if match[1] not in can.VALID_INTERFACES:
            known = sorted(can.VALID_INTERFACES)
            near = did_you_mean(match[1], known)
            raise BoardError(
                f"python-can knows no interface {match[1]!r}" + (near or f"; expected one of {', '.join(known)}")
            )
        settings = {}
        for part in query.split("&") if query else []:
            key, equals, value = part.partition("=")
            if not (key.isidentifier() and equals):
                raise BoardError(f"{text!r} has the setting {part!r}; expected KEY=VALUE")
            settings[key] = _value(unquote(value))
        return cls(text, match[1], match[2], settings)


def _value(text: str) -> Any:
    if re.fullmatch(r"-?\d{1,18}", text):
        return int(text)
    return {"true": True, "false": False}.get(text.lower(), text)


class PythonCanBus:
    """A bus of python-can."""

    def __init__(self, name: BusName) -> None:
        """Joins it.

        Raises:
            BoardError: there is no such bus, or this computer cannot join it.
        """
        self.name = name.text
        self.errors = 0
        self._can = import_extra("can")
        logging.getLogger("can").addHandler(logging.NullHandler())  # else its remarks go to standard error
        self._echoes: Counter[CanFrame] = Counter()  # some interfaces bring them back by themselves, some if asked to
        settings = _DEFAULTS.get(name.interface, {}) | name.settings
        if name.interface == "socketcand":
            _check_listener(name, settings)
        try:
            self._bus = self._can.Bus(interface=name.interface, channel=name.channel, **settings)
        except Exception as error:  # each interface has its own
            raise BoardError(f"the CAN bus {name.text} cannot be joined: {_reason(error)}") from None
        # python-can's client of socketcand takes the end of the connection for silence
        self._socket: socket.socket | None = getattr(self._bus, "_SocketCanDaemonBus__socket", None)
        self._closed = False
        self._emptied_s = time.perf_counter()

    @property
    def is_behind(self) -> bool:
        """See `Bus`."""
        return time.perf_counter() > self._emptied_s + BEHIND_S

    def send(self, frames: Iterable[CanFrame], stamp_s: float) -> None:
        """See `Bus`."""
        del stamp_s
        for frame in frames:
            message = self._can.Message(
                arbitration_id=frame.identifier, data=frame.data, is_extended_id=False, check=False
            )
            try:
                self._bus.send(message)
            except (self._can.CanError, OSError) as error:
                raise BoardError(f"the CAN bus {self.name} takes no frames: {_reason(error)}") from None
            self._echoes[frame] += 1
            if len(self._echoes) > _ECHOES:
                del self._echoes[next(iter(self._echoes))]

    def receive(self, wait_s: float) -> list[CanFrame]:
        """See `Bus`."""
        found: list[CanFrame] = []
        try:
            for _ in range(_AT_ONCE):
                message = self._bus.recv(wait_s)
                if message is None:
                    self._emptied_s = time.perf_counter()
                    break
                wait_s = 0.0
                frame = self._frame(message)
                if frame is not None:
                    found.append(frame)
        except (self._can.CanError, OSError, ValueError) as error:  # ValueError: a descriptor that was closed
            raise BoardError(f"the CAN bus {self.name} has gone: {_reason(error)}") from None
        if not found and self._socket is not None and _has_ended(self._socket):
            raise BoardError(f"the CAN bus {self.name} has gone: closed by the other side")
        return found

    def close(self) -> None:
        """See `Bus`."""
        if not self._closed:
            self._closed = True
            if self._socket is not None:
                _take_leave(self._socket)
            with contextlib.suppress(Exception):  # it may have gone
                self._bus.shutdown()

    def _frame(self, message: Any) -> CanFrame | None:
        """What came, if it is a frame of the kind that we use and not our own."""
        if message.is_error_frame:
            self.errors += 1
            if message.arbitration_id & _ERR_ACK:
                raise BoardError(
                    f"nobody acknowledges frames on the CAN bus {self.name}; expected another node, at its bit rate"
                )
            if message.arbitration_id & _ERR_BUS_OFF:
                raise BoardError(f"the CAN bus {self.name} is off, after too many errors")
            return None
        if message.is_extended_id or message.is_remote_frame or message.is_fd:
            return None
        frame = CanFrame(message.arbitration_id, bytes(message.data))
        if self._echoes[frame] > 0:
            self._echoes[frame] -= 1
            if not self._echoes[frame]:
                del self._echoes[frame]
            return None
        return frame


def _has_ended(connection: socket.socket) -> bool:
    """Whether the other side has closed it."""
    try:
        ready, _, _ = select.select([connection], [], [], 0)
        return bool(ready) and not connection.recv(1, socket.MSG_PEEK)
    except (OSError, ValueError):
        return True


def _take_leave(connection: socket.socket) -> None:
    """Says that no more will come, and reads until the other side closes, too: a connection that is closed with unread
    frames is reset, and the last ones sent may be lost."""
    until_s = time.perf_counter() + _LEAVE_S
    with contextlib.suppress(OSError, ValueError):  # it may have gone
        connection.shutdown(socket.SHUT_WR)
        connection.settimeout(_LEAVE_S)
        while connection.recv(_READ_BYTES) and time.perf_counter() < until_s:
            pass


def _check_listener(name: BusName, settings: dict[str, Any]) -> None:
    """python-can would ask for ten seconds where no program listens, and for ever where none answers."""
    port = settings.get("port")
    if not isinstance(port, int):
        raise BoardError(f"{name.text!r} names no port; expected socketcand:CHANNEL?host=HOST&port=PORT")
    host = str(settings["host"])
    try:
        with socket.create_connection((host, port), CONNECT_S) as connection:
            connection.recv(_READ_BYTES)  # the greeting
    except (OSError, OverflowError) as error:
        why = why_not_connected(error, host) if isinstance(error, OSError) else "there is no such port"
        raise BoardError(f"the CAN bus {name.text} cannot be joined: {why}") from None


def _reason(error: Exception) -> str:
    """An exception in one line."""
    cause = error if isinstance(error, OSError) else error.__cause__
    if isinstance(cause, (ConnectionResetError, BrokenPipeError)):
        return "closed by the other side"
    if isinstance(cause, OSError) and cause.errno:
        return os.strerror(cause.errno).lower()
    text = str(error).partition("Traceback")[0].strip().splitlines()  # of socketcand's client
    return text[0].strip() if text else type(error).__name__
