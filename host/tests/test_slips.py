"""Beginners' slips (boebot/slips.toml): each of them gets its sentence, after Python's own; and what is no slip gets
none."""

from __future__ import annotations

import math
import operator
import subprocess
import sys
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import boebot
from boebot import slips
from boebot.devices.device import kinds
from boebot.errors import BrainError
from boebot.record.run_folder import RunFolder
from boebot.result import RunResult, read_run
from boebot.running.loop import execute
from boebot.running.tasks import Request
from command import boebot as command

STEP = "def step(robot):\n    "
ERRORS = [  # a brain, what Python says, the word of our sentence that helps
    (STEP + "robot.ping.distance < 0.3", "'<' not supported between", "if robot.ping.distance is not None and ..."),
    (STEP + "0.3 - robot.ping.distance", "unsupported operand type", "if robot.ping.distance is not None and ..."),
    (STEP + "robot.ping < 0.3", "'<' not supported between", "as in robot.ping.distance"),
    (STEP + "robot.ping.distance()", "'NoneType' object is not callable", "without parentheses: robot.ping.distance"),
    (STEP + "robot.whisker_left.pressed()", "'bool' object is not callable", "robot.whisker_left.pressed"),
    (STEP + "robot.ping()", "'Ping' object is not callable", "without parentheses: robot.ping.distance"),
    (STEP + "robot.whisker_left.presed", "no attribute 'presed'", "a whisker has .pressed"),
    (STEP + "robot.drive = 0.5", "is read-only", "robot.drive(0.5, 0.5)"),
    (STEP + "robot.drive('fast')", "missing 1 required", "left and right: robot.drive(0.3, 0.3)"),
    (STEP + "robot.drive('fast', 'fast')", "expects two numbers", "robot.drive(0.5, 0.5)"),
    (STEP + "robot.drive(50, 50)", "go from -1 to 1", "50 percent of it are 0.5"),
    (STEP + "robot.forward(0.3)", "no attribute 'forward'", "expected def main(robot) in place of step"),
    (STEP + "robot.sleep(1)", "no attribute 'sleep'", "in main(robot) there is robot.wait(seconds)"),
    (STEP + "drive(0.5, 0.5)", "name 'drive' is not defined", "expected robot.drive"),
    (STEP + "whisker_left.pressed", "name 'whisker_left' is not defined", "expected robot.whisker_left"),
    ("robot.drive(0.5, 0.5)", "name 'robot' is not defined", "inside of it"),
    ("import robot", "No module named 'robot'", "needs no import"),
    ("from boebot import robot\nrobot.drive(1, 1)", "has no attribute 'drive'", "the robot is no module"),
    ("import boebot\nboebot.drive(1, 1)", "has no attribute 'drive'", "the robot is no module"),
    ("\nimport boebot\nboebot.run(__file__)", "is run again while it is loaded", "below if __name__ == '__main__':"),
    (STEP + "robot.stop", "names robot.stop and does not call it", "expected parentheses"),
    ("class Brain:\n    def step(self, robot):\n        robot.drive", "robot.drive and does not", "parentheses"),
    (STEP + "float(robot.ping.distance)", "not 'NoneType'", "is not None and"),
    (STEP + "robot.ping + 0.1", "can only concatenate tuple", "as in robot.ping.distance"),
    (STEP + "abs(robot.ping)", "bad operand type", "as in robot.ping.distance"),
    (STEP + "robot.ping == None", "never None", "expected one of its values: .distance, .status"),
    (STEP + "if robot.whisker_left: pass", "neither true nor false", "expected one of its values: .pressed"),
    (STEP + "if robot.infrared_left == True: pass", "no number", "expected one of its values: .detected, "),
    (
        "def main(robot):\n    while True: robot.drive(0.5, 0.5)",
        "no wait for 0.2 s",
        "robot.wait(...) in each of its loops",
    ),
]


def run(path: Path, step_timeout: float = 0.2, **options: Any) -> RunResult:
    return boebot.run(path, arena="empty", seconds=0.15, step_timeout=step_timeout, **options)


@pytest.mark.parametrize(("code", "python", "helps"), ERRORS)
def test_error_says_what_python_says_and_then_what_helps(code: str, python: str, helps: str, tmp_path: Path) -> None:
    brain = tmp_path / "mine.py"
    brain.write_text(code + "\n")
    with pytest.raises(BrainError) as caught:
        run(brain, record=False)
    said = str(caught.value)
    assert said.startswith(f"{brain}, line {code.count(chr(10)) + 1}: ") and "\n" not in said
    assert 0 < said.index(python) < said.index(helps)
    assert "its devices are" not in said


def test_error_that_is_none_of_the_table_is_python_s_alone(tmp_path: Path) -> None:
    brain = tmp_path / "mine.py"
    for line, said in (
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("boat", "NameError: name 'boat' is not defined"),
    ):
        brain.write_text(f"{STEP}{line}\n")
        with pytest.raises(BrainError, match=f"^.*, line 2: {said}$"):
            run(brain, record=False)


READINGS = sorted({kind.READING for kind in kinds() if kind.READING}, key=lambda kind: kind.__name__)


@pytest.mark.parametrize("reading", READINGS, ids=lambda kind: kind.__name__)
def test_reading_is_neither_true_nor_a_number_but_equal_to_its_like(reading: Any) -> None:
    one, same = (reading(*range(len(reading._fields))) for _ in range(2))
    compared: list[Any] = [
        partial(how, other) for how in (operator.eq, operator.ne) for other in (1, 0.3, True, None, "pressed")
    ]
    for ask in (bool, *compared):
        with pytest.raises(TypeError, match=rf"{reading.__name__}\) is neither .*\.{reading._fields[0]}\b"):
            ask(one)
    assert one == same and hash(one) == hash(same) and one != one._replace(age=-1)


METHOD = """
import time
class Brain:
    def rest(self): time.sleep(0.06)
    def step(self, robot): self.rest()
"""
SLEEPS = "import time\nHELPER\ndef step(robot):\n    robot.drive(0.5, 0.5)\n    REST\n    robot.stop()\n"

BUSY = """
import time
import numpy as np
heard = np.zeros((2, 2))
class Brain:
    @property
    def far(self): raise ValueError("asked too early")
    def step(self, robot):
        if robot.time > 100: heard[0, 0] = self.far
        end = time.perf_counter() + 0.06
        while time.perf_counter() < end: pass
"""


@pytest.mark.parametrize(
    ("code", "note"),
    [
        (BUSY, None),
        (SLEEPS.replace("HELPER", "").replace("REST", "time.sleep(0.06)"), "calls sleep"),
        (SLEEPS.replace("HELPER", "def rest(): time.sleep(0.06)").replace("REST", "rest()"), "calls sleep"),
        (SLEEPS.replace("HELPER", "from time import sleep as rest").replace("REST", "rest(0.06)"), "calls sleep"),
        (METHOD, "calls sleep"),
        (SLEEPS.replace("HELPER", "").replace("REST", "time.sleep(0.001)"), None),
        ("import time\ndef main(robot):\n    robot.wait(0.1)\n    time.sleep(0.06)\n", "calls sleep"),
        ("def main(robot):\n    robot.drive(0.5, 0.5)\n", "main has ended at once"),
        ("def main(robot):\n    robot.drive(0.5, 0.5)\n    robot.wait(0.1)\n", None),
        ("def main(robot):\n    for _ in range(2): robot.turn(-1.5708)\n", "expected turn(-90), if these are radians"),
    ],
)
def test_what_does_nothing_gets_a_notice(code: str, note: str | None, tmp_path: Path) -> None:
    brain = tmp_path / "mine.py"
    brain.write_text(code)
    result = run(brain, step_timeout=30.0)  # a busy computer sleeps longer than it should
    assert result.error is None and len(result.notices) == (note is not None)
    assert note is None or note in result.notices[0]


def test_notice_is_on_the_terminal_and_in_the_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    brain = tmp_path / "mine.py"
    brain.write_text("def main(robot):\n    robot.drive(0.5, 0.5)\n")
    _, _, err = command(capsys, "run", str(brain))
    with RunFolder(tmp_path / "out") as folder:
        execute(Request.single(brain), folder=folder)
    recorded = read_run(tmp_path / "out")
    assert isinstance(recorded, RunResult) and err == f"boebot: {recorded.notices[0]}\n"
    assert err.startswith("boebot: main has ended at once")


@pytest.mark.parametrize(
    ("angle", "is_noted"),
    [(math.pi / 2, True), (1.57, True), (-3.14, True), (math.pi / 12, True), (0.0, False), (1, False), (5, False)],
)
def test_turn_by_a_twelfth_of_pi_or_several_may_be_meant_in_radians(angle: float, is_noted: bool) -> None:
    def main(robot: boebot.MainRobot) -> None:
        robot.turn(angle)

    notices = boebot.run(main, arena="empty", record=False).notices
    assert [notice.startswith(f"turn({angle:g}) turns by {angle:g} degrees") for notice in notices] == [True] * is_noted


SAID = "boebot: {0} defines {1}, and nothing has run it; expected: boebot run {0}\n"


def test_script_that_only_defines_a_brain_says_at_its_end_how_to_run_it(tmp_path: Path) -> None:
    (tmp_path / "first.py").write_text("from boebot import Robot\ndef step(robot: Robot) -> None: pass\n")
    done = subprocess.run([sys.executable, "first.py"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", SAID.format("first.py", "step"))


STEP_ONLY = "def step(robot): pass"


@pytest.mark.parametrize(
    ("code", "name", "of_python", "ran"),
    [
        ("def main(robot): pass", "main", {}, False),
        (STEP_ONLY, "step", {}, False),
        (
            "from boebot.brain import Brain\nfrom boebot.behaviors import Wander\nbrain = Brain([Wander()])",
            "brain",
            {},
            False,
        ),
        ("brain = 'Brain'", None, {}, False),
        (STEP_ONLY, None, {}, True),
        (STEP_ONLY, None, {"ps1": ">>> "}, False),
        (STEP_ONLY, None, {"last_type": ValueError}, False),
        (STEP_ONLY, None, {"argv": []}, False),
        (STEP_ONLY + "\n__spec__ = 'python -m first'", None, {}, False),
        ("def main(arguments): pass", None, {}, False),
        ("def main(): pass", None, {}, False),
        ("from json import dumps as step", None, {}, False),
    ],
)
def test_it_is_said_of_no_other_script(
    code: str,
    name: str | None,
    of_python: dict[str, object],
    ran: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    main = ModuleType("__main__")
    exec(compile(code, "/home/folder/first.py", "exec"), vars(main))
    monkeypatch.setitem(sys.modules, "__main__", main)
    monkeypatch.delattr(sys, "last_type", raising=False)
    for attribute, value in ({"argv": ["folder/first.py"]} | of_python).items():
        monkeypatch.setattr(sys, attribute, value, raising=False)
    for name_of_module in () if ran else ("boebot.boards", "multiprocessing"):
        monkeypatch.delitem(sys.modules, name_of_module, raising=False)
    slips.say_unrun()
    assert capsys.readouterr() == ("", "" if name is None else SAID.format("folder/first.py", name))
