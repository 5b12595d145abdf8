"""Brains that run from top to bottom, `main(robot)`, through the whole circle: waits, ways and turns, errors, ends."""

from __future__ import annotations

import contextlib
import gc
import hashlib
import math
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot import MainRobot, Member, Robot
from boebot.arenas import load_arena
from boebot.brains import load_brain
from boebot.cli.new import template
from boebot.errors import BrainError
from boebot.result import RunResult
from boebot.running.loop import execute
from boebot.running.tasks import Request
from sim_bridge.batch import Batch
from sim_bridge.vehicle import vehicle_model

pytestmark = pytest.mark.unsanitized

BOARDS = [("native", "shieldbot"), ("avr", "shieldbot"), ("direct", "arsim")]


def digest(result: RunResult) -> str:
    """Of commands and true path."""
    assert result.true_pose is not None
    commands = repr(result.record.rows("command")).encode()
    return hashlib.sha256(commands + result.true_pose.x.tobytes() + result.true_pose.heading.tobytes()).hexdigest()


def turned(result: RunResult) -> float:
    """Degrees, from its start to its end."""
    assert result.true_pose is not None
    return math.degrees(float(np.unwrap(result.true_pose.heading)[-1] - result.true_pose.heading[0]))


def travelled(result: RunResult) -> float:
    """Metres from start to end."""
    assert result.true_pose is not None
    return float(math.hypot(np.ptp(result.true_pose.x[[0, -1]]), np.ptp(result.true_pose.y[[0, -1]])))


@pytest.mark.parametrize(("on", "robot"), BOARDS)
def test_the_same_commands_as_a_step_that_waits(on: str, robot: str) -> None:
    """Of one brain written in both ways, to the last bit; and again."""

    def main(robot: MainRobot) -> None:
        for signal in (0.5, -0.3):
            robot.drive(signal, 0.2)
            robot.wait(0.4)
        robot.drive(0.4, 0.4)
        robot.wait(math.inf)

    def step(robot: Robot) -> None:
        if robot.time < 0.399:
            robot.drive(0.5, 0.2)
        elif robot.time < 0.799:
            robot.drive(-0.3, 0.2)
        else:
            robot.drive(0.4, 0.4)

    runs = [boebot.run(brain, robot=robot, on=on, seconds=1.5) for brain in (main, step, main)]
    assert len({digest(run) for run in runs}) == 1 and runs[0].run_time == pytest.approx(1.5, abs=0.011)


@pytest.mark.parametrize(
    ("on", "robot", "degrees", "source"),
    [
        ("native", "shieldbot", 6.0, "encoders"),
        ("avr", "shieldbot", 6.0, "encoders"),
        ("direct", "arsim", 6.0, "odometer"),
        ("native", "boebot", 15.0, "commands"),
    ],
)
def test_ways_and_turns(on: str, robot: str, degrees: float, source: str) -> None:
    arrived = []

    def main(robot: MainRobot) -> None:
        arrived.append(robot.turn())
        robot.forward(0.2)
        arrived.append(robot.turn(-180))

    result = boebot.run(main, robot=robot, on=on, arena="empty")
    assert arrived == [True, True] and turned(result) == pytest.approx(-90, abs=degrees)
    assert travelled(result) == pytest.approx(0.2, rel=0.15)
    assert result.odometry_source == source and result.run_time < 15
    assert [notice for notice in result.notices if "went by time" in notice] == result.notices
    assert len(result.notices) == (source == "commands")


def test_a_movement_that_something_holds_is_given_up() -> None:
    arrived = []

    def main(robot: MainRobot) -> None:
        robot.emergency_stop()
        arrived.append(robot.forward(-0.3))

    result = boebot.run(main)
    assert arrived == [False] and result.error is None and 3 < result.run_time < 20


def test_waits() -> None:
    times: list[float] = []
    came: list[bool] = []

    def main(robot: MainRobot) -> None:
        robot.wait(0.12)  # ends at the next step
        times.append(robot.time)
        robot.wait()
        times.append(robot.time)
        came.append(robot.wait_until(lambda: robot.time > 0.32))
        times.append(robot.time)
        came.append(robot.wait_until(lambda: False, timeout=0.2))
        times.append(robot.time)
        came.append(robot.wait_until(lambda: True))
        times.append(robot.time)
        robot.beep(440, 0.1)
        robot.drive(0.5, 0.5)

    result = boebot.run(main, robot="boebot")
    assert times == pytest.approx([0.15, 0.2, 0.35, 0.55, 0.55]) and came == [True, False, True]
    assert result.error is None and result.run_time == pytest.approx(0.6, abs=0.02), "a period after main's end"
    assert result.record.steps[-1][1:] == ("stop", 0.0, 0.0)


@pytest.mark.parametrize(
    ("deed", "sentence"),
    [
        ("robot.drive(1.5, 0)", "mine.py, line 4: drive(1.5, 0): motor signals go from -1 to 1"),
        ("1 / 0", "mine.py, line 4: ZeroDivisionError: division by zero"),
        (
            "while True: pass",
            "mine.py, line 4: main has come to no wait for 0.3 s; expected robot.wait(...) in each of its loops",
        ),
        ("time.sleep(1e6)", "mine.py, line 4: main has come to no wait for 0.3 s"),
        (
            "robot.wait_until(robot.whisker_left.pressed)",
            "mine.py, line 4: wait_until(False) expects a function, as in",
        ),
        ("robot.wait(-1)", "mine.py, line 4: wait: seconds is -1; expected a finite number of at least 0"),
        ("robot.forward('far')", "mine.py, line 4: forward: metres is 'far'; expected a finite number"),
        ("robot.turn(float('inf'))", "mine.py, line 4: turn: degrees is inf; expected a finite number"),
        ("exit()", "mine.py, line 4: SystemExit"),
    ],
)
def test_error_has_its_line_and_ends_the_run(tmp_path: Path, deed: str, sentence: str) -> None:
    path = tmp_path / "mine.py"
    path.write_text(f"import time\ndef main(robot):\n    robot.wait(0.2)\n    {deed}\n")
    begun = time.perf_counter()
    result = execute(Request.single(path, seconds=20, step_timeout=0.3))
    assert sentence in str(result.error) and result.run_time == pytest.approx(0.2)
    assert time.perf_counter() - begun < 60


def test_the_end_of_the_run_ends_main_and_its_thread() -> None:
    left: list[str] = []

    def main(robot: MainRobot) -> None:
        try:
            while True:
                with contextlib.suppress(Exception):
                    robot.forward(1.0)
        finally:
            left.append("cleared up")
            robot.wait(1.0)
            left.append("never")

    before = threading.active_count()
    result = boebot.run(main, robot="arsim", seconds=1.0)
    assert result.error is None and left == ["cleared up"] and threading.active_count() == before


def test_each_run_begins_it_anew() -> None:
    def main(robot: MainRobot) -> None:
        robot.turn(90)

    loaded = load_brain(main)
    runs = [boebot.run(loaded, robot="arsim", seconds=seconds) for seconds in (0.5, 9.0, 9.0)]
    assert [run.run_time for run in runs[1:]] == [pytest.approx(runs[1].run_time)] * 2 and 0.9 < runs[1].run_time < 4
    assert digest(runs[1]) == digest(runs[2])


def test_main_that_catches_everything_does_not_keep_the_run() -> None:
    def main(robot: MainRobot) -> None:
        while True:
            with contextlib.suppress(BaseException):
                robot.wait(0.1)

    begun = time.perf_counter()
    assert boebot.run(main, robot="arsim", seconds=1.0).error is None
    assert time.perf_counter() - begun < 60


def test_among_others_it_ends_for_itself() -> None:
    def main(robot: MainRobot) -> None:
        robot.drive(0.5, 0.5)
        robot.wait(0.5)

    members = [Member(brain=main), Member(brain=main), Member(brain="wander")]
    together = boebot.run_together(members, "empty", seconds=1.5)
    assert [robot.run_time for robot in together.robots] == pytest.approx([0.55, 0.55, 1.5], abs=0.02)


def test_in_a_batch_as_alone() -> None:
    def main(robot: MainRobot) -> None:
        robot.turn(90)
        robot.drive(0.3, robot.random.uniform(0.2, 0.4))
        robot.wait(1.0)
        robot.stop()
        robot.wait(0.5)

    batch = Batch(vehicle_model("arsim"), load_arena("arsim"), np.zeros((3, 3)), [3, 4, 3])
    before = threading.active_count()
    batch.run(main, 200)
    alone = boebot.run(main, robot="arsim", arena="arsim", pose=(0, 0, 0), seed=4, seconds=2.0)
    assert alone.true_pose is not None and alone.run_time == 2.0
    poses = batch.true_poses
    assert poses[1, 0] == alone.true_pose.x[-1] and poses[0].tolist() == poses[2].tolist() != poses[1].tolist()
    batch.run(main, 400)
    poses = batch.true_poses
    batch.run(main, 100)  # main has returned
    assert batch.true_poses == pytest.approx(poses, abs=1e-3)
    del batch
    gc.collect()
    until = time.perf_counter() + 5
    while threading.active_count() > before and time.perf_counter() < until:
        time.sleep(0.01)
    assert threading.active_count() <= before


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "def main(robot): ...\ndef step(robot): ...\n",
            "has both a function main(robot) and a function step(robot); expected one",
        ),
        (
            "def main(robot): ...\nclass Brain:\n    def step(self, robot): ...\n",
            "has both a function main(robot) and a brain of",
        ),
        ("def main(): ...\n", "main takes no robot; expected def main(robot)"),
        ("async def main(robot): ...\n", "main is an async function; expected a plain one, def main(robot)"),
        ("def main(robot):\n    yield\n", "main contains yield"),
    ],
)
def test_a_file_that_cannot_be_run_is_refused_in_one_sentence(tmp_path: Path, text: str, sentence: str) -> None:
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(BrainError) as caught:
        load_brain(path)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)


def test_a_script_s_own_main_beside_step_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text("def step(robot): ...\ndef main(): ...\n")
    assert load_brain(path).main is None


def test_the_template_runs_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(template("main", "mine"))
    result = boebot.run(path)
    assert result.error is None and result.odometry_source == "encoders" and result.true_distance is not None
    assert result.true_distance > 1.0
