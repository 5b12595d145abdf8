"""Standard output and standard error as they may be: a terminal that has ASCII only, a full disk."""

from __future__ import annotations

import codecs
import contextlib
import io
import os
import sys
import unicodedata
from collections.abc import Iterator

_IN_ASCII = {
    "µ": "u",
    "Ω": "Ohm",
    "·": ".",
    "×": "x",
    "°": "deg",
    "±": "+-",
    "−": "-",
    "–": "-",
    "—": "-",
    "≤": "<=",
    "≥": ">=",
}
_OTHER = "?"
_STDOUT, _STDERR = 1, 2  # file descriptors


def open_closed() -> None:
    """Standard streams that are closed lead nowhere from now on: else a file that is opened gets their number, and what
    is printed."""
    for name in ("stdin", "stdout", "stderr"):  # in this order: each gets the lowest number that is free, its own
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115, PTH123


def accept_all_characters() -> None:
    """From now on a character that a terminal lacks is printed as the nearest of ASCII, and no error."""
    codecs.register_error("boebot.ascii", _in_ascii)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="boebot.ascii")


def _in_ascii(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    found = (_IN_ASCII.get(char) or _decomposed(char) for char in error.object[error.start : error.end])
    return "".join(found), error.end


def _decomposed(char: str) -> str:
    """Without accents and the like, as "e" of "é" and "..." of "…"."""
    return "".join(part for part in unicodedata.normalize("NFKD", char) if part.isascii()) or _OTHER


@contextlib.contextmanager
def kept(*, for_the_answer: bool = False) -> Iterator[None]:
    """Whatever a brain does with them meanwhile, standard streams, folder, rights of new files and the depth of calls
    are afterwards what they were.

    `for_the_answer`: what it prints meanwhile goes to standard error, also what it prints by the system, or by a
    program that it starts. Standard output is left to the answer that follows.
    """
    depth, rights = sys.getrecursionlimit(), os.umask(0)
    os.umask(rights)
    streams, folder = {"stdout": sys.stdout, "stderr": sys.stderr}, os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    own = [os.dup(number) for number in range(_STDERR + 1)]
    if for_the_answer:
        sys.stdout = sys.stderr
        os.dup2(_STDERR, _STDOUT)
    try:
        yield
    finally:
        with contextlib.suppress(OSError, ValueError, AttributeError):
            sys.__stdout__.flush()  # type: ignore[union-attr]
        for number, copy in enumerate(own):
            os.dup2(copy, number)
            os.close(copy)
        for number, (name, stream) in enumerate(streams.items(), _STDOUT):
            if stream.closed:
                stream = open(number, "w", encoding=stream.encoding, errors=stream.errors, closefd=False)  # noqa: SIM115
            setattr(sys, name, stream)
        sys.setrecursionlimit(depth)
        os.umask(rights)
        os.fchdir(folder)
        os.close(folder)


def finish() -> None:
    """Writes what waits in standard output. Raises OSError where that cannot be written."""
    if sys.stdout is not None and not sys.stdout.closed:
        sys.stdout.flush()


def discard() -> None:
    """What waits in standard output is lost, so that Python's end does not try to write it again."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())
    os.close(nothing)
