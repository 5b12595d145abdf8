"""Errors that people meet: one clear sentence each, never a traceback at the command line."""

from __future__ import annotations


class BoebotError(Exception):
    """Something the user can mend. Its text is one sentence: what is wrong, where, what was expected."""


class RobotError(BoebotError):
    """A robot description is wrong."""


class ArenaError(BoebotError):
    """An arena description is wrong."""


class BrainError(BoebotError):
    """A brain cannot be found, loaded or run."""


class BoardError(BoebotError):
    """A board cannot be found or opened, or has gone."""


class ProtocolError(BoebotError):
    """The board speaks, but not this kit's protocol."""


class TimingError(BoebotError):
    """An image's timing cannot be told: no bound, no graph, no table, or one that contradicts itself."""
