"""Utility functions found by evolution: section 8.2 of the notes.

A toy: a robot patrols a place that is 5 s away from its charger for 300 s. Its battery, E = 1 at first, loses 0.02 in
each second and gains 0.1 while the robot charges; at E = 0 the robot is dead. Two behaviors: B1 patrol with u_1 =
tanh 0.5, and B2 charge, which goes to the charger and stays there, with

    τ du_2/dt + u_2 = tanh(b + w_E E + w_on z_on),   z_on = 1 on the charger.                       (8.4)

Performance counts the time of patrol in its place, and nothing else. The toy is of this file; utilities are the kit's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from boebot.brain import Utility
from boebot.brain.utility import Utilities
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, about, exactly, experiment

PATROL = Utility(b=0.5)
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
    """by name, shape (times, robots): energy, utility of charging, place (s from the charger), work (s)"""


def utilities_of(genes: Floats) -> Utilities:
    """The kit's utilities of robots with genes of shape (robots, 4): u_1, u_2 of the first, of the second, ..., and
    their state variables, E and z_on of the first, of the second, ..."""
    functions, variables = [], []
    for number, one in enumerate(Genes(*row) for row in genes.tolist()):
        energy, on = f"energy {number}", f"on {number}"
        functions += [PATROL, Utility(b=one.b, w={energy: one.w_energy, on: one.w_on}, tau=math.exp(one.log_tau))]
        variables += [energy, on]
    return Utilities(functions, variables)


def live(genes: Floats, *, traced: bool = False, seconds: float = SECONDS) -> Lives:
    """Robots with genes of shape (robots, 4), all at once; each does what has the greater utility."""
    count = len(genes)
    utilities = utilities_of(genes)
    energy, place, work = np.ones(count), np.full(count, WAY), np.zeros(count)
    alive, switches = np.ones(count, dtype=bool), np.zeros(count, dtype=int)
    z = np.zeros((count, 2))
    z[:, 0] = energy
    utilities.start(z.ravel().tolist())
    charges = _wants_to_charge(utilities)
    rows: list[tuple[Floats, ...]] = []
    for _ in range(round(seconds / STEP)):
        on = place <= 1e-9
        z[:, 0], z[:, 1] = energy, on
        utilities.advance(z.ravel().tolist(), STEP)
        wanted = _wants_to_charge(utilities)
        switches += (wanted != charges) & alive
        charges = wanted
        work += np.where(alive & ~charges & (place >= WAY - 1e-9), STEP, 0.0)
        gain = np.where(charges & on, CHARGE, -DRAIN) * STEP
        energy = np.where(alive, np.minimum(energy + gain, 1.0), energy)
        place = np.where(alive, np.clip(place + np.where(charges, -STEP, STEP), 0.0, WAY), place)
        alive &= energy > 1e-9
        if traced:
            rows.append((energy, np.array(utilities.values[1::2]), place, work.copy()))
    names = ("energy", "utility", "place", "work")
    trace = dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True)) if rows else {}
    times: Floats = np.arange(1, len(rows) + 1, dtype=np.float64) * STEP
    return Lives(work, alive, switches, times, trace)


def _wants_to_charge(utilities: Utilities) -> NDArray[np.bool_]:
    """Of each robot: u_2 > u_1."""
    values = np.array(utilities.values)
    return np.asarray(values[1::2] > values[::2])


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


def evolve(seed: int, generations: int = GENERATIONS, seconds: float = SECONDS) -> Evolved:
    """All restarts, each with its own generator."""
    sources = [np.random.default_rng([seed, number]) for number in range(RESTARTS)]
    genes = np.stack([source.normal(0.0, SPREAD, (POPULATION, 4)) for source in sources])
    genes[..., 3] = math.log(0.3) + genes[..., 3] / 4
    genes[..., 3] = np.clip(genes[..., 3], math.log(0.1), math.log(3.0))
    best = []
    for _ in range(generations):
        fitness = live(genes.reshape(-1, 4), seconds=seconds).work.reshape(RESTARTS, POPULATION)
        best.append(fitness.max(axis=1))
        winner = genes.reshape(-1, 4)[fitness.argmax()]
        genes = np.stack([offspring(*each) for each in zip(genes, fitness, sources, strict=True)])
    return Evolved(np.array(best), winner)


@experiment("E65", slow=True)
def evolution(seed: int) -> Outcome:
    """Evolution finds when to charge

    In the notes: section 8.2 and Wahde (2003)

    Figure: Left: performance of the best individual over the generations of three restarts; dashed: never charging.
    Right: utilities of the best of all over time, its battery, and where it is.

    Expected: A toy, whose figures are chosen: patrol counts only in its place, 5 s from the charger; going there
    and back costs energy. Of the 30 restarts of the seeds 1 to 10, 17 came to 190 s (39 to 73 %), the others stayed
    mostly at never charging, 50 s: all of three do so at one seed in twelve, not at 1 to 10. Without selection, or
    without mutation, the best gets worse or stays where chance put it.
    """
    evolved = evolve(seed)
    known = live(np.array([NEVER, ALWAYS, THRESHOLD, BY_HAND]))
    best = live(evolved.genes[None], traced=True)
    worse = int((np.diff(evolved.best, axis=0) < -1e-9).sum())
    measured = [
        Measured("performance of the best of three restarts", float(best.work[0]), "s", least=190.0),
        Measured("restarts that come to 190 s, of three", float((evolved.best[-1] >= 190.0).sum())),
        Measured("best of the first generation", float(evolved.best[0].max()), "s"),
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
            axes["best"].plot(evolved.best[:, number], lw=4 - 1.4 * number, label=f"restart {number + 1}")
        axes["best"].axhline(50, linestyle="--", color="black", lw=1, label="never charging")
        axes["best"].set(xlabel="generation", ylabel="performance of the best (s of patrol)", ylim=(0, 220))
        axes["best"].legend(loc="center right")
        _draw_life(axes["u"], axes["energy"], axes["place"], best)

    return Outcome(measured, data, draw)


def _draw_life(utilities: Axes, energy: Axes, place: Axes, lives: Lives) -> None:
    utilities.plot(lives.times, np.full(len(lives.times), math.tanh(PATROL.b)), label="u1 patrol")
    utilities.plot(lives.times, lives.trace["utility"][:, 0], label="u2 charge")
    utilities.set(ylabel="utility", ylim=(-1.05, 1.05), xticklabels=())
    utilities.legend(loc="lower right", fontsize="x-small")
    energy.plot(lives.times, lives.trace["energy"][:, 0], color="C2")
    energy.set(ylabel="battery E", ylim=(0, 1.05), xticklabels=())
    place.plot(lives.times, lives.trace["place"][:, 0], color="C3")
    place.set(xlabel="time (s)", ylabel="way to\ncharger (s)", ylim=(-0.3, WAY + 0.3))
