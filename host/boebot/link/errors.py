"""Errors of the link that a program may want to distinguish."""

from __future__ import annotations

from boebot.errors import BoardError


class LatchedAgainError(BoardError):
    """The motors were latched off once more before they were armed."""


class TakenOverError(BoardError):
    """Another program has the board."""


class SessionLostError(BoardError):
    """The session ended during a request; whether it was carried out is not known."""
