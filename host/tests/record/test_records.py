"""Tests of a run's record and its folder, by whole commands: killed, on a full disk, beside another run."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

import boebot as library
from boebot.record.reading import CutError
from boebot.result import RunResult, TogetherResult, read_run
from copied_process import Done, command


def boebot(*arguments: str) -> Done:
    return command(arguments, Path.cwd())


def wait_for(record: Path, size: int) -> None:
    until = time.perf_counter() + 30
    while (not record.exists() or record.stat().st_size < size) and time.perf_counter() < until:
        time.sleep(0.05)


def read(folder: Path) -> RunResult:
    result = read_run(folder)
    assert isinstance(result, RunResult)
    return result


def test_killed_run_leaves_all_but_its_last_second(tmp_path: Path) -> None:
    run = tmp_path / "run"
    paced = ("run", "demo", "--robot", "shieldbot-charging", "--arena", "station", "--seconds", "1e6", "--realtime")
    process = subprocess.Popen([sys.executable, "-m", "boebot", *paced, "--out", str(run)], stdout=subprocess.DEVNULL)
    wait_for(run / "record.mcap", 35_000)
    other = boebot("run", "wander", "--seconds", "1", "--out", str(run))
    process.kill()
    process.wait()
    assert (other.returncode, other.stdout) == (1, "")
    assert other.stderr == f"boebot: another process writes to {run} now; expected a folder for this one alone\n"
    cut = read(run)
    assert isinstance(cut.error, CutError) and "the record is cut: it ends at" in str(cut.error)
    assert cut.run_time == cut.record.times_of(cut.record.tick_stream)[-1] > 1 and cut.steps > 20
    assert cut.brain_record is not None and len(cut.brain_record) == cut.steps
    assert cut.true_distance is not None and cut.odometry_error is not None and cut.odometry_error < 1
    report = boebot("report", str(run), "--mend", "--as", "csv")
    assert report.returncode == 0 and str(cut.error) in report.stderr
    whole = read(run / "record-mended.mcap")
    assert whole.record.rows("to_host") == cut.record.rows("to_host") and whole.table() == cut.table()
    rows = (run / "run.csv").read_text().splitlines()
    assert len(rows) == 1 + cut.record.ticks


def reported(run: Path) -> RunResult | TogetherResult:
    """The run as it is read back; a report of it makes the same files, to the byte."""
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    again = boebot("report", str(run), "--json")
    assert (again.returncode, again.stderr) == (0, "")
    assert {path: path.read_bytes() for path in run.rglob("*") if path.is_file()} == before
    result = read_run(run)
    assert result.error is None
    return result


def test_report_is_that_of_the_run_and_its_folder_holds_no_other(tmp_path: Path) -> None:
    run = tmp_path / "run"
    assert boebot("run", "wander", "--robots", "2", "--seconds", "0.5", "--out", str(run)).returncode == 0
    assert isinstance(reported(run), TogetherResult)
    (run / "robot-2" / "notes.txt").write_text("mine")
    (run / "notes.txt").write_text("mine, too")
    for left in ("record-mended.mcap", ".part-run.png"):  # of a run that was killed
        (run / left).touch()
    assert boebot("run", "wander", "--seconds", "0.5", "--out", str(run)).returncode == 0
    there = {str(path.relative_to(run)) for path in run.rglob("*") if path.is_file()}
    assert there == {
        "record.mcap", "summary.json", "run.png", "replay.html", "notes.txt", "robot-2/notes.txt",
    }  # fmt: skip
    assert isinstance(reported(run), RunResult)


def test_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    done = boebot("run", "wander", "--seconds", "0.5", "--out", str(tmp_path))
    assert done.returncode == 1 and [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    assert done.stderr.startswith(
        f"boebot: {tmp_path} holds 'thesis.tex' and no record of a run (record.mcap); expected"
    )


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("none", None, "there is no record of a run; expected the folder of a run, or its record.mcap"),
        ("record.mcap", b"# Notes\n", "is no record of a run; expected an MCAP file"),
        ("record.mcap", b"", "does not say whose run it is; it is cut after 0 B; expected begin.json in it"),
    ],
)
def test_what_is_no_record_is_one_sentence(tmp_path: Path, name: str, content: bytes | None, sentence: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    done = boebot("report", str(tmp_path / name))
    assert done.returncode == 2 and sentence in done.stderr and len(done.stderr.splitlines()) == 1


@pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="needs a small disk")
def test_full_disk_ends_the_run_and_keeps_what_is_there(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=40k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("a small disk cannot be mounted")
    try:
        done = boebot("run", "wander", "--seconds", "1e6", "--out", str(disk / "run"), "--json")
        figures = json.loads(done.stdout)
        assert figures["run_time_s"] > 1  # its first second was too much for the disk
        assert figures["true_distance_m"] > 0 and figures["odometry_distance_m"] > 0
        (tmp_path / "slow.py").write_text("import time\ndef step(robot):\n    time.sleep(0.01)\n")
        done = boebot("run", str(tmp_path / "slow.py"), "--seconds", "1e6", "--out", str(disk / "run"))
        assert done.returncode == 1
        sentence = f"boebot: the record cannot be written to {disk}/run/record.mcap: No space left on device"
        assert sentence in done.stderr.splitlines()  # on a busy computer behind one about the sleep
        result = read(disk / "run")
        assert isinstance(result.error, CutError) and result.run_time > 1
    finally:
        subprocess.run(["umount", "--lazy", str(disk)], check=True)


def test_run_without_a_record_has_none() -> None:
    result = library.run("wander", seconds=1, record=False)
    assert (result.ticks, result.steps, result.truth, result.odometry_distance) == (None, 20, None, None)
    assert result.run_time == pytest.approx(1.0)
