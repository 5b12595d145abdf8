"""What `boebot.run` and its like return, as a user meets it: the figures of a run (boebot.record.run) with their
pictures, pages and files; and a run read back from its folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from boebot.record import figures
from boebot.record.reading import read_robots
from boebot.record.record_file import RecordError
from boebot.record.run import Run, why

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame


class _Shown:
    """Pictures, pages and files of a run.

    Attributes:
        robots: a result per robot, in the order of the members.
        error: why the run ended before its time, or None; of several robots it says which one was to blame.
    """

    robots: list[RunResult]
    error: BaseException | None

    def _repr_html_(self) -> str:
        """The figures as a table for each robot and the picture below them, for notebooks."""
        tables = "".join(
            f"<h4>robot {number}</h4>" * (len(self.robots) > 1) + figures.html_table(robot.table() | robot.wall_clock())
            for number, robot in enumerate(self.robots, 1)
        )
        if not any(robot.ticks for robot in self.robots):
            return tables
        from boebot.view import on_screen

        return tables + on_screen.html_image(on_screen.drawn(self.robots, self.error))

    def plot(self) -> Figure:
        """The run from above, as in run.png: a figure of matplotlib, to be shown or saved (`.savefig("mine.pdf")`).

        Raises:
            BoebotError: no control tick of the run was recorded.
        """
        from boebot.view import on_screen

        return on_screen.drawn(self.robots, self.error).figure

    def replay(self) -> Path | None:
        """The run, to play and scrub. In a notebook it is shown below the cell. Elsewhere it is opened in the browser,
        where there is a display; returns the page's path, a temporary file.

        Raises:
            BoebotError: no control tick of the run was recorded.
        """
        from boebot.view import on_screen

        return on_screen.play(self.robots)

    def to_pandas(self) -> DataFrame:
        """The columns of run.csv, by the same names (units are in them), one row per control tick; the index is
        `time_s`, the run's time in s, and of several robots before it `robot`, its number from 1. Empty cells are NaN.

        Raises:
            BoebotError: pandas, an extra of the kit, is not installed.
        """
        from boebot.view import data_frame

        return data_frame.of_robots(self.robots)

    def save(self, folder: str | Path, *, csv: bool = False) -> list[Path]:
        """Writes summary.json, run.png and replay.html; returns their paths. `csv`: also run.csv, to_board.bin,
        to_host.bin and wire.csv, and of a brain of processes brain.csv and switches.csv. Of several robots picture and
        page have all of them, and the other files of each go into robot-1, robot-2 and so on."""
        from boebot.view import save

        return save(self.robots, self.error, Path(folder), csv=csv)


@dataclass(kw_only=True, repr=False)
class RunResult(Run, _Shown):
    """What came of a run of one robot; its attributes are those of `boebot.record.run.Run`."""

    @property
    def robots(self) -> list[RunResult]:  # type: ignore[override]
        """The one robot, as a `TogetherResult` has several."""
        return [self]


@dataclass(kw_only=True, repr=False)
class TogetherResult(_Shown):
    """What came of a run of several robots in one world.

    Attributes:
        robots: a result per robot, in the order of the members.
        error: why the run ended before its time, or None; it says which robot was to blame.
    """

    robots: list[RunResult]
    error: BaseException | None

    def __repr__(self) -> str:
        """A line for each robot."""
        robots = "".join(f"\n  {number}: {robot.summary()}" for number, robot in enumerate(self.robots, 1))
        return f"<TogetherResult of {len(self.robots)}:{robots}>"

    @property
    def notices(self) -> list[str]:
        """What the user should know, in sentences that say which robot they are about."""
        return [f"robot {number}: {one}" for number, robot in enumerate(self.robots, 1) for one in robot.notices]

    def table(self) -> dict[str, Any]:
        """The figures by name: of each robot, and how the run ended."""
        ended = "complete" if self.error is None else why(self.error)
        return {"robots": [result.table() for result in self.robots], "ended": ended}

    def wall_clock(self) -> dict[str, Any]:
        """Of each robot. See `Run.wall_clock`."""
        return {"robots": [result.wall_clock() for result in self.robots]}


Result = RunResult | TogetherResult


def read_run(path: str | Path, *, up_to_damage: bool = False) -> Result:
    """The run in a folder, or in the file of its record. Of a record that is cut the run has ended there, with a
    `CutError` that says so. One that is damaged inside has such an error, too, and all rows that are sound;
    `up_to_damage`: only those before the first ones that are lost.

    Raises:
        BoebotError: there is no record, or it is none of a run, or does not say whose it is.
    """
    robots = read_robots(path, RunResult, up_to_damage=up_to_damage)
    if len(robots) == 1:
        return robots[0]
    return TogetherResult(robots=robots, error=next((one.error for one in robots if one.error is not None), None))


def robots_of(result: Result, number: int | None = None) -> dict[int, RunResult]:
    """A run's robots by their numbers, from 1: all of them, or one.

    Raises:
        RecordError: there is no robot of that number.
    """
    robots = dict(enumerate(result.robots, 1))
    if number is None:
        return robots
    if number not in robots:
        expected = "1, or none" if len(robots) == 1 else f"1 to {len(robots)}"
        raise RecordError(f"there is no robot {number} in the run; expected {expected}")
    return {number: robots[number]}
