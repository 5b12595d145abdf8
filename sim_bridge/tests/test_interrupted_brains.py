"""Ctrl-C and SIGTERM end a run whatever its brain does: it catches everything, keeps Python busy, or leaves threads."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from command import heed_signals

pytestmark = [
    pytest.mark.unsanitized,
    pytest.mark.wall_clock,
    pytest.mark.skipif(os.name != "posix", reason="sends signals"),
]

STEP = """import ctypes, re, threading, time
def step(robot):
    robot.drive(0.5, 0.5)
    if robot.time > 0.299:
        open("begun", "w").close()
        {deed}
"""
MAIN = """import re, time
def main(robot):
    robot.drive(0.5, 0.5)
    robot.wait(0.3)
    open("begun", "w").close()
    {deed}
"""
CATCHES = """while True:
            try:
                time.sleep(0.01)
            except BaseException:
                pass"""
LOCKS = "lock = ctypes.create_string_buffer(64); [ctypes.{kind}(None).pthread_mutex_lock(lock) for _ in '12']"
THREAD = "threading.Thread(target=time.sleep, args=(1e6,)).start(); time.sleep(1e6)"
BACKTRACKS = 're.match("(a+)+b", "a" * 60)  # holds the interpreter, and no signal reaches it outside the main thread'
LEAVES = "boebot: the brain went on after Ctrl-C, so the whole program was ended; expected no `except:` that catches it"
COMMAND = (sys.executable, "-m", "boebot", "run", "mine.py", "--step-timeout", "inf", "--seconds", "60")
MISSING = "boebot: interrupted; the brain gave Python no turn, so what is written at the end of a run is missing"


def run(
    folder: Path,
    brain: str,
    *options: str,
    signals: Sequence[int] = (signal.SIGINT,),
    command: Sequence[str] = COMMAND,
) -> tuple[int, str, str, float]:
    """Exit code, what it printed, and the seconds from the first signal, sent once the brain misbehaves, to its end; a
    further one comes 0.6 s after the one before."""
    (folder / "mine.py").write_text(brain)
    process = subprocess.Popen(
        [*command, *options],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_signals,
    )
    try:
        until = time.monotonic() + 20
        while not (folder / "begun").exists() and process.poll() is None and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(0.1)
        sent = time.monotonic()
        process.send_signal(signals[0])
        for number in signals[1:]:
            time.sleep(0.6)
            process.send_signal(number)
        out, err = process.communicate(timeout=20)
        return process.returncode, out, err, time.monotonic() - sent
    finally:
        process.kill()


def test_a_brain_that_catches_everything_leaves_a_whole_record(tmp_path: Path) -> None:
    code, out, err, took_s = run(tmp_path, STEP.format(deed=CATCHES), "--out", "out", "--json")
    assert (code, err) == (130, f"{LEAVES}\nboebot: interrupted\n") and took_s < 3.0
    values = json.loads(out)
    assert values["ended"] == "interrupted" and values["run_time_s"] == pytest.approx(0.3)
    assert all(Path(tmp_path, name).stat().st_size > 0 for name in values["files"])
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["ended"] == "interrupted"


def test_sigterm_has_its_own_exit_code_also_among_several_robots(tmp_path: Path) -> None:
    options = ("--robots", "2", "--json")
    code, out, err, took_s = run(tmp_path, STEP.format(deed=CATCHES), *options, signals=[signal.SIGTERM])
    assert code == 143 and err.endswith("boebot: interrupted\n") and took_s < 3.0
    assert [robot["run_time_s"] for robot in json.loads(out)["robots"]] == pytest.approx([0.3, 0.3], abs=0.06)


@pytest.mark.parametrize(
    ("brain", "sentence"),
    [
        (STEP.format(deed=LOCKS.format(kind="CDLL")), f"{LEAVES}\nboebot: interrupted"),
        (STEP.format(deed=THREAD), "boebot: interrupted"),
        (STEP.format(deed=LOCKS.format(kind="PyDLL")), MISSING),
    ],
    ids=["waits in C", "leaves a thread", "keeps the interpreter"],
)
def test_a_brain_that_nothing_wakes(tmp_path: Path, brain: str, sentence: str) -> None:
    code, _, err, took_s = run(tmp_path, brain)
    assert (code, err) == (130, f"{sentence}\n") and took_s < 3.4


def test_the_second_one_ends_it_at_once(tmp_path: Path) -> None:
    code, _, err, took_s = run(tmp_path, MAIN.format(deed=BACKTRACKS), signals=[signal.SIGINT, signal.SIGTERM])
    assert (code, err) == (130, f"{MISSING}\n") and took_s < 2.0


def test_a_script_ends_too(tmp_path: Path) -> None:
    script = STEP.format(deed=CATCHES) + "import boebot\nboebot.run(step, seconds=60, step_timeout=float('inf'))\n"
    code, _, err, took_s = run(tmp_path, script, command=(sys.executable, "mine.py"))
    assert code == 130 and err.startswith("boebot: interrupted; the brain went on after Ctrl-C") and took_s < 3.0


def test_a_brain_that_catches_it_and_returns_has_ended(tmp_path: Path) -> None:
    deed = "\n        ".join(("try: time.sleep(1e6)", "except BaseException: pass"))
    code, _, err, took_s = run(tmp_path, STEP.format(deed=deed))
    assert (code, err) == (130, "boebot: interrupted\n") and took_s < 1.0
