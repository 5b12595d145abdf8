"""Files that are made from the record of a run, each whole or not at all:

summary.json   the figures of the run; `format` numbers the form of all these files
run.png        a picture of the run
replay.html    a page that plays it; needs no network

and, if asked for:

run.csv        one row per control tick: sensors, commands, odometry and, where known, the true pose
brain.csv      of a brain of processes: one row per step of it; switches.csv: what it switched, and why
to_board.bin   every byte that went to the board; to_host.bin: every byte that came from it
wire.csv       when which stretch of those two files crossed the wire
foxglove.mcap  the run in the schemas of Foxglove, which draws it
pins.vcd       the pins of the boards, for viewers of logic signals

A run of several robots leaves picture, page, foxglove.mcap and pins.vcd with all of them, and a folder of all other
files for each.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.errors import BoebotError
from boebot.missing import imported
from boebot.record.run_folder import make_folder, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from boebot.record.run import Run

    Write = Callable[[Path], object]


class IncompleteError(BoebotError):
    """Some files of a run could not be made; `files` are those that were."""

    def __init__(self, sentence: str, files: list[Path]) -> None:
        super().__init__(sentence)
        self.files = files


def save(robots: Sequence[Run], error: BaseException | None, folder: Path, *, csv: bool = False) -> list[Path]:
    """Writes the files of a run into `folder`, which is made if need be; returns their paths. `error`: why it ended
    before its time, or None; `csv`: also its tables and bytes.

    Raises:
        BoebotError: the folder cannot be written to.
        IncompleteError: picture or page cannot be made; all other files are there.
    """
    from boebot.view import tables

    paths = []
    for number, robot in enumerate(robots, 1):
        make_folder(place := folder if len(robots) == 1 else folder / f"robot-{number}")
        wanted: dict[str, Write] = {"summary.json": partial(tables.write_summary, robot)}
        if csv:
            wanted |= {
                "run.csv": partial(tables.write_run, robot),
                "to_board.bin": partial(tables.write_bytes, robot, "to_board"),
                "to_host.bin": partial(tables.write_bytes, robot, "to_host"),
                "wire.csv": partial(tables.write_wire, robot),
            }
            if robot.brain_names is not None:
                wanted |= {
                    "brain.csv": partial(tables.write_steps, robot.record, robot.brain_names),
                    "switches.csv": partial(tables.write_switches, robot.record),
                }
        paths += [write_whole(place / name, write) for name, write in wanted.items()]
    if not any(robot.ticks for robot in robots):
        return paths
    failed = []
    for name in ("run.png", "replay.html"):
        try:
            paths.append(write_whole(folder / name, partial(_draw, robots, error)))
        except BoebotError:
            raise
        except Exception as why:  # whatever drawing meets: the run is worth more than its picture
            what = str(why).strip().partition("\n")[0]
            failed.append(f"{name} cannot be made: {type(why).__name__}" + (f": {what}" if what else ""))
    if failed:
        raise IncompleteError(f"{'; '.join(failed)}; the run's other files are in {folder}", paths)
    return paths


def save_for_foxglove(results: Sequence[Run], folder: Path) -> Path:
    """Writes foxglove.mcap, with the robots of one run, into `folder`, which is there; returns its path.

    Raises:
        BoebotError: Foxglove's schemas are not installed, or the folder cannot be written to.
    """
    imported("foxglove_schemas_protobuf", "--as foxglove", "foxglove-schemas-protobuf", "foxglove")
    from boebot.view import foxglove

    return write_whole(folder / "foxglove.mcap", partial(foxglove.write, results))


def save_pins(results: Sequence[Run], folder: Path) -> Path:
    """Writes pins.vcd, with the boards of the robots of one run, into `folder`, which is there; returns its path.

    Raises:
        BoebotError: their pins are not recorded, or the folder cannot be written to.
    """
    from boebot.view import vcd

    return write_whole(folder / "pins.vcd", partial(vcd.write, results))


def _draw(robots: Sequence[Run], error: BaseException | None, path: Path) -> None:
    """The picture or the page, by the path's ending."""
    if path.suffix == ".png":
        from boebot.view import picture

        picture.draw(robots, error).save(path)
    else:
        from boebot.view import replay

        replay.write([robot for robot in robots if robot.ticks], path)
