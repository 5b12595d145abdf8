"""Utility functions found by evolution, and what performance is: section 8.2 of the notes and the opening of chapter 8.

A toy: a robot patrols a place that is 5 s away from its charger for 300 s. Its
battery, E = 1 at first, loses 0.02 in each second and gains 0.1 while the robot charges; at E = 0 the robot is dead.
Two behaviors: B1 patrol with u_1 = tanh 0.5, and B2 charge, which goes to the charger and stays there, with

    τ du_2/dt + u_2 = tanh(b + w_E E + w_on z_on),   z_on = 1 on the charger.                       (8.4)

Performance counts the time of patrol in its place, and nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from boebot.experiments.experiment import Floats, Measured, Outcome, Progress, about, exactly, experiment, with_progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


PATROL = math.tanh(0.5)  # u_1
DRAIN, CHARGE = 0.02, 0.1  # 1/s
WAY = 5.0  # s
SECONDS, STEP = 300.0, 0.1


class Genes(NamedTuple):
    """The utility function of charging."""

    b: float
    w_energy: float
    w_on: float
    log_tau: float = math.log(0.3)


NEVER, ALWAYS = Genes(-9.0, 0.0, 0.0), Genes(9.0, 0.0, 0.0)
THRESHOLD = Genes(1.5, -3.2, 0.0)
BY_HAND = Genes(1.5, -3.2, 1.9)


@dataclass(frozen=True)
class Lives:
    """What robots of different genes did; arrays have one entry per robot."""

    work: Floats
    """s"""
    alive: NDArray[np.bool_]
    """at the end"""
    switches: NDArray[np.int_]
    times: Floats
    """s; with a trace only"""
    trace: dict[str, Floats]
    """by name, shape (times, robots): energy, utility, place (s from the charger), work (s), charging"""


def live(genes: Floats, *, traced: bool = False, seconds: float = SECONDS) -> Lives:
    """Robots with genes of shape (robots, 4), all at once."""
    b, w_energy, w_on, log_tau = genes.T
    lag = np.exp(-STEP / np.exp(log_tau))
    count = len(genes)
    energy, place, work = np.ones(count), np.full(count, WAY), np.zeros(count)
    alive, switches = np.ones(count, dtype=bool), np.zeros(count, dtype=int)
    u = np.tanh(b + w_energy)
    charges = u > PATROL
    rows: list[tuple[Floats, ...]] = []
    for _ in range(round(seconds / STEP)):
        on = place <= 1e-9
        settled = np.tanh(b + w_energy * energy + w_on * on)
        u = settled + (u - settled) * lag  # (8.4), held over the step
        wanted = u > PATROL
        switches += (wanted != charges) & alive
        charges = wanted
        work += np.where(alive & ~charges & (place >= WAY - 1e-9), STEP, 0.0)
        gain = np.where(charges & on, CHARGE, -DRAIN) * STEP
        energy = np.where(alive, np.minimum(energy + gain, 1.0), energy)
        place = np.where(alive, np.clip(place + np.where(charges, -STEP, STEP), 0.0, WAY), place)
        alive &= energy > 1e-9
        if traced:
            rows.append((energy, u, place, work.copy(), (charges & on & alive).astype(float)))
    names = ("energy", "utility", "place", "work", "charging")
    trace = dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True)) if rows else {}
    times: Floats = np.arange(1, len(rows) + 1, dtype=np.float64) * STEP
    return Lives(work, alive, switches, times, trace)


POPULATION, GENERATIONS, RESTARTS = 30, 40, 3
TOURNAMENT, CROSSOVER, MUTATION = 0.75, 0.8, 0.5  # chance that the better one wins; that genes mix; step
SPREAD = 2.0  # of the first genes


def offspring(genes: Floats, fitness: Floats, source: np.random.Generator) -> Floats:
    """The next generation: the best as it is; the others by tournaments of two, uniform crossover, and mutation of one
    gene each on average by a normal step."""
    count, width = genes.shape
    rivals = source.integers(count, size=(count, 2, 2))
    better = fitness[rivals[..., 0]] >= fitness[rivals[..., 1]]
    first = better == (source.random((count, 2)) < TOURNAMENT)
    mother, father = genes[np.where(first, rivals[..., 0], rivals[..., 1])].swapaxes(0, 1)
    mixed = (source.random((count, 1)) < CROSSOVER) & (source.random((count, width)) < 0.5)
    children = np.where(mixed, father, mother)
    mutated = source.random((count, width)) < 1 / width
    children = children + np.where(mutated, source.normal(0.0, MUTATION, (count, width)), 0.0)
    children[0] = genes[fitness.argmax()]
    children[:, 3] = np.clip(children[:, 3], math.log(0.1), math.log(3.0))
    return np.asarray(children)


@dataclass(frozen=True)
class Evolved:
    """What evolution came to."""

    best: Floats
    """performance of the best, shape (generations, restarts)"""
    genes: Floats
    """of the best of all"""


def evolve(
    seed: int, progress: Progress = lambda share: None, generations: int = GENERATIONS, seconds: float = SECONDS
) -> Evolved:
    """All restarts, each with its own generator."""
    sources = [np.random.default_rng([seed, number]) for number in range(RESTARTS)]
    genes = np.stack([source.normal(0.0, SPREAD, (POPULATION, 4)) for source in sources])
    genes[..., 3] = math.log(0.3) + genes[..., 3] / 4
    genes[..., 3] = np.clip(genes[..., 3], math.log(0.1), math.log(3.0))
    best = []
    for _ in with_progress(range(generations), progress):
        fitness = live(genes.reshape(-1, 4), seconds=seconds).work.reshape(RESTARTS, POPULATION)
        best.append(fitness.max(axis=1))
        winner = genes.reshape(-1, 4)[fitness.argmax()]
        genes = np.stack([offspring(*each) for each in zip(genes, fitness, sources, strict=True)])
    return Evolved(np.array(best), winner)


@experiment(
    "E65",
    title="Evolution finds when to charge",
    source="section 8.2 and Wahde (2003)",
    caption="Left: performance of the best individual over the generations of three restarts; dashed: never "
    "charging. Right: utilities of the best of all over time, its battery, and where it is.",
    criterion="A toy, whose figures are chosen: patrol counts only in its place, 5 s from the charger, where the robot "
    "starts; going there and back costs energy; a charging robot loses none.",
    slow=True,
)
def evolution(seed: int, progress: Progress) -> Outcome:
    evolved = evolve(seed, progress)
    known = live(np.array([NEVER, ALWAYS, THRESHOLD, BY_HAND]))
    best = live(evolved.genes[None], traced=True)
    worse = int((np.diff(evolved.best, axis=0) < -1e-9).sum())
    measured = [
        Measured("performance of the best of three restarts", float(best.work[0]), "s", least=190.0),
        exactly("the best is alive at the end (1: yes)", float(best.alive[0]), 1),
        exactly("generations in which a restart's best got worse", worse, 0),
        about("never charging: performance", known.work[0], 50.0, 0.1, "s"),
        exactly("never charging: alive at the end", float(known.alive[0]), 0),
        about("always charging: performance", known.work[1], 0.0, 0.1, "s"),
        about("without z_on: performance", known.work[2], 32.0, 5.0, "s"),
        about("without z_on: switches", float(known.switches[2]), 147, 15),
        about("by hand: performance", known.work[3], 191.5, 5.0, "s"),
        exactly("by hand: switches", float(known.switches[3]), 13),
    ]
    data = {"generation": np.arange(len(evolved.best), dtype=np.float64)}
    data |= {f"best_{number + 1}_s": evolved.best[:, number] for number in range(RESTARTS)}

    def draw(figure: Figure) -> None:
        axes = figure.subplot_mosaic([["best", "u"], ["best", "energy"], ["best", "place"]], height_ratios=(2, 1, 1))
        for number in range(RESTARTS):
            axes["best"].plot(evolved.best[:, number], label=f"restart {number + 1}")
        axes["best"].axhline(50, linestyle="--", color="0.6")
        axes["best"].set(xlabel="generation", ylabel="performance of the best (s of patrol)", ylim=(0, 220))
        axes["best"].legend(loc="lower right")
        _draw_life(axes["u"], axes["energy"], axes["place"], best)

    return Outcome(measured, data, draw)


def _draw_life(utilities: Axes, energy: Axes, place: Axes, lives: Lives) -> None:
    utilities.plot(lives.times, np.full(len(lives.times), PATROL), label="u1 patrol")
    utilities.plot(lives.times, lives.trace["utility"][:, 0], label="u2 charge")
    utilities.set(ylabel="utility", ylim=(-1.05, 1.05), xticklabels=())
    utilities.legend(loc="lower right", fontsize="x-small")
    energy.plot(lives.times, lives.trace["energy"][:, 0], color="C2")
    energy.set(ylabel="battery E", ylim=(0, 1.05), xticklabels=())
    place.plot(lives.times, lives.trace["place"][:, 0], color="C3")
    place.set(xlabel="time (s)", ylabel="way to\ncharger (s)", ylim=(-0.3, WAY + 0.3))


def planned_work(low: float, high: float, times: Sequence[float]) -> Floats:
    """Performance until some times of a robot that goes to charge at E = low and goes back to work at E = high, at once
    and exactly: the closed form that the toy comes near to."""
    first, charging = (1.0 - low) / DRAIN, (high - (low - WAY * DRAIN)) / CHARGE
    again = (high - WAY * DRAIN - low) / DRAIN
    cycle = WAY + charging + WAY + again
    found = []
    for time in times:
        whole, rest = divmod(max(time - first, 0.0), cycle)
        found.append(min(time, first) + whole * again + max(0.0, rest - (cycle - again)))
    return np.array(found)


@experiment(
    "robot-economics",
    title="Charging earns nothing, and yet who charges earns most",
    source="chapter 8, opening",
    caption="Performance (time of patrol) until each instant of three robots: one that never charges, one that "
    "always does, and one that schedules it by utility; grey: when that one charges. Dotted: its closed form.",
    criterion="Patrolling alone empties the battery in 1 / 0.02 per s = 50 s. Utility by hand goes to charge where "
    "1.5 - 3.2 E = 0.5 and leaves where 1.5 - 3.2 E + 1.9 = 0.5: while E goes evenly, a utility lags by its 0.3 s, "
    "so that E goes on by 0.02 per s and 0.1 per s · 0.3 s. From these two levels follow cycle and performance; 2 % "
    "is for steps and bends.",
)
def economics(seed: int, progress: Progress) -> Outcome:
    names = ("never", "always", "by utility")
    lives = live(np.array([NEVER, ALWAYS, BY_HAND]), traced=True)
    work, charging = lives.trace["work"], lives.trace["charging"][:, 2] > 0
    lag = math.exp(BY_HAND.log_tau)
    low, high = (BY_HAND.b - 0.5) / -BY_HAND.w_energy, (BY_HAND.b + BY_HAND.w_on - 0.5) / -BY_HAND.w_energy
    planned = planned_work(low - DRAIN * lag, high + CHARGE * lag, lives.times.tolist())
    earned = np.diff(work[:, 2], prepend=0.0)[charging].sum()
    overtakes = lives.times[np.flatnonzero(work[:, 2] > work[:, 0] + 1e-9)[:1]]
    expected = np.append(lives.times[planned > 50.0], math.nan)[0]
    measured = [
        about("never charging: performance", work[-1, 0], 50.0, 0.1, "s"),
        about("always charging: performance", work[-1, 1], 0.0, 0.1, "s"),
        about("by utility: performance", work[-1, 2], float(planned[-1]), 0.02 * planned[-1], "s"),
        exactly("by utility: alive at the end (1: yes)", float(lives.alive[2]), 1),
        exactly("by utility: earned while it charges", float(earned), 0, "s"),
        Measured("by utility: share of the time on the charger", float(charging.mean()), "", 0.1, 0.3),
        Measured("after 50 s: never charging is ahead by", float(work[499, 0] - work[499, 2]), "s", least=5.0),
        about("by utility overtakes it at", overtakes[0] if len(overtakes) else math.nan, float(expected), 2.0, "s"),
    ]

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, sharex=True, height_ratios=(3, 1))
        for index, name in enumerate(names):
            upper.plot(lives.times, work[:, index], label=name)
            lower.plot(lives.times, lives.trace["energy"][:, index])
        upper.plot(lives.times, planned, ":", color="black", label="closed form")
        for axes in (upper, lower):
            axes.fill_between(
                lives.times, 0, 1, where=list(charging), color="0.9", transform=axes.get_xaxis_transform()
            )
        upper.set(ylabel="performance (s of patrol)")
        upper.legend()
        lower.set(xlabel="time (s)", ylabel="battery E", xlim=(0, SECONDS), ylim=(0, 1.05))

    data = {"time_s": lives.times} | {f"work_{name.replace(' ', '_')}_s": work[:, i] for i, name in enumerate(names)}
    return Outcome(measured, data, draw)
