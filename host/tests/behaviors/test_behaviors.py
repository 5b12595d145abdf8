"""Motor behaviors, each alone: observations in, commands out, against laws that docs/reference/notes.md lists."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

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
    Stop,
    StraightRun,
    Wander,
    Withdraw,
)
from boebot.behaviors.escalate import STENTOR
from boebot.behaviors.withdraw import ReflexIntensity
from boebot.brain import Brain, Utility
from boebot.cognition import BatteryLevel, Odometry
from boebot.robot import Command
from steps import FULL, Stepped, SteppedVehicle, alone

REST = Utility(b=-0.5)  # below whatever is called


def signals(left: float, right: float) -> Command:
    return Command("signal", pytest.approx(left), pytest.approx(right))  # type: ignore[arg-type]


def driven(brain: Brain, stepped: Stepped, count: int, **fields: int) -> list[tuple[float, float]]:
    return [stepped.step(brain, **fields)[1:] for _ in range(count)]


# ---- wander, straight run ------------------------------------------------------------------------------------------


def test_stop_stops() -> None:
    assert Stepped().step(alone(Stop())).kind == "stop"


@pytest.mark.parametrize("period", [0.01, 0.05])
def test_e19_wander_keeps_its_statistics_whatever_the_period(period: float) -> None:
    """Steps straight on, state 0 among them, are geometric with mean 1/p', turns take one more: the step that begins
    them; p' = 1 - (1 - p)^(Δt/0.01). Within four standard errors: the deviation is as large as the mean.
    """
    wander, stepped = Wander(), Stepped(period)
    brain = alone(wander)
    commands = driven(brain, stepped, round(400 / period))
    kinds = np.array([0 if left == right else 1 if left < right else -1 for left, right in commands])
    assert set(commands) == {(0.5, 0.5), (-0.7, 0.7), (0.7, -0.7)}
    changes = np.flatnonzero(np.diff(kinds)) + 1
    stretches = np.split(kinds, changes)[1:-1]
    for turning, p in ((False, 0.01), (True, 0.03)):
        lengths = np.array([len(one) for one in stretches if bool(one[0] != 0) == turning]) * period
        expected = period / (1 - (1 - p) ** (period / 0.01)) + period * turning
        assert abs(lengths.mean() - expected) < 4 * expected / math.sqrt(len(lengths))
    turns = [one[0] for one in stretches if one[0] != 0]
    share = turns.count(1) / len(turns)
    assert abs(share - 0.5) < 4 * 0.5 / math.sqrt(len(turns))


@given(st.floats(-0.5, 2.5))
@settings(max_examples=50)
def test_straight_run_slows_down_by_the_way_left(way: float) -> None:
    """(5.1): s = a (D - d) / D, which is negative behind the end; 0 once within b D."""
    run, vehicle = StraightRun(), SteppedVehicle()
    brain = alone(run, Odometry())
    vehicle.steer(brain)
    vehicle.steer(brain, 0, 0, way)
    distance = abs(way)
    if abs(1 - distance) < 0.02:
        assert vehicle.robot.command == (signals(0, 0)) and run.arrived
    else:
        aim = min(max(0.9 * (1 - distance), -1.0), 1.0)
        assert vehicle.robot.command == signals(aim, aim) and not run.arrived


def test_straight_run_heeds_dead_band_and_heading_and_stays_where_it_arrived() -> None:
    run, vehicle = StraightRun(goal=2.0, least=0.06, heading_gain=0.5), SteppedVehicle()
    brain = alone(run, Odometry())
    vehicle.steer(brain, 0, 0, 5.0, 1.0, 3.0)
    x, y = 5.0 + 1.9 * math.cos(3.0), 1.0 + 1.9 * math.sin(3.0)
    # 0.9 · 0.1 / 2 = 0.045 is within the dead band; the heading is 0.2 rad (across the cut at π) to the left
    assert vehicle.steer(brain, 0, 0, x, y, 3.2 - 2 * math.pi) == signals(0.06 + 0.1, 0.06 - 0.1)
    assert vehicle.steer(brain, 0, 0, 5.0 + 2.0 * math.cos(3.0), 1.0 + 2.0 * math.sin(3.0), 3.0) == signals(0, 0)
    assert vehicle.steer(brain, 0, 0, 5.0, 1.0, 3.0) == signals(0, 0), "state 2: stay"


# ---- things in the way ------------------------------------------------------------------------------------------


@given(st.floats(0, 1), st.floats(0, 1), st.sampled_from(["left", "right"]))
@settings(max_examples=60)
def test_follow_wall_by_its_law(beside: float, other: float, side: str) -> None:
    follow, vehicle = FollowWall(side=side), SteppedVehicle()  # type: ignore[arg-type]
    readings = (other, beside) if side == "right" else (beside, other)
    vehicle.steer(alone(follow), *readings)
    if other > 0.25:
        wheels = (-0.3, 0.3)
    else:
        error = beside - 0.25
        wheels = (0.5 - 0.5 * error, 0.5 + 0.5 * error)
    assert vehicle.robot.command == signals(*(wheels if side == "right" else wheels[::-1]))


@given(st.floats(0.05, 1.0), st.floats(2.1, 20.0), st.floats(0.3, 1.5))
@settings(max_examples=20)
def test_reflex_intensity_is_the_solution_of_its_equations(warm_up: float, fatigue: float, weight: float) -> None:
    """τ_w dW/dt = S - W, τ_f dF/dt = W - F; stimulus 1 for 3 s, then 0, against scipy."""
    reflex = ReflexIntensity(warm_up, fatigue, weight)
    ours = [reflex.advance(1.0 if step < 60 else 0.0, 0.05) for step in range(100)]

    def by_solver(stimulus: float, start: tuple[float, float], seconds: float, times: object) -> np.ndarray:
        found = solve_ivp(
            lambda t, y: ((stimulus - y[0]) / warm_up, (y[0] - y[1]) / fatigue),
            (0, seconds),
            start,
            t_eval=times,
            rtol=1e-9,
            atol=1e-11,
        )
        return np.asarray(found.y)

    during = by_solver(1.0, (0.0, 0.0), 3.0, np.arange(1, 61) * 0.05)
    after = by_solver(0.0, (during[0, -1], during[1, -1]), 2.0, np.arange(1, 41) * 0.05)
    w, f = np.hstack([during, after])
    assert ours == pytest.approx(np.maximum(0, w - weight * f), abs=1e-6)


def test_e25_a_reflex_peaks_and_tires() -> None:
    reflex = ReflexIntensity()
    values = [reflex.advance(1.0, 0.01) for _ in range(900)]
    peak = int(np.argmax(values))
    assert values[peak] == pytest.approx(0.734, abs=0.02) and (peak + 1) * 0.01 == pytest.approx(0.70, abs=0.05)
    assert values[-1] < 0.13


def test_withdraw_backs_off_turns_away_from_the_touch_and_tires() -> None:
    withdraw, stepped = Withdraw(utility=Utility(b=-1.0, tau=0.02)), Stepped(0.05)
    brain = Brain([Stop(utility=REST), withdraw])
    strengths = []
    for _ in range(4):
        commands = driven(brain, stepped, 6, whiskers=1) + driven(brain, stepped, 24)
        back = [left for left, right in commands if left == right < 0]
        turned = [(left, right) for left, right in commands if left > right]
        assert back and turned and not [1 for left, right in commands if left < right], "away from the left whisker"
        strengths.append(-back[0])
    assert strengths[0] > 0 and strengths[-1] < max(strengths)


def test_escape_is_a_fixed_action_pattern_of_a_third_of_a_turn() -> None:
    escape, stepped = Escape(), Stepped(0.01)
    brain = Brain([Stop(utility=REST), escape])
    touched = driven(brain, stepped, 2, whiskers=2) + driven(brain, stepped, 400)
    begun = touched.index((-0.5, -0.5))
    size = stepped.robot.dimensions
    turning = 2 * math.pi / 3 * size.track_width / (2 * 0.5 * size.speed)
    assert touched[begun : begun + 40] == [(-0.5, -0.5)] * 40
    left_turn = touched.count((-0.5, 0.5))
    assert left_turn == pytest.approx(turning / 0.01, abs=1) and (0.5, -0.5) not in touched
    assert touched.count((0.5, 0.5)) == pytest.approx(30, abs=1)
    assert 2 * 0.5 * size.speed / size.track_width * left_turn * 0.01 == pytest.approx(2 * math.pi / 3, abs=0.04)


# ---- taxis, kinesis, chemotaxis ------------------------------------------------------------------------------------


@given(st.floats(0, 1e5), st.floats(0, 1e5), st.booleans())
@settings(max_examples=60)
def test_phototaxis_by_crossed_excitation(left: float, right: float, flee: bool) -> None:
    """a = (I_l - I_r) / (I_l + I_r), s_0 ∓ 0.6 s_0 a; both dark: it turns on the spot."""
    vehicle = SteppedVehicle()
    vehicle.steer(alone(Phototaxis(flee=flee)), 0, 0, 0, 0, 0, 0, left, right)
    if left + right > 0:
        steer = 0.3 * ((left - right) / (left + right)) * (-1 if flee else 1)
        assert vehicle.robot.command == signals(0.5 - steer, 0.5 + steer)
    else:
        assert vehicle.robot.command == (signals(0, 0) if flee else signals(-0.25, 0.25))


def test_stale_light_is_dark() -> None:
    stepped = Stepped(description=FULL)
    brain = alone(Phototaxis())
    assert stepped.step(brain, light_left=1000, light_right=2000, light_age=0) == signals(0.4, 0.6)
    assert stepped.step(brain, light_left=1000, light_right=2000, light_age=99) == signals(-0.25, 0.25)


@pytest.mark.parametrize("flee", [False, True])
def test_klinotaxis_turns_where_the_swing_was_brighter(flee: bool) -> None:
    """Swings of 0.5 s about the course; after one to each side, 3 (I_l - I_r) / (I_l + I_r) is added, limited."""
    klinotaxis, vehicle = Klinotaxis(flee=flee), SteppedVehicle(0.05)
    brain = alone(klinotaxis)
    turned: list[float] = []
    for _ in range(200):
        # +1: the robot swings left; there it is brighter by a quarter
        swinging_left = klinotaxis._side > 0 if turned else True
        command = vehicle.steer(brain, 0, 0, 0, 0, 0, 0, 1.25 if swinging_left else 0.75, 0)
        turned.append(command.right - command.left)
    mean = float(np.mean(turned[40:200]))  # whole swings
    assert mean == pytest.approx(-0.25 if flee else 0.25, abs=0.02), "3 · 0.25 is beyond the swing, 0.25"
    straight = SteppedVehicle(0.05)
    even = alone(Klinotaxis())
    back_and_forth = [straight.steer(even, 0, 0, 0, 0, 0, 0, 1.0, 0) for _ in range(205)]
    assert np.mean([c.right - c.left for c in back_and_forth[5:205]]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(
    ("stimulus", "signal"), [(None, 0.5), (0.0, 0.5), (0.25, 0.4), (1.0, 0.1), (7.0, 0.1), (-1, 0.5)]
)
def test_kinesis_lingers_where_the_stimulus_is(stimulus: float | None, signal: float) -> None:
    """V = V_max (1 - H) + V_min H, and the heading's random walk has variance σ² t."""
    stepped = Stepped(0.05)
    commands = driven(alone(Kinesis(stimulus=lambda robot: stimulus, spread=0.08)), stepped, 4000)
    assert {round((left + right) / 2, 9) for left, right in commands} == {signal}
    size = stepped.robot.dimensions
    turns = np.array([(right - left) * size.speed / size.track_width * 0.05 for left, right in commands])
    deviation = 0.08 * math.sqrt(0.05)  # of one step; the estimate's own is 1 / sqrt(2 n) of it
    assert turns.std() == pytest.approx(deviation, rel=4 / math.sqrt(8000))
    assert abs(turns.mean()) < 4 * deviation / math.sqrt(4000)


def test_run_and_tumble_runs_while_it_gets_better() -> None:
    """(4.1), a = b = 1: X = 0.4 from 1 s on gives U = 0.4 e^-(t-1) > 0; back at 0 it is negative at once: tumble."""
    stepped = Stepped(0.01)
    coli = RunAndTumble(
        stimulus=lambda robot: 0.4 if 1.0 - 1e-9 <= robot.time < 3.0 - 1e-9 else 0.0, threshold=1e-6, run_on=0.05
    )
    brain = alone(coli)
    runs, values = [], []
    for _ in range(600):
        command = stepped.step(brain)
        runs.append(command.left == command.right)
        values.append(coli.value)
    times = np.arange(600) * 0.01
    rising = (times >= 1.01) & (times < 2.99)
    # the memory takes each step's stimulus from its beginning
    assert np.array(values)[rising] == pytest.approx(0.4 * np.exp(-(times[rising] - 0.99)), abs=1e-6)
    assert values[301] == pytest.approx(-0.4 * (1 - math.exp(-2.0)) * math.exp(-0.02), abs=0.003)
    # a tumble that had begun before is carried to its end
    longest = math.pi / (2 * 0.5 * stepped.robot.dimensions.speed / stepped.robot.dimensions.track_width)
    assert all(runs[round((1.0 + longest) / 0.01) + 1 : 299])
    assert not all(runs[:100]) and not all(runs[302:])


# ---- the battery ----------------------------------------------------------------------------------------------------


def test_charge_battery_seeks_the_lamp_creeps_under_it_and_stands_while_it_charges() -> None:
    charge, vehicle = ChargeBattery(patience=1.0), SteppedVehicle(0.05)
    brain = alone(charge, BatteryLevel(empty=10, full=12, tau=0.05))

    def steps(left: float, right: float, volts: float, count: int) -> list[Command]:
        return [vehicle.steer(brain, 0, 0, 0, 0, 0, 0, left, right, volts) for _ in range(count)]

    # phototaxis: a = 1/3, k = 0.24
    assert steps(2.0, 1.0, 11.0, 3)[-1] == signals(0.4 - 0.08, 0.4 + 0.08)
    assert steps(10.0, 10.0, 11.0, 2)[-1] == signals(0.4, 0.4)
    assert steps(6.5, 6.5, 11.0, 1)[-1] == signals(0.4, 0.4), "0.65 of the brightest: not yet past the lamp"
    steps(0.0, 0.0, 11.0, 1)
    size = vehicle.robot.dimensions
    under = steps(0.0, 0.0, 11.0, math.ceil(size.radius / (0.15 * size.speed) / 0.05 - 1e-9))
    assert under == [signals(0.15, 0.15)] * len(under), "a body's radius further"
    assert {one.kind for one in steps(0.0, 0.0, 11.0, 20)} == {"stop"}, "waits for the voltage to rise"
    assert steps(0.0, 0.0, 11.0, 2)[-1] == signals(-0.2, 0.2), "it does not: looks for light again"
    assert not charge.charging
    assert {one.kind for one in steps(0.0, 0.0, 11.5, 100)[5:]} == {"stop"} and charge.charging
    assert {one.kind for one in steps(5.0, 1.0, 12.0, 100)} == {"stop"}, "whatever it sees"
    assert steps(1.0, 1.0, 11.5, 6)[-1] == signals(0.4, 0.4) and not charge.charging, "pushed off"


def test_charge_battery_looks_round_and_moves_on_in_the_dark() -> None:
    vehicle = SteppedVehicle(0.05)
    brain = alone(ChargeBattery(), BatteryLevel(empty=10, full=12))
    commands = [vehicle.steer(brain, 0, 0, 0, 0, 0, 0, 0, 0, 11.0) for _ in range(200)]
    size = vehicle.robot.dimensions
    a_round = 2 * math.pi / (2 * 0.2 * size.speed / size.track_width)
    first_ahead = next(index for index, one in enumerate(commands) if one.left == one.right)
    assert first_ahead * 0.05 == pytest.approx(a_round, abs=0.05)
    assert [one.left for one in commands[first_ahead : first_ahead + 20]] == [0.4] * 20


# ---- the moth and the trumpet animalcule -----------------------------------------------------------------------------


def moth(**parameters: float) -> tuple[Brain, SteppedVehicle, Evade]:
    evade = Evade(utility=Utility(b=-1.0, tau=0.02), **parameters)  # type: ignore[arg-type]
    return Brain([Stop(utility=REST), evade], period=0.05), SteppedVehicle(0.05), evade


def test_a_moth_steers_away_from_a_weak_signal_and_ignores_none() -> None:
    brain, vehicle, _ = moth()
    assert {vehicle.steer(brain, 0.1, 0.1).kind for _ in range(20)} == {"stop"}, "not above the first threshold"
    far = [vehicle.steer(brain, 0.3, 0.1) for _ in range(20)]
    assert far[-1] == signals(0.5 + 0.25, 0.5 - 0.25), "a = 1/2, away from the left"
    assert [vehicle.steer(brain, 0.0, 0.0) for _ in range(20)][-1].kind == "stop"


def test_a_moth_that_is_found_flies_by_chance_then_drops_whatever_it_hears() -> None:
    brain, vehicle, evade = moth(erratic=1.0, beat=0.2, drop=0.5)
    vehicle.steer(brain, 0.0, 0.0)
    while not evade.is_bound:
        begun = vehicle.steer(brain, 0.6, 0.0)
        assert vehicle.steps < 10
    flight = [begun] + [vehicle.steer(brain, 0.0, 0.0) for _ in range(29)]
    assert all(one.kind == "signal" for one in flight[:20]), "1 s"
    beats = [flight[index : index + 4] for index in range(0, 20, 4)]
    assert all(len(set(beat)) == 1 for beat in beats) and len({beat[0] for beat in beats}) == 5
    assert all(abs(one.left) <= 0.8 and abs(one.right) <= 0.8 for one in flight)
    assert {one.kind for one in flight[20:30]} == {"stop"}, "0.5 s"
    for _ in range(4):
        vehicle.steer(brain, 0.0, 0.0)
    assert not evade.is_bound and brain.active == "stop"


def test_leaky_chain_is_the_solution_of_its_equations() -> None:
    """dU/dt + aU = bX for a step of X: U = (b/a) X (1 - e^(-at)); each overtakes the milder ones at its time."""
    chain, order, x = LeakyChain(), [0], 1.2
    for step in range(1, 2001):
        chosen = chain.advance(x, 0.005)
        t = step * 0.005
        exact = [b / a * x * (1 - math.exp(-a * t)) for a, b in STENTOR]
        assert chain.values == pytest.approx(exact)
        assert chosen == int(np.argmax([0.46, *exact]))
        if chosen != order[-1]:
            order.append(chosen)
    assert order == [0, 1, 2, 3, 4]


def test_touches_that_do_not_end_are_answered_ever_more_drastically() -> None:
    escalate, stepped = Escalate(utility=Utility(b=-1.0, tau=0.02)), Stepped(0.05, description=FULL)
    brain = Brain([Wander(utility=REST), escalate])
    answers: list[str] = []
    commands, beeps = [], 0
    for _ in range(200):
        commands.append(stepped.step(brain, whiskers=1))
        if brain.active == "escalate" and escalate.answer != (answers[-1] if answers else ""):
            answers.append(escalate.answer)
        beeps += stepped.robot.slow_command is not None
        stepped.robot.slow_command = None
    assert answers == ["turn", "reverse", "stop", "call"]
    assert signals(0.5, -0.5) in commands and signals(-0.5, -0.5) in commands and commands[-1].kind == "stop"
    called = next(switch.time for switch in brain.switches)  # the run's begin
    assert called == 0.0 and 3 <= beeps <= 8, "a call each second"
    for _ in range(400):
        stepped.step(brain)
    assert escalate.answer == "" and brain.active == "wander", "calm again"
    first = [one for one in [stepped.step(brain, whiskers=1) for _ in range(20)] if one == signals(0.5, -0.5)]
    assert first, "and mild again"


def test_a_robot_without_a_buzzer_waves() -> None:
    escalate, stepped = Escalate(utility=Utility(b=-1.0, tau=0.02)), Stepped(0.05)
    brain = Brain([Wander(utility=REST), escalate])
    commands = [stepped.step(brain, whiskers=2) for _ in range(200)]
    assert escalate.answer == "call" and commands[-1] == signals(-0.5, 0.5)


def test_the_longer_a_touch_the_more_drastic_the_answer() -> None:
    def strongest(seconds: float) -> int:
        escalate, stepped = Escalate(utility=Utility(b=-1.0, tau=0.02)), Stepped(0.05)
        brain = Brain([Wander(utility=REST), escalate])
        answers: list[int] = []
        for _ in range(200):
            stepped.step(brain, whiskers=int(stepped.time < seconds - 1e-9))
            answers.append(("", "turn", "reverse", "stop", "call").index(escalate.answer))
        return max(answers)

    # X after 0.1 s of touch is at most 0.1 · 2.6 = 0.26, above which no U gets more than 1.93 · 0.26 = 0.5; it has
    # faded before the slow ones come near that
    found = [strongest(seconds) for seconds in (0.1, 0.2, 0.4, 1.0, 10.0)]
    assert found == sorted(found) and found[0] == 0 and found[-1] == 4 and len(set(found)) >= 3
