"""Ctrl-C and its like: the first asks a run to end, the second ends the program, and the motors stop in any case."""

from __future__ import annotations

import json
import math
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from boebot.boards import BoardRequest, BoardSession, board_kinds, find_server
from boebot.description.robots import load_robot
from boebot.pausable_thread import DONE, PausableThread
from boebot.record.blocks import Group
from boebot.record.reading import CutError
from boebot.record.record import Record
from boebot.result import RunResult, read_run
from boebot.running import interrupts, loop
from boebot.running.tasks import Request
from command import heed_signals

pytestmark = [
    pytest.mark.unsanitized,
    pytest.mark.wall_clock,
    pytest.mark.skipif(os.name != "posix", reason="sends signals"),
    pytest.mark.skipif("native" not in board_kinds(), reason="the simulator is not installed"),
]

HEEDS = """import time
def step(robot):
    robot.drive(0.5, 0.5)
    if robot.time > 0.3:
        open("begun", "w").close()
    time.sleep(0.01)
"""
CATCHES = """import time
def step(robot):
    robot.drive(0.5, 0.5)
    time.sleep(0.05)  # so that the record is written meanwhile
    while robot.time > 1.5:
        try:
            open("begun", "w").close()
            time.sleep(0.01)
        except BaseException:
            pass
"""
GOES_ON = """import time
def step(robot):
    robot.drive(0.5, 0.5)
    if robot.time > 0.3:
        open("begun", "w").close()
        try:
            time.sleep(60)
        except KeyboardInterrupt:
            pass
"""
AGAIN = "boebot: interrupted again, so the program has ended at once; what is recorded by then is kept\n"
GAP_S = interrupts.AGAIN_S + 0.2


def begun(folder: Path, brain: str, *options: str) -> subprocess.Popen[str]:
    """The command with that brain, once its run is under way."""
    (folder / "mine.py").write_text(brain)
    command = [sys.executable, "-m", "boebot", "run", "mine.py", "--step-timeout", "inf", "--seconds", "600", *options]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, preexec_fn=heed_signals)
    until = time.perf_counter() + 60
    while not (folder / "begun").exists() and process.poll() is None and time.perf_counter() < until:
        time.sleep(0.01)
    return process


def end(process: subprocess.Popen[str], signals: Sequence[int]) -> tuple[int, str, str]:
    """Sends the signals; exit code, output and errors of its end."""
    try:
        process.send_signal(signals[0])
        for number in signals[1:]:
            time.sleep(GAP_S)
            process.send_signal(number)
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    return process.returncode, out, err


def test_the_first_one_leaves_a_whole_record_of_several_robots_too(tmp_path: Path) -> None:
    process = begun(tmp_path, HEEDS, "--robots", "2", "--json", "--out", "out")
    code, out, err = end(process, [signal.SIGTERM])
    assert code == 143 and err.endswith("boebot: interrupted\n")  # on a busy machine a sign of its sleep before it
    assert [robot["ended"] for robot in json.loads(out)["robots"]] == ["interrupted"] * 2
    read = read_run(tmp_path / "out")
    assert all(isinstance(robot.error, KeyboardInterrupt) for robot in read.robots)
    assert (tmp_path / "out" / "run.png").is_file() and (tmp_path / "out" / "robot-2" / "summary.json").is_file()


ENDS_SLOWLY = """import os, time
class Slow:
    def __del__(self, wait=time.sleep, write=os.write):
        write(2, b"going\\n")
        wait(2)
slow = Slow()
"""


def test_a_second_one_while_python_ends_changes_no_exit_code(tmp_path: Path) -> None:
    process = begun(tmp_path, ENDS_SLOWLY + HEEDS)
    process.send_signal(signal.SIGINT)
    assert process.stderr is not None
    assert [process.stderr.readline() for _ in range(2)] == ["boebot: interrupted\n", "going\n"]
    assert end(process, [signal.SIGINT])[0] == 130


def test_a_brain_that_has_caught_it_ends_with_its_step(tmp_path: Path) -> None:
    code, _, err = end(begun(tmp_path, GOES_ON), [signal.SIGINT])
    assert (code, err) == (130, "boebot: interrupted\n")


def test_the_second_one_ends_the_program_and_the_record_is_cut_there(tmp_path: Path) -> None:
    code, _, err = end(begun(tmp_path, CATCHES, "--out", "out"), [signal.SIGINT, signal.SIGTERM])
    assert (code, err) == (130, AGAIN)
    record = read_run(tmp_path / "out")
    assert isinstance(record, RunResult) and isinstance(record.error, CutError)
    assert record.run_time > 0.1 and record.steps > 2


def test_a_press_is_one_signal_even_if_the_terminal_sends_several(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "first", None)
    monkeypatch.setattr(os, "_exit", lambda code: pytest.fail("ended"))
    with interrupts.heard():
        with pytest.raises(KeyboardInterrupt):
            interrupts.interrupt(signal.SIGINT, None)
        interrupts.interrupt(signal.SIGHUP, None)


def test_a_first_one_is_noted_while_the_run_ends_anyway(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interrupts, "first", None)
    with interrupts.held():
        interrupts.interrupt(signal.SIGHUP, None)
    assert interrupts.exit_code() == 129


def test_rows_on_their_way_to_the_record_are_not_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    put, is_due = Record.put, Record.is_due

    def interrupted(record: Record, group: Group) -> None:
        if interrupts.first is None:
            os.kill(os.getpid(), signal.SIGINT)
        put(record, group)

    monkeypatch.setattr(Record, "put", interrupted)
    monkeypatch.setattr(Record, "is_due", lambda record: is_due(record) or record.count("command") == 20)
    result = loop.execute(Request.single(seconds=60))
    assert isinstance(result.error, KeyboardInterrupt)
    assert result.steps == 20 and result.true_distance is not None


class Watched:
    """A robot that is served at real time, and where it is."""

    def __init__(self) -> None:
        self.poses: list[tuple[float, float, float]] = []
        self._ends = threading.Event()
        urls: queue.SimpleQueue[str] = queue.SimpleQueue()
        request = BoardRequest(robot=load_robot("shieldbot"), arena="empty", record=False)
        serve, going = find_server(), lambda: not self._ends.is_set()
        wishes = {"tcp": 0, "announce": urls.put, "visit": lambda _: None, "running": going, "look": self._look}
        self._thread = threading.Thread(target=lambda: serve("native", request, **wishes))  # type: ignore[arg-type]
        self._thread.start()
        self.url = urls.get(timeout=30)

    def _look(self, session: BoardSession, data: bytes) -> None:
        now = session.truth_now()
        assert now is not None
        self.poses.append(now.pose)

    def moves(self) -> bool:
        """Within a fifth of a second."""
        count = len(self.poses)
        while len(self.poses) < count + 5:
            time.sleep(0.01)
        return math.dist(self.poses[-1], self.poses[count]) > 1e-3

    def close(self) -> None:
        """It ends."""
        self._ends.set()
        self._thread.join()


@pytest.fixture(scope="module")
def watched() -> Iterator[Watched]:
    robot = Watched()
    yield robot
    robot.close()


@pytest.mark.parametrize(
    ("brain", "signals"),
    [
        (HEEDS, [signal.SIGINT]),
        (CATCHES, [signal.SIGINT, signal.SIGINT]),
        (HEEDS, [signal.SIGKILL]),
    ],
    ids=["first", "second", "kill"],
)
def test_motors_stop(watched: Watched, brain: str, signals: list[int], tmp_path: Path) -> None:
    """By the stop message, or by the board's dead-man."""
    process = begun(tmp_path, brain.replace("1.5", "0.3"), "--on", watched.url)
    moved = watched.moves()
    end(process, signals)
    time.sleep(1.0)  # set-points live 0.25 s, and wheels run out
    assert not watched.moves()
    assert moved or brain is CATCHES  # whose step has outlasted its set-points


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_a_process_that_a_brain_has_forked_ends_with_the_run(tmp_path: Path) -> None:
    fork = """import os, time
def step(robot):
    child = os.fork()
    if not child:
        time.sleep(600)
    open("child", "w").write(str(child))
    open("begun", "w").close()
    time.sleep(600)
"""
    end(begun(tmp_path, fork), [signal.SIGKILL])
    child, until = int((tmp_path / "child").read_text()), time.perf_counter() + 10
    while time.perf_counter() < until:
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        if Path(f"/proc/{child}/stat").read_text().split(")")[1].split()[0] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("it goes on")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
@pytest.mark.parametrize("first_ended", [0, 1])
def test_runs_that_take_turns_may_end_in_any_order(first_ended: int) -> None:
    """A process that is forked then ends with this one while one of them goes on, and no more after the last."""
    threads: list[PausableThread] = []

    def work(index: int) -> None:
        loop.execute(Request.single(lambda robot: threads[index].pause("step"), on="native", seconds=0.1))

    threads += [PausableThread(lambda index=index: work(index), f"run {index}") for index in range(2)]  # type: ignore[misc]
    looks = []
    for thread in threads:
        thread.resume()
    for index in (first_ended, 1 - first_ended):
        looks.append(threads_of_a_child())
        while threads[index].resume() != DONE:
            pass
        assert threads[index].error is None
    looks.append(threads_of_a_child())
    assert looks == [2, 2, 1]


def threads_of_a_child() -> int:
    """How many threads a process has that is forked now: with one more it looks whether this one is there."""
    if (child := os.fork()) == 0:
        os._exit(threading.active_count())
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
