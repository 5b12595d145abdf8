"""The straight odometric run on servos and coarse encoders: what a dead band does to (5.1); E23.

A servo stands still within its dead band, and (5.1) asks for less and less: without a least motor signal s_min the
robot never gets there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import msgspec

from boebot.behaviors import StraightRun
from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription, load_robot
from boebot.link import messages
from boebot.robot import Observation, Robot
from boebot_course.experiment import Figure, Measured, Outcome, Variant, exactly, experiment
from boebot_course.experiments.straight_line import Straight, drive, runner
from boebot_course.trials import trial_seeds
from boebot_course.variants import varied

STEP = 0.01  # s
SECONDS = 25.0
DEAD_BAND, LAG_S, TOP_M_S = 0.05, 0.05, 0.174
LEAST = 0.06  # s_min
SPAN_US, PULSE_COUNT_US = 200.0, 0.0625


def coarse(wheel_radius_m: float) -> RobotDescription:
    """A shieldbot with 16 edges to a turn, without differences between its servos."""
    edges = {"edges_per_turn": 16}
    body = {"wheel_radius_m": wheel_radius_m}
    described = varied("shieldbot", "shieldbot-16", body, encoder_left=edges, encoder_right=edges)
    return msgspec.structs.replace(described, unit=0)


# ---- the model -------------------------------------------------------------------------------------------------------


@dataclass
class ServoRun:
    """A run on the servo model."""

    behavior: StraightRun
    times: list[float] = field(default_factory=list)
    distances: list[float] = field(default_factory=list)
    """true d (m)"""
    signals: list[float] = field(default_factory=list)
    speed: float = 0.0
    """m/s at the end"""


def on_servo_model(least: float) -> ServoRun:
    """Both wheels alike: v follows s v_top with a lag, from 0 within the dead band; the encoders count whole edges of
    2 π 0.0333 m / 16 = 13.08 mm.

        τ dv/dt + v = v_top s  for |s| ≥ 0.05, else 0;   dd/dt = v
    """
    described = coarse(0.0333)
    robot, equipment = Robot("servo model", STEP), Equipment(described, STEP)
    quantum = 2 * math.pi * 0.0333 / 16
    brain = runner(period=STEP, least=least)
    behavior = brain.processes[0]
    assert isinstance(behavior, StraightRun)
    run = ServoRun(behavior)
    distance = speed = signal = 0.0
    decay = math.exp(-STEP / LAG_S)
    for index in range(round(SECONDS / STEP)):
        edges = math.floor(distance / quantum)
        robot.observation = Observation(_telemetry(index, edges, signal), equipment, time=index * STEP)
        brain.step(robot)
        signal = robot.command.left
        run.times.append(index * STEP)
        run.distances.append(distance)
        run.signals.append(signal)
        aim = TOP_M_S * signal if abs(signal) >= DEAD_BAND else 0.0
        distance += aim * STEP + (speed - aim) * LAG_S * (1 - decay)
        speed = aim + (speed - aim) * decay
    run.speed = speed
    return run


def _telemetry(tick: int, edges: int, signal: float) -> messages.Telemetry:
    """What a board would send."""
    nothing = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
    pulses = [round((1500 + mount * SPAN_US * signal) / PULSE_COUNT_US) for mount in (1, -1)]
    return nothing._replace(
        tick=tick, encoder_left=edges, encoder_right=edges, pulse_left=pulses[0], pulse_right=pulses[1]
    )


def judge_model(with_least: ServoRun, without: ServoRun) -> list[Measured]:
    """What is asked."""
    return [
        exactly("with s_min: stops (1: yes)", with_least.behavior.arrived, 1),
        Measured("with s_min: d at rest", with_least.distances[-1], "m", 0.98, 0.995),
        exactly("without: stops (1: yes)", without.behavior.arrived, 0),
        Measured("without: d where it stalls", without.distances[-1], "m", 0.94, 0.96),
        Measured("without: speed at the end", abs(without.speed), "m/s", most=1e-6),
    ]


Columns = tuple["Sequence[float]", "Sequence[float]", "Sequence[float]"]
"""time (s); distance (m); motor signal"""


def _outcome(measured: list[Measured], dead_band: float, with_least: Columns, without: Columns) -> Outcome:
    """The data end where the shorter run ends."""
    count = min(len(with_least[0]), len(without[0]))
    data = {
        "time_s": with_least[0][:count],
        "distance_m": with_least[1][:count],
        "signal": with_least[2][:count],
        "distance_without_m": without[1][:count],
        "signal_without": without[2][:count],
    }
    rows = {"s_min = 0.06": with_least, "without s_min": without}
    return Outcome(measured, data, lambda figure: _draw(figure, rows, dead_band))


def _draw(figure: Figure, rows: dict[str, Columns], dead_band: float) -> None:
    """Distance and motor signal of the runs against time."""
    upper, lower = figure.subplots(2, sharex=True)
    upper.axhspan(0.98, 1.02, color="C2", alpha=0.15, label="destination, |D - d| < b D")
    lower.axhspan(0, dead_band, color="0.85", label="dead band")
    for (name, (times, distances, signals)), look, width in zip(rows.items(), ("C0-", "C1--"), (2.4, 1.2), strict=True):
        upper.plot(times, distances, look, lw=width, label=name)
        lower.plot(times, signals, look, lw=width)
    upper.set(ylabel="true distance (m)", ylim=(0.8, 1.03))
    lower.set(xlabel="time (s)", ylabel="motor signal", ylim=(-0.01, 0.2))
    upper.legend(fontsize="small", loc="lower right")
    lower.legend(fontsize="small", loc="upper right")


# ---- through the circle ----------------------------------------------------------------------------------------------


def judge_shieldbot(with_least: Straight, without: Straight) -> list[Measured]:
    """By the derivation in the criterion."""
    asked = without.result.record.steps[-1][2]
    return [
        exactly("with s_min: stops (1: yes)", with_least.behavior.arrived, 1),
        Measured("with s_min: believed d at the stop command", with_least.believed, "m", 0.980, 0.993),
        Measured("with s_min: d at rest", with_least.rest, "m", 0.967, 1.008),
        exactly("without: stops (1: yes)", without.behavior.arrived, 0),
        Measured("without: believed d where it stalls", without.believed, "m", 0.950, 0.963),
        Measured("without: d where it stalls", without.rest, "m", 0.937, 0.978),
        Measured("without: motor signal at the end", asked, "", 0.9 * 0.02, 0.045),
        Measured("without: moves at the end", without.moves, "m", most=1e-3),
    ]


@experiment(
    "E23",
    on={
        "model": Variant("shieldbot (16 edges, as a model of its servos)", False),
        "shieldbot": Variant("shieldbot (native)", True),
    },
)
def dead_band(on_board: bool, seed: int) -> Outcome:
    """A metre straight ahead on servos with a dead band

    In the notes: section 5.4, equation (5.1)

    Figure: The straight run on servos with a dead band and encoder edges of 13 mm, by a model (dead band 0.05, lag
    50 ms) or on the board: the last fifth of the way with and without a least motor signal of 0.06.

    Expected: It stops at 0.98 m to an edge later; else it stalls about 1 - 0.05 / 0.9 = 0.944 m, to an edge later.

    Expected on shieldbot: Nominal servos, whose dead band is 9 us = 0.045; no edge missed or counted twice; an edge is
    q = 208 mm / 16 = 13.0 mm. With s_min it stops with a believed d from 0.980 m to 0.980 m + q; the truth is up to q
    less or more, as the first edge comes anywhere, and 2 mm of coming to rest (75 ms at 0.027 m/s). Without, it stalls
    once 0.9 (1 - d) < 0.045: believed d from 0.950 m to 0.950 m + q, the truth again up to q less or more, and 2 mm.
    """
    if not on_board:
        with_least = on_servo_model(LEAST)
        without = on_servo_model(0.0)
        columns = [(run.times, run.distances, run.signals) for run in (with_least, without)]
        return _outcome(judge_model(with_least, without), DEAD_BAND, *columns)
    robot = coarse(load_robot("shieldbot").body.wheel_radius_m)
    runs = [
        drive(runner(period=0.05, least=least), robot, 20.0, trial_seed, "native", "encoder_errors")
        for least, trial_seed in zip((LEAST, 0.0), trial_seeds(seed, 2), strict=True)
    ]
    columns = [(list(run.time), list(run.distances), list(run.result.series.signals[0])) for run in runs]
    return _outcome(judge_shieldbot(*runs), 0.045, *columns)
