"""The general-purpose brain structure against closed forms: utilities, gamma parameters, activation, random streams.

E61 to E64 and E34 are experiments that docs/experiments shows: notes, sections 8.2.2, 8.2.3 and 4.4.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.brain import (
    Brain,
    CognitiveProcess,
    FixedActionPattern,
    Machine,
    MotorBehavior,
    Process,
    StateVariable,
    Utility,
    maximum,
    mean,
    minimum,
)
from boebot.brain.utility import Utilities
from boebot.errors import BrainError
from boebot.robot import Robot
from steps import Stepped, alone

numbers = st.floats(-10, 10)


def variable(name: str, of_time: Callable[[float], float | None]) -> StateVariable:
    return StateVariable(name, lambda robot: of_time(robot.time))


def during(begin: float, end: float, inside: float, outside: float) -> Callable[[float], float]:
    return lambda time: inside if begin - 1e-9 <= time < end - 1e-9 else outside


@dataclass(kw_only=True)
class Drive(MotorBehavior):
    """Drives with one signal, and records its calls."""

    signal: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        self.calls: list[str] = []

    def enter(self, robot: Robot) -> None:
        self.calls.append("enter")

    def step(self, robot: Robot) -> None:
        self.calls.append("step")
        robot.drive(self.signal, self.signal)

    def exit(self, robot: Robot) -> None:
        self.calls.append("exit")


@dataclass(kw_only=True)
class Think(CognitiveProcess):
    """Counts its steps."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.times: list[float] = []

    def step(self, robot: Robot) -> None:
        self.times.append(robot.time)


# ---- utilities ----------------------------------------------------------------------------------------------------


@given(st.floats(0.01, 5), st.floats(0.05, 5), numbers, numbers, st.floats(0, 1), st.floats(0, 1), st.floats(1e-3, 10))
def test_utility_follows_the_closed_form(
    tau: float, c: float, b: float, w: float, before: float, after: float, elapsed: float
) -> None:
    utilities = Utilities([Utility(b=b, w={"z": w}, tau=tau, c=c)], ["z"])
    utilities.start([before])
    utilities.advance([after], elapsed)
    start, end = math.tanh(c * (w * before + b)), math.tanh(c * (w * after + b))
    assert utilities.values[0] == pytest.approx(end + (start - end) * math.exp(-elapsed / tau), abs=1e-12)
    assert -1 <= utilities.values[0] <= 1


@given(st.floats(1e-3, 3), st.integers(1, 50))
def test_many_small_steps_are_one_large_one(elapsed: float, count: int) -> None:
    one, many = (Utilities([Utility(b=0.3, w={"z": 1.0})], ["z"]) for _ in range(2))
    for utilities in (one, many):
        utilities.start([0.0])
    one.advance([1.0], elapsed)
    for _ in range(count):
        many.advance([1.0], elapsed / count)
    assert many.values[0] == pytest.approx(one.values[0], abs=1e-12)


def test_e61_a_short_loss_of_data_is_filtered_out() -> None:
    """Fig. 8.2: tau 0.3 s, b 1, w 0.5, and z lost for 0.15 s at 5 s."""
    behavior = Drive(utility=Utility(b=1.0, w={"z": 0.5}, tau=0.3))
    lost = variable("z", lambda time: None if 5.0 - 1e-9 <= time < 5.15 - 1e-9 else 1.0)
    stepped, brain = Stepped(0.01), Brain([behavior], [lost])
    for _ in range(700):
        stepped.step(brain)
    # a step's state variables hold over the time that it advances: up to and with the step itself
    utility = {round(step.time, 2): step.utilities[0] for step in brain.steps}
    settled, unfiltered = math.tanh(1.5), math.tanh(1.5) - math.tanh(1.0)
    assert utility[4.99] == pytest.approx(settled, abs=1e-9)
    dip = settled - min(utility.values())
    assert dip == pytest.approx(0.0566, abs=0.001)
    assert dip / unfiltered == pytest.approx(1 - math.exp(-0.5), abs=1e-9)
    assert abs(utility[round(5.15 + 0.73, 2)] - settled) < 0.005 < abs(utility[round(5.15 + 0.71, 2)] - settled)


def test_e62_the_best_of_three_behaviors_drives() -> None:
    """Fig. 8.3: B1 drives but for two intervals of B3; B2 never does."""

    def second(time: float) -> float:
        pulse = 20.9 - 1e-9 <= time < 23.2 - 1e-9 or 27.0 - 1e-9 <= time < 27.55 - 1e-9
        return (pulse + 0.1 * math.sin(1.3 * time) ** 2) / 1.1  # 0..1; the weight makes up for it

    behaviors = [
        Drive(name="B1", utility=Utility(b=0.5, tau=0.2)),
        Drive(name="B2", utility=Utility(b=-0.8, w={"z1": 0.6}, tau=0.3)),
        Drive(name="B3", utility=Utility(b=-0.9, w={"z2": 2.2}, tau=0.3)),
    ]
    first = variable("z1", lambda time: 0.5 + 0.4 * math.sin(0.35 * time) + 0.03 * math.sin(9 * time))
    brain, stepped = Brain(behaviors, [first, variable("z2", second)]), Stepped(0.01)
    for _ in range(4000):
        stepped.step(brain)
    third = [step.time for step in brain.steps if step.motor == "B3"]
    assert third[0] == pytest.approx(21.30, abs=0.02) and max(third) == pytest.approx(27.58, abs=0.02)
    assert [(switch.on, round(switch.time, 1)) for switch in brain.switches if switch.on == "B3"] == [
        ("B3", 21.3),
        ("B3", 27.4),
    ]
    assert sum(time > 25 for time in third) * 0.01 < 1.0
    assert all(step.motor != "B2" for step in brain.steps)
    low, high = ([edge(step.utilities[i] for step in brain.steps) for i in range(3)] for edge in (min, max))
    assert low == pytest.approx([0.462, -0.632, -0.716], abs=0.002)
    assert high == pytest.approx([0.462, -0.250, 0.855], abs=0.002)


def test_e63_gamma_calls_a_process_for_a_while() -> None:
    """A kick of 3 on a process at -0.5, tau 0.3 s and 0.5 s: active from 0.117 to 1.215 s."""

    @dataclass(kw_only=True)
    class Kicker(CognitiveProcess):
        def step(self, robot: Robot) -> None:
            if robot.time == 0.0:
                self.kick("think", 3.0)

    think = Think(utility=Utility(b=-0.5, tau=0.3, tau_gamma=0.5))
    brain, stepped = Brain([Drive(), Kicker(), think]), Stepped(0.001)
    for _ in range(2000):
        stepped.step(brain)
        assert brain.gamma(think) == pytest.approx(3 * math.exp(-(stepped.steps - 1) * 0.001 / 0.5), rel=1e-9)
    assert think.times[0] == pytest.approx(0.117, abs=0.01)
    assert think.times[-1] == pytest.approx(1.215, abs=0.01)


def test_e64_one_motor_behavior_and_all_cognitive_processes_above_zero() -> None:
    """A cognitive process's delays have closed forms; among three and three the rule holds at all times."""
    think = Think(name="delayed", utility=Utility(b=-0.5, w={"z": 1.5}, tau=0.3))
    others = [Think(name="always"), Think(name="never", utility=Utility(b=-0.2))]
    motor = [Drive(name=f"m{i}", signal=i / 10, utility=Utility(b=i / 10, w={"z": 0.3 - i / 5})) for i in range(3)]
    brain = Brain([*motor, think, *others], [variable("z", during(1.0, 4.0, 1.0, 0.0))])
    stepped = Stepped(0.001)
    for _ in range(6000):
        command = stepped.step(brain)
        step = brain.steps[-1]
        assert [brain._active[brain._place(one)] for one in motor].count(True) == 1
        assert step.utilities[:3].index(max(step.utilities[:3])) == [one.name for one in motor].index(step.motor)
        assert command.left == next(one.signal for one in motor if one.name == step.motor)
        assert [brain._active[brain._place(one)] for one in (think, *others)] == [u > 0 for u in step.utilities[3:]]
    low, high = math.tanh(-0.5), math.tanh(1.0)
    on = 0.3 * math.log((high - low) / high)
    off = 0.3 * math.log((high - low) / -low)
    assert (on, off) == pytest.approx((0.142, 0.292), abs=0.001)
    assert think.times[0] == pytest.approx(1.0 + on, abs=0.01)
    assert think.times[-1] == pytest.approx(4.0 + off, abs=0.01)
    assert len(others[0].times) == 6000 and not others[1].times


# ---- activation --------------------------------------------------------------------------------------------------


def test_a_switch_ends_one_behavior_begins_the_other_and_says_why() -> None:
    calm = Drive(name="calm", signal=0.1, utility=Utility(b=0.5))
    flee = Drive(name="flee", signal=-0.3, utility=Utility(b=-1.0, w={"near": 3.0}, tau=0.1))
    brain = Brain([calm, flee], [variable("near", during(0.1, 0.5, 0.9, 0.0))])
    stepped = Stepped(0.05)
    commands = [stepped.step(brain).left for _ in range(30)]
    assert calm.calls.index("exit") == 1 + commands.index(-0.3)
    assert [name for name in flee.calls if name != "step"] == ["enter", "exit"]
    assert [(switch.off, switch.on) for switch in brain.switches] == [("", "calm"), ("calm", "flee"), ("flee", "calm")]
    into = brain.switches[1]
    assert into.reason == f"flee {brain.steps[round(into.time / 0.05)].utilities[1]:.3f} (near +2.70, b -1.00), " + (
        "above calm 0.462"
    )


def test_of_equals_the_active_one_goes_on() -> None:
    brain = Brain([Drive(name="a"), Drive(name="b")])
    stepped = Stepped()
    for _ in range(10):
        stepped.step(brain)
    assert len(brain.switches) == 1 and brain.active == "a"


def test_margin_keeps_the_active_one() -> None:
    better = [variable("z", during(1.0, 9.0, 0.01, 0.0))]
    for margin, last in ((0.0, "b"), (0.02, "a")):
        pair = [Drive(name="a", utility=Utility(b=0.1)), Drive(name="b", utility=Utility(b=0.1, w={"z": 1.0}))]
        brain, stepped = Brain(pair, better, margin=margin), Stepped()
        for _ in range(300):
            stepped.step(brain)
        assert brain.active == last


def test_what_the_last_behavior_wanted_ends_with_it() -> None:
    """One that says nothing at first does not drive on with the other's signals."""

    @dataclass(kw_only=True)
    class Silent(MotorBehavior):
        def step(self, robot: Robot) -> None:
            pass

    brain = Brain(
        [Drive(signal=0.5), Silent(utility=Utility(b=-1.0, w={"z": 5.0}, tau=0.01))],
        [variable("z", during(0.1, 9, 1.0, 0.0))],
    )
    stepped = Stepped()
    assert stepped.step(brain).left == 0.5
    commands = [stepped.step(brain) for _ in range(30)]
    assert commands[-1].kind == "stop"


def test_declared_periods_hold() -> None:
    slow, drive = Think(name="slow", period=0.3), Drive(period=0.1)
    brain, stepped = Brain([drive, slow]), Stepped(0.05)
    for _ in range(40):
        stepped.step(brain)
    assert slow.times == pytest.approx([0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 1.8])
    assert drive.calls.count("step") == 20


def test_a_step_that_comes_late_costs_none() -> None:
    """A board's telemetry may reach the brain a tick late, at 0.06 s in place of 0.05 s: all steps are carried out."""
    each, second, drive = Think(name="each"), Think(name="second", period=0.1), Drive()
    brain, stepped = Brain([drive, each, second]), Stepped(0.05)
    late = [0.0, 0.06, 0.1, 0.16, 0.21, 0.25, 0.3, 0.36]
    for time in late:
        stepped.robot.observation = stepped.robot.observation._replace(time=time)
        brain.step(stepped.robot)
    assert each.times == late and drive.calls.count("step") == len(late)
    assert second.times == late[::2]


@pytest.mark.parametrize("period", [0.03, 0.07])
def test_periods_must_fit(period: float) -> None:
    with pytest.raises(BrainError, match=rf"drive: a period of {period} s; expected a multiple of the brain's, 0.05 s"):
        Stepped(0.05).step(alone(Drive(period=period)))


# ---- chance ------------------------------------------------------------------------------------------------------


@dataclass(kw_only=True)
class Dice(CognitiveProcess):
    """Throws a die at each step."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.thrown: list[float] = []

    def step(self, robot: Robot) -> None:
        self.thrown.append(self.random.random())


def test_each_process_has_its_own_chance() -> None:
    def thrown(*others: Process, seed: int = 1) -> list[float]:
        dice = Dice()
        brain, stepped = Brain([Drive(), *others, dice]), Stepped(seed=seed)
        for _ in range(20):
            stepped.step(brain)
        return dice.thrown

    first = thrown()
    assert thrown(Dice(name="another"), Think()) == first, "whatever others draw"
    assert thrown(seed=2) != first
    assert len(set(first)) == 20


def test_another_run_begins_afresh() -> None:
    dice = Dice()
    brain = Brain([Drive(), dice])
    for _ in range(2):
        stepped = Stepped()
        for _ in range(5):
            stepped.step(brain)
    assert dice.thrown[:5] == dice.thrown[5:] and len(brain.steps) == 5


@pytest.mark.parametrize("period", [0.01, 0.05, 0.2])
def test_chances_do_not_depend_on_the_period(period: float) -> None:
    """The share of seconds without an event is (1 - p)^(1 s / 0.01 s), within three standard deviations."""

    @dataclass(kw_only=True)
    class Events(CognitiveProcess):
        def __post_init__(self) -> None:
            super().__post_init__()
            self.times: list[float] = []

        def step(self, robot: Robot) -> None:
            if self.chance(0.01, per=0.01):
                self.times.append(robot.time)

    events = Events()
    brain, stepped = Brain([Drive(), events]), Stepped(period)
    seconds = 1000
    for _ in range(round(seconds / period)):
        stepped.step(brain)
    quiet = seconds - len({int(time + 1e-9) for time in events.times})
    expected = 0.99**100
    assert abs(quiet / seconds - expected) < 3 * math.sqrt(expected * (1 - expected) / seconds)


# ---- helpers -----------------------------------------------------------------------------------------------------


def test_machine_steps_through_its_states() -> None:
    said: list[tuple[str, float]] = []

    @dataclass(kw_only=True)
    class Two(MotorBehavior):
        def enter(self, robot: Robot) -> None:
            self.machine = Machine(robot, self.left)

        def step(self, robot: Robot) -> None:
            said.append((self.machine.state, self.machine.time(robot)))
            self.machine.step(robot)

        def left(self, robot: Robot) -> object:
            return self.right if self.machine.time(robot) >= 0.02 - 1e-9 else None

        def right(self, robot: Robot) -> object:
            return self.left

    stepped, brain = Stepped(), alone(Two())
    for _ in range(5):
        stepped.step(brain)
    assert [state for state, _ in said] == ["left", "left", "left", "right", "left"]
    assert [time for _, time in said] == pytest.approx([0, 0.01, 0.02, 0.01, 0.01])


def test_e34_a_fixed_action_pattern_runs_to_its_end_without_its_stimulus() -> None:
    escape = FixedActionPattern(
        name="escape",
        actions=[(-0.5, -0.5, 0.4), (-0.7, 0.7, 0.6), (0.5, 0.5, 0.3)],
        releaser=lambda robot: robot.whisker_left.pressed,
        refractory=1.0,
    )
    brain, stepped = Brain([Drive(signal=0.2, utility=Utility(b=0.5)), escape]), Stepped(0.05)

    def commands(count: int, **fields: int) -> list[tuple[float, float]]:
        return [(command.left, command.right) for command in (stepped.step(brain, **fields) for _ in range(count))]

    cruise = (0.2, 0.2)
    assert commands(10) == [cruise] * 10
    touched = commands(1, whiskers=1)
    after = commands(80)
    assert touched == [cruise], "the releasing mechanism saw it in this step"
    pattern = after[after.index((-0.5, -0.5)) :]
    assert pattern[:26] == [(-0.5, -0.5)] * 8 + [(-0.7, 0.7)] * 12 + [(0.5, 0.5)] * 6
    assert pattern[26] == (0.0, 0.0) and pattern[27:] == [cruise] * len(pattern[27:])
    assert escape.duration == pytest.approx(1.3)
    commands(3, whiskers=1)
    assert (-0.5, -0.5) in commands(5), "released again"


def test_a_fixed_action_pattern_rests_after_its_end() -> None:
    def begins(refractory: float) -> list[float]:
        nod = FixedActionPattern(
            name="nod", actions=[(0.3, -0.3, 0.2)], releaser=lambda robot: True, refractory=refractory
        )
        brain, stepped = Brain([Drive(utility=Utility(b=0.5)), nod]), Stepped(0.05)
        for _ in range(100):
            stepped.step(brain)
        return [switch.time for switch in brain.switches if switch.on == "nod"]

    gaps = [[later - earlier for earlier, later in pairwise(times)] for times in (begins(0.0), begins(2.0))]
    assert min(gaps[0]) < 0.5 and min(gaps[1]) >= 2.2 - 1e-9


@given(st.lists(st.one_of(st.none(), st.floats(0, 1)), max_size=6))
def test_preprocessing_leaves_out_missing_readings(readings: list[float | None]) -> None:
    known = [reading for reading in readings if reading is not None]
    if known:
        assert mean(readings) == pytest.approx(sum(known) / len(known))
        assert (minimum(readings), maximum(readings)) == (min(known), max(known))
    else:
        assert mean(readings) is minimum(readings) is maximum(readings) is None


@given(st.one_of(st.none(), st.floats(allow_nan=False), st.booleans()))
def test_state_variables_stay_within_zero_and_one(raw: float | None) -> None:
    value = StateVariable("z", lambda robot: raw).value(Stepped().robot)
    assert 0 <= value <= 1 and value == (0 if raw is None else min(max(raw, 0), 1))


# ---- errors ---------------------------------------------------------------------------------------------------------


def test_kicks_and_questions_name_the_missing_process() -> None:
    @dataclass(kw_only=True)
    class Asking(CognitiveProcess):
        asks: Callable[[Process], object]

        def step(self, robot: Robot) -> None:
            self.asks(self)

    for asks, sentence in (
        (lambda one: one.kick("nobody", 1.0), "no process 'nobody'; this brain has drive, asking"),
        (lambda one: one.kick("drive", math.inf), "asking: a gamma parameter of inf"),
        (lambda one: one.other(Think), "no process Think; this brain has drive, asking"),
        (lambda one: one.other(Process), "more than one process Process"),
    ):
        with pytest.raises(BrainError, match=sentence):
            Stepped().step(alone(Drive(), Asking(asks=asks)))
