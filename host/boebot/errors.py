"""Errors that people meet: one clear sentence each, never a traceback at the command line."""

from __future__ import annotations

import unicodedata

_CONTROL = {"Cc", "Cf", "Cs", "Co", "Zl", "Zp"}  # Unicode's categories: control, format, surrogate, private, separators


def printable(text: str) -> str:
    """Text for a terminal: control characters, which may come from files, boards and exceptions, as escapes such as
    \\x1b; ends of lines stay."""
    if text.isprintable():
        return text
    return "".join(
        char.encode("unicode_escape").decode() if unicodedata.category(char) in _CONTROL and char != "\n" else char
        for char in text
    )


class BoebotError(Exception):
    """Something the user can mend. Its text is one sentence: the error, where it is, and what was expected."""


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
    """An image's timing is not known: no bound, no graph, no table, or one that contradicts itself."""
