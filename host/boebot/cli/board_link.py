"""The link to a board for sub-commands that look at it and move nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from boebot.boards import BoardRequest, open_board
from boebot.cli import output
from boebot.link.link import Link


@contextmanager
def board_link(url: str, request: BoardRequest) -> Iterator[tuple[Link, str]]:
    """A session with the board, for as long as the block lasts, and the board in a few words. The link's sentences for
    the user are printed when they come at the opening, and else at the end.

    Raises:
        BoebotError: no board answers there.
    """
    session = open_board(url, request)
    try:
        link = Link(session.transport)
        link.open()
        _say(link)
        yield link, session.description
        link.close()
        _say(link)
    finally:
        session.close()


def _say(link: Link) -> None:
    for notice in link.notices:
        output.say(notice)
    link.notices.clear()
