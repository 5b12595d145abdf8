"""A link with a board of peer.py, and what tests ask of both."""

from __future__ import annotations

from channel import Channel

from boebot.link import messages
from boebot.link.link import Link
from boebot.record.record import Record
from peer import InProcess, Peer


def open_link(
    peer: Peer | None = None, channel: Channel | None = None, **options: object
) -> tuple[Link, Peer, InProcess]:
    """A link with an open session, its board, and the channel between them."""
    peer = peer or Peer()
    session = InProcess(peer, channel)
    link = Recorded(session, **options)
    link.open()
    return link, peer, session


class Recorded(Link):
    """A link that keeps what it sends."""

    def __init__(self, session: InProcess, **options: object) -> None:
        self.memory = Record()
        super().__init__(session, self.memory.append, **options)


def sent(link: Link) -> list[tuple[float, bytes]]:
    """(time, frame) of all that a recorded link has sent."""
    assert isinstance(link, Recorded)
    return list(link.memory.rows("to_board"))


def sent_kinds(link: Link) -> list[str]:
    """Names of the messages that the host sent."""
    return [messages.MESSAGES[frame[2]].NAME for _, frame in sent(link)]


def tick_of(payload: bytes) -> int:
    """Of a telemetry message."""
    return messages.Telemetry.unpack(payload).tick


def listen(link: Link, seconds: float) -> list[int]:
    """Lets time pass; the ticks of the telemetry that came."""
    end = link.transport.now() + seconds
    ticks: list[int] = []
    while link.transport.now() < end - 1e-9:
        ticks += [tick_of(payload) for payload, *_ in link.poll(end - link.transport.now())]
    return ticks


def newest_tick(link: Link) -> int:
    """Of the telemetry that has come."""
    assert link.telemetry.latest is not None
    return tick_of(link.telemetry.latest)
