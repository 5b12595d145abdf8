"""A brain asked anew what it would have commanded on what was sensed in a run."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from boebot import brains
from boebot.description.equipment import Equipment
from boebot.devices.device import SlowDevice
from boebot.devices.latest import Latest
from boebot.devices.readings import Readings
from boebot.errors import BoebotError, BrainError
from boebot.record.columns import BoardColumns
from boebot.record.interventions import Hand, interventions
from boebot.record.run import Run
from boebot.robot import Command, Observation, Robot
from boebot.running.brain_parameters import in_force, parameters
from boebot.running.hands import carry_out

EXPECTED = "expected one with a step of its brain at least"
"""Of a run that is to be compared: that nothing differs from nothing says nothing."""


def replayed(result: Run, brain: object) -> list[Command]:
    """What a fresh brain commands, step by step, on what was sensed in a run: without board, link and world. A brain
    that is over before the run was gives fewer commands. What a person did to robot and brain is done again.

    Raises:
        BoebotError: the run has no commands.
        BrainError: the brain cannot be loaded, or fails.
    """
    if result.program:
        raise BoebotError(f"{result.brain} drove the robot, a program that sensed for itself; expected --again")
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
                with contextlib.suppress(BrainError):  # a parameter of another brain
                    held = carry_out(deeds.pop(0)[1], robot, loaded, held)
            try:
                loaded.step(robot)
            except Exception as error:
                raise BrainError(brains.explain(error, loaded.path)) from error
            robot.slow_command = None
            if held is not None:
                robot.drive(held.left, held.right)
            commands.append(robot.command)
    return commands


def _observations(result: Run) -> Iterator[Observation]:
    """What the brain saw at each of its steps."""
    record = result.record
    series = result.series
    times: list[float] = series.time.tolist()
    if result.layout is not None:
        equipment = Equipment(result.robot, result.tick, result.layout)
        for index in series.steps.tolist():
            row = series.raw[index]
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
    assert isinstance(series, BoardColumns)
    for index in series.steps.tolist():
        while seen < len(slow) and slow[seen][0] <= times[index]:
            _, kind, data = slow[seen]
            newest = {**newest, kind: kind.unpack(data)}
            seen += 1
        telemetry = series.telemetry(index)
        board_s = telemetry.tick * result.tick
        latest = Latest(newest, telemetry.tick)
        host_s, bound_s = float(series.raw["host"][index]), float(series.raw["bound"][index])
        yield Observation(telemetry, equipment, times[index], board_s, host_s, bound_s, latest)
