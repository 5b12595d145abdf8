"""Brains: how they are found and loaded, and the errors of those that cannot be."""

from __future__ import annotations

import importlib
import math
import os
import re
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import boebot
from boebot.brains import beside, bundled, load_brain, program_state
from boebot.errors import BrainError
from boebot.robot import Robot
from boebot.running.tasks import Request


def write(folder: Path, text: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_bundled_brain() -> None:
    assert "wander" in bundled()
    brain = load_brain("wander")
    assert brain.name == "wander" and set(brain.needs) == {"infrared"}


def test_wander_backs_off_from_a_touch_and_turns_away() -> None:
    run = boebot.run("wander", arena="room", pose=(1.4, 0.0, 0.0), seconds=2.0)  # its whiskers touch the eastern wall
    after = run.to_pandas()[["true_x_m", "true_heading_rad", "command_left", "command_right"]].loc[1.2]
    assert after.true_x_m < 1.35
    assert math.radians(80) < abs(after.true_heading_rad) < math.radians(140)
    assert after.command_left == after.command_right > 0  # straight on


def test_the_state_of_a_program_changes_with_its_sources(tmp_path: Path) -> None:
    sketch, project = tmp_path / "own", tmp_path / "project"
    (project / "lib" / "motor").mkdir(parents=True)
    (sketch / "libraries").mkdir(parents=True)
    (project / "platformio.ini").touch()
    for path, made in (
        (sketch, [sketch / "own.ino", sketch / "libraries" / "more.h"]),
        (sketch / "own.ino", [sketch / "own.ino"]),
        (project, [project / "platformio.ini", project / "lib" / "motor" / "motor.h", project / "more.py"]),
    ):
        states = []
        for file in made:
            for text in ("1;", "20;"):
                file.write_text(text)
                states.append(program_state(path))
        assert len(set(states)) == len(states) and program_state(path) == states[-1]
        (made[0].parent / ".pio").mkdir(exist_ok=True)
        (made[0].parent / ".pio" / "made.h").write_text("2;")
        assert program_state(path) == states[-1]


def test_function_in_a_file(tmp_path: Path) -> None:
    brain = load_brain(write(tmp_path, "PERIOD = 0.1\nNEEDS = ['ping']\ndef step(robot):\n    robot.stop()\n"))
    assert (brain.name, brain.period, brain.needs) == ("mine", 0.1, ("ping",))


def test_class_in_a_file_is_made_afresh_each_time(tmp_path: Path) -> None:
    path = write(tmp_path, "class Brain:\n    NEEDS = 'ping'\n    n = 0\n    def step(self, robot): self.n += 1\n")
    first, second = load_brain(path), load_brain(str(path))
    assert first.needs == ("ping",)
    first.step(None)  # type: ignore[arg-type]
    assert second.step.__self__.n == 0  # type: ignore[attr-defined]


def test_function_class_and_object_themselves() -> None:
    class Mine:
        PERIOD = 0.02

        def step(self, robot: Robot) -> None: ...

    def drive(robot: Robot) -> None: ...

    assert load_brain(drive).name == "drive"
    assert load_brain(Mine).period == 0.02
    assert load_brain(Mine()).name == "Mine"


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("brain.py", 'ROBOT, ARENA = "shieldbot-line", "office"\ndef step(robot): robot.stop()\n'),
        ("brain.toml", 'robot = "shieldbot-line"\narena = "office"\n[process.wander]\n'),
    ],
)
def test_a_brain_may_say_for_which_robot_and_arena_it_is(file: str, text: str, tmp_path: Path) -> None:
    brain = write(tmp_path, text, file)
    for given, robot, arena in (
        ({}, "shieldbot-line", "office"),
        ({"robot": "shieldbot"}, "shieldbot", None),
        ({"arena": "room"}, "shieldbot-line", "room"),
        ({"on": "/dev/ttyACM0"}, "shieldbot-line", None),
    ):
        request = Request.single(brain, **given)
        tasks = request.tasks()
        assert (tasks[0].board.robot.name, tasks[0].board.arena) == (robot, arena)
        assert request.said(tasks)["arena"] == arena, "so that the run can be repeated"


@pytest.mark.parametrize(
    ("file", "text", "sentence"),
    [
        ("a.py", 'ROBOT = "b.toml"\ndef step(robot): robot.stop()\n', "a: ROBOT is 'b.toml'; expected the name of a"),
        ("a.toml", 'arena = "b.toml"\n[process.stop]\n', "a.toml:1: arena is 'b.toml'; expected the name of"),
        ("a.toml", "robot = 3\n[process.stop]\n", "a.toml:1: robot: expected"),
    ],
)
def test_it_says_so_by_the_name_of_a_bundled_one(file: str, text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(BrainError, match=re.escape(sentence)):
        load_brain(write(tmp_path, text, file))


def test_brain_may_import_a_file_beside_it(tmp_path: Path) -> None:
    write(tmp_path, "SPEED = 0.25\n", "beside_it.py")
    brain = load_brain(write(tmp_path, "from beside_it import SPEED\ndef step(robot): return SPEED\n"))
    assert brain.step(None) == 0.25  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("def step(robot):\n    robot.drive(1, 1\n", r"mine\.py, line 2: '\(' was never closed"),
        ("import nowhere_to_be_found\n", r"mine\.py, line 1: ModuleNotFoundError"),
        ("x = 1\n\ny = x / 0\n", r"mine\.py, line 3: ZeroDivisionError: division by zero"),
        ("x = 1\n", r"mine\.py has neither a function step\(robot\) nor main\(robot\) nor a class Brain"),
        ("class Brain:\n    pass\n", r"mine\.py: class Brain has no method step"),
        ("class Brain:\n    def __init__(self):\n        oops\n", r"mine\.py, line 3: NameError"),
        ("PERIOD = 'fast'\ndef step(robot): ...\n", r"mine\.py: PERIOD is 'fast'; expected seconds"),
        ("NEEDS = 3\ndef step(robot): ...\n", r"mine\.py: NEEDS is 3; expected a list of device names"),
        ("async def step(robot): ...\n", r"mine\.py: step is an async function; expected a plain one"),
        (
            "def step(): ...\n",
            r"mine\.py: step cannot be called with the robot alone \(too many pos.*\); expected step\(",
        ),
        ("class Brain:\n    def step(self): ...\n", r"mine\.py: step cannot be called with the robot alone"),
        (
            "def step(robot, world): ...\n",
            r"mine\.py: step cannot be called with .* \(missing a required argument: 'world'",
        ),
        ("def step(robot):\n    yield\n", r"mine\.py: step contains yield; expected a function that returns"),
        ("async def step(robot):\n    yield\n", r"mine\.py: step contains yield"),
        ("class Brain:\n    async def step(self, robot): ...\n", r"mine\.py: step is an async function"),
        ("raise ValueError('first\\nsecond')\n", r"mine\.py, line 1: ValueError: first$"),
        ("import sys\nsys.exit(3)\n", r"mine\.py, line 2: SystemExit"),
        ("class Brain:\n    def __init__(self): raise SystemExit\n", r"mine\.py, line 2: SystemExit$"),
    ],
)
def test_brain_that_cannot_be_loaded_is_one_sentence_with_its_place(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence) as caught:
        load_brain(write(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_brain_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BrainError, match=r"there is no brain 'wonder'; expected a bundled one \(.*wander"):
        load_brain("wonder")
    with pytest.raises(BrainError, match=r"there is no brain file .*none\.py"):
        load_brain(tmp_path / "none.py")
    write(tmp_path, "def step(robot): ...\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BrainError, match=r"did you mean mine\.py\?"):
        load_brain("mine")
    with pytest.raises(BrainError, match="42 is no brain"):
        load_brain(42)


def test_function_that_would_never_run_is_refused() -> None:
    async def later(robot: Robot) -> None: ...

    class Callable:
        async def __call__(self, robot: Robot) -> None: ...

    for brain in (later, Callable()):
        with pytest.raises(BrainError, match="step is an async function"):
            load_brain(brain)


def test_what_a_brain_imports_is_what_lies_beside_it_now(tmp_path: Path) -> None:
    """Not what another brain has imported by that name, nor what was there when it was loaded before."""
    found = {}
    for folder, speed in (("slow", 0.25), ("fast", 0.75)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "helper.py").write_text(f"SPEED = {speed}\n")
        brain = tmp_path / folder / f"{folder}_one.py"
        brain.write_text("from helper import SPEED\n\n\ndef step(robot):\n    pass\n\n\nPERIOD = SPEED\n")
        found[folder] = brain
    assert [load_brain(found[one]).period for one in ("slow", "fast", "slow")] == [0.25, 0.75, 0.25]
    assert beside(found["fast"]) == {found["fast"], tmp_path / "fast" / "helper.py"}
    (tmp_path / "slow" / "helper.py").write_text("SPEED = 1.125\n")
    assert load_brain(found["slow"]).period == 1.125


STEP = "\n\ndef step(robot):\n    pass\n"


def brain_beside(folder: Path, helper: str, speed: float) -> Path:
    """A brain's file, whose period is the SPEED of that helper."""
    (folder / helper).parent.mkdir(parents=True)
    (folder / helper).write_text(f"import time\ntime.sleep(0.002)\nSPEED = {speed}\n")
    module = helper.removesuffix(".py").replace("/", ".")
    return write(folder, f"from {module} import SPEED as PERIOD\n{STEP}")


@pytest.mark.parametrize("helper", ["helper.py", "parts/helper.py"])
def test_a_script_and_a_brain_each_have_their_own_module_of_a_name(
    helper: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    brain, script = brain_beside(tmp_path / "brain", helper, 0.25), brain_beside(tmp_path / "script", helper, 0.75)
    monkeypatch.syspath_prepend(script.parent)
    monkeypatch.delitem(sys.modules, helper.split("/")[0].removesuffix(".py"), raising=False)
    module = helper.removesuffix(".py").replace("/", ".")
    mine = importlib.import_module(module)
    before = dict(sys.modules)
    assert load_brain(brain).period == 0.25 and beside(brain) == {brain, brain.parent / helper}
    assert mine.SPEED == 0.75 and importlib.import_module(module) is mine
    assert {name for name in before if sys.modules.get(name) is not before[name]} <= {"boebot_brain_mine"}
    assert not {name for name in sys.modules.keys() - before.keys() if name.startswith(("helper", "parts"))}
    assert load_brain(script).period == 0.75 and beside(script) == {script, script.parent / helper}


def test_what_a_brain_has_imported_is_there_while_another_one_is_run(tmp_path: Path) -> None:
    one, other = brain_beside(tmp_path / "one", "of_one.py", 1), brain_beside(tmp_path / "other", "of_other.py", 2)
    write(
        other.parent, "try:\n    import of_one\nexcept ImportError:\n    from of_other import SPEED as PERIOD\n" + STEP
    )
    load_brain(one)
    mine = sys.modules["of_one"]
    assert load_brain(other).period == 2 and sys.modules["of_one"] is mine and "of_other" in sys.modules


def test_brains_that_threads_load_have_their_own_modules(tmp_path: Path) -> None:
    brains = [brain_beside(tmp_path / str(number), "helper.py", number) for number in range(1, 5)]
    with ThreadPoolExecutor(4) as pool:
        assert [loaded.period for loaded in pool.map(load_brain, brains * 5)] == [1, 2, 3, 4] * 5


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded:DeprecationWarning")
def test_a_copy_of_the_process_loads_brains_while_a_thread_of_the_first_one_does(tmp_path: Path) -> None:
    begun, end = tmp_path / "begun", tmp_path / "end"
    wait = f"while not Path({str(end)!r}).exists():\n    time.sleep(0.01)\n"
    begin = f"import time\nfrom pathlib import Path\nPath({str(begun)!r}).touch()\n"
    slow, fast = write(tmp_path, begin + wait + STEP, "slow.py"), write(tmp_path, STEP, "fast.py")
    with ThreadPoolExecutor(1) as pool:
        loaded = pool.submit(load_brain, slow)
        try:
            while not begun.exists():
                time.sleep(0.01)
            if (copy := os.fork()) == 0:
                signal.alarm(5)
                os._exit(7 if load_brain(fast).name == "fast" else 1)
            assert os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]) == 7
        finally:
            end.touch()
        assert loaded.result().name == "slow"


def test_a_module_that_gets_a_second_name_stays(tmp_path: Path) -> None:
    brain = write(tmp_path, f"import sys\nsys.modules['second_name'] = sys.modules[{__name__!r}]\n{STEP}")
    try:
        for _ in range(2):
            load_brain(brain)
            assert sys.modules[__name__].load_brain is load_brain
    finally:
        del sys.modules["second_name"]


def test_an_edit_within_a_second_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    brain = brain_beside(tmp_path / "brain", "helper.py", 1)
    now = time.time()
    for speed in (2, 3, 4):
        (brain.parent / "helper.py").write_text(f"SPEED = {speed}\n")
        os.utime(brain.parent / "helper.py", (now, now))
        assert load_brain(brain).period == speed
