"""A run as a pandas DataFrame: run.csv, read by pandas. pandas is an extra of the kit."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.missing import imported
from boebot.view import tables

if TYPE_CHECKING:
    from pandas import DataFrame

    from boebot.record.run import Run


def of_robots(robots: Sequence[Run]) -> DataFrame:
    """One row per control tick; the index is the time. Of several robots the rows of each stand below those of the one
    before, and the index is the robot's number, from 1, and the time.

    Raises:
        BoebotError: pandas is not installed.
    """
    pandas = imported("pandas", "to_pandas()", "pandas", "pandas")
    frames = {}
    for number, robot in enumerate(robots, 1):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.csv"
            tables.write_run(robot, path)
            frames[number] = pandas.read_csv(path, index_col="time_s", keep_default_na=False, na_values=[""])
    return frames[1] if len(frames) == 1 else pandas.concat(frames, names=["robot"])
