"""What carries a board's bytes: the interface that the link is written against. A transport knows no frames.

The ports of this computer are in boebot.link.ports; an in-process board brings its own transport.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable


class Transport(Protocol):
    """Bytes to and from one board, and the clock that they are stamped with."""

    @property
    def name(self) -> str:
        """How people call it, such as "/dev/ttyACM0"."""

    @property
    def realtime(self) -> bool:
        """False: time advances only while `read` waits (a board in this process)."""

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """Everything that arrived.

        Lets `quiet_s` pass without looking, then returns as soon as something has arrived and the line has
        gone idle, at the latest after `wait_s`; both in seconds of the transport's clock, `wait_s` the whole.
        A live transport may return earlier, with what there is.

        Raises:
            BoardError: the board has gone.
        """

    def write(self, data: bytes) -> None:
        """Sends bytes.

        Raises:
            BoardError: the board has gone, or takes no bytes.
        """

    def now(self) -> float:
        """The transport's clock (s)."""

    def close(self) -> None:
        """Gives the port back. May be called twice."""


@runtime_checkable
class Stamping(Protocol):
    """A transport that knows when bytes arrived, not only when they were fetched."""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """As `read`, but in the pieces in which it came, oldest first, each with the instant at which it was there
        (s, the transport's clock): at the arrival of its last byte or soon after, never before."""


@runtime_checkable
class Following(Transport, Stamping, Protocol):
    """A transport whose line can have the board's own bit rate."""

    def follow(self) -> None:
        """From now on the line has whatever rate the board sets, and each byte is a piece of `read_stamped`."""


@runtime_checkable
class BaudSelectable(Protocol):
    """A transport whose line has a bit rate that the host chooses."""

    @property
    def baud(self) -> int:
        """The rate in use (bit/s)."""

    @property
    def baud_given(self) -> bool:
        """Whether the URL named the rate: then no other one is meant."""

    def set_baud(self, rate: int) -> None:
        """Another rate, from now on; what was received so far is forgotten.

        Raises:
            BoardError: the port does not run at that rate, or has gone.
        """


@runtime_checkable
class CountsOverruns(Protocol):
    """A transport that knows of bytes that were lost before it could read them."""

    @property
    def overruns(self) -> int:
        """How many since it was opened, as far as the operating system counts them."""


@runtime_checkable
class Measures(Protocol):
    """A transport that knows more of the way to the board than its bytes, as of a bus."""

    def figures(self) -> Mapping[str, float | None]:
        """By name, a unit in it; None: not yet known."""


def stamped_read(transport: Transport) -> Callable[[float, float], list[tuple[float, bytes]]]:
    """Its `read_stamped`; of one that does not stamp what comes, a `read` that does."""

    def read(wait_s: float, quiet_s: float) -> list[tuple[float, bytes]]:
        data = transport.read(wait_s, quiet_s)
        return [(transport.now(), data)] if data else []

    return transport.read_stamped if hasattr(transport, "read_stamped") else read
