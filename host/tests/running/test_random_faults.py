"""Random schedules of faults: motors always stop, telemetry comes back, and the robot drives again.

A schedule that breaks a law is made as short as possible, and printed as a command.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st

from boebot.description.robots import load_robot
from boebot.link.messages import SetpointSignal
from boebot.record.interventions import Fault
from boebot.robot import Robot
from boebot.running.faults import OWNERS, UnfiredError, known
from boebot.running.loop import execute
from boebot.running.tasks import Request

ROBOT = load_robot("shieldbot")
SERVO_PINS = (12, 13)
FAULTS_END_S, SECONDS = 2.5, 4.0
TIME_TO_LIVE_S = 0.25
LAST_PULSE_S = TIME_TO_LIVE_S + 0.0025 + 0.020  # a servo's slot, and its frame
BACK_S = 1.0
UP_S = 0.2  # in which the motors are armed and the wheels turn
NAMES = sorted(name for name, (_, whose) in known(ROBOT).items() if name.partition(".")[0] in OWNERS)


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    """Any one that is over at FAULTS_END_S; host.killed is not among them."""
    name = draw(st.sampled_from([name for name in NAMES if name != "host.killed"]))
    kind = known(ROBOT)[name][0]
    begin_s = draw(st.integers(0, 240)) / 100
    end_s = begin_s + draw(st.integers(1, 200)) / 100
    value: float | str | None = None
    if kind.words:
        value = draw(st.sampled_from(kind.words))
    elif kind.default is not None:
        value = draw(st.sampled_from([kind.default, kind.least, min(kind.most, 3 * kind.default), kind.default / 10]))
    return Fault(name, value, begin_s, min(end_s, FAULTS_END_S) if kind.lasts else None)


def obeys(board: str, schedule: list[Fault]) -> None:
    """Runs it, and looks at what came of it."""
    given = [one for one in schedule if not (one.name == "eeprom.corrupted" and one.value == 0.1)]
    words = " ".join(f"--fault {one}" for one in given)
    note(f"boebot run BRAIN --arena empty --on {board} --seconds {SECONDS:g} --pins {words}")
    result = execute(Request.single(straight, ROBOT, arena="empty", on=board, seconds=SECONDS, pins=True, faults=given))
    assert result.error is None or isinstance(result.error, UnfiredError), result.error
    record, offset_s = result.record, result.clock_offset
    sent = np.array([time_s for time_s, data in record.each_row("to_board") if data[2] == SetpointSignal.ID])
    pins = [(time_s, data) for time_s, data in record.each_row("pins") if data[0] in SERVO_PINS and data[1] == 1]
    pulses = np.array([time_s for time_s, _ in pins])
    assert len(pulses) > 20
    late = pulses - sent[np.searchsorted(sent, pulses, side="right") - 1] - LAST_PULSE_S
    assert late.max() <= 0.0, f"a pulse begins at {pulses[late.argmax()]:.4f} s, {late.max():.4f} s too late"
    pulses -= offset_s

    ticks = np.array([row[0] for row in result.record.each_row("telemetry")])
    over_s = max([0.0, *(one.begin_s if one.end_s is None else one.end_s for one in given)])
    late_s = sum(float(one.value or 0.0) for one in given if one.name in ("serial.delayed", "host.slow"))
    back_s = over_s + late_s + BACK_S
    if back_s < SECONDS - UP_S:
        seen = ticks[(ticks > over_s) & (ticks <= back_s)]
        assert len(seen), f"no telemetry from {over_s:g} s to {back_s:g} s"
        again = pulses[pulses > back_s + UP_S - 0.025]
        assert len(again), "the motors are armed again"


def examples(count: int) -> settings:
    """The same ones each time."""
    phases = (Phase.generate, Phase.shrink)
    unhurried = list(HealthCheck)
    return settings(
        max_examples=count,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=unhurried,
        phases=phases,
        print_blob=False,
    )


@examples(25)
@given(st.lists(faults(), min_size=1, max_size=4))
def test_random_schedules(schedule: list[Fault]) -> None:
    obeys("native", schedule)


@pytest.mark.soak
@examples(1000)
@given(st.lists(faults(), min_size=1, max_size=6))
def test_a_thousand_random_schedules(schedule: list[Fault]) -> None:
    obeys("native", schedule)


@pytest.mark.soak
@examples(100)
@given(st.lists(faults(), min_size=1, max_size=6))
def test_a_hundred_random_schedules_on_the_chip(schedule: list[Fault]) -> None:
    obeys("avr", schedule)
