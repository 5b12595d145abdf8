"""Ctrl-C and SIGTERM end a run whatever its brain does: it catches everything, keeps Python busy, or leaves threads."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import pytest

from boebot.record.reading import CutError
from boebot.result import RunResult, read_run
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
SLOW = STEP.replace("def step(robot):", "def step(robot):\n    time.sleep(0.3)")  # longer than a chunk of the record
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
BACKTRACKS = 're.match("(a+)+b", "a" * 60)  # holds the interpreter, and no signal reaches it outside the main thread'
LEAVES = "boebot: the brain went on after Ctrl-C, so the whole program was ended; expected no `except:` that catches it"
SCRIPT = "import boebot\nboebot.run(step, seconds=60, step_timeout=float('inf'))\n"
THREAD = "threading.Thread(target=threading.Event().wait, args=(1e6,)).start()"
RETURNS = "\n        ".join((THREAD, "try: threading.Event().wait(1e6)", "except BaseException: pass"))
MISSING = "boebot: interrupted; the brain gave Python no turn, so what is written at the end of a run is missing"


class Case(NamedTuple):
    """A brain that misbehaves, and what is sent to its process then: a further signal 0.6 s after the one before."""

    brain: str
    options: tuple[str, ...] = ()
    signals: tuple[int, ...] = (signal.SIGINT,)
    command: tuple[str, ...] = ("-m", "boebot", "run", "mine.py", "--step-timeout", "inf", "--seconds", "60")


class Ended(NamedTuple):
    """How its process ended."""

    code: int
    out: str
    err: str
    took_s: float
    """from the first signal"""
    folder: Path


CASES = {
    "catches": Case(STEP.format(deed=CATCHES), ("--out", "out", "--json")),
    "sigterm": Case(STEP.format(deed=CATCHES), ("--robots", "2", "--json"), (signal.SIGTERM,)),
    "waits in C": Case(STEP.format(deed=LOCKS.format(kind="CDLL"))),
    "keeps the interpreter": Case(SLOW.format(deed=LOCKS.format(kind="PyDLL")), ("--out", "out")),
    "twice": Case(MAIN.format(deed=BACKTRACKS), signals=(signal.SIGINT, signal.SIGTERM)),
    "script": Case(STEP.format(deed=CATCHES) + SCRIPT, command=("mine.py",)),
    "returns and leaves a thread": Case(STEP.format(deed=RETURNS)),
}


def end(folder: Path, case: Case) -> Ended:
    (folder / "mine.py").write_text(case.brain)
    process = subprocess.Popen(
        [sys.executable, *case.command, *case.options],
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
        process.send_signal(case.signals[0])
        for number in case.signals[1:]:
            time.sleep(0.6)
            process.send_signal(number)
        out, err = process.communicate(timeout=20)
        return Ended(process.returncode, out, err, time.monotonic() - sent, folder)
    finally:
        process.kill()


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Ended]:
    """The first case, which draws pictures, by itself; the others two at a time: they wait more than they compute."""
    folders = [tmp_path_factory.mktemp("brain") for _ in CASES]
    (first, *others), cases = folders, list(CASES.values())
    with ThreadPoolExecutor(2) as pool:
        return dict(zip(CASES, [end(first, cases[0]), *pool.map(end, others, cases[1:])], strict=True))


def test_a_brain_that_catches_everything_leaves_a_whole_record(ended: dict[str, Ended]) -> None:
    code, out, err, took_s, folder = ended["catches"]
    assert (code, err) == (130, f"{LEAVES}\nboebot: interrupted\n") and took_s < 3.0
    values = json.loads(out)
    assert values["ended"] == "interrupted" and values["run_time_s"] == pytest.approx(0.3)
    assert all(Path(folder, name).stat().st_size > 0 for name in values["files"])
    assert json.loads((folder / "out" / "summary.json").read_text())["ended"] == "interrupted"


def test_sigterm_has_its_own_exit_code_also_among_several_robots(ended: dict[str, Ended]) -> None:
    code, out, err, took_s, _ = ended["sigterm"]
    assert code == 143 and err.endswith("boebot: interrupted\n") and took_s < 3.0
    assert [robot["run_time_s"] for robot in json.loads(out)["robots"]] == pytest.approx([0.3, 0.3], abs=0.06)


@pytest.mark.parametrize(
    ("name", "sentence", "limit_s"),
    [
        ("waits in C", f"{LEAVES}\nboebot: interrupted", 3.0),
        ("keeps the interpreter", MISSING, 3.2),
        ("twice", MISSING, 2.0),
        ("returns and leaves a thread", "boebot: interrupted", 3.0),
    ],
)
def test_a_brain_that_does_not_heed_it(ended: dict[str, Ended], name: str, sentence: str, limit_s: float) -> None:
    code, _, err, took_s, _ = ended[name]
    assert (code, err) == (130, f"{sentence}\n") and took_s < limit_s


def test_record_is_kept_up_to_the_last_second_though_python_gets_no_turn(ended: dict[str, Ended]) -> None:
    record = read_run(ended["keeps the interpreter"].folder / "out")
    assert isinstance(record, RunResult) and isinstance(record.error, CutError)
    assert record.run_time >= 0.1 and record.steps >= 2 and record.whisker_touches == 0


def test_a_script_ends_too(ended: dict[str, Ended]) -> None:
    code, _, err, took_s, _ = ended["script"]
    assert (code, err) == (130, f"boebot: interrupted; {LEAVES.removeprefix('boebot: ')}\n") and took_s < 3.0
