"""Two runs of the same brain and seed, on an emulated and a real board or on two emulated ones: from where on they
differ, and whether the brain is to blame.

A brain is a function of its seed and of what it saw. So its commands may differ as soon as telemetry does, and not
before (experiment E68); `replayed` goes further and asks a brain anew what it would have commanded on that telemetry.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from boebot import brains
from boebot.devices.device import SlowDevice
from boebot.devices.latest import Latest
from boebot.devices.readings import Readings
from boebot.errors import BoebotError, BrainError
from boebot.link.messages import Telemetry
from boebot.record.blocks import Row
from boebot.record.result import RunResult
from boebot.robot import Command, Equipment, Observation, Robot
from boebot.running.brain_parameters import in_force, parameters, set_parameters
from boebot.running.interventions import Arm, Deed, Hand, Parameter, Release, Stop, interventions

NOT_SEEN = frozenset(("setpoint_sequence",))
"""Fields of telemetry that say what the host itself sent, and that no device shows to a brain."""

EXPECTED = "expected one with a step of its brain at least"
"""Of a run that is to be compared: that nothing differs from nothing says nothing."""

_OTHER_CLOCKS = ("to_board", "to_host", "event", "truth", "pins", "waits", "shifts")
"""Streams whose times are of the transport's clock, or near it."""


@dataclass(frozen=True)
class Difference:
    """Where two runs differ first."""

    step: int
    """of the brain, from 0"""
    tick: int
    """of the control ticks since the run began, in the first run"""
    what: str
    """"tick", a field of telemetry, or "command\""""
    first: object
    """there, in the first run"""
    second: object
    """and in the second"""

    def __str__(self) -> str:
        return f"step {self.step} (tick {self.tick}): {self.what} is {self.first} and {self.second}"


def telemetry_difference(one: RunResult, other: RunResult, fields: tuple[str, ...] = ()) -> Difference | None:
    """The first step at which the brains did not see the same: another tick, or other telemetry.

    Args:
        one, other: runs on boards.
        fields: of telemetry, that count, with "tick"; (): all that a brain can see.

    Raises:
        BoebotError: a run without a board, which has no telemetry.
    """
    rows = [_seen(run) for run in (one, other)]
    for step, (a, b) in enumerate(zip(*rows, strict=False)):
        for name in a._fields:
            if (name in fields or (not fields and name not in NOT_SEEN)) and getattr(a, name) != getattr(b, name):
                return Difference(step, one.record.steps[step][0], name, getattr(a, name), getattr(b, name))
    return None


def command_difference(one: RunResult, other: RunResult) -> Difference | None:
    """The first step at which the brains did not command the same."""
    for step, (a, b) in enumerate(zip(one.record.steps, other.record.steps, strict=False)):
        if a[1:] != b[1:]:
            return Difference(step, a[0], "command", Command(*a[1:]), Command(*b[1:]))
    return None


@dataclass(frozen=True)
class RowDifference:
    """Where the records of two runs differ first."""

    stream: str
    time: float
    """of the run, in s"""
    row: int
    """of the stream, from 0"""
    what: str
    """what differs there, in words: of the first record, and of the second"""

    def __str__(self) -> str:
        return f"stream {self.stream}, {self.time:.4f} s, row {self.row}: {self.what}"


def record_difference(
    one: RunResult, other: RunResult, *, is_cut: bool = False, until_s: float = math.inf
) -> RowDifference | None:
    """The first row, in time, that two records do not have in common, bit for bit. `is_cut`: the first record is; what
    the second one has beyond its end is no difference. `until_s`: of the run; rows from then on do not count."""
    found = []
    for stream in sorted(one.record.streams() | other.record.streams()):
        offset_s = one.clock_offset if stream in _OTHER_CLOCKS else 0.0
        rows = zip_longest(one.record.each_row(stream), other.record.each_row(stream))
        for index, (a, b) in enumerate(rows):
            if a is None and is_cut:
                break
            if a != b:
                time_s = min(row[0] for row in (a, b) if row is not None) - offset_s
                if time_s >= until_s:
                    break
                found.append(RowDifference(stream, time_s, index, _in_words(a, b)))
                break
    return min(found, key=lambda difference: difference.time, default=None)


def _in_words(one: Row | None, other: Row | None) -> str:
    if one is None or other is None:
        return f"only the {'second' if one is None else 'first'} has it"
    if one[0] != other[0]:
        return f"its time is {one[0]!r} s and {other[0]!r} s"
    if len(one[1]) != len(other[1]):
        return f"it has {len(one[1])} B and {len(other[1])} B"
    index = next(index for index, (a, b) in enumerate(zip(one[1], other[1], strict=True)) if a != b)
    return f"its byte {index} is 0x{one[1][index]:02X} and 0x{other[1][index]:02X}"


def replayed(result: RunResult, brain: object) -> list[Command]:
    """What a fresh brain commands, step by step, on what was sensed in a run: without board, link and world. A brain
    that is over before the run was gives fewer commands. What a person did to robot and brain is done again.

    Raises:
        BoebotError: the run has no commands.
        BrainError: the brain cannot be loaded, or fails.
    """
    if not result.record.count("command"):
        raise BoebotError(f"there is nothing to compare: the run has no commands; {EXPECTED}")
    loaded = brains.load_brain(brain)
    description = result.robot
    fastest = () if result.layout is None else (description.body.wheel_speed_maximum_m_s,)
    robot = Robot(description.name, result.period, result.seed, *fastest)
    deeds = interventions(result.record)
    held: Hand | None = None
    commands = []
    known = parameters(loaded)
    with contextlib.ExitStack() as stack:
        stack.callback(loaded.end)
        stack.enter_context(in_force(loaded, {name: one for name, one in result.parameters.items() if name in known}))
        for observation in _observations(result):
            if loaded.is_over:
                break
            robot.observation = observation
            while deeds and deeds[0][0] <= observation.time:
                held = _done_again(deeds.pop(0)[1], robot, loaded, held)
            try:
                loaded.step(robot)
            except Exception as error:
                raise BrainError(brains.explain(error, loaded.path)) from error
            robot.slow_command = None
            if held is not None:
                robot.drive(held.left, held.right)
            commands.append(robot.command)
    return commands


def _done_again(deed: Deed, robot: Robot, brain: brains.LoadedBrain, held: Hand | None) -> Hand | None:
    """Does to robot and brain what a person did. Returns by which signals the robot is driven by hand then."""
    match deed:
        case Hand():
            return deed
        case Release():
            return None
        case Stop():
            robot.emergency_stop()
        case Arm():
            robot.arm()
        case Parameter(name, value):
            with contextlib.suppress(BrainError):  # of another brain
                set_parameters(brain, {name: value})
    return held


def _observations(result: RunResult) -> Iterator[Observation]:
    """What the brain saw at each of its steps."""
    record = result.record
    times = record.times
    if result.layout is not None:
        equipment = Equipment(result.robot, result.tick, result.layout)
        count = max((part.stop for part in result.layout.values()), default=0)
        rows = record.readings(count)
        for index, *_ in record.steps:
            row = rows[index]
            ages, values = tuple(row["ages"].tolist()), tuple(row["values"].tolist())
            sample = Readings(int(row["tick"]), int(row["status"]), ages, values)
            time_s = times[index]
            yield Observation(sample, equipment, time_s, time_s, time_s, 0.0, sample)
        return
    equipment = Equipment(result.robot, result.tick)
    kinds: set[Any] = {device.MESSAGE for device in result.robot.device.values() if isinstance(device, SlowDevice)}
    slow = [(time_s, kind, data) for kind in kinds for time_s, data in record.rows(kind.NAME)]
    slow.sort(key=lambda row: row[0])
    newest: dict[type, Any] = {}
    seen = 0
    payloads, stamps = record.telemetry, record.stamps
    for index, *_ in record.steps:
        while seen < len(slow) and slow[seen][0] <= times[index]:
            _, kind, data = slow[seen]
            newest = {**newest, kind: kind.unpack(data)}
            seen += 1
        telemetry = Telemetry.unpack(payloads[index])
        board_s = telemetry.tick * result.tick
        latest = Latest(newest, telemetry.tick)
        yield Observation(telemetry, equipment, times[index], board_s, *stamps[index], latest)


def _seen(run: RunResult) -> list[Telemetry]:
    if run.layout is not None:
        raise BoebotError(f"robot {run.robot.name!r} has no board, and no telemetry to compare")
    return [Telemetry.unpack(run.record.telemetry[index]) for index, *_ in run.record.steps]
