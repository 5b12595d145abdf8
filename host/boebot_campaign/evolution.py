"""`boebot.evolve(...)`: parameters of a brain by CMA-ES (Hansen, arXiv:1604.00772), as the package cma has it.

    out/evolve.json         what was asked
        generation-000/     a sweep: its points are the candidates, each at all arenas, starts and seeds
        BRAIN-evolved.toml  the best candidate of all
        test/               a sweep: that file and the brain by hand, at arenas and seeds that no candidate has met
        curve.png

What comes next depends on the rows and on the file alone. So an evolution that was stopped is done again from its
beginning, and what its folders hold is not run twice.
"""

from __future__ import annotations

import dataclasses
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import replace

from boebot import missing
from boebot.cli.ending import Detail
from boebot.errors import BoebotError
from boebot.rates import Mean, mean_of
from boebot.record.figures import counted
from boebot.running.brain_parameters import in_force
from boebot.running.loop import execute
from boebot_campaign import kept, rows, toml_brain
from boebot_campaign.command import command
from boebot_campaign.engine import Told, Workers
from boebot_campaign.evolve_file import Evolve
from boebot_campaign.plan import Plan
from boebot_campaign.report import Page, saved, tell
from boebot_campaign.sweep import function, run_plan

NAME, TEST = "evolve.json", "test"
SIGMA = 0.3  # of the way between the bounds: how far the first candidates are from the brain by hand
WORST = -np.inf  # fitness of a candidate of which a run has no figures


@dataclass(frozen=True)
class Generation:
    """A point of the curve: fitness, the more the better. The brain by hand is among the candidates of the first one.
    `mean`: of those all of whose runs have figures."""

    best: float
    mean: float | None
    best_so_far: float


@dataclass(frozen=True, kw_only=True)
class Evolution:
    """What came of it.

    Attributes:
        folder: where everything is.
        brain: the best one, as a file.
        picture: of the curve.
        by_hand: fitness of the brain as it was, in the first generation.
        pairs: runs of the test that have figures, of the best and of the brain as it was alike.
        difference: there, the best one's fitness less the other's at the same arena, start and seed; None: no pair.
    """

    folder: Path
    brain: Path
    picture: Path
    curve: list[Generation]
    by_hand: float
    pairs: int
    difference: Mean | None


def run_evolution(asked: Evolve, path: Path, workers: Workers, told: Told) -> Evolution:
    """All of it, in a folder that keeps what it was begun with."""
    with kept.held(path, NAME) as is_begun:
        if is_begun:
            before = kept.loaded(path / NAME, Evolve)
            goes_on = asked.restarts == 0 and asked.generations > before.plan.generations
            more = {"generations": asked.generations} if goes_on else {}
            kept.compare(path, replace(before, plan=replace(before.plan, **more)), asked)
        kept.keep(path / NAME, kept.Kept(version=kept.version(), plan=asked))
        return _Work(asked, path, workers, told).all()


evolve = function("evolve", Evolve, run_evolution)


class _Work:
    """An evolution on its way."""

    def __init__(self, asked: Evolve, out: Path, workers: Workers, told: Told) -> None:
        self._asked, self._out, self._workers, self._told = asked, out, workers, told
        self._runs = 0
        self._means: list[np.ndarray] = []  # of each generation: fitness by candidate, at the first's end by hand

    def all(self) -> Evolution:
        cma = missing.imported("cma", "an evolution", "cma", "learn")
        for start in range(self._asked.restarts + 1):
            self._from(cma, start)
        best = [float(means.max()) for means in self._means]
        if max(best) == WORST:
            raise BoebotError(f"no candidate has figures of all its runs; see the rows in {self._out}")
        brain = self._best(best.index(max(best)))
        pairs = self._test(brain)
        done = Evolution(
            folder=self._out,
            brain=brain,
            picture=self._out / "curve.png",
            curve=[Generation(best[at], _mean(means), max(best[: at + 1])) for at, means in enumerate(self._means)],
            by_hand=float(self._means[0][-1]),
            pairs=len(pairs),
            difference=mean_of(pairs) if len(pairs) else None,
        )
        _draw(done)
        return done

    def _from(self, cma: Any, start: int) -> None:
        """CMA-ES from the brain by hand, or in a later start from anywhere with twice as many candidates."""
        asked = self._asked
        chance = np.random.default_rng((asked.seed, start))
        options = {"bounds": [0, 1], "popsize": asked.population << start, "verbose": -9, "seed": np.nan}
        options["randn"] = lambda *shape: chance.standard_normal(shape)
        first = chance.random(len(asked.by_hand)) if start else asked.by_hand
        search = cma.CMAEvolutionStrategy(first, SIGMA, options)
        for _ in range(asked.generations):
            if search.stop():
                break
            candidates = search.ask()
            search.tell(candidates, -self._generation(np.clip(candidates, 0, 1)))

    def _generation(self, points: np.ndarray) -> np.ndarray:
        """The fitness of each candidate: the mean of its runs."""
        name, count = _folder(len(self._means)), len(points)
        if not self._means:
            points = np.vstack([points, self._asked.by_hand])
        plan = replace(self._asked.training, points=len(points))
        means = self._fitness(name, plan, points).reshape(plan.sizes[0], len(points), -1).mean(axis=(0, 2))
        means[np.isnan(means)] = WORST
        self._means.append(means)
        return np.asarray(means[:count])

    def _fitness(self, name: str, plan: Plan, points: np.ndarray | None = None) -> np.ndarray:
        """Of each row of a sweep, in order, after it is run; nan: it has no figures."""
        before = self._runs
        folder = run_plan(plan, self._out / name, self._workers, lambda done: self._told(before + done), points)
        self._runs += plan.count
        return np.array([self._asked.fitness_of(row, folder.path) for row in folder.table().to_pylist()])

    def _best(self, generation: int) -> Path:
        """The file of the best candidate of a generation, which is run once, at the first arena, start and seed. Raises
        BoebotError: that run is not the candidate's."""
        asked, means, folder = self._asked, self._means[generation], kept.Folder(self._out / _folder(generation))
        row = int(means.argmax()) * (folder.plan.count // folder.plan.sizes[0] // folder.plan.points)
        case = folder.plan.case(row, folder.points)
        comment = f"{asked.loaded.name}, evolved: fitness {means.max():.4g} in training, by boebot evolve"
        with in_force(asked.loaded, case.parameters):
            robot = _bundled(asked.all_robots[0], asked.loaded.robot)
            text = toml_brain.text(asked.loaded, comment, robot, _bundled(asked.all_arenas[0], asked.loaded.arena))
        brain = self._out / f"{Path(asked.loaded.name).stem}-evolved.toml"
        if not brain.is_file() or brain.read_text(encoding="utf-8") != text:
            shutil.rmtree(self._out / TEST, ignore_errors=True)  # of the best before there were more generations
            kept.write_whole(brain, lambda part: part.write_text(text, encoding="utf-8"))
        request = rows.request_of(folder, case)
        member = dataclasses.replace(request.members[0], brain=brain, parameters=None)
        expected = folder.table(["hash"])["hash"][row].as_py()
        if execute(dataclasses.replace(request, members=[member])).robots[0].hash != expected:
            raise BoebotError(f"{brain} does not run as row {row} of {folder.path}, of which it was made")
        return brain

    def _test(self, brain: Path) -> np.ndarray:
        """How much fitter it is than the brain by hand, of each pair of runs that both have figures."""
        plan = replace(self._asked.test, brains=[*self._asked.test.brains, str(brain.absolute())])
        values = self._fitness(TEST, plan).reshape(plan.sizes[0], 2, -1)
        found = (values[:, 1] - values[:, 0]).ravel()
        return np.asarray(found[~np.isnan(found)])


def in_words(done: Evolution) -> str:
    """What came of the test."""
    if done.difference is None:
        return "no run of both has figures"
    (mean, least, most), pairs = done.difference, counted(done.pairs, "pair", "pairs")
    if np.isinf(most):
        return f"{mean:+.2f} beside by hand: nothing is shown by {pairs}"
    verdict = "nothing is shown: the interval includes 0" if least <= 0 <= most else "better" if mean > 0 else "worse"
    return f"{mean:+.2f} beside by hand ({least:+.2f} to {most:+.2f} at 95 %, {pairs}): {verdict}"


def _bundled(given: str | None, own: str | None) -> str | None:
    """The name that a brain's file may say: of the one that was given, or else of the brain's own."""
    return own if given is None else given if Path(given).suffix != ".toml" else None


def _mean(means: np.ndarray) -> float | None:
    return float(np.mean(means[means > WORST])) if (means > WORST).any() else None


def _folder(generation: int) -> str:
    return f"generation-{generation:03}"


def _draw(done: Evolution) -> None:
    """Fitness over the generations, and in the title how the best does in the test. Raises BoebotError."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    panel = figure.subplots()
    lines = {"mean": ".", "best": ".", "best so far": "-"}
    for name, style in lines.items():
        panel.plot([getattr(one, name.replace(" ", "_")) for one in done.curve], style, label=name)
    panel.axhline(done.by_hand, color="#c2452d", linestyle="--", label="by hand")
    panel.set(xlabel="generation", ylabel="fitness in training")
    panel.set_title(f"in the test {in_words(done)}".replace(": ", ":\n"), fontsize=9)
    panel.xaxis.set_major_locator(MaxNLocator(integer=True))
    panel.legend(fontsize=8)
    saved(figure, done.picture)


@command(Evolve, run_evolution)
def evolve_command(done: Evolution, wanted: Detail) -> None:
    """Find parameters with which a brain does better, as a file says.

    Stopped anywhere, the same command goes on where it was. The best brain is a TOML file that runs on any board. The
    file is as docs/how-to/evolve.md says."""
    lines = [
        f"fitness in training {done.curve[-1].best_so_far:.2f}, by hand {done.by_hand:.2f}",
        f"in the test {in_words(done)}",
        f"best brain: {done.brain}",
    ]
    found = msgspec.to_builtins(done, enc_hook=str)
    tell(Page(done.picture, f"Evolution {done.folder.name}", [], lines, found), wanted)
