"""Standard output and standard error as they may be: a terminal that has ASCII only, a full disk."""

from __future__ import annotations

import codecs
import io
import os
import sys
import unicodedata

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


def finish() -> None:
    """Writes what waits in standard output. Raises OSError where that cannot be written."""
    if sys.stdout is not None and not sys.stdout.closed:
        sys.stdout.flush()


def discard() -> None:
    """What waits in standard output is lost, so that Python's end does not try to write it again."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())
    os.close(nothing)
