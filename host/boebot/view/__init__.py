"""Files that a run leaves behind:

run.csv        one row per control tick: sensors, commands, estimated and, where known, true pose
brain.csv      of a brain of processes: one row per step of it; switches.csv: what it switched, and why
summary.json   the figures of the run; `format` numbers the form of all these files
to_board.bin   every byte that went to the board; to_host.bin: every byte that came from it
wire.csv       when which stretch of those two files crossed the wire
run.png        a picture of the run
replay.html    a page that plays it; needs no network

A run of several robots leaves the last two with all of them, and a folder of all files for each.
"""

from __future__ import annotations

import errno
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.errors import BoebotError
from boebot.record.run_folder import unwritable

if TYPE_CHECKING:
    from collections.abc import Callable

    from boebot.record.result import RunResult, TogetherResult


class IncompleteError(BoebotError):
    """Some files of a run could not be made; `files` are those that were."""

    def __init__(self, sentence: str, files: list[Path]) -> None:
        super().__init__(sentence)
        self.files = files


def make_folder(folder: Path) -> None:
    """Makes the folder of a run's files; called before the run too, so that no run is lost for want of one.

    Raises:
        BoebotError: it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise unwritable(folder, error) from None


def save(result: RunResult, folder: Path) -> list[Path]:
    """Writes all files of a run into `folder`, which is made if need be; returns their paths.

    Raises:
        BoebotError: the folder cannot be written to.
        IncompleteError: picture or page cannot be made; all other files are there.
    """
    from boebot.view import tables

    make_folder(folder)
    try:
        paths = [
            tables.write_summary(result, folder / "summary.json"),
            tables.write_run(result, folder / "run.csv"),
            *tables.write_wire(result, folder),
        ]
        if result.brain_record is not None:
            paths += tables.write_brain(result.brain_record, folder)
    except OSError as error:
        raise unwritable(folder, error) from None
    if not result.ticks:
        return paths
    drawn, failed = _draw(
        folder, {"run.png": partial(_write_picture, result), "replay.html": partial(_write_page, result)}
    )
    paths += drawn
    if failed:
        raise IncompleteError(f"{'; '.join(failed)}; the run's other files are in {folder}", paths)
    return paths


def save_together(result: TogetherResult, folder: Path) -> list[Path]:
    """Writes picture and page of all robots into `folder`, and the files of each into its own folder; returns
    their paths.

    Raises: as `save`.
    """
    make_folder(folder)
    paths: list[Path] = []
    failed: list[str] = []
    for number, robot in enumerate(result.robots, 1):
        try:
            paths += save(robot, folder / f"robot-{number}")
        except IncompleteError as error:
            paths += error.files
            failed.append(str(error))
    if any(robot.ticks for robot in result.robots):
        drawn, missing = _draw(
            folder,
            {"run.png": partial(_write_common_picture, result), "replay.html": partial(_write_common_page, result)},
        )
        paths, failed = drawn + paths, missing + failed
    if failed:
        raise IncompleteError("; ".join(failed), paths)
    return paths


def _draw(folder: Path, files: dict[str, Callable[[Path], Path]]) -> tuple[list[Path], list[str]]:
    """Writes those files; returns the paths of those that could be made, and why others could not."""
    paths, failed = [], []
    for name, write in files.items():
        try:
            paths.append(write(folder / name))
        except OSError as error:
            raise unwritable(folder, error) from None
        except Exception as error:  # whatever drawing meets: the run is worth more than its picture
            what = str(error).strip().partition("\n")[0]
            failed.append(f"{name} cannot be made: {type(error).__name__}" + (f": {what}" if what else ""))
    return paths, failed


def _write_picture(result: RunResult, path: Path) -> Path:
    from boebot.view import picture

    return picture.write(result, path)


def _write_page(result: RunResult, path: Path) -> Path:
    from boebot.view import replay

    return replay.write([result], path)


def _write_common_picture(result: TogetherResult, path: Path) -> Path:
    from boebot.view import together_picture

    return together_picture.write(result, path)


def _write_common_page(result: TogetherResult, path: Path) -> Path:
    from boebot.view import replay

    return replay.write([robot for robot in result.robots if robot.ticks], path)
