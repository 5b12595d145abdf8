"""What holds for every process: commands within bounds whatever the sensors say, the same chance from the same
seed, and nothing left of the run before.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot.behaviors import (
    Avoid,
    ChargeBattery,
    Escalate,
    Escape,
    Evade,
    FollowLine,
    FollowWall,
    Homing,
    Kinesis,
    Klinotaxis,
    Phototaxis,
    RunAndTumble,
    Stop,
    StraightRun,
    Wander,
    Withdraw,
)
from boebot.brain import Brain, BrainStep, CognitiveProcess, MotorBehavior, StateVariable, Switch, Utility
from boebot.brain.composition import process_kinds
from boebot.cognition import (
    BatteryLevel,
    Contact,
    Drift,
    LightSense,
    Odometry,
    PathIntegration,
    Proximity,
    StuckDetector,
    SunCompass,
    contact,
    near,
)
from boebot.robot import Command, Robot
from steps import ANYTHING, FULL, Stepped


@dataclass(frozen=True)
class Case:
    """A behavior and what it works with."""

    make: Callable[[], MotorBehavior]
    with_: Callable[[], list[CognitiveProcess]] = list


def half_read(robot: Robot) -> float | None:
    return 0.5


def landmark(robot: Robot) -> float | None:
    return float(robot.whisker_left.pressed and robot.whisker_right.pressed)


CASES = {
    "avoid": Case(Avoid),
    "charge battery": Case(ChargeBattery, lambda: [BatteryLevel(empty=5.0, full=7.75)]),
    "escalate": Case(Escalate),
    "escape": Case(Escape),
    "evade": Case(Evade),
    "follow line": Case(FollowLine),
    "follow wall": Case(FollowWall),
    "homing": Case(lambda: Homing(found=landmark), lambda: [Odometry(), PathIntegration()]),
    "kinesis": Case(lambda: Kinesis(stimulus=half_read, spread=20.0)),
    "klinotaxis": Case(Klinotaxis),
    "phototaxis": Case(lambda: Phototaxis(signal=1.0, gain=1.0)),
    "run and tumble": Case(lambda: RunAndTumble(stimulus=lambda robot: robot.light_left.brightness)),
    "stop": Case(Stop),
    "straight run": Case(lambda: StraightRun(heading_gain=5.0), lambda: [Odometry()]),
    "wander": Case(Wander),
    "withdraw": Case(Withdraw),
}


@pytest.mark.parametrize("name", CASES)
@given(seen=st.lists(ANYTHING, min_size=1, max_size=6), seed=st.integers(0, 9))
@settings(max_examples=6)
def test_commands_stay_within_bounds_whatever_the_sensors_say(name: str, seen: list[dict[str, int]], seed: int) -> None:
    """Stale, missing and extreme values included; the robot itself refuses NaN and signals beyond 1."""
    case = CASES[name]
    brain, stepped = Brain([case.make(), *case.with_()]), Stepped(0.05, seed, FULL)
    for fields in seen:
        for _ in range(3):
            kind, left, right = stepped.step(brain, **fields)
            assert kind in ("signal", "stop") and -1 <= left <= 1 and -1 <= right <= 1


@pytest.mark.parametrize("name", CASES)
def test_the_same_seed_gives_the_same_commands_and_others_change_none_of_its_chance(name: str) -> None:
    def commands(seed: int, *more: CognitiveProcess) -> list[Command]:
        case = CASES[name]
        brain, stepped = Brain([case.make(), *case.with_(), *more]), Stepped(0.05, seed, FULL)
        slow = {"light_left": 900, "light_right": 1100, "light_age": 0, "battery": 700, "battery_age": 0}
        return [stepped.step(brain, whiskers=step // 30 % 4, infrared=step // 20 % 4, **slow) for step in range(200)]

    @dataclass(kw_only=True)
    class Gambler(CognitiveProcess):
        def step(self, robot: Robot) -> None:
            self.chance(0.5)

    first = commands(3)
    assert commands(3) == first == commands(3, Gambler())
    if name in ("kinesis", "wander", "run and tumble"):
        assert commands(4) != first


# ---- a second run ---------------------------------------------------------------------------------------------------


def test_no_kind_of_process_is_left_out() -> None:
    tested = {type(case.make()) for case in CASES.values()} | {type(one) for one in cognitive()}
    assert tested == set(process_kinds().values())


def cognitive() -> list[CognitiveProcess]:
    return [
        Odometry(),
        PathIntegration(),
        SunCompass(turning=True),
        BatteryLevel(empty=5.0, full=7.75, tau=0.2, fall=0.02),
        Contact(),
        Drift(distance=0.2),
        LightSense(scale=500.0),
        Proximity(),
        StuckDetector(window=0.5),
    ]


def called(robot: Robot) -> float:
    return float(0.3 <= robot.time % 2.0 < 1.5)


def brain_of(behavior: MotorBehavior, others: list[CognitiveProcess]) -> Brain:
    """One that lets the behavior begin and end, and that hears of every state variable there is."""
    variables = [StateVariable("called", called), near(), contact()]
    for process in others:
        variables += [getattr(process, name)() for name in sorted(dir(process)) if name.endswith("variable")]
    weights = {variable.name: 0.05 for variable in variables} | {"called": 1.0}
    behavior.utility = Utility(b=-0.5, w=weights, tau=behavior.utility.tau, tau_gamma=behavior.utility.tau_gamma)
    return Brain([Stop(name="rest"), behavior, *others], variables)


def life(brain: Brain, steps: int) -> tuple[list[Command], list[BrainStep], list[Switch]]:
    """One run: all that can be seen of it."""
    stepped = Stepped(0.05, 3, FULL)
    commands = []
    for step in range(steps):
        seen = {
            "whiskers": (0, 1, 0, 3)[step // 9 % 4],
            "infrared": step // 7 % 4,
            "light_left": 900 + 40 * (step % 11),
            "light_right": 1300 - 30 * (step % 7),
            "light_age": 0,
            "battery": 500 + 2 * (step % 60),
            "battery_age": 0,
            "compass_x": 300,
            "compass_y": 7 * (step % 40),
            "compass_age": 0,
            "encoder_left": 2 * step,
            "encoder_right": 3 * step,
            "pulse_left": 25000,
            "pulse_right": 25100,
            "line_left": (3500, 250)[step // 8 % 2],
            "line_middle": (3500, 250)[step // 4 % 2],
            "line_right": 250,
            "line_age": 0,
        }
        commands.append(stepped.step(brain, **seen))
    return commands, brain.steps, brain.switches


@pytest.mark.parametrize("name", CASES)
def test_second_run_is_as_the_first_whenever_that_ended(name: str) -> None:
    def made() -> Brain:
        case = CASES[name]
        return brain_of(case.make(), case.with_())

    first = life(made(), 120)
    assert any(step.motor != "rest" for step in first[1]), "it has done something"
    brain = made()
    for ended in (11, 23, 38, 61, 90):  # in the middle of something
        life(brain, ended)
        assert life(brain, 120) == first


def test_second_run_knows_nothing_of_what_the_first_perceived() -> None:
    first = life(brain_of(Wander(), cognitive()), 60)
    moved = [len(set(values)) > 1 for values in zip(*(step.variables for step in first[1]), strict=True)]
    assert sum(moved) >= 6, "most variables say something"
    brain = brain_of(Wander(), cognitive())
    for ended in (11, 38):
        life(brain, ended)
        assert life(brain, 60) == first


def test_what_sleeps_through_the_second_run_has_forgotten_the_first() -> None:
    awake = [False]
    battery = BatteryLevel(empty=5.0, full=7.75, utility=Utility(b=-1.0, w={"awake": 2.0}))
    brain = Brain([Stop(), battery], [StateVariable("awake", lambda robot: float(awake[0])), battery.variable()])
    for awake[0] in (True, False):
        stepped = Stepped(description=FULL)
        stepped.step(brain, battery=500, battery_age=0)
        assert (battery.level is not None) == awake[0]
