"""The folder of a run: its record, record.mcap, and the files that are made from it. It holds one run.

A new run replaces the record and the files that runs leave, and no others. While a run writes, the folder is locked.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import IO

from boebot import system
from boebot.errors import BoebotError
from boebot.guests import FORMATS, guests

RECORD, MENDED = "record.mcap", "record-mended.mcap"
FORMAT = 4  # of a record and of the files made from it; CHANGELOG.md says what is new in each
FILES = (
    "summary.json",
    "run.png",
    "replay.html",
    "run.csv",
    "brain.csv",
    "switches.csv",
    "to_board.bin",
    "to_host.bin",
    "wire.csv",
    "foxglove.mcap",
    MENDED,
    *guests(FORMATS),
)
"""What is made from a record; of a run of several robots also in a folder for each, `robot-1` and so on."""
_ROBOT = re.compile(r"robot-[1-9]\d*\Z")


class RunFolder:
    """A folder that a run may write to, locked until it is closed."""

    def __init__(self, path: Path) -> None:
        """Made if need be.

        Raises:
            BoebotError: it cannot be written to, another run writes there, or it holds other things than a run.
        """
        self._lock = -1
        try:
            self.path = path.absolute()  # a brain may change to another folder
            self._is_new = not path.exists()
            make_folder(path)
            self._lock = system.lock_folder(path)
            there = {entry.name for entry in path.iterdir()} - {system.LOCK}
            links = sorted(name for name in there if _ROBOT.match(name) and (path / name).is_symlink())
        except OSError as error:
            self.close()
            raise unwritable(path, error) from None
        if links:
            self.close()
            raise BoebotError(f"{links[0]!r} in {path} is a link to elsewhere; expected a folder, or nothing")
        if there and RECORD not in there:
            self.close()
            raise BoebotError(
                f"{path} holds {sorted(there)[0]!r} and no record of a run ({RECORD}); expected an empty folder, a new "
                "one, or that of a former run, which is replaced"
            )

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if error is not None and self._is_new:
            with suppress(OSError):  # it holds what was written before the error
                self.path.rmdir()
        self.close()

    def close(self) -> None:
        """Others may write there. May be called twice."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def new_record(self) -> IO[bytes]:
        """An empty record, open for reading and writing; what a former run has left is gone.

        Raises:
            BoebotError: it cannot be written.
        """
        try:
            for folder in (self.path, *sorted(path for path in self.path.iterdir() if _is_of_robot(path))):
                for name in (*FILES, RECORD):
                    (folder / name).unlink(missing_ok=True)
                    unfinished(folder / name).unlink(missing_ok=True)
                if folder != self.path and not any(folder.iterdir()):
                    folder.rmdir()
            file = (self.path / RECORD).open("x+b", buffering=0)
            os.fsync(self._lock)
        except OSError as error:
            raise unwritable(self.path, error) from None
        return file


def make_folder(folder: Path) -> None:
    """Makes the folder of a run's files; called before the run too, so that no run is lost for want of one.

    Raises:
        BoebotError: it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except (FileExistsError, NotADirectoryError):
        file = next(one for one in (folder, *folder.parents) if one.exists())
        raise BoebotError(f"{file} is a file; expected a folder, by another --out") from None
    except OSError as error:
        raise unwritable(folder, error) from None


def locked(path: Path | None) -> AbstractContextManager[RunFolder | None]:
    """That folder, while a run writes to it; None: none. Raises as `RunFolder`."""
    return nullcontext() if path is None else RunFolder(path)


def unfinished(path: Path) -> Path:
    """Where a file is written, before it is whole and gets its name."""
    return path.with_name(f".part-{path.name}")


def write_whole(path: Path, write: Callable[[Path], object], what: str = "the run's files") -> Path:
    """A file, whole or not at all: `write` writes it to the path that it is given. Returns `path`. `what`: it is one
    of, as errors call it.

    Raises:
        BoebotError: the folder cannot be written to.
    """
    part = unfinished(path)
    try:
        part.unlink(missing_ok=True)  # in the folder of a stranger it may be a link to elsewhere
        write(part)
        part.replace(path)
    except OSError as error:
        raise unwritable(path.parent, error, what) from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
    return path


def write_files(folder: Path, contents: dict[str, bytes]) -> list[Path]:
    """Each file whole or not at all, by its name. Raises as `write_whole`."""
    return [write_whole(folder / name, partial(Path.write_bytes, data=data)) for name, data in contents.items()]


def unwritable(folder: Path, error: OSError, what: str = "the run's files") -> BoebotError:
    """Why a run's files, or others, cannot be written; BlockingIOError: another process has locked their folder."""
    if isinstance(error, BlockingIOError):
        return BoebotError(f"another process writes to {folder} now; expected a folder for this one alone")
    return BoebotError(f"{what} cannot be written to {folder}: {error.strerror or error}")


def _is_of_robot(path: Path) -> bool:
    return _ROBOT.match(path.name) is not None and path.is_dir()
