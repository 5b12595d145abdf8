"""The files that a run came from, as they are attached to its record, and taken from there to repeat it.

brain/NAME.py   the brain's file; beside it those that it had imported from its own folder when the run began
sketch/NAME.ino   where a program was built of a sketch: its files; the program itself is brain/NAME.elf
robot/NAME.toml, arena/NAME.toml   where they were given as files

Of several robots, names of brain and robot begin with robot-1/, robot-2/ and so on.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from boebot import brains
from boebot.errors import BoebotError, as_utf8
from boebot.running.tasks import Request, Task


def sources(request: Request, tasks: Sequence[Task]) -> dict[str, bytes]:
    """The files of a request and its tasks, by name."""
    found: dict[str, bytes] = {}
    if request.arena is not None:
        found |= _description("arena/", request.arena)
    for number, (member, task) in enumerate(zip(request.members, tasks, strict=True), 1):
        prefix = _prefix(number, len(tasks))
        if task.brain.path is not None and task.brain.path.is_file():
            found |= {f"{prefix}brain/{name}": data for name, data in _brain(task.brain.path).items()}
        found |= {f"{prefix}sketch/{as_utf8(name)}": data for name, data in task.brain.sources.items()}
        if isinstance(member.robot, str | Path):
            found |= _description(f"{prefix}robot/", member.robot)
    return found


def brain_files(
    attached: Mapping[str, bytes], path: Path, number: int, count: int, program: str | None = None
) -> dict[str, bytes]:
    """The files of a brain as they were, by their names in its folder; none where it is the kit's, or its file on this
    computer and all that it imported from beside it are still the same.

    Args:
        attached: to the record of the run.
        path: of the brain's file then.
        number: of the robot, from 1, of `count`.
        program: SHA-256 of that file, where it is a program for the board.

    Raises:
        BoebotError: the record does not have them, has another program, or names one that would land elsewhere.
    """
    if str(path) in brains.bundled_files():
        return {}
    prefix = f"{_prefix(number, count)}brain/"
    files = {name.removeprefix(prefix): data for name, data in attached.items() if name.startswith(prefix)}
    for name in files:
        if "\0" in name or {"", ".", ".."} & set(re.split(r"[/\\]", name)):
            raise BoebotError(f"the record has a file {prefix + name!r}; expected a path below {prefix}")
    if as_utf8(path.name) not in files:
        raise BoebotError(f"the record lacks the file of brain {path}; expected {prefix}{as_utf8(path.name)} in it")
    if program is not None and program != (found := hashlib.sha256(files[as_utf8(path.name)]).hexdigest()):
        raise BoebotError(
            f"the record's {prefix}{as_utf8(path.name)} has SHA-256 {found}; expected {program}, as it ran"
        )
    return {} if all(_is_same(path.parent / name, data) for name, data in files.items()) else files


def write_copies(files: Mapping[str, bytes], folder: Path) -> None:
    """Files of `brain_files`, into an empty folder. Raises BoebotError where they cannot be written."""
    try:
        for name, data in files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(data)
    except OSError as error:
        raise BoebotError(f"the record's file {name!r} cannot be written: {error.strerror}") from None


def arena_file(attached: Mapping[str, bytes], path: Path, folder: Path) -> Path:
    """The file of an arena as it was, as of `brain_files`."""
    data = attached.get(as_utf8(f"arena/{path.name}"))
    if data is None or _is_same(path, data):
        return path
    copy = folder / path.name
    copy.write_bytes(data)
    return copy


def _prefix(number: int, count: int) -> str:
    return "" if count == 1 else f"robot-{number}/"


def _description(prefix: str, name: str | Path) -> dict[str, bytes]:
    """Of a robot or arena; a bundled one came from no file of the user's."""
    path = Path(name)
    return {prefix + path.name: path.read_bytes()} if path.suffix == ".toml" and path.is_file() else {}


def _brain(path: Path) -> dict[str, bytes]:
    """A brain's file, and what it has imported from its folder, by their names there."""
    files = sorted({path, *brains.beside(path)})
    return {file.relative_to(path.parent).as_posix(): file.read_bytes() for file in files}


def _is_same(path: Path, data: bytes) -> bool:
    return path.is_file() and path.read_bytes() == data
