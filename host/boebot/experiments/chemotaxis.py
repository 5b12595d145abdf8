"""E. coli: running and tumbling by equation (4.1), Figs. 4.1 and 4.2, section 4.4.2 of the notes; E29 to E32."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from boebot.brain.leaky import LeakyIntegrator
from boebot.experiments.experiment import Floats, Measured, Outcome, Progress, about, exactly, experiment, with_progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STEP = 0.01  # s
SIZE, SPREAD, SPEED = 10.0, 2.5, 1.0  # side of the square, width of the attractant, speed of a run


def utility_of(stimulus: Floats, a: float, b: float, step: float) -> Floats:
    """U = X - V, dV/dt + a V = b X  (4.1), with V(0) = (b/a) X(0) and X held over each step."""
    memory = LeakyIntegrator(a, b, b / a * float(stimulus[0]))
    values = []
    for x in stimulus:
        values.append(float(x) - memory.value)
        memory.advance(float(x), step)
    return np.array(values)


@experiment(
    "E29",
    title="E. coli's utility follows a rise and a fall",
    source="section 4.4.2, equation (4.1), Fig. 4.1",
    caption="Left: concentration X of the attractant, a triangle. Right: utility U of running (B1), which is active "
    "while U > 0: between 1 s and 3 s (shaded).",
)
def triangle(seed: int, progress: Progress) -> Outcome:
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


@experiment(
    "E30",
    title="With b > a a constant attractant ends in tumbling",
    source="section 4.4.2, equation (4.1)",
    caption="Utility after a step of the attractant to 0.4 with a = 1, b = 1.5; dashed: its limit X (1 - b/a).",
)
def sign(seed: int, progress: Progress) -> Outcome:
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
        axes.axhline(-0.2, linestyle="--", color="0.6")
        axes.set(xlabel="time after the step (s)", ylabel="utility U of running")

    return Outcome(measured, {"time_s": times[::10], "u": values[::10]}, draw)


@dataclass(frozen=True)
class Swarm:
    """Bacteria after some time."""

    begun: Floats
    """positions at the beginning, shape (n, 2)"""
    ended: Floats
    """and at the end"""
    running: float
    """share of steps that were runs"""
    source: tuple[float, float] = (0.0, 0.0)
    """where the attractant's middle was at the end"""

    @property
    def ratio(self) -> float:
        """Mean distance from the middle at the end against that at the beginning."""
        return float(np.hypot(*self.ended.T).mean() / np.hypot(*self.begun.T).mean())

    @property
    def share(self) -> float:
        """Share of them within the attractant's width at the end."""
        return float((np.hypot(*self.ended.T) < SPREAD).mean())


def swarm(
    draw: np.random.Generator,
    *,
    uniform: bool = False,
    jitter: bool = True,
    count: int = 100,
    seconds: float = 10.0,
    drift: float = 0.0,
) -> Swarm:
    """Bacteria that run and tumble by (4.1), a = b = 1, T = 0, in a Gaussian of attractant.

    Args:
        uniform: the same attractant everywhere: a control.
        jitter: a tumble also moves by one step, which sets a bacterium free from where U has fallen to just below 0.
        drift: speed of the attractant's middle, along x.
    """

    def attractant(at: Floats, time: float) -> Floats:
        if uniform:
            return np.full(len(at), 0.5)
        return np.asarray(np.exp(-((at - (drift * time, 0.0)) ** 2).sum(axis=1) / (2 * SPREAD**2)))

    at = draw.uniform(-SIZE / 2, SIZE / 2, (count, 2))
    begun = at.copy()
    heading = draw.uniform(-np.pi, np.pi, count)
    memory = attractant(at, 0.0)
    lag = math.exp(-STEP)
    runs = 0
    for step in range(round(seconds / STEP)):
        x = attractant(at, step * STEP)
        run = x - memory > 0
        heading = np.where(run, heading, draw.uniform(-np.pi, np.pi, count))
        moves = run | jitter
        at += np.where(moves, SPEED * STEP, 0.0)[:, None] * np.stack((np.cos(heading), np.sin(heading)), axis=1)
        memory = x + (memory - x) * lag
        runs += int(run.sum())
    return Swarm(begun, at, runs / (count * round(seconds / STEP)), (drift * seconds, 0.0))


def positions(group: Swarm) -> dict[str, Floats]:
    """Columns of the data."""
    return {"x0": group.begun[:, 0], "y0": group.begun[:, 1], "x": group.ended[:, 0], "y": group.ended[:, 1]}


def begin_and_end(figure: Figure, group: Swarm, title: str = "") -> Iterator[tuple[Axes, Floats]]:
    """Axes for the beginning and for the end, and the bacteria's positions then."""
    for axes, at, name in zip(figure.subplots(1, 2), (group.begun, group.ended), ("begin", "after 10 s"), strict=True):
        axes.set(title=title + name, xlabel="x", ylabel="y", aspect="equal", xlim=(-6, 6), ylim=(-6, 6))
        yield axes, at


def draw_circle(axes: Axes, radius: float, middle: tuple[float, float] = (0.0, 0.0), **look: Any) -> None:
    """A circle of 100 points."""
    turn = np.linspace(0, 2 * np.pi, 100)
    axes.plot(middle[0] + radius * np.cos(turn), middle[1] + radius * np.sin(turn), **look)


def _draw_swarm(figure: Figure, group: Swarm, title: str) -> None:
    for axes, at in begin_and_end(figure, group, f"{title}, "):
        axes.plot(*at.T, ".", markersize=4)
        draw_circle(axes, SPREAD, linestyle="--", color="0.6")


@experiment(
    "E31",
    title="A hundred bacteria find the attractant",
    source="section 4.4.2, Fig. 4.2",
    caption="100 bacteria in a Gaussian of attractant at the beginning and after 10 s; dashed: its width.",
)
def accumulation(seed: int, progress: Progress) -> Outcome:
    groups, controls = [], []
    for number in with_progress(range(10), progress):
        groups.append(swarm(np.random.default_rng([seed, number])))
        controls.append(swarm(np.random.default_rng([seed, 100 + number]), uniform=True))
    measured = [
        Measured("mean distance against the beginning", float(np.mean([one.ratio for one in groups])), most=0.3),
        Measured("share within the width at the end", float(np.mean([one.share for one in groups])), least=0.85),
        about("the same ratio in uniform attractant", float(np.mean([one.ratio for one in controls])), 1.0, 0.05),
    ]
    return Outcome(measured, positions(groups[0]), lambda figure: _draw_swarm(figure, groups[0], "attractant"))


@experiment(
    "E32",
    title="Bacteria that tumble on the spot do not gather",
    source="section 4.4.2, Fig. 4.2",
    caption="The same bacteria, but a tumble does not move them: those whose utility has fallen to zero stay for ever.",
)
def trap(seed: int, progress: Progress) -> Outcome:
    group = swarm(np.random.default_rng([seed, 7]), jitter=False)
    measured = [
        Measured("share of steps that were runs", group.running, most=0.01),
        about("mean distance against the beginning", group.ratio, 1.0, 0.05),
    ]
    return Outcome(measured, positions(group), lambda figure: _draw_swarm(figure, group, "no jitter"))
