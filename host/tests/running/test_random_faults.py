"""Random schedules of faults: motors always stop, telemetry comes back, and the robot drives again.

A schedule that breaks a law is made as short as possible, and printed as a command.
"""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, note, settings
from hypothesis import strategies as st

from boebot.cli.faults import names_of
from boebot.description.robots import load_robot
from boebot.link.messages import SetpointSignal
from boebot.record.interventions import Fault
from boebot.robot import Robot
from boebot.running.faults import UnfiredError, known
from boebot.running.loop import execute
from boebot.running.tasks import Request

ROBOT = load_robot("shieldbot")
SERVO_PINS = (12, 13)
FAULTS_END_S, SECONDS = 2.5, 4.5
TIME_TO_LIVE_S = 0.25
LAST_PULSE_S = TIME_TO_LIVE_S + 0.0025 + 0.020  # a servo's slot, and its frame
BACK_S = 1.0
UP_S = 0.1  # between the last pulse and the last telemetry
HOST_TIME = struct.Struct("<d")  # of a row of telemetry, before its error bound
NAMES = sorted(set(names_of(known(ROBOT))) - {"host.killed", "battery.sagging"})  # which end the run


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    """Any one that is over at FAULTS_END_S."""
    name = draw(st.sampled_from(NAMES))
    kind = known(ROBOT)[name][0]
    begin_s = draw(st.integers(0, 240)) / 100
    end_s = begin_s + draw(st.integers(1, 200)) / 100
    value: float | str | None = None
    if kind.words:
        value = draw(st.sampled_from(kind.words))
    elif kind.default is not None:
        value = draw(st.sampled_from([kind.default, kind.least, max(kind.default / 10, kind.least)]))
    return Fault(name, value, begin_s, min(end_s, FAULTS_END_S) if kind.lasts else None)


def schedules(most: int) -> st.SearchStrategy[list[Fault]]:
    """Of several faults, each kind once: three delays at a time are a line over which no session can be opened."""
    return st.lists(faults(), min_size=1, max_size=most, unique_by=lambda one: one.name)


def obeys(board: str, schedule: list[Fault]) -> None:
    """Runs it, and looks at what came of it."""
    words = " ".join(f"--fault {one}" for one in schedule)
    note(f"boebot run BRAIN --arena empty --on {board} --seconds {SECONDS:g} --pins {words}")
    result = execute(
        Request.single(straight, ROBOT, arena="empty", on=board, seconds=SECONDS, pins=True, faults=schedule)
    )
    assert result.error is None or isinstance(result.error, UnfiredError), result.error
    record = result.record
    sent = np.array([time_s for time_s, data in record.each_row("to_board") if data[2] == SetpointSignal.ID])
    pins = [(time_s, data) for time_s, data in record.each_row("pins") if data[0] in SERVO_PINS and data[1] == 1]
    pulses = np.array([time_s for time_s, _ in pins])
    assert len(pulses) > 20
    late = pulses - sent[np.searchsorted(sent, pulses, side="right") - 1] - LAST_PULSE_S
    assert late.max() <= 0.0, f"a pulse begins at {pulses[late.argmax()]:.4f} s, {late.max():.4f} s too late"
    over_s = max([0.0, *(one.begin_s if one.end_s is None else one.end_s for one in schedule)])
    late_s = sum(float(one.value or 0.0) for one in schedule if one.name in ("serial.delayed", "host.slow"))
    back_s = result.clock_offset + over_s + late_s
    came = np.array([HOST_TIME.unpack(data[-16:-8])[0] for _, data in record.each_row("telemetry")])
    assert len(came[(came > back_s) & (came <= back_s + BACK_S)]), f"no telemetry in the second after {back_s:g} s"
    assert pulses[-1] > came[-1] - UP_S and came[-1] > back_s + BACK_S, "the motors are armed again"


def examples(count: int) -> settings:
    """The same ones each time, shrunk where one breaks a law."""
    return settings(
        max_examples=count,
        derandomize=True,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=(Phase.generate, Phase.shrink),
    )


@examples(10)
@given(schedules(4))
def test_random_schedules(schedule: list[Fault]) -> None:
    obeys("native", schedule)


@pytest.mark.soak
@examples(1000)
@given(schedules(6))
def test_a_thousand_random_schedules(schedule: list[Fault]) -> None:
    obeys("native", schedule)


@pytest.mark.soak
@examples(100)
@given(schedules(6))
def test_a_hundred_random_schedules_on_the_chip(schedule: list[Fault]) -> None:
    obeys("avr", schedule)
