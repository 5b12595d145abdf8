"""Linux and macOS: locks, a program with all that it has begun, the keyboard of a terminal."""

from __future__ import annotations

import contextlib
import fcntl
import functools
import os
import select
import signal
import subprocess
import sys
import termios
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

host_clock = functools.partial(time.clock_gettime, getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC))
"""Time (s) that goes on while the computer sleeps, where the system has such a clock."""
LOCK = ""  # the file in a folder by which it is locked; "": there is none
NEW_GROUP: dict[str, Any] = {"start_new_session": True}
"""For subprocess.Popen: Ctrl-C does not come to the program, nor to those that it begins; `end_group` ends them."""


def lock_folder(folder: Path) -> int:
    """Keeps a folder for this process, until the file that is returned is closed (os.close), or the process ends.

    Raises:
        BlockingIOError: another one has it.
        OSError: it cannot be opened.
    """
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(opened)
        raise
    return opened


def lock(file: IO[Any]) -> None:
    """Waits until no other process has a lock on that file, and has one until it is closed."""
    fcntl.flock(file, fcntl.LOCK_EX)


def end_group(process: subprocess.Popen[bytes], *, by_force: bool) -> None:
    """Asks a program of NEW_GROUP to end, as by Ctrl-C, or ends it, with all that it has begun.

    Raises:
        ProcessLookupError: it has ended.
    """
    os.killpg(process.pid, signal.SIGKILL if by_force else signal.SIGINT)


@contextlib.contextmanager
def folder_kept() -> Iterator[None]:
    """Afterwards the working folder is what it was, whatever it is called by then."""
    folder = os.open(".", getattr(os, "O_PATH", os.O_RDONLY))
    try:
        yield
    finally:
        os.fchdir(folder)
        os.close(folder)


@contextlib.contextmanager
def raw_keyboard() -> Iterator[Callable[[], str]]:
    """Keys as they are typed, without waiting and without echo; gives a function that returns what was typed. Arrow
    keys are as of a VT100: ESC [ A to D."""
    file = sys.stdin.fileno()
    before = termios.tcgetattr(file)

    def read_terminal() -> str:
        ready, _, _ = select.select([file], [], [], 0)
        return os.read(file, 1024).decode("utf-8", errors="ignore") if ready else ""

    try:
        tty.setcbreak(file)
        yield read_terminal
    finally:
        with contextlib.suppress(termios.error):  # the terminal has gone
            termios.tcsetattr(file, termios.TCSADRAIN, before)
