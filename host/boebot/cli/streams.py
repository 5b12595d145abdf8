"""Standard output and standard error as they may be: a terminal that has ASCII only, a full disk."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator

from boebot import system

_STDOUT, _STDERR = 1, 2  # file descriptors


def open_closed() -> None:
    """Standard streams that are closed lead nowhere from now on: else a file that is opened gets their number, and what
    is printed."""
    for name in ("stdin", "stdout", "stderr"):  # in this order: each gets the lowest number that is free, its own
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115, PTH123


def accept_all_characters() -> None:
    """From now on a character that a terminal lacks is printed as a question mark, and no error."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


@contextlib.contextmanager
def kept(*, for_the_answer: bool = False) -> Iterator[None]:
    """Whatever a brain does with them meanwhile, standard streams, folder, rights of new files and the depth of calls
    are afterwards what they were.

    `for_the_answer`: what it prints meanwhile goes to standard error, also what it prints by the system, or by a
    program that it starts. Standard output is left to the answer that follows.
    """
    depth, rights = sys.getrecursionlimit(), os.umask(0)
    os.umask(rights)
    streams = {"stdout": sys.stdout, "stderr": sys.stderr}
    own = [os.dup(number) for number in range(_STDERR + 1)]
    if for_the_answer:
        sys.stdout = sys.stderr
        os.dup2(_STDERR, _STDOUT)
    try:
        with system.folder_kept():
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


def finish() -> None:
    """Writes what waits in standard output. Raises OSError where that cannot be written."""
    if sys.stdout is not None and not sys.stdout.closed:
        sys.stdout.flush()


def discard() -> None:
    """What waits in standard output is lost, so that Python's end does not try to write it again."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())
    os.close(nothing)
