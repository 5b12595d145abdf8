"""Brains of processes as they are given to a run: in a Python file, in a TOML file, bundled, as an object; and the
errors of those that are wrong.

The runs are on robots without and with a board of this process (boebot.run, native).
"""

from __future__ import annotations

import subprocess
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot import cli
from boebot.behaviors import Avoid, Stop, StraightRun, Wander
from boebot.brain import Brain, CognitiveProcess, MotorBehavior, StateVariable, Utility
from boebot.brains import bundled, load_brain
from boebot.cognition import Odometry, contact, near
from boebot.errors import BoebotError, BrainError
from boebot.link import messages
from boebot.result import RunResult
from boebot.robot import Robot
from steps import Stepped

COMPOSED = """
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain, Utility
from boebot.cognition import near

brain = Brain(
    [Wander(utility=Utility(b=0.5)), Avoid(utility=Utility(b=-1.0, w={"near": 3.0}))], [near()], period=0.1
)
"""
TOML = """
period_s = 0.1
[variable.near]
[process.wander]
utility = { b = 0.5 }
[process.avoid]
utility = { b = -1.0, w = { near = 3.0 } }
"""


def composed() -> Brain:
    """The same as both."""
    return Brain(
        [Wander(utility=Utility(b=0.5)), Avoid(utility=Utility(b=-1.0, w={"near": 3.0}))], [near()], period=0.1
    )


def write(folder: Path, text: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def commands(result: RunResult) -> list[tuple[object, ...]]:
    return [tuple(step) for step in result.record.steps]


# ---- loading ---------------------------------------------------------------------------------------------------------


def test_file_object_and_toml_are_the_same_brain(tmp_path: Path) -> None:
    sources = [write(tmp_path, COMPOSED), composed(), str(write(tmp_path, TOML, "mine.toml"))]
    loaded = [load_brain(source) for source in sources]
    assert [one.name for one in loaded] == ["mine", "brain", "mine"]
    assert [(one.period, one.needs) for one in loaded] == [(0.1, ("infrared",))] * 3
    assert [one.path is not None for one in loaded] == [True, False, True]
    runs = [boebot.run(source, robot="arsim", seconds=10, seed=3) for source in sources]
    assert {run.period for run in runs} == {0.1}
    assert commands(runs[0]) == commands(runs[1]) == commands(runs[2])
    assert len({step[2:] for step in commands(runs[0])}) > 2, "they do not just drive on"


def test_loaded_brain_records_its_decisions(tmp_path: Path) -> None:
    brain = load_brain(write(tmp_path, COMPOSED))
    assert isinstance(brain.brain, Brain) and brain.step == brain.brain.step
    mine = composed()
    result = boebot.run(mine, robot="arsim", seconds=2)
    record = result.brain_record
    assert record is not None and len(record) == result.steps == 20 and record.switches[0].on == "wander"
    assert not mine.steps, "they are in the record"
    assert load_brain(lambda robot: None).brain is None


def test_bundled_brains_by_name_and_none_twice() -> None:
    assert {"wander", "clearway"} <= set(bundled()) and len(set(bundled())) == len(bundled())
    brain = load_brain("clearway").brain
    assert brain is not None and [one.name for one in brain.processes] == ["wander", "avoid"]


@pytest.mark.parametrize(("robot", "speed_m_s", "seconds"), [("shieldbot", 0.14, 60), ("arsim", 0.68, 30)])
def test_bundled_brain_of_a_file_wanders_and_turns_away(robot: str, speed_m_s: float, seconds: float) -> None:
    """At least half of the way that it would go straight on in that time: it does not stay at a wall."""
    loaded = load_brain("clearway")
    result = boebot.run(loaded, robot=robot, seconds=seconds)
    assert result.brain == "clearway" and loaded.brain is not None
    assert (result.true_distance or 0.0) > speed_m_s * seconds / 2
    assert result.brain_record is not None
    assert {switch.on for switch in result.brain_record.switches} == {"wander", "avoid"}


def test_module_may_say_more_than_its_brain(tmp_path: Path) -> None:
    brain = load_brain(write(tmp_path, "PERIOD = 0.2\nNEEDS = ['ping']\n" + COMPOSED))
    assert (brain.period, brain.needs) == (0.2, ("ping", "infrared"))


def test_module_object_and_a_class_of_ones_own(tmp_path: Path) -> None:
    module = types.ModuleType("cell")
    exec(COMPOSED, module.__dict__)
    assert isinstance(load_brain(module).brain, Brain)
    text = "from boebot.behaviors import Stop\nfrom boebot import brain as b\nclass Brain(b.Brain):\n"
    text += "    def __init__(self):\n        super().__init__([Stop()], period=0.02)\n"
    loaded = load_brain(write(tmp_path, text))
    assert isinstance(loaded.brain, Brain) and loaded.period == 0.02


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.py", COMPOSED.replace("brain = ", "clever = "), r"a\.py has neither .*; it has a Brain called clever"),
        ("a.py", COMPOSED + "\ndef step(robot): ...\n", r"a\.py has both a function step\(robot\) and a brain = "),
        ("a.py", "from boebot.brain import Brain\n", r"a\.py has neither a function step"),
        ("a.py", COMPOSED.replace('"near"', '"far"'), r"a\.py, line 6: utility: w names the state variable 'far'"),
        ("a.toml", TOML + "hue = 3\n", r"a\.toml.*hue"),
        ("a.toml", TOML.replace("near = 3.0", "far = 3.0"), r"a\.toml:7: .*names the state variable 'far'"),
        ("a.toml", "= 1", r"a\.toml"),
        ("a.txt", TOML, r"a\.txt is no brain file; a brain's file ends in \.py or \.toml"),
    ],
)
def test_file_that_is_wrong_is_one_sentence(tmp_path: Path, name: str, text: str, sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence) as caught:
        load_brain(write(tmp_path, text, name))
    assert "\n" not in str(caught.value)


def test_one_process_is_no_brain_and_a_toml_file_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BrainError, match=r"'wander' is one process; expected a brain of it, Brain\(\[Wander\(\)\]\)"):
        load_brain(Wander())
    write(tmp_path, TOML, "fly.toml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(BrainError, match=r"there is no brain 'fly'; .*did you mean fly\.toml\?"):
        load_brain("fly")
    with pytest.raises(BrainError, match=r"there is no brain file none\.toml"):
        load_brain("none.toml")


# ---- runs ------------------------------------------------------------------------------------------------------------


def test_second_run_begins_afresh() -> None:
    brain = composed()
    first = boebot.run(brain, robot="arsim", seconds=10, seed=5)
    second = boebot.run(brain, robot="arsim", seconds=10, seed=5)
    assert commands(first) == commands(second)
    assert first.brain_record is not None and second.brain_record is not None
    assert np.array_equal(first.brain_record.utilities, second.brain_record.utilities)
    assert first.brain_record.switches == second.brain_record.switches
    other = boebot.run(brain, robot="arsim", seconds=10, seed=6)
    assert commands(other) != commands(first)


def test_robots_do_not_share_a_brain(tmp_path: Path) -> None:
    brain, wander = composed(), Wander()
    for one, two in ((brain, brain), (Brain([wander]), Brain([Stop(), wander]))):
        members = [boebot.Member(brain=one), boebot.Member(brain=Brain([Stop()])), boebot.Member(brain=two)]
        with pytest.raises(BrainError, match="robots 1 and 3 share the brain of 'wander'; expected another Brain for"):
            boebot.run_together(members, "room", 1.0)
    path = write(tmp_path, COMPOSED)
    result = boebot.run_together([boebot.Member(brain=path), boebot.Member(brain=path)], "room", 5.0)
    assert result.error is None and [len(robot.record.steps) for robot in result.robots] == [50, 50]
    assert commands(result.robots[0]) != commands(result.robots[1])


@pytest.mark.parametrize(
    ("robot", "source"), [("arsim", "odometer"), ("shieldbot", "encoders"), ("shieldbot-basic", "commands")]
)
def test_poses_from_commands_are_marked_as_such(robot: str, source: str) -> None:
    odometry = Odometry()
    result = boebot.run(Brain([Wander(), odometry]), robot=robot, seconds=1)
    assert odometry.source == source
    assert result.odometry_source == result.table()["odometry_source"] == source
    assert boebot.run(Brain([Wander()]), robot=robot, seconds=0.1).table()["odometry_source"] is None
    asleep = Odometry(utility=Utility(b=-1.0))
    assert boebot.run(Brain([Wander(), asleep]), robot=robot, seconds=0.1).table()["odometry_source"] is None


def test_poses_from_commands_are_those_of_ideal_wheels() -> None:
    """Straight at half signal for 2 s: v t - v tau (1 - e^(-t/tau)), with the wheels' lag tau."""
    from boebot.cognition.odometry import LAG_S

    odometry = Odometry(use="commands")
    result = boebot.run(Brain([Wander(turn_probability=0.0), odometry], period=0.01), seconds=2.0, arena="empty")
    speed = 0.5 * result.robot.body.wheel_speed_maximum_m_s
    begins = odometry.pose  # the last step was 0.01 s before the end; the first command acts a step after the first
    times = [2.0 - 0.01 * late for late in (1, 2, 3)]
    ways = [speed * (t - LAG_S * (1 - np.exp(-t / LAG_S))) for t in times]
    assert ways[-1] - 1e-9 <= begins[0] <= ways[0] + 1e-9
    assert begins[1] == begins[2] == 0.0


@pytest.mark.parametrize("kind", ["object", "py", "toml"])
def test_brain_that_needs_what_the_robot_lacks_is_refused_by_name(tmp_path: Path, kind: str) -> None:
    source: object = Brain([Wander(), Odometry(), Needy()])
    if kind == "py":
        source = write(tmp_path, "from boebot.behaviors import Withdraw\nfrom boebot.brain import Brain\n"
                       "brain = Brain([Withdraw()])\n")  # fmt: skip
    elif kind == "toml":
        source = write(tmp_path, "[process.wander]\n[process.contact]\n", "mine.toml")
    device = "compass and laser" if kind == "object" else "whisker_left and whisker_right"
    robot = "shieldbot-basic" if kind == "object" else write(
        tmp_path, 'name = "bald"\nextends = "shieldbot"\nremove = ["whisker_left", "whisker_right"]\n', "bald.toml"
    )  # fmt: skip
    with pytest.raises(BrainError, match=rf"brain '\w+' needs {device}, which robot '[\w-]+' does not have"):
        boebot.run(source, robot=robot, seconds=1)


@dataclass(kw_only=True)
class Needy(CognitiveProcess):
    NEEDS = ("compass", "laser")


def test_state_variable_may_need_a_device() -> None:
    brain = Brain([Wander()], [StateVariable("north", lambda robot: 0.0, needs=("compass",))])
    with pytest.raises(BrainError, match="brain 'brain' needs compass"):
        boebot.run(brain, robot="shieldbot-basic", seconds=1)


# ---- what processes do wrong -----------------------------------------------------------------------------------------


@dataclass(kw_only=True)
class Clumsy(MotorBehavior):
    deed: Callable[[Robot], object]

    def step(self, robot: Robot) -> None:
        robot.drive(0.1, 0.1)
        if robot.time >= 0.3:
            self.deed(robot)


def test_error_in_a_process_names_it_and_the_place(tmp_path: Path) -> None:
    line = Clumsy.step.__code__.co_firstlineno + 3
    here = rf"{Path(__file__).name}, line \d+"
    for brain, sentence in (
        (Brain([Clumsy(deed=lambda robot: 1 / 0)]), rf"{here}: process 'clumsy': ZeroDivisionError: division by zero$"),
        (Brain([Clumsy(name="a", deed=lambda r: r.drive(2, 0))]), rf"{here}: process 'a': drive\(2, 0\): motor sig"),
        (Brain([Clumsy(deed=lambda r: r.drive("x", 0))]), rf"{here}: process 'clumsy': drive\('x', 0\) expects two"),  # type: ignore[arg-type]
        (Brain([Clumsy(deed=ord)]), rf"{Path(__file__).name}, line {line}: process 'clumsy': TypeError"),  # type: ignore[arg-type]
        (Brain([Wander()], [StateVariable("z", lambda r: 1 / 0)]), rf"{here}: state variable 'z': ZeroDivisionError"),
        (Brain([Wander()], [StateVariable("z", lambda r: float("nan"))]), r"the brain: state variable 'z' is nan; ex"),
        (
            Brain([StraightRun()]),
            r"the brain: process 'straight_run': no process Odometry; this brain has straight_run",
        ),
    ):
        with pytest.raises(BrainError, match=sentence):
            boebot.run(brain, robot="arsim", seconds=1)
    path = write(tmp_path, "[process.straight_run]\n", "lost.toml")
    with pytest.raises(BrainError, match=r"lost\.toml: process 'straight_run': no process Odometry; this brain has"):
        boebot.run(path, robot="arsim", seconds=1)
    path = write(tmp_path, "[process.wander]\nforward = 2.0\n", "fast.toml")
    with pytest.raises(
        BrainError, match=r"fast\.toml:2: wander: forward is 2\.0; expected a motor signal from -1 to 1"
    ):
        boebot.run(path, robot="arsim", seconds=1)


def test_error_in_a_file_beside_the_brain_has_its_place_there(tmp_path: Path) -> None:
    write(tmp_path, "from boebot.brain import MotorBehavior\nclass Odd(MotorBehavior):\n    def step(self, robot):\n"
          "        robot.fly()\n", "odd_behavior.py")  # fmt: skip
    path = write(tmp_path, "from boebot.brain import Brain\nfrom odd_behavior import Odd\nbrain = Brain([Odd()])\n")
    with pytest.raises(
        BrainError, match=r"odd_behavior\.py, line 4: process 'odd': robot 'arsim' has no attribute 'fly'"
    ):
        boebot.run(path, robot="arsim", seconds=1)


# ---- where brains are written ----------------------------------------------------------------------------------------

SCRIPT = """
import boebot
from boebot import cli
from boebot.behaviors import Wander
from boebot.brain import Brain, MotorBehavior

def step(robot):
    robot.drive(0.4, 0.4)

class Back(MotorBehavior):
    def step(self, robot):
        robot.drive(-0.4, -0.4)

class Bad(MotorBehavior):
    def step(self, robot):
        robot.drive(0.1, 7)

for brain in (step, Brain([Back()]), Brain([Wander(turn_probability=0)])):
    result = boebot.run(brain, robot="arsim", arena="empty", seconds=1)
    print(result.brain, result.steps, round(result.record.steps[-1][2], 1))
try:
    boebot.run(Brain([Bad()]), robot="arsim", seconds=1)
except boebot.BoebotError as error:
    print(error)
"""
BAD_LINE = SCRIPT.splitlines().index("        robot.drive(0.1, 7)") + 1


def expected_lines(file: str) -> list[str]:
    slip = "1 is all ahead, and 50 percent of it are 0.5"
    return [
        "step 20 0.4",
        "brain 20 -0.4",
        "brain 20 0.5",
        f"{file}, line {BAD_LINE}: process 'bad': drive(0.1, 7): motor signals go from -1 to 1; {slip}",
    ]


def test_brains_of_a_notebook_have_no_file(capsys: pytest.CaptureFixture[str]) -> None:
    exec(compile(SCRIPT, "<cell 3>", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out.splitlines() == expected_lines("<cell 3>")


@pytest.mark.parametrize("way", ["script", "stdin"])
def test_brains_of_a_script_and_of_a_prompt(tmp_path: Path, way: str) -> None:
    path = write(tmp_path, SCRIPT, "script.py")
    command, typed = ([path.name], None) if way == "script" else (["-"], SCRIPT)
    done = subprocess.run(
        [sys.executable, *command], cwd=tmp_path, input=typed, capture_output=True, text=True, check=False
    )
    assert done.stderr == ""
    assert done.stdout.splitlines() == expected_lines(str(path) if way == "script" else "<stdin>")


def test_new_brain_of_several_behaviors_backs_off_from_what_it_touches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["boebot", "new", "several", "--brain"])
    monkeypatch.setattr("boebot.cli.SIGNALS", [])
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)  # restored afterwards
    with pytest.raises(SystemExit, match="0"):
        cli.main()
    assert capsys.readouterr().out.startswith("wrote several.py; now: boebot run several.py")
    brain = load_brain(tmp_path / "several.py").brain
    assert brain is not None and brain.NEEDS == ("infrared", "whiskers")
    stepped = Stepped(brain.PERIOD)
    assert stepped.step(brain).left == 0.5, "it wanders"
    touched = [stepped.step(brain, whiskers=int(messages.Whiskers.LEFT)).left for _ in range(6)]
    assert touched[-1] == -0.6, "it backs off"
    after = [stepped.step(brain) for _ in range(60)]
    assert [command.left for command in after[:10]] == [-0.6] * 10 and brain.active == "wander"


def test_brain_without_a_first_step_has_no_odometry() -> None:
    assert load_brain(Brain([Wander(), Odometry()], [contact()])).odometry is None


def test_step_time_out_that_is_none() -> None:
    for bad, sentence in ((0, "a step cannot last 0 s"), (float("nan"), "cannot last nan s"), ("1", "is '1'; expecte")):
        with pytest.raises(BoebotError, match=sentence):
            boebot.run(Brain([Wander()]), robot="arsim", seconds=1, step_timeout=bad)  # type: ignore[arg-type]
