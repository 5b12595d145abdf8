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
def kept_for_the_answer() -> Iterator[None]:
    """What a brain prints meanwhile goes to standard error: also what it prints by the system, or by a program that it
    starts. Standard output is left to the answer that follows."""
    with contextlib.redirect_stdout(sys.stderr):
        try:
            own = os.dup(_STDOUT)
        except OSError:  # it is closed
            yield
            return
        try:
            with contextlib.suppress(OSError):
                os.dup2(_STDERR, _STDOUT)
            yield
        finally:
            with contextlib.suppress(OSError, ValueError, AttributeError):
                sys.__stdout__.flush()  # type: ignore[union-attr]
            os.dup2(own, _STDOUT)
            os.close(own)


def finish() -> None:
    """Writes what waits in standard output. Raises OSError where that cannot be written."""
    if sys.stdout is not None and not sys.stdout.closed:
        sys.stdout.flush()


def discard() -> None:
    """What waits in standard output is lost, so that Python's end does not try to write it again."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())
    os.close(nothing)
