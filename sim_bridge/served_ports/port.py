"""What `boebot serve` asks of a port, whatever kind it is."""

from __future__ import annotations

from typing import Protocol

from boebot.boards import Visit

BACKLOG = 65536  # bytes that wait in each direction: for the line, and for a client that does not read


class Port(Protocol):
    """Where one client at a time comes and goes."""

    url: str

    def wait(self, seconds: float) -> None:
        """Sleeps until something may have happened."""

    def look(self) -> list[Visit]:
        """Who came, went and was refused since the last call. Receives what the client sent, up to `BACKLOG` bytes; the
        rest waits at the client. What earlier clients sent is dropped when another one comes."""

    def take(self, count: int) -> bytes:
        """At most that many of the bytes received, oldest first."""

    def write(self, data: bytes) -> None:
        """To the client, if there is one; of what it does not read the newest `BACKLOG` bytes are kept."""

    def baud(self) -> int | None:
        """The bit rate that the client has set; None: the robot's own."""

    def close(self) -> None:
        """Gives the port back."""
