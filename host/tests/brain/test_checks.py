"""Bad parts: parameters, utilities and brains that do not fit are refused in one sentence, where they are made."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from boebot.behaviors import (
    ChargeBattery,
    Escalate,
    Escape,
    Evade,
    FollowWall,
    Kinesis,
    Klinotaxis,
    LeakyChain,
    Phototaxis,
    RunAndTumble,
    StraightRun,
    Wander,
)
from boebot.behaviors.withdraw import ReflexIntensity
from boebot.brain import Brain, CognitiveProcess, FixedActionPattern, MotorBehavior, StateVariable, Utility
from boebot.cognition import Drift, LightSense, Odometry, StuckDetector, near
from boebot.errors import BrainError
from boebot.robot import Robot
from steps import Stepped, alone


def variable(name: str, of_time: Callable[[float], float | None]) -> StateVariable:
    return StateVariable(name, lambda robot: of_time(robot.time))


def half_read(robot: Robot) -> float | None:
    return 0.5


@dataclass(kw_only=True)
class Drive(MotorBehavior):
    def step(self, robot: Robot) -> None:
        robot.drive(0.5, 0.5)


@dataclass(kw_only=True)
class Think(CognitiveProcess):
    def step(self, robot: Robot) -> None:
        pass


class Idle(MotorBehavior):
    pass


class Unready(MotorBehavior):
    def __init__(self) -> None:
        self.speed = 0.3


class Entering(Think):
    def enter(self, robot: Robot) -> None:
        robot.drive(1.0, 1.0)


@dataclass(kw_only=True)
class Meddler(CognitiveProcess):
    def step(self, robot: Robot) -> None:
        robot.drive(1.0, 1.0)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Brain([]), "a brain needs at least one motor behavior"),
        (lambda: Brain([Think()]), "a brain needs at least one motor behavior"),
        (lambda: Brain([Drive(), Drive()]), "two processes are called 'drive'; expected another name= for each"),
        (lambda: Brain([Drive()], [variable("z", lambda t: 0)] * 2), "two state variables are called 'z'"),
        (
            lambda: Brain([Drive(utility=Utility(w={"near": 1}))]),
            "names the state variable 'near'; this brain has none",
        ),
        (lambda: Brain([Drive()], period=0), "a brain's period of 0; expected seconds"),
        (lambda: Brain([Drive()], margin=-1), "a margin of -1; expected 0 or more"),
        (lambda: Brain(Drive()), "a brain's processes are Drive.*; expected a list of them"),  # type: ignore[arg-type]
        (lambda: Brain(["wander"]), "among a brain's processes is 'wander'; expected a Process"),  # type: ignore[list-item]
        (lambda: Brain([Drive]), r"is the class Drive; expected Drive\(\)"),  # type: ignore[list-item]
        (lambda: Brain([Drive()], [near]), "among a brain's state variables is .*near"),  # type: ignore[list-item]
        (lambda: Brain([Unready()]), r"Unready is not ready; expected super\(\).__init__\(\)"),
        (lambda: Drive(utility=0.5), r"drive: utility is 0.5; expected a Utility\(...\)"),  # type: ignore[arg-type]
        (lambda: Drive(name=3), "a process is called 3; expected a text"),  # type: ignore[arg-type]
        (lambda: Utility(w=["near"]), r"utility: w is \['near'\]; expected weights by names"),  # type: ignore[arg-type]
        (lambda: Utility(tau=0), "utility: tau is 0; expected more than 0"),
        (lambda: Utility(b=math.nan), "utility: b is nan; expected a finite number"),
        (lambda: Utility(w={"near": "much"}), r"utility: w\['near'\] is 'much'; expected a finite number"),  # type: ignore[dict-item]
        (lambda: Drive(period=-1), "drive: period is -1; expected seconds"),
        (lambda: Drive().kick("x", 1), "belongs to no brain yet"),
        (lambda: Stepped().step(alone(Drive(), Meddler())), "cognitive process 'meddler' drives the motors"),
        (lambda: Stepped().step(alone(Drive(), Entering())), "cognitive process 'entering' drives the motors"),
        (lambda: Stepped().step(alone(Idle())), r"idle: class Idle has no step\(self, robot\)"),
        (
            lambda: Stepped().step(Brain([Drive()], [variable("z", lambda t: math.nan)])),
            "state variable 'z' is nan; expected a number from 0 to 1",
        ),
        (
            lambda: FixedActionPattern(actions=[(2, 0, 1)], releaser=bool),
            r"fixed_action_pattern: action \(2, 0, 1\); expected signals from -1 to 1, and seconds > 0",
        ),
        (lambda: FixedActionPattern(actions=[(1, 2)], releaser=bool), r"action \(1, 2\); expected"),  # type: ignore[list-item]
        (lambda: FixedActionPattern(actions=[(1, "x", 1)], releaser=bool), "'x'.*; expected"),  # type: ignore[list-item]
        (lambda: FixedActionPattern(actions=[], releaser=None), "releaser is None; expected a function"),  # type: ignore[arg-type]
    ],
)
def test_brain_whose_parts_do_not_fit_is_refused_in_one_sentence(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence):
        make()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: FollowWall(side="up"),  # type: ignore[arg-type]
            "follow_wall: side is 'up'; expected 'left' or 'right'",
        ),
        (lambda: Evade(weak=0.5, strong=0.5), "evade: weak is 0.5 and strong 0.5; expected 0 <= weak < strong"),
        (lambda: Evade(beat=0), "evade: beat is 0; expected more than 0"),
        (lambda: Wander(forward=2), "wander: forward is 2; expected a motor signal from -1 to 1"),
        (lambda: Wander(turn_probability=2), "wander: turn_probability is 2; expected 0 to 1"),
        (lambda: Wander(forward="x"), "wander: forward is 'x'; expected a number"),  # type: ignore[arg-type]
        (lambda: StraightRun(goal=0), "straight_run: goal is 0; expected more than 0"),
        (lambda: StraightRun(heading_gain=math.nan), "straight_run: heading_gain is nan; expected a number"),
        (lambda: Phototaxis(signal=2), "phototaxis: signal is 2; expected a motor signal"),
        (lambda: Phototaxis(gain="much"), "phototaxis: gain is 'much'; expected a number"),  # type: ignore[arg-type]
        (lambda: Klinotaxis(seconds=-1), "klinotaxis: seconds is -1; expected more than 0"),
        (lambda: RunAndTumble(stimulus=half_read, a=0), "run_and_tumble: a is 0; expected more than 0"),
        (lambda: StuckDetector(window=-1), "stuck_detector: window is -1; expected more than 0"),
        (lambda: Drift(distance=0), "drift: distance is 0; expected more than 0"),
        (lambda: LightSense(scale=0), "light_sense: scale is 0; expected more than 0"),
        (lambda: Odometry(start=(1,)), r"odometry: start is \(1,\); expected x \(m\)"),  # type: ignore[arg-type]
        (lambda: Evade(spread=1.5), "evade: spread is 1.5; expected 0 to 1"),
        (
            lambda: Escalate(links=((1.0, 1.0),)),
            "escalate: 1 links; expected one for each of turn, reverse, stop, call",
        ),
        (lambda: Escalate(fade=(0.9, 3.0)), "escalate: X_1 is 2.6; expected more than X_2, 3.0"),
        (lambda: Escalate(signal=2), "escalate: signal is 2; expected a motor signal above 0, to 1"),
        (lambda: LeakyChain([(0.0, 1.0)]), r"a chain of \[\(0.0, 1.0\)\]; expected pairs \(a, b\) of numbers above 0"),
        (lambda: Escape(back=0), "escape: back is 0; expected more than 0"),
        (lambda: ChargeBattery(passed=1.0), "charge_battery: passed is 1.0; expected a share between 0 and 1"),
        (lambda: ChargeBattery(creep=0.0), "charge_battery: creep is 0.0; expected more than 0"),
        (lambda: ReflexIntensity(1.0, 1.0), "expected two different times above 0"),
    ],
)
def test_parameters_that_do_not_fit_get_one_sentence(make: Callable[[], object], sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence):
        make()


@pytest.mark.parametrize(
    "make", [lambda f: Evade(left=f), lambda f: Kinesis(stimulus=f), lambda f: RunAndTumble(stimulus=f)]
)
@pytest.mark.parametrize("signal", [math.nan, math.inf, "loud"])
def test_a_stimulus_that_is_no_number_is_said_to_be_none(make: Callable[..., MotorBehavior], signal: Any) -> None:
    behavior = make(lambda robot: signal)
    with pytest.raises(BrainError, match=f"{behavior.name}: a signal of {signal!r}; expected a finite number or None"):
        Stepped().step(alone(behavior))
