"""Brains that raise, hang, command what motors cannot do, or are late, through the whole circle: the run ends with one
sentence that has the place in the user's file, its record goes up to that tick, and the motors are stopped.

Every bad brain drives well until 0.30 s. What is expected of the record follows from that: steps at 0, 0.05 ... 0.25 s
were carried out, the one at 0.30 s was not, and there is a row for each hundredth of a second up to there.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot import cli
from boebot.boards import BoardRequest, World, open_world
from boebot.errors import BoebotError, BrainError
from boebot.record.record import KINDS
from boebot.result import RunResult, read_run
from boebot.robot import Robot
from boebot.running import loop
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.sessions.session import DirectSession, SimSession
from sim_bridge.tests.simulated import happened

pytestmark = pytest.mark.unsanitized

BAD_FROM_S = 0.30
FUNCTION = """import math, time
from boebot import Command

def step(robot):
    robot.drive(0.5, 0.5)
    if robot.time > 0.299:
        {deed}
"""
PROCESS = """import math, time
from boebot import Command
from boebot.brain import Brain, MotorBehavior
class Naughty(MotorBehavior):
    def step(self, robot):
        robot.drive(0.5, 0.5)
        if robot.time > 0.299:
            {deed}
brain = Brain([Naughty()])
"""
FORMS = {"function": (FUNCTION, 7, ""), "process": (PROCESS, 8, "process 'naughty': ")}
ROBOTS = {"native": "shieldbot", "avr": "shieldbot", "direct": "arsim"}


@pytest.fixture
def stood_still(monkeypatch: pytest.MonkeyPatch) -> list[bool]:
    """Tells of each run whether the robot stands still once its driver has let go of it."""
    stopped: list[bool] = []

    def look(session: SimSession) -> None:
        session.transport.read(1.0, 1.0)  # wheels that nothing drives have stopped by then
        truth = happened(session.robot)
        assert truth is not None and truth.left_speed is not None
        stopped.append(bool(abs(truth.left_speed[-1]) < 1e-3 < abs(truth.left_speed).max()))

    def opened(url: str, requests: Sequence[BoardRequest]) -> World:
        world = open_world(url, requests)
        (session,) = world.sessions
        assert isinstance(session, SimSession | DirectSession)
        calls: list[str] = []
        if isinstance(session, DirectSession):
            for name in ("step", "stop", "close"):
                spy(session, name, calls)
        close = session.close

        def look_and_close() -> None:
            if isinstance(session, SimSession):
                look(session)
            else:
                stopped.append(calls.count("step") > 10 and calls[-1] == "stop")
            close()

        session.close = look_and_close  # type: ignore[method-assign]
        return world

    # tested elsewhere, and they take long
    monkeypatch.setattr("boebot.view._draw", lambda robots, error, path: path.touch())
    monkeypatch.setattr(loop, "open_world", opened)
    return stopped


def spy(session: DirectSession, name: str, calls: list[str]) -> None:
    """Notes calls of a method."""
    method: Callable[..., None] = getattr(session, name)

    def noted(*arguments: float) -> None:
        calls.append(name)
        method(*arguments)

    setattr(session, name, noted)


def complete(folder: Path) -> None:
    """The record has a row for each tick up to that of the bad step."""
    result = read_run(folder)
    assert isinstance(result, RunResult)
    assert result.record.times_of(result.record.tick_stream) == pytest.approx([n / 100 for n in range(31)])
    assert set(result.series.command["kind"][1:]) == {KINDS.index("signal")}
    assert (folder / "summary.json").exists()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("on", ["native", pytest.param("direct", marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    ("deed", "sentence"),
    [
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("robot.drive(math.nan, 0)", "drive(nan, 0): motor signals go from -1 to 1"),
        ("robot.drive(0, -math.inf)", "drive(0, -inf): motor signals go from -1 to 1"),
        ("robot.drive(0.5, 1.01)", "drive(0.5, 1.01): motor signals go from -1 to 1"),
        ("robot.drive('fast', 0)", "drive('fast', 0) expects two numbers"),
        ("robot.drive_speed(9, 9)", "drive_speed(9, 9): wheel speeds go from"),
    ],
)
def test_brain_that_does_wrong(
    tmp_path: Path, stood_still: list[bool], form: str, on: str, deed: str, sentence: str
) -> None:
    text, line, process = FORMS[form]
    path = tmp_path / "bad.py"
    path.write_text(text.format(deed=deed))
    with pytest.raises(BrainError) as caught:
        boebot.run(path, robot=ROBOTS[on], on=on, seconds=5, out=tmp_path / "out")
    assert str(caught.value).startswith(f"{path}, line {line}: {process}{sentence}")
    assert "\n" not in str(caught.value)
    complete(tmp_path / "out")
    assert stood_still == [True]


@pytest.mark.parametrize("on", ["native", pytest.param("direct", marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    ("deed", "sentence"),
    [
        ("return math.nan, 2.0", "step returned (nan, 2.0); motors are driven by robot.drive(left, right)"),
        ("return ['left', 'right']", "step returned ['left', 'right']; motors are"),
        (
            "robot.command = Command('signal', math.nan, 0.0)",
            "robot.command is Command(kind='signal', left=nan, right=0.0); expected what robot.drive(",
        ),
        ("robot.command = Command('speed', 3.0, 0.0)", "robot.command is Command(kind='speed', left=3.0"),
        ("robot.command = Command('signal', 'a', 0)", "robot.command is Command(kind='signal', left='a'"),
        ("robot.command = Command('fly', 0, 0)", "robot.command is Command(kind='fly'"),
        ("robot.command = (1, 1)", "robot.command is (1, 1)"),
    ],
)
def test_answer_or_command_that_no_call_has_checked(
    tmp_path: Path, stood_still: list[bool], on: str, deed: str, sentence: str
) -> None:
    path = tmp_path / "bad.py"
    path.write_text(FUNCTION.format(deed=deed))
    with pytest.raises(BrainError) as caught:
        boebot.run(path, robot=ROBOTS[on], on=on, seconds=5, out=tmp_path / "out")
    assert str(caught.value).startswith(f"{path}, line 4: {sentence}"), "where the function begins"
    complete(tmp_path / "out")
    assert stood_still == [True]


class Oddity(BaseException):
    """As asyncio's CancelledError, no Exception."""

    def __str__(self) -> str:
        raise RuntimeError("no words")


def test_whatever_is_raised_ends_the_run_in_one_sentence(stood_still: list[bool]) -> None:
    for error in (Oddity(), StopIteration(), GeneratorExit(), RecursionError(), BoebotError("mine")):

        def step(robot: Robot, error: BaseException = error) -> None:
            robot.drive(0.5, 0.5)
            if robot.time > 0.299:
                raise error

        result = execute(Request.single(step, seconds=5))
        assert isinstance(result.error, BrainError) and type(error).__name__ in str(result.error)
        assert result.run_time == pytest.approx(BAD_FROM_S)
    assert stood_still == [True] * 5


# ---- hanging ---------------------------------------------------------------------------------------------------------

HANGS = ["while True: pass", "time.sleep(1000)", "[None for _ in iter(int, 1)]"]


@pytest.mark.parametrize(
    ("on", "form", "deed"),
    [
        *[("native", "function", deed) for deed in HANGS],
        ("native", "process", HANGS[0]),
        ("direct", "function", HANGS[0]),
        ("direct", "process", HANGS[1]),
        ("avr", "function", HANGS[0]),
    ],
)
def test_brain_that_hangs(tmp_path: Path, stood_still: list[bool], on: str, form: str, deed: str) -> None:
    text, line, process = FORMS[form]
    path = tmp_path / "bad.py"
    path.write_text(text.format(deed=deed))
    with pytest.raises(BrainError) as caught:
        boebot.run(path, robot=ROBOTS[on], on=on, seconds=5, out=tmp_path / "out", step_timeout=0.2)
    assert str(caught.value) == (
        f"{path}, line {line}: {process}a step of the brain has not ended after 0.2 s; "
        "expected it to return (step_timeout, --step-timeout: how long to wait)"
    )
    complete(tmp_path / "out")
    assert stood_still == [True]


def stubborn(robot: Robot) -> None:
    """Catches what it should not."""
    robot.drive(0.5, 0.5)
    until = time.perf_counter() + 0.6
    while robot.time > 0.299 and time.perf_counter() < until:
        with contextlib.suppress(BaseException):
            time.sleep(0.01)


def test_brain_that_catches_everything_is_found_out_once_it_returns(stood_still: list[bool]) -> None:
    result = execute(Request.single(stubborn, seconds=5, step_timeout=0.2))
    assert str(result.error).startswith("the brain: a step of the brain has not ended after 0.2 s")
    assert result.run_time == pytest.approx(BAD_FROM_S) and stood_still == [True]


def test_step_of_another_thread_and_among_several_robots() -> None:
    """An endless loop is ended there, too, and names the robot."""
    errors: list[BaseException | None] = []

    def hang(robot: Robot) -> None:
        while robot.time > 0.299:
            pass

    def alone() -> None:
        errors.append(execute(Request.single(hang, robot="arsim", seconds=5, step_timeout=0.2)).error)

    thread = threading.Thread(target=alone)
    thread.start()
    thread.join()
    line = hang.__code__.co_firstlineno + 1
    assert str(errors[0]).startswith(f"{__file__}, line {line}: a step of the brain has not ended after 0.2 s")
    members = [boebot.Member(), boebot.Member(brain=hang)]
    with pytest.raises(BrainError, match=rf"^robot 2: .*test_bad_brains\.py, line {line}: a step of the brain has not"):
        boebot.run_together(members, "room", 5.0, step_timeout=0.2)


def test_long_step_within_its_time_is_no_error_and_leaves_nothing_behind() -> None:
    before = signal.getsignal(signal.SIGURG), threading.active_count()

    def slow(robot: Robot) -> None:
        if robot.time == 0.0:
            time.sleep(0.3)

    for limit in (60.0, float("inf")):
        assert execute(Request.single(slow, robot="arsim", seconds=0.5, step_timeout=limit)).error is None
    assert (signal.getsignal(signal.SIGURG), threading.active_count()) == before


def test_step_that_somebody_debugs_is_not_interrupted() -> None:
    def traced(robot: Robot) -> None:
        if robot.time == 0.0:
            sys.settrace(lambda frame, event, argument: None)
            sys._getframe().f_trace = lambda frame, event, argument: None  # as a debugger at a break point
            time.sleep(0.5)
            sys.settrace(None)

    assert execute(Request.single(traced, robot="arsim", seconds=0.5, step_timeout=0.1)).error is None


# ---- at the command line ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("on", "deed", "sentence"),
    [
        ("native", HANGS[0], "a step of the brain has not ended after 0.3 s; expected it to return"),
        ("direct", "raise KeyError('x')", "KeyError: 'x'"),
    ],
)
def test_bad_brain_at_the_command_line(
    tmp_path: Path,
    stood_still: list[bool],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    on: str,
    deed: str,
    sentence: str,
) -> None:
    path = tmp_path / "bad.py"
    path.write_text(PROCESS.format(deed=deed))
    arguments = ["--robot", ROBOTS[on], "--on", on, "--step-timeout", "0.3", "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["boebot", "run", str(path), *arguments])
    monkeypatch.setattr(cli, "SIGNALS", [])  # this process keeps its own handlers
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    with pytest.raises(SystemExit, match="1"):
        cli.main()
    said = capsys.readouterr()
    assert said.err.startswith(f"boebot: {path}, line 8: process 'naughty': {sentence}")
    assert len(said.err.splitlines()) == 1 and "ended" in said.out
    complete(tmp_path / "out")
    assert stood_still == [True]


# ---- late, in real time ----------------------------------------------------------------------------------------------


class Clock:
    """A wall clock that goes on only while somebody sleeps: paced runs are then the same on every machine."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """What runs are held to in place of the machine's."""
    clock = Clock()
    for name in (
        "boebot.running.board_driver.wall",
        "boebot.running.direct_driver.wall",
        "sim_bridge.sessions.world.time",
    ):
        monkeypatch.setattr(name, clock)
    return clock


def late(clock: Clock, seconds: float) -> Callable[[Robot], None]:
    """Takes that long for its step at 0.30 s."""

    def step(robot: Robot) -> None:
        robot.drive(0.5, 0.5)
        if 0.299 < robot.time < 0.301:
            clock.sleep(seconds)

    return step


def paced(brain: object, **options: Any) -> RunResult:
    result: RunResult = execute(Request.single(brain, arena="empty", seconds=1.0, realtime=True, **options))
    return result


def test_run_in_real_time_takes_its_time(clock: Clock) -> None:
    result = paced(late(clock, 0.0))
    assert 1.0 <= clock.now < 1.2, "and what it takes to greet the board and to stop it"
    assert (result.steps, result.late_steps, result.overview.dead_man_stops) == (20, 0, 0)


def test_late_step_of_a_paced_run_is_counted_and_the_run_goes_on(clock: Clock) -> None:
    """What was due at 0.35 s comes after 0.42 s, and what was due at 0.40 s does not come."""
    result = paced(late(clock, 0.12), step_timeout=60)
    assert result.error is None and result.run_time == pytest.approx(1.0)
    assert (result.steps, result.late_steps) == (19, 1)
    assert result.overview.dead_man_stops == 0, "two periods may be missed"


def test_dead_man_stops_the_motors_in_a_step_that_outlasts_its_set_points(clock: Clock) -> None:
    """The last set-point came at 0.25 s and lives for 0.25 s: pulses end with the next servo frames."""
    result = paced(late(clock, 0.6), step_timeout=60)
    assert result.error is None and result.overview.dead_man_stops == 1
    missed = result.late_steps or 0
    assert missed >= 11 and result.steps + missed == 20
    time_s, pulses = result.series.time, result.series.number("servo_left", "pulse")
    assert (pulses[(time_s > 0.1) & (time_s < 0.49)] > 1500).all()
    assert (pulses[(time_s > 0.55) & (time_s < 0.89)] == 0).all()
    assert np.diff(time_s) == pytest.approx(0.01), "nothing of it is missing in the record"


@pytest.mark.parametrize("deed", ["time.sleep(1000)", "while True: pass"])
def test_step_that_outlasts_its_set_points_ends_a_run_in_real_time(
    tmp_path: Path, stood_still: list[bool], clock: Clock, deed: str
) -> None:
    path = tmp_path / "bad.py"
    path.write_text(FUNCTION.format(deed=deed))
    with pytest.raises(BrainError) as caught:
        boebot.run(path, seconds=5, realtime=True, out=tmp_path / "out")
    assert str(caught.value).startswith(
        f"{path}, line 7: a step of the brain has not ended after 0.25 s; the dead-man stops the motors then"
    )
    complete(tmp_path / "out")
    assert stood_still == [True]


def test_late_step_without_a_board_is_counted(clock: Clock) -> None:
    result = execute(Request.single(late(clock, 0.12), robot="arsim", seconds=0.5, realtime=True))
    assert result.error is None and result.late_steps == 2, "those that were due at 0.35 and at 0.40 s"
