"""Windows; what each name means is said in posix.py."""

from __future__ import annotations

import contextlib
import msvcrt
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

assert sys.platform == "win32"

host_clock = time.perf_counter
LOCK = ".running"  # a folder cannot be locked, but a file in it
NEW_GROUP: dict[str, Any] = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
_AGAIN_S = 0.05  # between two tries for a lock
_ARROWS = {"H": "\x1b[A", "P": "\x1b[B", "M": "\x1b[C", "K": "\x1b[D"}  # by the second half of such a key's code


def lock_folder(folder: Path) -> int:
    """The file vanishes when it is closed, also where the process is killed."""
    try:
        opened = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_TEMPORARY | os.O_NOINHERIT)
    except PermissionError:  # another one has opened it, and a third has closed it
        raise BlockingIOError from None
    try:
        msvcrt.locking(opened, msvcrt.LK_NBLCK, 1)
    except OSError:
        os.close(opened)
        raise BlockingIOError from None
    return opened


def lock(file: IO[Any]) -> None:
    """Windows itself would give up after ten seconds."""
    while True:
        try:
            return msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            time.sleep(_AGAIN_S)


def end_group(process: subprocess.Popen[bytes], *, by_force: bool) -> None:
    """Asked by Ctrl-Break, which alone can be sent to a group."""
    if by_force:
        subprocess.run(["taskkill", "/f", "/t", "/pid", str(process.pid)], capture_output=True, check=False)
    else:
        process.send_signal(signal.CTRL_BREAK_EVENT)


def folder_kept() -> contextlib.AbstractContextManager[None]:
    """A folder in use cannot be renamed, nor removed."""
    return contextlib.chdir(".")


@contextlib.contextmanager
def raw_keyboard() -> Iterator[Callable[[], str]]:
    """Of the console."""

    def read_console() -> str:
        typed = ""
        while msvcrt.kbhit():
            key = msvcrt.getwch()
            typed += _ARROWS.get(msvcrt.getwch(), "") if key in ("\0", "\xe0") else key
        return typed

    yield read_console
