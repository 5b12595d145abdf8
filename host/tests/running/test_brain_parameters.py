"""Parameters of a brain's processes: set by name for a run, changed while it goes on, in its record, and repeated."""

from __future__ import annotations

import math
import pickle
from collections.abc import Iterable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.behaviors import Avoid, Evade, FollowWall, Kinesis, Wander, Withdraw
from boebot.brain import Brain, MotorBehavior, StateVariable, Utility
from boebot.brain.composition import composed, described
from boebot.brains import load_brain
from boebot.cli.run import _assigned
from boebot.cognition import BatteryLevel, Contact, LightSense, Odometry, contact, near
from boebot.errors import BoebotError
from boebot.record.interventions import Deed, Parameter
from boebot.record.run_folder import RunFolder
from boebot.result import RunResult, TogetherResult, read_run
from boebot.running.again import again, recorded
from boebot.running.brain_parameters import parameters
from boebot.running.hands import Hands
from boebot.running.loop import execute
from boebot.running.replayed import replayed
from boebot.running.tasks import Member, Request


def mind(turn_probability: float = 0.00777) -> Brain:
    return Brain(
        [
            Wander(turn_probability=turn_probability, utility=Utility(b=0.5)),
            Avoid(utility=Utility(b=-1.0, w={"near": 3.0})),
        ],
        [near()],
    )


def kept(folder: Path, request: Request, onlooker: Any = None) -> RunResult:
    """As it is read from its record."""
    with RunFolder(folder) as there:
        result = execute(request, folder=there, onlooker=onlooker)
    assert result.error is None
    read = read_run(folder)
    assert isinstance(read, RunResult)
    return read


VALUES = {"avoid.turn": 0.4, "avoid.utility.b": -0.5, "avoid.utility.w.near": 4.0, "wander.utility.tau": 0.3}


def test_parameters_that_are_set_are_those_of_a_brain_made_with_them() -> None:
    """And after the run the brain has its own again."""
    made = Brain(
        [
            Wander(turn_probability=0.00777, utility=Utility(b=0.5, tau=0.3)),
            Avoid(turn=0.4, utility=Utility(b=-0.5, w={"near": 4.0})),
        ],
        [near()],
    )
    brain = mind()
    wall: dict[str, Any] = {"arena": "room", "pose": (0.4, 1.0, math.pi), "seconds": 3}  # before one: both drive
    plain = boebot.run(brain, **wall)
    changed = boebot.run(brain, **wall, parameters=VALUES)
    assert changed.table()["behavior_switches"] > 0
    assert changed.hash == boebot.run(made, **wall).hash != plain.hash
    assert changed.parameters == VALUES and changed.made_of == boebot.run(made, seconds=0.1).made_of
    assert boebot.run(brain, **wall).hash == plain.hash


@pytest.mark.parametrize("value", [np.float64(0.25), np.float32(0.25), np.array(0.25)])
def test_numbers_of_numpy_are_taken(value: Any) -> None:
    assert boebot.run(mind(), seconds=0.1, parameters={"avoid.turn": value}).parameters == {"avoid.turn": 0.25}


def test_other_values_than_numbers_are_set() -> None:
    brain = Brain([FollowWall(), Odometry()])
    values = {"follow_wall.side": "left", "odometry.factors": [1, 0.5], "follow_wall.period": 0.1}
    made = boebot.run(brain, seconds=0.1, parameters=values).made_of
    assert made is not None and made["process"]["follow_wall"]["side"] == "left"
    assert made["process"]["odometry"]["factors"] == [1.0, 0.5] and made["process"]["follow_wall"]["period"] == 0.1


@dataclass(kw_only=True)
class Halved(MotorBehavior):
    """Makes something of its parameter when it is made."""

    signal: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        self._half = self.signal / 2

    def step(self, robot: boebot.Robot) -> None:
        robot.drive(self._half, self._half)


def test_what_a_process_has_made_of_a_parameter_follows_it() -> None:
    brain = Brain([Halved()])
    for values, half in (({"halved.signal": 0.2}, 0.1), ({}, 0.25)):
        run = boebot.run(brain, robot="arsim", seconds=0.2, parameters=values)
        assert {step[1:] for step in run.record.steps} == {("signal", half, half)}


def test_a_value_that_no_record_can_have_is_put_back_but_not_set() -> None:
    brain = Brain([Wander(), Withdraw(fatigue=math.inf)])
    boebot.run(brain, seconds=0.1, parameters={"withdraw.fatigue": 1.0})
    assert brain.processes[1] == Withdraw(fatigue=math.inf)
    with pytest.raises(BoebotError, match="withdraw: fatigue is inf; expected float, finite"):
        boebot.run(brain, parameters={"withdraw.fatigue": math.inf})


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("avoid.trun", 0.4, r"brain 'brain' has no parameter 'avoid.trun'; expected one of avoid.period, avoid.turn, .*"
         r"; did you mean 'avoid.turn'\?"),
        ("avid.x", 0.4, r"brain 'brain' has no parameter 'avid.x'; expected one that begins with wander\., avoid\."),
        ("avoid.turn", 2.0, "avoid: turn is 2.0; expected a motor signal from -1 to 1"),
        ("avoid.turn", "fast", "avoid: turn is 'fast'; expected a number"),
        ("avoid.turn", True, "avoid: turn is True; expected a number"),
        ("avoid.turn", float("nan"), "avoid: turn is nan; expected a number"),
        ("avoid.utility.tau", 0.0, "avoid: utility: tau is 0.0; expected more than 0"),
        ("avoid.utility.b", float("inf"), "avoid: utility.b is inf; expected a finite number"),
        ("avoid.utility.w.near", "far", "avoid: utility.w.near is 'far'; expected a finite number"),
        ("avoid.utility.w.tired", 1.0, "brain 'brain' has no parameter 'avoid.utility.w.tired'"),
        ("avoid.turn", 10**400, r"avoid does not take turn = 1000.*\.\.\."),
        ("avoid.turn", {}, "avoid: turn is {}; expected a number"),
        ("wander.turn", float("inf"), "wander: turn is inf; expected"),
        (3, 0.4, "brain 'brain' has no parameter '3'; expected one that begins with wander"),
        ("avoid.turn", [object()], "avoid: turn is .*; expected a number"),
        ("avoid.period", -1.0, "avoid: period is -1.0; expected seconds from step to step"),
    ],
)  # fmt: skip
def test_what_no_brain_takes_is_one_sentence(name: str, value: Any, sentence: str) -> None:
    brain = mind()
    before = parameters(load_brain(brain))
    with pytest.raises(BoebotError, match=sentence) as error:
        boebot.run(brain, parameters={"wander.turn": 0.1, name: value})
    assert "\n" not in str(error.value) and parameters(load_brain(brain)) == before, "all or none"


def test_a_brain_that_is_none_of_processes_has_no_parameters() -> None:
    with pytest.raises(BoebotError, match=r"brain 'wander' has no parameter 'wander\.turn'; expected a Brain of proc"):
        boebot.run("wander", parameters={"wander.turn": 0.1})
    with pytest.raises(BoebotError, match="parameters is 3; expected values by name"):
        boebot.run(mind(), parameters=3)  # type: ignore[arg-type]


def test_each_robot_has_its_own() -> None:
    members = [Member(brain=mind(), parameters={"avoid.turn": turn}) for turn in (0.1, 0.2)]
    assert [task.parameters for task in Request(members=members).tasks()] == [{"avoid.turn": 0.1}, {"avoid.turn": 0.2}]
    with pytest.raises(BoebotError, match=r"robot 2: brain 'wander' has no parameter 'avoid\.turn'"):
        Request(members=[members[0], Member(parameters={"avoid.turn": 0.1})]).tasks()


def test_the_command_line_reads_values_as_toml_or_texts() -> None:
    given = ["a.b=0.4", "a.c=.5", "a.d=left", "a.e=[1, 2.5]", "a.f=true", "a.g=1e-3", "a.h=", "a.w.x=-2", "2:a.i=a=b"]
    values = {"a.b": 0.4, "a.c": 0.5, "a.d": "left", "a.e": [1, 2.5], "a.f": True, "a.g": 1e-3, "a.h": "", "a.w.x": -2}
    assert _assigned(given, 2) == [values, values | {"a.i": "a=b"}]
    for wrong in (["a.b"], ["a.b=1", "a.b=2"], ["3:a.b=1"], ["a.b=1", "2:a.b=1"]):
        with pytest.raises(BoebotError, match=f"--set {wrong[-1]}; expected NAME=VALUE or N:NAME=VALUE, once for each"):
            _assigned(wrong, 2)


# ---- the record --------------------------------------------------------------------------------------------------


def everything() -> Brain:
    """Of each kind of part that a record can describe."""
    pack, light = BatteryLevel(name="pack", empty=5, full=7.75), LightSense(scale=3.0)
    bright = light.variable()
    return Brain(
        [
            Wander(
                turn_probability=np.float64(0.00777),
                turn=np.float32(0.75),  # type: ignore[arg-type]
                utility=Utility(b=0.5),
            ),
            Evade(utility=Utility(b=-2.0)),
            FollowWall(name="along", side="left", period=0.1, utility=Utility(b=-1.0, w={"near": 3.0, "touch": -1.0})),
            Kinesis(stimulus=bright.read, utility=Utility(b=-3.0, c=2.0, tau_gamma=0.7)),
            Odometry(factors=(1.0, 1.01)),
            Contact(),
            pack,
            light,
        ],
        [near(), StateVariable("touch", contact().read), pack.variable(), pack.charging_variable(), bright],
        period=0.1,
        margin=0.02,
    )


def test_a_description_composes_the_same_brain() -> None:
    brain = everything()
    whole = described(brain)
    assert whole["undescribed"] == []
    assert whole["process"]["wander"]["kind"] == "boebot.behaviors.wander.Wander"
    assert whole["process"]["wander"]["turn_probability"] == 0.00777
    assert whole["process"]["kinesis"]["stimulus"] == "light"
    assert whole["variable"] == {
        "near": {"kind": "near"}, "touch": {"kind": "contact"}, "low": {"of": "pack"},
        "charging": {"of": "pack", "kind": "charging"}, "light": {"of": "light_sense"},
    }  # fmt: skip
    again_made = composed(deepcopy({key: value for key, value in whole.items() if key != "undescribed"}), "record")
    assert described(again_made) == whole and (again_made.PERIOD, again_made.margin) == (0.1, 0.02)
    assert pickle.loads(pickle.dumps(again_made)).variables[0] == near()


class Slid:
    """Moves sliders at these times of the run (an `Onlooker`)."""

    def __init__(self, deeds: Sequence[tuple[float, Deed]]) -> None:
        self._deeds = list(deeds)

    def begin(self, robots: Sequence[Hands], results: Sequence[RunResult]) -> None:
        pass

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        while self._deeds and self._deeds[0][0] <= time_s + 1e-9:
            yield self._deeds.pop(0)[1]

    def refuse(self, number: int, error: BoebotError) -> None:
        raise error

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        pass


def test_a_utility_that_is_changed_in_a_run_counts_and_is_repeated(tmp_path: Path) -> None:
    """By --again and by replay. Avoid's utility is raised above wander's, whatever is near."""
    deeds = [(2.0, Parameter("avoid.utility.b", 2.0)), (3.0, Parameter("avoid.utility.tau", 0.05))]
    values = {"wander.turn_probability": 0.01}
    run = kept(tmp_path, Request.single(mind(), "arsim", seconds=4, parameters=values), Slid(deeds))
    record = run.brain_record
    assert record is not None
    before, after = record.utility_of("avoid")[record.time < 2.0], record.utility_of("avoid")[record.time > 3.5]
    assert before.max() < 0 and after == pytest.approx(np.tanh(2.0), abs=0.01) and record.shares(4.0)["avoid"] > 0.4
    assert run.touched == 2 and run.made_of is not None
    assert run.made_of["process"]["avoid"]["utility"]["b"] == -1.0, "as the run began"
    repetition = again(recorded(tmp_path))
    assert repetition.is_equal and repetition.steps == 80
    assert [tuple(one) for one in replayed(run, mind())] == [step[1:] for step in run.record.steps]


def test_a_brain_that_came_from_no_file_is_repeated(tmp_path: Path) -> None:
    run = kept(tmp_path, Request.single(mind(), "arsim", seconds=4, parameters=VALUES))
    assert run.made_of is not None and run.parameters == VALUES
    assert run.made_of["process"]["wander"]["turn_probability"] == 0.00777
    assert again(recorded(tmp_path)).is_equal


def test_robots_with_parameters_of_their_own_are_repeated(tmp_path: Path) -> None:
    members = [Member(brain="clearway", robot="arsim", parameters={"avoid.turn": turn}) for turn in (0.2, 0.3)]
    with RunFolder(tmp_path) as folder:
        result = execute(Request(members=members, seconds=1), folder=folder)
    assert result.error is None and isinstance(read_run(tmp_path), TogetherResult)
    assert again(recorded(tmp_path)).is_equal


@dataclass(kw_only=True)
class Mine(Wander):
    """Somebody's own."""


@pytest.mark.parametrize(
    ("brain", "sentence"),
    [
        (lambda: Brain([Wander()], [StateVariable("odd", lambda robot: 0.5)]), "state variable 'odd' is read by"),
        (lambda: Brain([Withdraw(fatigue=math.inf)]), "withdraw.fatigue is inf"),
        (lambda: Brain([Mine()]), "process 'mine' is a .*Mine"),
        (lambda: Brain([Kinesis(stimulus=lambda robot: 0.5)]), "kinesis.stimulus is <function"),
        (lambda: lambda robot: robot.drive(0.1, 0.1), "it is no Brain of processes"),
    ],
)  # fmt: skip
def test_what_a_record_cannot_describe_is_named(brain: Any, sentence: str, tmp_path: Path) -> None:
    run = kept(tmp_path, Request.single(brain(), seconds=0.1))
    assert run.steps == 2
    with pytest.raises(BoebotError, match=rf"came from no file, and its record does not hold all of it: .*{sentence}"):
        recorded(tmp_path)
