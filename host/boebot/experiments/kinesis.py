"""Kinesis: wood lice are where it is humid because they are slow there. Section 4.4.2 of the notes, E28.

Density is proportional to 1/V: with speeds of 0.2 and 1 m/s the humid half of the floor has a share of 1/(1 + 0.2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from boebot import run
from boebot.behaviors import Kinesis
from boebot.brain import Brain
from boebot.devices.motor import RegulatedMotor
from boebot.experiments.experiment import Floats, Outcome, Progress, about, experiment
from boebot.experiments.variants import varied

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from boebot.robot import Robot

FULL_SPEED = 2.0  # m/s at motor signal 1: half of it is left for turning
FAST, SLOW = 1.0, 0.2  # m/s
FIELD = 2.0  # m; side of a square of the chequered floor
SECONDS = 3000.0
PERIOD = 0.05  # s
# Brain and motors answer late by T = 0.025 s and 0.015 s; over a square's mean chord π w / 4 this shifts the share by
# about (1 - 0.2) m/s T / chord (1 / 6 + 1 / 6) 5 / 6 = -0.006, which is why squares are large and motors strong.
MOTOR = RegulatedMotor(gain_n_s=10.0, torque_maximum_n_m=10.0)


def humidity(x: Floats | float, y: Floats | float) -> Floats:
    """H at places (m): half of the floor is humid, in squares like those of a chessboard, without end and border."""
    return np.asarray((np.floor(x / FIELD) + np.floor(y / FIELD)) % 2)


def feel(robot: Robot) -> float:
    """H where the robot is: it has no hygrometer, but an exact odometer and a map."""
    return float(humidity(robot.odometer.x, robot.odometer.y))


def humid_share(x: Floats, y: Floats) -> float:
    """Share of places that are humid."""
    return float(humidity(x, y).mean())


@experiment(
    "E28",
    title="Wood lice linger where it is humid",
    source="section 4.4.2, kinesis",
    caption="Path of 10 min over a floor whose shaded squares are humid, and the share of time spent there.",
    robot="arsim with velocity-regulated motors (3.15) of 10 N m",
    slow=True,
)
def wood_louse(seed: int, progress: Progress) -> Outcome:
    robot = varied(
        "arsim", "wood louse", body={"wheel_speed_maximum_m_s": FULL_SPEED}, motor_left=MOTOR, motor_right=MOTOR
    )
    louse = Kinesis(stimulus=feel, fast=FAST / FULL_SPEED, slow=SLOW / FULL_SPEED)
    result = run(
        Brain([louse], period=PERIOD),
        robot=robot,
        arena="empty",
        seconds=SECONDS,
        seed=seed,
        progress=lambda seconds: progress(min(seconds / SECONDS, 1.0)),
    )
    assert result.truth is not None
    time, x, y = result.truth.time, result.truth.x, result.truth.y
    measured = [about("humid share of the time", humid_share(x, y), 0.83, 0.02)]
    shown = slice(0, 60_000, 20)
    wet = humidity(x, y)
    share = np.cumsum(wet) / np.arange(1, len(wet) + 1)
    along = slice(0, None, 500)

    def draw(figure: Figure) -> None:
        above, beside = figure.subplots(1, 2)
        low = [math.floor(values[shown].min()) for values in (x, y)]
        high = [math.ceil(values[shown].max()) for values in (x, y)]
        columns, rows = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        squares = (columns + rows) % 2
        extent = (low[0], high[0], low[1], high[1])
        above.imshow(squares, origin="lower", extent=extent, cmap="Blues", vmin=0, vmax=4)
        above.plot(x[shown], y[shown], color="#d55e00", linewidth=0.8)
        above.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        beside.plot(time[along] / 60, share[along], color="#0072b2")
        beside.axhspan(0.81, 0.85, color="#e3e5ea", zorder=0, label="criterion")
        beside.set(xlabel="time (min)", ylabel="humid share of the time so far", ylim=(0.5, 1))
        beside.legend(loc="lower right", fontsize=9, frameon=False)

    data = {"time_s": time[along], "true_x_m": x[along], "true_y_m": y[along], "share": share[along]}
    return Outcome(measured, data, draw)
