"""E. coli: running and tumbling by equation (4.1), Figs. 4.1 and 4.2, section 4.4.2 of the notes; E29 to E32.

All by the kit's behavior `RunAndTumble`: E29 and E30 its utility, E31 and E32 runs, one robot for each bacterium.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from boebot import run
from boebot.behaviors import RunAndTumble
from boebot.brain import Brain
from boebot.description.robots import RobotDescription
from boebot.devices.motor import RegulatedMotor
from boebot.robot import Robot
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, about, exactly, experiment
from boebot_course.trials import Alone, trial_seeds
from boebot_course.variants import varied

STEP = 0.01  # s
SIZE, SPREAD, SPEED = 10.0, 2.5, 1.0  # side of the square (m), width of the attractant (m), speed of a run (m/s)
COUNT, SECONDS = 100, 10.0
RUN_ON = 0.05  # s that a bacterium runs after each tumble

Attractant = Callable[[float, float, float], float]
"""X at a place (m, m) and time (s)."""


def utility_of(stimulus: Floats, a: float, b: float, step: float) -> Floats:
    """U = X - V, dV/dt + a V = b X  (4.1), with V(0) = (b/a) X(0), as the kit's behavior has it in its steps.

    The behavior looks at nothing but X.
    """
    smelled = [float(stimulus[0])]
    behavior = RunAndTumble(stimulus=lambda robot: smelled[0], a=a, b=b)
    alone = Alone(behavior, step)
    values = []
    for x in stimulus.tolist():
        smelled[0] = x
        alone.step()
        values.append(behavior.value)
    return np.array(values)


@experiment("E29")
def triangle(seed: int) -> Outcome:
    """E. coli's utility follows a rise and a fall

    In the notes: section 4.4.2, equation (4.1), Fig. 4.1

    Figure: Left: concentration X of the attractant, a triangle. Right: utility U of running (B1), which is active
    while U > 0: between 1 s and 3 s (shaded).

    Expected: Fig. 4.1 by (4.1): U > 0 from 1.00 s to 3.00 s, ± 0.01 s; at most 0.213, at least -0.162, ± 0.005.
    """
    step, peak, top = 0.001, 2.433, 0.4
    times = np.arange(0, 5, step)
    slope = top / (peak - 1)
    stimulus = np.clip(np.minimum(slope * (times - 1), top - slope * (times - peak)), 0, None)
    values = utility_of(stimulus, 1.0, 1.0, step)
    above = times[values > 1e-12]
    measured = [
        about("U > 0 from", above[0], 1.0, 0.01, "s"),
        about("U > 0 until", above[-1], 3.0, 0.01, "s"),
        exactly("gaps in between", int((np.diff(above) > 1.5 * step).sum()), 0),
        about("largest U", values.max(), 0.213, 0.005),
        about("smallest U", values.min(), -0.162, 0.005),
    ]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, sharex=True, sharey=True)
        left.plot(times, stimulus)
        left.set(xlabel="time (s)", ylabel="attractant X")
        right.plot(times, values)
        right.axhline(0, color="0.6", linewidth=0.8)
        right.axvspan(above[0], above[-1], color="0.9", zorder=0, label="B1 is active")
        right.set(xlabel="time (s)", ylabel="utility U of running")
        right.legend()

    return Outcome(measured, {"time_s": times[::10], "x": stimulus[::10], "u": values[::10]}, draw)


@experiment("E30")
def sign(seed: int) -> Outcome:
    """With b > a a constant attractant ends in tumbling

    In the notes: section 4.4.2, equation (4.1)

    Figure: Utility after a step of the attractant to 0.4 with a = 1, b = 1.5; dashed: its limit X (1 - b/a).

    Expected: (4.1) solved: X (1 - b/a (1 - exp(-t))) is zero at ln 3 = 1.099 s, -0.189 at 4 s, tends to -0.2.
    """
    step = 0.001
    times = np.arange(-0.5, 8, step)
    stimulus = np.where(times >= 0, 0.4, 0.0)
    values = utility_of(stimulus, 1.0, 1.5, step)
    at_four = float(values[np.searchsorted(times, 4.0)])
    crossing = float(times[np.nonzero(values > 0)[0][-1]])
    measured = [
        about("U 4 s after the step", at_four, 0.4 * (1 - 1.5 * (1 - math.exp(-4.0))), 1e-3),
        about("U at the end", values[-1], 0.4 * (1 - 1.5), 1e-3),
        about("U crosses zero", crossing, math.log(3), 0.01, "s"),
    ]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.plot(times, values)
        axes.axhline(-0.2, linestyle="--", color="0.6", label="X (1 - b/a)")
        axes.legend()
        axes.set(xlabel="time after the step (s)", ylabel="utility U of running")

    return Outcome(measured, {"time_s": times[::10], "u": values[::10]}, draw)


@dataclass(frozen=True)
class Swarm:
    """What bacteria did."""

    path: Floats
    """positions (m) each `STRIDE` seconds from the beginning to the end, shape (times, n, 2)"""
    running: float
    """share of steps that were runs"""

    @property
    def begun(self) -> Floats:
        """Positions at the beginning, shape (n, 2)."""
        return np.asarray(self.path[0])

    @property
    def ended(self) -> Floats:
        """And at the end."""
        return np.asarray(self.path[-1])

    @property
    def ratio(self) -> float:
        """Mean distance from the middle at the end against that at the beginning."""
        return float(np.hypot(*self.ended.T).mean() / np.hypot(*self.begun.T).mean())

    @property
    def share(self) -> float:
        """Share of them within the attractant's width at the end."""
        return float((np.hypot(*self.ended.T) < SPREAD).mean())


STRIDE = 1.0  # s


def gaussian(x: float, y: float, time: float) -> float:
    """The attractant of Fig. 4.2."""
    return math.exp(-(x * x + y * y) / (2 * SPREAD * SPREAD))


def uniform(x: float, y: float, time: float) -> float:
    """The same everywhere: a control."""
    return 0.5


def bacterium() -> RobotDescription:
    """arsim, but so narrow, light to turn and strong that it is at its speed after 6 ms, and that half a turn takes
    31 ms."""
    track = 0.02  # m
    motor = RegulatedMotor(gain_n_s=25.0, torque_maximum_n_m=1000.0)
    share = (track / 0.4) ** 2  # of arsim's inertia
    body = {"wheel_speed_maximum_m_s": SPEED, "track_width_m": track, "inertia_kg_m2": 0.2 * share}
    return varied(
        "arsim", "bacterium", body | {"angular_damping_n_m_s": 0.1 * share}, motor_left=motor, motor_right=motor
    )


def swarm(
    seed: int,
    attractant: Attractant,
    *,
    run_on: float = RUN_ON,
    count: int = COUNT,
    seconds: float = SECONDS,
    period: float = STEP,
) -> Swarm:
    """Bacteria all over the square, each a robot that runs and tumbles by (4.1) with a = b = 1, T = 0.

    Args:
        seed: of the first; the others follow.
        run_on: seconds that each runs after a tumble.
        period: of the brain (s).
    """
    source = np.random.default_rng([seed, 31])
    robot, every = bacterium(), round(STRIDE / STEP)
    paths, running = [], []
    for number in range(count):
        x, y = source.uniform(-SIZE / 2, SIZE / 2, 2).tolist()
        behavior = RunAndTumble(stimulus=_smelling(attractant), signal=1.0, turn=1.0, run_on=run_on)
        result = run(
            Brain([behavior], period=period),
            robot=robot,
            arena="empty",
            seconds=seconds,
            seed=seed + number,
            pose=(x, y, float(source.uniform(-math.pi, math.pi))),
        )
        assert result.truth is not None
        paths.append(np.column_stack((result.truth.x, result.truth.y))[::every])
        running.append(np.mean([left == right for _, _, left, right in result.record.steps]))
    return Swarm(np.stack(paths, axis=1), float(np.mean(running)))


def _smelling(attractant: Attractant) -> Callable[[Robot], float]:
    """X where the robot is, by its exact odometer."""
    return lambda robot: attractant(robot.odometer.x, robot.odometer.y, robot.time)


def positions(group: Swarm) -> dict[str, Floats]:
    """Columns of the data."""
    return {"x0": group.begun[:, 0], "y0": group.begun[:, 1], "x": group.ended[:, 0], "y": group.ended[:, 1]}


def begin_and_end(figure: Figure, group: Swarm, seconds: float, title: str = "") -> Iterator[tuple[Axes, Floats]]:
    """Axes for the beginning and for the end, and the bacteria's positions then."""
    names = ("begin", f"after {seconds:g} s")
    for axes, at, name in zip(figure.subplots(1, 2), (group.begun, group.ended), names, strict=True):
        axes.set(title=title + name, xlabel="x (m)", ylabel="y (m)", aspect="equal", xlim=(-6, 6), ylim=(-6, 6))
        yield axes, at


def draw_circle(axes: Axes, radius: float, middle: tuple[float, float] = (0.0, 0.0), **look: Any) -> None:
    """A circle of 100 points."""
    turn = np.linspace(0, 2 * np.pi, 100)
    axes.plot(middle[0] + radius * np.cos(turn), middle[1] + radius * np.sin(turn), **look)


def _draw_swarm(figure: Figure, group: Swarm, title: str) -> None:
    for axes, at in begin_and_end(figure, group, SECONDS, f"{title}, "):
        axes.plot(*at.T, ".", markersize=4)
        draw_circle(axes, SPREAD, linestyle="--", color="0.6", label="width of the attractant")
    axes.legend(loc="upper right", fontsize=9)


@experiment("E31", robot="arsim, as narrow as a bacterium", slow=True)
def accumulation(seed: int) -> Outcome:
    """A hundred bacteria find the attractant

    In the notes: section 4.4.2, Fig. 4.2

    Figure: 100 bacteria in a Gaussian of attractant at the beginning and after 10 s; dashed: its width.

    Expected: As Fig. 4.2: mean distance below 0.3 of the first, 85 % within the width; without, it stays (± 5 %).
    """
    first = trial_seeds(seed, COUNT)[0]
    group = swarm(first, gaussian)
    control = swarm(first + COUNT, uniform)
    measured = [
        Measured("mean distance against the beginning", group.ratio, most=0.3),
        Measured("share within the width at the end", group.share, least=0.85),
        about("the same ratio in uniform attractant", control.ratio, 1.0, 0.05),
    ]
    return Outcome(measured, positions(group), lambda figure: _draw_swarm(figure, group, "attractant"))


@experiment("E32", robot="arsim, as narrow as a bacterium", slow=True)
def trap(seed: int) -> Outcome:
    """Bacteria that tumble on the spot do not gather

    In the notes: section 4.4.2, Fig. 4.2

    Figure: The same bacteria, but they do not run after a tumble unless U > 0: those whose utility has fallen to
    zero stay.

    Expected: With T = 0 a tumble never ends: at most 1 % of the steps are runs, the mean distance stays (± 5 %).
    """
    group = swarm(trial_seeds(seed, COUNT)[0] + 2 * COUNT, gaussian, run_on=0.0)
    measured = [
        Measured("share of steps that were runs", group.running, most=0.01),
        about("mean distance against the beginning", group.ratio, 1.0, 0.05),
    ]
    return Outcome(measured, positions(group), lambda figure: _draw_swarm(figure, group, "no run after a tumble"))
