"""What came of a sweep: each figure against each factor, with 95 % intervals, as a table and a picture; and its brains
compared, run by run at the same seed, start and all else. One factor is in memory at a time.

Intervals are those of boebot.rates. Two brains differ by the mean of the paired differences, by Cliff's delta
(Psychological Bulletin 114, 1993; -1 to 1, 0: neither does better), and by Wilcoxon's signed-rank test.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boebot import missing, rates
from boebot.cli import output
from boebot.cli.ending import Detail
from boebot.rates import Mean, mean_of
from boebot.record import figures as figures_in_words
from boebot.record.run_folder import write_whole
from boebot_campaign.kept import Folder
from boebot_campaign.plan import Plan
from boebot_campaign.rows import OK

PICTURE, PAGE = "report.png", "index.md"
MEANS = ("true_distance_m", "true_contacts", "behavior_switches")
FACTORS = ("set", "arena", "brain", "robot", "faults")
BINS = 6  # of a factor that has more values than MOST_VALUES
MOST_VALUES = 8
Read = Callable[[list[str]], Any]  # a table of those columns


class Level(NamedTuple):
    """One value of a factor, or a range of them, and what came of the runs there."""

    factor: str
    value: str
    at: float
    """where it is drawn"""
    runs: int
    ok: str
    """how many of them are, in words"""
    means: dict[str, Mean | None]
    """of each figure, and of whether runs are ok"""


def report(path: Path, wanted: Detail) -> None:
    """`boebot report` of a sweep's folder. Raises BoebotError: there is no row yet, or it cannot be written to."""
    folder = Folder(path)
    axes = {"parameter": folder.plan.parameters, "imperfection": folder.plan.imperfections}
    factors = [*FACTORS, *(f"{kind}.{one}" for kind, own in axes.items() for one in own)]
    read = folder.steady(["row", "status", *MEANS, *factors])
    compute = missing.imported("pyarrow.compute", "a report", "pyarrow", "sweep")
    is_ok = compute.equal(read(["status"])["status"], OK).to_numpy()
    numbers = {name: np.where(is_ok, read([name])[name].to_numpy(), np.nan) for name in MEANS}
    figures = {name: values for name, values in numbers.items() if not np.isnan(values).all()}
    levels = [_level("all", "", 0.0, np.ones(len(is_ok), dtype=bool), is_ok, figures)]
    for name in factors:
        levels += [_level(name, *level, is_ok, figures) for level in _values(read, name)]
    compared = [] if not figures else _compared(folder.plan, read, *next(iter(figures.items())))
    picture = _drawn(path / PICTURE, levels, figures)
    titles = ["factor", "value", "ok", *map(words, figures)]
    rows = [[one.factor, one.value, one.ok, *(said(one.means[name]) for name in figures)] for one in levels]
    lines = [*_differences(compared), _INTERVALS]
    by_level = [{"factor": one.factor, "value": one.value, "runs": one.runs} | one.means for one in levels]
    found = {"levels": by_level, "compared": compared}
    tell(Page(picture, f"Sweep {path.name}", [(titles, rows)], lines, found), wanted)


def _values(read: Read, name: str) -> Iterator[tuple[str, float, np.ndarray]]:
    """Of a factor that has several: the value, where it is drawn, and which rows have it. Many numbers are put together
    in bins of as many runs."""
    arrow = missing.imported("pyarrow", "a report", "pyarrow", "sweep")
    column = read([name])[name]
    if arrow.types.is_string(column.type) or arrow.types.is_boolean(column.type):
        texts, places = _encoded(column)
        named = [(one, text) for one, text in enumerate(texts) if text is not None or name == "faults"]
        named.sort(key=lambda pair: (pair[1] is not None, str(pair[1])))
        for at, (one, text) in enumerate(named if len(named) > 1 else []):
            yield "none" if text is None else str(text), float(at), places == one
        return
    numbers = np.asarray(column.to_numpy(), dtype=float)
    known = np.unique(numbers)
    if len(known) > MOST_VALUES:
        edges = np.quantile(numbers, np.linspace(0, 1, BINS + 1))
        place = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, BINS - 1)
        for index in range(BINS):
            text = f"{edges[index]:.4g} to {edges[index + 1]:.4g}"
            yield text, float(edges[index : index + 2].mean()), place == index
        return
    for value in known if len(known) > 1 else []:
        yield f"{value:.4g}", float(value), numbers == value


def _encoded(column: Any) -> tuple[list[Any], np.ndarray]:
    """The values that a column has, and where each row's is among them."""
    encoded = column.combine_chunks().dictionary_encode(null_encoding="encode")
    return encoded.dictionary.to_pylist(), encoded.indices.to_numpy()


def _level(
    factor: str, value: str, at: float, rows: np.ndarray, is_ok: np.ndarray, figures: dict[str, np.ndarray]
) -> Level:
    runs, ok, means = int(np.count_nonzero(rows)), int(np.count_nonzero(rows & is_ok)), dict[str, Mean | None]()
    for name, values in figures.items():
        there = values[rows]
        there = there[~np.isnan(there)]
        means[name] = mean_of(there) if len(there) else None
    means[OK] = Mean(ok / runs, *rates.interval(ok, runs)) if runs else None
    return Level(factor, value, at, runs, rates.in_words(ok, runs) if runs else "0", means)


def cliffs_delta(one: np.ndarray, other: np.ndarray) -> float:
    """How often a value of `one` is above one of `other`, less how often it is below, of all pairs."""
    ordered = np.sort(other)
    below, upto = (np.searchsorted(ordered, one, side=side) for side in ("left", "right"))
    return float((below.sum() - (len(other) - upto).sum()) / (len(one) * len(other)))


def _compared(plan: Plan, read: Read, name: str, values: np.ndarray) -> list[dict[str, Any]]:
    """Each two brains by a figure, over the runs that both have ended as they should, with one robot in one arena."""
    rows = read(["row"])["row"].to_numpy()

    def by_brain(of_rows: np.ndarray) -> np.ndarray:
        whole = np.full(plan.count, np.nan)
        whole[rows] = of_rows
        return np.moveaxis(whole.reshape(plan.sizes), 1, 0).reshape(len(plan.brains), -1)

    found: list[dict[str, Any]] = []
    each, *places = by_brain(values), *(by_brain(_encoded(read([one])[one])[1]) for one in ("arena", "robot"))
    names = [Path(brain).name for brain in plan.brains]
    for one, other in combinations(sorted(range(len(names)), key=names.__getitem__), 2):
        both = ~np.isnan(each[one]) & ~np.isnan(each[other])
        for place in places:
            both &= place[one] == place[other]
        first, second = each[one][both], each[other][both]
        found.append({"brains": [names[one], names[other]], "figure": name, "pairs": len(first)})
        found[-1]["difference"] = mean_of(first - second) if len(first) else None
        if len(first) > 1:
            found[-1] |= {"cliffs_delta": cliffs_delta(first, second), "wilcoxon_p": _wilcoxon(first - second)}
    return found


def _wilcoxon(differences: np.ndarray) -> float:
    """How often chance alone makes such differences."""
    if not differences.any():
        return 1.0
    stats = missing.imported("scipy.stats", "a comparison of brains", "scipy", "sweep")
    return float(stats.wilcoxon(differences).pvalue)


_INTERVALS = "95 % intervals: Wilson's of rates; of means (of ok runs) Student's t, by bootstrap of 20 values or more."


def words(name: str) -> str:
    """A figure's name as people read it, with its unit."""
    ((said, _, unit),) = figures_in_words.rows({name: 0})
    return f"{said} ({unit})" if unit else said


def said(mean: Mean | None) -> str:
    """With its interval, if it has one."""
    if mean is None:
        return ""
    return f"{mean.mean:.3g}" + ("" if np.isinf(mean.most) else f" ({mean.least:.3g} to {mean.most:.3g})")


def _differences(compared: list[dict[str, Any]]) -> Iterator[str]:
    for one in compared:
        mean, pairs = said(one["difference"]) or "none", figures_in_words.counted(one["pairs"], "pair", "pairs")
        tests = ": nothing is shown"
        if one["pairs"] > 1:
            tests = f"; Cliff's delta {one['cliffs_delta']:.2f}, Wilcoxon p = {one['wilcoxon_p']:.2g}"
        yield f"{' less '.join(one['brains'])}, {words(one['figure'])}: {mean} over {pairs}{tests}"


def _drawn(path: Path, levels: list[Level], figures: dict[str, np.ndarray]) -> Path:
    """A panel for each figure and factor."""
    from matplotlib.figure import Figure

    factors = list(dict.fromkeys(level.factor for level in levels))
    factors = factors[1:] or factors
    figure = Figure(figsize=(3.2 * len(factors) + 1, 2.4 * (len(figures) + 1)), layout="constrained")
    panels = figure.subplots(len(figures) + 1, len(factors), squeeze=False, sharex="col", sharey="row")
    for column, factor in enumerate(factors):
        own = [level for level in levels if level.factor == factor]
        for panel, name in zip(panels[:, column], [*figures, OK], strict=True):
            drawn = [(level.at, *mean) for level in own if (mean := level.means[name]) is not None]
            at, middle, least, most = np.array(drawn).reshape(-1, 4).T
            ends = np.maximum([middle - least, most - middle], 0)
            panel.errorbar(at, middle, ends, fmt="o", capsize=3, clip_on=False)
            panel.set_xticks([level.at for level in own], [level.value for level in own], rotation=20, fontsize=7)
            panel.margins(x=0.2)
            panel.grid(axis="y", color="#dfe2ea")
        panels[-1, column].set_xlabel(factor)
    for panel, name in zip(panels[:, 0], [*figures, "share of runs ok"], strict=True):
        panel.set_ylabel(words(name))
        if name not in figures or not (figures[name] < 0).any():  # it cannot be negative
            panel.set_ylim(bottom=max(panel.get_ylim()[0], 0))
    return saved(figure, path)


def saved(figure: Any, path: Path) -> Path:
    """A picture, as a file. Raises BoebotError."""
    return write_whole(path, lambda part: figure.savefig(part, dpi=120), path.name)


class Page(NamedTuple):
    """Tables, with their titles, and sentences beside a picture; `found`: for programs."""

    picture: Path
    title: str
    tables: Sequence[tuple[Sequence[str], Sequence[Sequence[str]]]]
    lines: Sequence[str]
    found: dict[str, Any]


def tell(told: Page, wanted: Detail) -> None:
    """Writes the page beside its picture, and prints what is wanted of it. Raises BoebotError."""
    picture, title, tables, lines, found = told
    parts = [f"# {title}", f"![{title}]({picture.name})"]
    for titles, rows in tables:
        cells = [titles, ["---"] * len(titles), *rows]
        parts.append("\n".join(f"| {' | '.join(one.replace('|', chr(92) + '|') for one in row)} |" for row in cells))
    text = "\n\n".join([*parts, *lines]) + "\n"
    page = write_whole(picture.with_name(PAGE), lambda part: part.write_text(text, encoding="utf-8"), PAGE)
    if wanted is Detail.JSON:
        output.print_json(found | {"files": [str(picture), str(page)]})
    elif wanted is not Detail.NOTHING:
        for table in tables:
            output.print_columns(*table)
        output.line("\n".join([*lines, f"picture: {picture}, page: {page}"]))
