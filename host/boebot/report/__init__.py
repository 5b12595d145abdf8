"""Files that a run leaves behind:

run.csv        one row per control tick: sensors, commands, estimated and, where known, true pose
summary.json   the figures of the run
to_board.bin   every byte that went to the board; to_host.bin: every byte that came from it
wire.csv       when which stretch of those two files crossed the wire
run.png        a picture of the run
replay.html    a page that plays it; needs no network
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from boebot.errors import BoebotError

if TYPE_CHECKING:
    from boebot.result import RunResult


def save(result: RunResult, folder: Path) -> list[Path]:
    """Writes all files of a run into `folder`, which is made if need be; returns their paths.

    Raises:
        BoebotError: the folder cannot be written to.
    """
    from boebot.report import picture, replay, tables

    try:
        folder.mkdir(parents=True, exist_ok=True)
        paths = [
            tables.write_summary(result, folder / "summary.json"),
            tables.write_run(result, folder / "run.csv"),
            *tables.write_wire(result, folder),
        ]
        if result.ticks:
            paths.append(picture.write(result, folder / "run.png"))
            paths.append(replay.write(result, folder / "replay.html"))
    except OSError as error:
        raise BoebotError(f"the run's files cannot be written to {folder}: {error.strerror or error}") from None
    return paths
