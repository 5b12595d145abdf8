"""`boebot matters FILE`: what a brain's result hangs on.

First each imperfection that changes something of the robot is off or as it is in use, in a two-level design that is run
at each seed. Its effect is how much more the figure is where it is in use, over all settings of the others. What is
drawn for a robot makes one better and the next one worse: so there is the effect at one seed, too, as a root mean
square. An imperfection counts where the interval of its mean effect leaves out 0 (Student's t over seeds), or where its
effects at one seed exceed what nothing explains (F test); this is wrong for any of them in 1 of 20 tables (Bonferroni).

The five that count most are then varied together with the seed: Sobol indices (Saltelli et al., Computer Physics
Communications 181, 2010) are the shares of the figure's variance that each explains by itself and together with others.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, Self

import msgspec
import numpy as np

from boebot import missing
from boebot.cli.ending import Detail
from boebot.description.robots import RobotDescription, idle, magnitude
from boebot.errors import BoebotError, CallError, expected_one
from boebot.imperfections import imperfections
from boebot.rates import Mean
from boebot.running.tasks import prepare
from boebot_campaign import kept
from boebot_campaign.command import command
from boebot_campaign.engine import Told, Workers
from boebot_campaign.kept import Folder
from boebot_campaign.plan import AnyAxis, Axis, Range, Single, length, listed
from boebot_campaign.report import Page, said, saved, tell, words
from boebot_campaign.rows import OK, numbers
from boebot_campaign.sweep import function, run_plan

Axes = Sequence[tuple[str, AnyAxis]]
MOST = 5  # imperfections that get Sobol indices
ERROR = 0.05  # of all effects together
NAME, PICTURE = "matters.json", "matters.png"
EFFECTS = ["name", "from", "to", "effect on average", "at one seed"]
SHARES = {"by_itself": "by itself", "with_others": "together with others"}
LEGEND = (
    "Effect: the figure at the second value less that at the first. At one seed: its root mean square; three others "
    "together can be taken for it, which the shares then show. None: the interval holds 0. Intervals hold 95 %, those "
    "of effects all together."
)


class Matters(Single, frozen=True, kw_only=True, forbid_unknown_fields=True, dict=True):
    """The keys of matters.toml (docs/how-to/what-matters.md)."""

    figure: str
    samples: int = 128
    design: Literal["two-level"] = "two-level"

    def completed(self, at: str) -> Self:
        """With each imperfection that changes something of the robot. Raises CallError."""
        if length(self.seeds) < 2:
            raise CallError(f"{at}there is one seed; expected 2 or more, as one alone does not show what is chance")
        if self.samples < 1 or self.samples & (self.samples - 1):
            raise CallError(f"{at}samples is {self.samples}; expected a power of two, such as 128")
        if self.figure not in (known := numbers(self)):
            raise CallError(f"{at}figure is {self.figure!r}; {expected_one(self.figure, known)}")
        robot = prepare(self.brains[0], self.all_robots[0], None)[1]
        found = {name: _ends(name, robot) for name in imperfections() if not idle(name, robot)}
        own = {name: axis for name, axis in found.items() if axis is not None}
        return msgspec.structs.replace(self, imperfections=own | self.imperfections)

    @property
    def most_runs(self) -> int:
        """Of the effects, and of the indices of as many axes as may get them, and of the seed."""
        return self.count + self.count // (self.sizes[3] * self.sizes[6]) * self.samples * (MOST + 3)


def _ends(name: str, robot: RobotDescription) -> Axis | None:
    """Off and as in use; a tenth less and more of what cannot be off; None: there is no such range."""
    row = imperfections()[name]
    here = magnitude(row, robot) or 0.0
    low, high = (row.neutral, here) if row.switch else (here * 0.9, here * 1.1)
    if low == high or (row.whole and not row.switch):
        return None
    return [low, high] if row.whole else Range(low=float(f"{low:.6g}"), high=float(f"{high:.6g}"))


def effects(axes: Axes, at: np.ndarray, values: np.ndarray) -> list[dict[str, Any]]:
    """A row for each axis of a two-level design, the largest first. `at`: the design's points; `values`: of the figure,
    by point and seed."""
    stats = missing.imported("scipy.stats", "boebot matters", "scipy", "sweep")
    (points, seeds), count, signs = values.shape, len(axes), 2 * at - 1
    found = 2 * signs.T @ values / points  # of each axis, at each seed
    found[abs(found) < 1e-9 * abs(values).max()] = 0.0  # what rounding leaves
    left = values - values.mean(axis=0) - signs @ found / 2
    free = seeds * (points - count - 1)  # degrees of freedom of what is left
    noise = 4 * (left**2).sum() / points / max(free, 1)  # variance of an effect at one seed
    chance = (stats.f.ppf(1 - ERROR / count, seeds, free) * noise) ** 0.5 if free else np.inf
    means, at_one_seed = found.mean(axis=1), (found**2).mean(axis=1) ** 0.5
    halves = stats.t.ppf(1 - ERROR / count / 2, seeds - 1) * found.std(axis=1, ddof=1) / seeds**0.5
    return [
        {
            "name": name,
            "ends": listed(axis),
            "effect": _mean(means[one], halves[one]),
            "at_one_seed": float(at_one_seed[one]),
            "counts": bool(abs(means[one]) > halves[one] or at_one_seed[one] > chance),
        }
        for one, (name, axis) in sorted(enumerate(axes), key=lambda pair: -at_one_seed[pair[0]])
    ]


def shares(axes: Axes, values: np.ndarray) -> list[dict[str, Any]]:
    """A row for each axis of a saltelli design; none where all values, by point, are alike."""
    sobol = missing.imported("SALib.analyze.sobol", "boebot matters", "SALib", "learn")
    names = [name for name, _ in axes]
    problem = {"num_vars": len(names), "names": names, "bounds": [[0, 1]] * len(names)}
    if values.min() == values.max():
        return []
    found = sobol.analyze(problem, values, calc_second_order=False, seed=1)
    return [
        {
            "name": name,
            "by_itself": _mean(found["S1"][at], found["S1_conf"][at]),
            "with_others": _mean(found["ST"][at], found["ST_conf"][at]),
        }
        for at, name in enumerate(names)
    ]


def _mean(middle: float, half: float) -> Mean:
    return Mean(float(middle), float(middle - half), float(middle + half))


def _values(folder: Folder, figure: str) -> np.ndarray:
    """Of a figure at each point and seed: the mean over arenas, faults, starts. Raises BoebotError: a run has none."""
    table = folder.table(["status", figure])
    values: np.ndarray = np.where(table["status"].to_numpy() == OK, table[figure].to_numpy(), np.nan).astype(float)
    if len(gaps := np.flatnonzero(np.isnan(values))):
        few = f"not ok or without {figure}: {len(gaps):,} of {len(values):,} runs, the first is row {gaps[0]}"
        raise BoebotError(f"{few} of {folder.path}; expected it of each, as effects need all settings")
    return np.asarray(values.reshape(folder.plan.sizes).mean(axis=(0, 1, 2, 4, 5)))


def run_matters(asked: Matters, path: Path, workers: Workers, told: Told) -> Page:
    """The effects, and the indices of those that count."""
    missing.imported("SALib.analyze.sobol", "boebot matters", "SALib", "learn")
    with kept.held(path, NAME):
        kept.keep(path / NAME, kept.Kept(version=kept.version(), plan=asked))
        return _page(asked, path, workers, told)


def _page(asked: Matters, path: Path, workers: Workers, told: Told) -> Page:
    first = run_plan(asked.as_sweep(), path / "effects", workers, told)
    found, indices = effects(first.plan.axes, first.points, _values(first, asked.figure)), []
    counting = [one for one in found if one["counts"]]
    if few := [one["name"] for one in counting][:MOST]:
        kinds = {"parameters": asked.parameters, "imperfections": asked.imperfections}
        axes = {kind: {name: own[name] for name in few if name in own} for kind, own in kinds.items()}
        plan = asked.as_sweep(design="saltelli", points=asked.samples, **axes)
        second = run_plan(plan, path / "indices", workers, lambda done: told(first.plan.count + done))
        indices = shares(second.plan.axes, _values(second, asked.figure)[:, 0])
    title = f"What the {words(asked.figure)} of {Path(asked.brains[0]).name} hangs on"
    shared = [[one["name"], *(_said(one[key]) for key in SHARES)] for one in indices]
    tables = [(EFFECTS, [_in_words(one) for one in counting]), (["share of the variance", *SHARES.values()], shared)]
    others = ", ".join(one["name"] for one in found if not one["counts"])
    lines = [*([f"No effect shows of {others}."] if others else []), LEGEND]
    both = {"figure": asked.figure, "effects": found, "indices": indices}
    return Page(_drawn(path / PICTURE, title, found, indices), title, tables, lines, both)


matters = function("matters", Matters, run_matters)


@command(Matters, run_matters)
def matters_command(page: Page, wanted: Detail) -> None:
    """Find out which imperfections a brain's result hangs on.

    Stopped anywhere, the same command goes on where it was. The file is as docs/how-to/what-matters.md says."""
    tell(page, wanted)


def _in_words(one: dict[str, Any]) -> list[str]:
    mean, ends = one["effect"], (str(end) if isinstance(end, str) else f"{end:.4g}" for end in one["ends"])
    return [one["name"], *ends, _said(mean), f"{one['at_one_seed']:.3g}"]


def _said(mean: Mean) -> str:
    return said(mean) if mean.least * mean.most > 0 else "none"


def _drawn(path: Path, title: str, found: list[dict[str, Any]], indices: list[dict[str, Any]]) -> Path:
    """Effects at the left, Sobol indices at the right, the largest at the top."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 1.6 + 0.2 * len(found)), layout="constrained")
    figure.suptitle(title)
    left, right = figure.subplots(1, 2, width_ratios=[3, 2])
    at_one_seed = np.array([one["at_one_seed"] for one in found])
    left.use_sticky_edges = False
    left.barh(range(len(found)), 2 * at_one_seed, left=-at_one_seed, color="#d5deec", label="at one seed")
    left.set_xlabel("effect on the figure, from the first value to the second")
    right.set_xlabel("share of the variance (Sobol index)")
    for panel, rows, series in ((left, found, {"effect": "on average, 95 %"}), (right, indices, SHARES)):
        for shift, (key, name) in enumerate(series.items()):
            middle, least, most = np.array([one[key] for one in rows]).reshape(-1, 3).T
            at, ends = np.arange(len(rows)) + 0.2 * shift, [middle - least, most - middle]
            panel.errorbar(middle, at, xerr=ends, fmt="o", ms=4, capsize=2, label=name)
        panel.set_yticks(range(len(rows)), [one["name"] for one in rows], fontsize=8)
        panel.set_ylim(len(rows) - 0.4, -0.6)
        panel.axvline(0, color="#9aa1ad")
        panel.legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, frameon=False)
    return saved(figure, path)
