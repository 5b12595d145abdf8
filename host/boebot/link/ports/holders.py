"""Who has a serial port of this computer open: by its lock file, and on Linux by the open files of processes."""

from __future__ import annotations

import contextlib
import os
import tempfile
from pathlib import Path

from boebot.link.ports.lock_file import USUAL_FOLDERS, living_owner, lock_name


def holder_of(port: str) -> str | None:
    """The other process that has the port open, in words, as in "process 4711 (minicom)"; None: nobody is known. Open
    files of other users' processes cannot be seen."""
    name = lock_name(port)
    places = (*USUAL_FOLDERS, Path(tempfile.gettempdir()))
    owner = next((owner for place in places if (owner := living_owner(place / name)) is not None), None)
    owner = _opener(os.path.realpath(port)) if owner is None else owner
    return None if owner is None else in_words(owner)


def in_words(process: int) -> str:
    """A process by its number and, on Linux, its name."""
    if process == os.getpid():
        return f"this program itself (process {process})"
    try:
        return f"process {process} ({Path(f'/proc/{process}/comm').read_text().strip()})"
    except OSError:
        return f"process {process}"


def _opener(device: str) -> int | None:
    """A process that has the device open, other than this one."""
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it has ended, or is another user's
            if int(process.name) != os.getpid() and device in map(os.readlink, (process / "fd").iterdir()):
                return int(process.name)
    return None
