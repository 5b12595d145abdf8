"""`boebot.evolve(...)`: parameters of a brain by CMA-ES (Hansen, arXiv:1604.00772), as the package cma has it.

    out/generation-000/     a sweep: its points are the candidates, each at all arenas, starts and seeds
        BRAIN-evolved.toml  the best candidate of all
        test/               a sweep: that file and the brain by hand, at arenas and seeds that no candidate has met
        curve.png

What comes next depends on the rows and on the file alone. So an evolution that was stopped is done again from its
beginning, and what its folders hold is not run twice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np
import typer

from boebot import missing
from boebot.cli import options, output
from boebot.errors import BoebotError
from boebot.rates import Mean, mean_of
from boebot.record.figures import counted
from boebot.record.run_folder import make_folder
from boebot.running.brain_parameters import in_force
from boebot.running.loop import execute
from boebot_campaign import engine, evolve_file, kept, rows, toml_brain
from boebot_campaign.command import Out, Scheduler, Workers, shown
from boebot_campaign.evolve_file import Evolve
from boebot_campaign.plan import Plan
from boebot_campaign.report import saved
from boebot_campaign.sweep import check_call

SIGMA = 0.3  # of the way between the bounds: how far the first candidates are from the brain by hand
WORST = -np.inf  # fitness of a candidate of which a run has no figures


@dataclass(frozen=True)
class Generation:
    """A point of the curve: fitness, the more the better. `mean`: of the candidates all of whose runs have figures.
    `best_so_far`: the brain by hand is among them."""

    best: float
    mean: float | None
    best_so_far: float


class Best(NamedTuple):
    """A candidate."""

    fitness: float
    generation: int
    candidate: int


@dataclass(kw_only=True)
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
    curve: list[Generation] = field(default_factory=list)
    by_hand: float = WORST
    pairs: int = 0
    difference: Mean | None = None


def evolve(
    file: str | Path | None = None,
    *,
    out: str | Path | None = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
    **keys: Any,
) -> Evolution:
    """Finds parameters with which a brain does better, and says how much better where it has not been.

    Args:
        file: evolve.toml; or its keys by name, as of `boebot.sweep`.
        out, scheduler, workers: as of `boebot.sweep`.
        progress: is called with the number of runs that are done.

    Raises:
        BoebotError: in one sentence, before the first run where the file or the cluster is wrong. What is done stays.
        KeyboardInterrupt: Ctrl-C; what is done stays, and the same call goes on.
    """
    check_call("an evolution", file, keys, out)
    asked = evolve_file.made(keys) if file is None else evolve_file.read(Path(file))
    folder = Path(out if out is not None else Path(str(file)).stem)
    make_folder(folder)
    with engine.Workers(scheduler, workers, folder / engine.LOG) as ours:
        return _Work(asked, folder, ours, progress or (lambda _: None)).all()


class _Work:
    """An evolution on its way."""

    def __init__(self, asked: Evolve, out: Path, workers: engine.Workers, told: Callable[[int], object]) -> None:
        self._asked, self._out, self._workers, self._told = asked, out, workers, told
        self._cma = missing.imported("cma", "an evolution", "cma", "learn")
        self._runs = 0
        self._best = Best(WORST, 0, 0)
        brain = out / f"{Path(asked.loaded.name).stem}-evolved.toml"
        self._done = Evolution(folder=out, brain=brain, picture=out / "curve.png")

    def all(self) -> Evolution:
        for start in range(self._asked.given.restarts + 1):
            self._from(start)
        if self._best.fitness == WORST:
            raise BoebotError(f"no candidate has figures of all its runs; see the rows in {self._out}")
        self._write_best()
        self._test()
        _draw(self._done)
        return self._done

    def _from(self, start: int) -> None:
        """CMA-ES from the brain by hand, or in a later start from anywhere with twice as many candidates."""
        given, hand = self._asked.given, self._asked.by_hand
        chance = np.random.default_rng((given.seed, start))
        options = {"bounds": [0, 1], "popsize": given.population << start, "verbose": -9, "seed": np.nan}
        options["randn"] = lambda *shape: chance.standard_normal(shape)
        search = self._cma.CMAEvolutionStrategy(chance.random(len(hand)) if start else hand, SIGMA, options)
        for _ in range(given.generations):
            if search.stop():
                break
            candidates = search.ask()
            search.tell(candidates, -self._generation(np.clip(candidates, 0, 1)))

    def _generation(self, points: np.ndarray) -> np.ndarray:
        """The fitness of each candidate, after one more line of the curve."""
        number, count = len(self._done.curve), len(points)
        if number == 0:
            points = np.vstack([points, self._asked.by_hand])
        plan = msgspec.structs.replace(self._asked.plan, points=len(points))
        values = self._fitness(_folder(number), plan, points)
        means: np.ndarray = values.reshape(plan.sizes[0], len(points), -1).mean(axis=(0, 2))
        means[np.isnan(means)] = WORST
        if means.max() > self._best.fitness:
            self._best = Best(float(means.max()), number, int(means.argmax()))
        if number == 0:
            self._done.by_hand = float(means[-1])
        means = means[:count]
        finite = means[means > WORST]
        mean = float(finite.mean()) if len(finite) else None
        self._done.curve.append(Generation(float(means.max()), mean, self._best.fitness))
        return means

    def _fitness(self, name: str, plan: Plan, points: np.ndarray | None = None) -> np.ndarray:
        """Of each row of a sweep, in order, after it is run; nan: it has no figures."""
        with kept.locked(self._out / name, plan, points) as folder:
            self._workers.run(folder, lambda done: self._told(self._runs + done))
            folder.merge()
            self._runs += plan.count
            self._told(self._runs)
            return np.array([self._asked.fitness(row, folder.path) for row in folder.table().to_pylist()])

    def _write_best(self) -> None:
        """Writes its file, and runs it once, at the first arena, start and seed. Raises BoebotError: that run is
        not the candidate's."""
        folder = kept.Folder(self._out / _folder(self._best.generation))
        row = self._best.candidate * (folder.plan.count // folder.plan.sizes[0] // folder.plan.points)
        case = folder.plan.case(row, folder.points)
        comment = f"{self._asked.loaded.name}, evolved: fitness {self._best.fitness:.4g} in training, by boebot evolve"
        with in_force(self._asked.loaded, case.parameters):
            text = toml_brain.text(self._asked.loaded, comment, self._asked.robot, self._asked.arena)
        kept.write_whole(self._done.brain, lambda part: part.write_text(text, encoding="utf-8"))
        request = rows.request_of(folder, case)
        member = replace(request.members[0], brain=self._done.brain, parameters=None)
        expected = folder.table(["hash"])["hash"][row].as_py()
        if execute(replace(request, members=[member])).robots[0].hash != expected:
            raise BoebotError(f"{self._done.brain} does not run as row {row} of {folder.path}, of which it was made")

    def _test(self) -> None:
        plan = msgspec.structs.replace(
            self._asked.test, brains=[*self._asked.test.brains, str(self._done.brain.absolute())]
        )
        values = self._fitness("test", plan).reshape(plan.sizes[0], 2, -1)
        found = (values[:, 1] - values[:, 0]).ravel()
        found = found[~np.isnan(found)]
        self._done.pairs, self._done.difference = len(found), mean_of(found) if len(found) else None


def in_words(done: Evolution) -> str:
    """What came of the test."""
    if done.difference is None:
        return "no run of both has figures"
    (mean, least, most), pairs = done.difference, counted(done.pairs, "pair", "pairs")
    if np.isinf(most):
        return f"{mean:+.2f} beside by hand: nothing is shown by {pairs}"
    verdict = "nothing is shown: the interval includes 0" if least <= 0 <= most else "better" if mean > 0 else "worse"
    return f"{mean:+.2f} beside by hand ({least:+.2f} to {most:+.2f} at 95 %, {pairs}): {verdict}"


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


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="How to evolve: docs/how-to/evolve.md has its keys.")],
    out: Out = None,
    scheduler: Scheduler = None,
    workers: Workers = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check all, say how many runs it is, and run none.")
    ] = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Find parameters with which a brain does better, as a file says.

    Stopped anywhere, the same command goes on where it was. The best brain is a TOML file that runs on any board."""
    asked, folder = evolve_file.read(file), out or Path(file.stem)
    if dry_run:
        output.print_json({"runs": asked.most_runs}) if json else output.line(f"at most {asked.most_runs:,} runs")
        return
    with shown("evolve", folder, asked.most_runs, quiet or json) as told:
        done = evolve(file, out=folder, scheduler=scheduler, workers=workers, progress=told)
    if json:
        output.print_json(msgspec.to_builtins(done, enc_hook=str))
    elif not quiet:
        output.line(f"fitness in training {done.curve[-1].best_so_far:.2f}, by hand {done.by_hand:.2f}")
        output.line(f"in the test {in_words(done)}")
        output.line(f"best brain: {done.brain}")
        output.line(f"picture: {done.picture}")
