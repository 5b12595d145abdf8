"""Kinesis: wood lice are where it is humid because they are slow there. Section 4.4.2 of the notes, E28.

Density is proportional to 1/V: with speeds of 0.2 and 1 m/s the humid half of the floor has a share of 1/(1 + 0.2).
"""

from __future__ import annotations

import math

import numpy as np

from boebot import run
from boebot.behaviors import Kinesis
from boebot.brain import Brain
from boebot.devices.motor import RegulatedMotor
from boebot_course.experiment import Figure, Floats, Measured, Outcome, about, experiment
from boebot_course.trials import Log
from boebot_course.variants import varied

FULL_SPEED = 2.0  # m/s at motor signal 1: half of it is left for turning
FAST, SLOW = 1.0, 0.2  # m/s
FIELD = 1.0  # m; side of a square of the chequered floor
SECONDS = 4500.0
PARTS = 30  # of the run, whose shares say how well the whole one is known
PERIOD = 0.02  # s
# Brain and motors answer late by T = 0.010 s and 0.006 s; over a square's mean chord π w / 4 this shifts the share by
# about (1 - 0.2) m/s T / chord (1 / 6 + 1 / 6) 5 / 6 = -0.005, which is why motors are strong and steps short.
MOTOR = RegulatedMotor(gain_n_s=25.0, torque_maximum_n_m=1000.0)


def humidity(x: Floats | float, y: Floats | float) -> Floats:
    """H at places (m): half of the floor is humid, in squares like those of a chessboard, without end and border."""
    return np.asarray((np.floor(x / FIELD) + np.floor(y / FIELD)) % 2)


def humid_share(x: Floats, y: Floats) -> float:
    """Share of places that are humid."""
    return float(humidity(x, y).mean())


@experiment("E28", robot="arsim with velocity-regulated motors (3.15) of 25 N s", slow=True)
def wood_louse(seed: int) -> Outcome:
    """Wood lice linger where it is humid

    In the notes: section 4.4.2, kinesis

    Figure: Path of 5 min over a floor whose shaded squares are humid, and the share of time spent there.

    Expected: Density is proportional to 1/V: 1/(1 + 0.2) = 0.833, from which lags of brain and motors take 0.005.
    Some 950 visits to squares of either kind, whose lengths differ by 0.6 of their mean (1 σ), leave a standard
    error of 0.83 · 0.17 · 0.6 √(2 / 950) = 0.004, a fifth of what is allowed.
    """
    robot = varied(
        "arsim", "wood louse", body={"wheel_speed_maximum_m_s": FULL_SPEED}, motor_left=MOTOR, motor_right=MOTOR
    )
    # it has no sensor of humidity, but an exact odometer and a map
    louse = Kinesis(
        stimulus=lambda robot: float(humidity(robot.odometer.x, robot.odometer.y)),
        fast=FAST / FULL_SPEED,
        slow=SLOW / FULL_SPEED,
    )
    places = Log(read=lambda _, robot: (robot.odometer.x, robot.odometer.y))
    run(
        Brain([louse, places], period=PERIOD),
        robot=robot,
        arena="empty",
        seconds=SECONDS,
        seed=seed,
        record=False,
    )
    x, y = np.array(places.rows).T
    time: Floats = np.arange(len(x), dtype=np.float64) * PERIOD
    wet = humidity(x, y)
    parts = [part.mean() for part in np.array_split(wet, PARTS)]
    measured = [
        about("humid share of the time", humid_share(x, y), 0.83, 0.02),
        Measured("its standard error", float(np.std(parts, ddof=1)) / math.sqrt(PARTS), "", 0.0, 0.02 / 3),
    ]
    shown = slice(0, round(300 / PERIOD), 5)
    share = np.cumsum(wet) / np.arange(1, len(wet) + 1)
    along = slice(0, None, 750)

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
