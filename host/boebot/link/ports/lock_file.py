"""Lock files of serial ports, as UUCP began them and minicom, picocom and others heed them: LCK..NAME holds the owner's
process number. They keep programs apart that do not lock the port itself, and say who has it.

Within this process a register keeps threads apart. What lies there in this process's name and is not in the register
was left by another one of that number, as numbers come again soon in a container.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import tempfile
from pathlib import Path

USUAL_FOLDERS = (Path("/run/lock"), Path("/var/lock"))


_held: dict[tuple[int, str], LockFile] = {}  # by process, for a forked child inherits it, and name


class PortBusyError(Exception):
    """Another process has the port; `owner` is its number."""

    def __init__(self, owner: int) -> None:
        super().__init__(f"process {owner} has it open")
        self.owner = owner


class LockFile:
    """A port's lock, held from the making of this object until `release`."""

    def __init__(self, port: str) -> None:
        """Takes the lock of `port`, also from a process that has died.

        Raises:
            PortBusyError: a living process has it.
        """
        name = lock_name(port)
        self._path: Path | None = None
        self._key = (os.getpid(), name)
        if _held.setdefault(self._key, self) is not self:
            raise PortBusyError(os.getpid())
        try:
            self._path = _take_somewhere(name)
        except BaseException:
            del _held[self._key]
            raise

    def release(self) -> None:
        """Removes the file. May be called twice."""
        path, self._path = self._path, None
        if path is not None and read_owner(path) == os.getpid():
            with contextlib.suppress(OSError):
                path.unlink()
        if _held.get(self._key) is self:
            del _held[self._key]


def _take_somewhere(name: str) -> Path | None:
    """Makes the lock file where it may lie; None: nowhere."""
    places = {folder.resolve(): None for folder in (*USUAL_FOLDERS, Path(tempfile.gettempdir()))}
    for folder in places:  # a lock counts wherever it lies
        owner = living_owner(folder / name)
        if owner is not None:
            raise PortBusyError(owner)
    for folder in places:
        with contextlib.suppress(OSError):  # no such folder, or not ours to write
            return take(folder / name)
    return None


def lock_name(port: str) -> str:
    """LCK..ttyACM0 for /dev/ttyACM0 and for every link to it, LCK..pts_3 for /dev/pts/3."""
    device = os.path.realpath(port)
    return "LCK.." + device.removeprefix("/dev/").strip("/").replace("/", "_")


def take(path: Path) -> Path:
    """Makes the lock file whole in one step.

    Raises:
        PortBusyError: a living process has made it first.
        OSError: the folder is missing or not ours to write.
    """
    mine = _beside(path)
    mine.write_text(f"{os.getpid():10d}\n", encoding="ascii")
    try:
        for _ in range(10):  # others may try at the same time
            try:
                os.link(mine, path)
            except FileExistsError:
                owner = living_owner(path)
                if owner is not None:
                    raise PortBusyError(owner) from None
                _remove_stale(path)
            else:
                return path
        raise OSError(f"{path} comes back again and again")
    finally:
        mine.unlink()


def read_owner(path: Path) -> int | None:
    """The process that a lock file names; None: there is none, or it names nobody."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    with contextlib.suppress(ValueError):
        return int(content)
    # Some old programs write the number as it is in memory.
    return int.from_bytes(content, "little") if len(content) == 4 else None


def living_owner(path: Path) -> int | None:
    """The process that a lock file names, if it lives and is another one: who asks holds nothing of that name yet."""
    owner = read_owner(path)
    if owner is None or owner <= 0 or owner == os.getpid():
        return None
    try:
        os.kill(owner, 0)
    except (ProcessLookupError, OverflowError):
        return None
    except PermissionError:  # it lives, and is somebody else's
        pass
    return owner


def _beside(path: Path) -> Path:
    """A name in the same folder that nobody else has, whatever containers share that folder."""
    return path.with_name(f"{path.name}.{os.getpid()}.{secrets.token_hex(4)}")


def _remove_stale(path: Path) -> None:
    """Removes a dead process's lock; one that somebody living has made in its place meanwhile is put back."""
    aside = _beside(path)
    with contextlib.suppress(FileNotFoundError):
        path.rename(aside)
        if living_owner(aside) is not None:
            with contextlib.suppress(FileExistsError):
                os.link(aside, path)
        aside.unlink()
