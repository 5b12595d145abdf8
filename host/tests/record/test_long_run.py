"""A recorded day of a robot without a board: what it takes of memory, and whether its files are whole."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest
from PIL import Image

from boebot.result import RunResult, read_run
from tools.tests import resident

SECONDS = 24 * 3600
GROWTH_MB = 300  # older rows are on the disk
COMMAND = ("run", "wander", "--robot", "arsim", "--arena", "arsim", "--period", "0.05", "--seed", "1", "--json")


class Day(NamedTuple):
    """How its process ended, and the memory that it took (MB)."""

    figures: dict[str, object]
    early_mb: float
    """while it goes, after at least a minute of the run"""
    peak_mb: float
    """of all, with the files at the end"""


def driven(folder: Path) -> Day:
    command = [sys.executable, "-m", "boebot", *COMMAND, "--seconds", str(SECONDS), "--out", str(folder)]
    record, early = folder / "record.mcap", list[float]()

    def look(taken_mb: float) -> None:
        if not early and record.exists() and record.stat().st_size > 1_000_000:  # 100 s
            early.append(taken_mb)

    with (folder.parent / "out.json").open("w+") as out, subprocess.Popen(command, stdout=out, text=True) as process:
        peak_mb = resident.peak(process, look)
        assert process.returncode == 0
        out.seek(0)
        return Day(json.load(out), early[0], peak_mb)


@pytest.mark.soak
@pytest.mark.unsanitized
@pytest.mark.skipif(sys.platform != "linux", reason="no /proc")
def test_day_takes_little_memory_and_leaves_whole_files(tmp_path: Path) -> None:
    folder = tmp_path / "day"
    day = driven(folder)
    print(f"{day.early_mb:.0f} MB after a minute, {day.peak_mb:.0f} MB at most")
    assert day.peak_mb <= day.early_mb + GROWTH_MB
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["ended"] == day.figures["ended"] == "complete" and summary["run_time_s"] == SECONDS
    with Image.open(folder / "run.png") as picture:
        picture.load()
        assert picture.width > 600 and picture.height > 600
    page = (folder / "replay.html").read_text(encoding="utf-8")
    data = re.search(r"const page = (\{.*\});\n", page)
    assert data and len(json.loads(data[1])["runs"]) == 1 and page.rstrip().endswith("</html>")
    result = read_run(folder)
    assert isinstance(result, RunResult) and result.error is None
    assert result.ticks == SECONDS * 100 + 1 and result.steps == SECONDS * 20
    assert {name: value for name, value in summary.items() if name in result.table()} == result.table()
