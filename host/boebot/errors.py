"""Errors that people meet: one clear sentence each, never a traceback at the command line."""

from __future__ import annotations

import unicodedata
from collections.abc import Collection, Iterable
from difflib import get_close_matches

LONGEST_NAME = 100  # that is compared with known ones; no name of the kit's is longer
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


def as_utf8(name: str) -> str:
    """A file's name, or a part of it, that any text can have: bytes that are no UTF-8 as escapes such as \\xff."""
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The end of a sentence about an unknown name: the known one most like it, whatever the order of its words; or
    nothing."""
    by_words = {_words(other): other for other in known}
    near = get_close_matches(_words(name), by_words, n=1, cutoff=0.7) if len(name) <= LONGEST_NAME else []
    return f"; did you mean {by_words[near[0]]!r}?" if near else ""


def expected_one(name: str, known: Collection[str]) -> str:
    """The end of a sentence about an unknown name: all known ones, and which of them may be meant."""
    return f"expected one of {', '.join(known)}{did_you_mean(name, known)}"


def _words(name: str) -> str:
    return "_".join(sorted(name.lower().split("_")))


class BoebotError(Exception):
    """Something the user can mend. Its text is one sentence: the error, where it is, and what was expected.

    Attributes:
        exit_code: of a command that ends by it.
        brief: how a run ended that ended by it, in two words.
    """

    exit_code = 1
    brief = "ended early"


def brief(error: BaseException | None) -> list[str]:
    """How a run ended that ended by that error, in two words; nothing where it ended as it should."""
    return [] if error is None else [getattr(error, "brief", BoebotError.brief)]


class InterruptedRunError(BoebotError):
    """Ctrl-C ended a run; its figures are printed and its files written."""


class CallError(BoebotError):
    """Something is asked for that does not go together, or is not there: wrong usage."""

    exit_code = 2


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


class NotRealisableError(BoebotError):
    """A robot, a brain's period and a line that cannot go together in time."""


class SketchError(BoebotError):
    """A sketch does not compile, or does not fit into the chip."""


class MissingTextError(BoebotError):
    """A program did not print the text that was waited for."""

    brief = "timed out"


class AnalysisError(BoebotError):
    """An image cannot be read or followed, or something in it has no bound."""


class TimingError(BoebotError):
    """An image's timing is not known: no bound, no graph, no table, or one that contradicts itself."""
