"""What came of a sweep: each figure against each factor, with 95 % intervals, as a table and a picture; and its brains
compared, run by run at the same seed, start and all else.

Intervals are those of boebot.rates. Two brains differ by the mean of the paired differences, by Cliff's delta
(Psychological Bulletin 114, 1993; -1 to 1, 0: neither does better), and by Wilcoxon's signed-rank test.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from boebot import missing, rates
from boebot.cli import output
from boebot.cli.ending import Detail
from boebot.errors import BoebotError
from boebot.rates import Mean, mean_of
from boebot.record import figures as figures_in_words
from boebot_campaign.kept import Folder
from boebot_campaign.rows import OK

PICTURE = "report.png"
MEANS = ("true_distance_m", "true_contacts", "behavior_switches")
FACTORS = ("set", "arena", "brain", "robot", "faults")
BINS = 6  # of a factor that has more values than MOST_VALUES
MOST_VALUES = 8


class Level(NamedTuple):
    """One value of a factor, or a range of them, and the runs there."""

    factor: str
    value: str
    at: float
    """where it is drawn"""
    rows: np.ndarray


def report(path: Path, wanted: Detail) -> None:
    """`boebot report` of a sweep's folder. Raises BoebotError: there is no row yet, or no picture can be written."""
    folder = Folder(path)
    columns = {name: np.array(values, dtype=object) for name, values in folder.table().to_pydict().items()}
    factors = [*FACTORS, *(name for name in columns if name.startswith(("parameter.", "imperfection.")))]
    levels = [level for name in factors for level in _levels(name, columns[name])]
    levels = [Level("all", "", 0.0, np.ones(len(columns["row"]), dtype=bool)), *levels]
    figures = [name for name in MEANS if any(value is not None for value in columns[name])]
    table = [_said(level, columns, figures) for level in levels]
    compared = [_compared(*pair, columns, figures[:1]) for pair in combinations(sorted(set(columns["brain"])), 2)]
    picture = _drawn(path / PICTURE, levels, columns, figures)
    if wanted is Detail.JSON:
        output.print_json({"levels": table, "compared": compared, "files": [str(picture)]})
    elif wanted is not Detail.NOTHING:
        _print(table, compared, figures)
        output.line(f"picture: {picture}")


def _levels(name: str, values: np.ndarray) -> Iterator[Level]:
    """Of a factor that has several; many numbers are put together in bins of as many runs."""
    known = sorted({value for value in values if value is not None}, key=lambda value: (str(type(value)), value))
    is_number = all(isinstance(value, int | float) and not isinstance(value, bool) for value in known)
    if len(known) + any(value is None for value in values) < 2:
        return
    if is_number and len(known) > MOST_VALUES:
        numbers = values.astype(float)
        edges = np.quantile(numbers, np.linspace(0, 1, BINS + 1))
        place = np.clip(np.searchsorted(edges, numbers, side="right") - 1, 0, BINS - 1)
        for index in range(BINS):
            text = f"{edges[index]:.4g} to {edges[index + 1]:.4g}"
            yield Level(name, text, float(edges[index : index + 2].mean()), place == index)
        return
    for index, value in enumerate([*([None] if any(value is None for value in values) else []), *known]):
        at = float(value) if is_number and value is not None else float(index)
        yield Level(name, "none" if value is None else f"{value:.4g}" if is_number else str(value), at, values == value)


def _said(level: Level, columns: dict[str, np.ndarray], figures: list[str]) -> dict[str, Any]:
    """Its runs, the rate of those that ended as they should, and the means, by name."""
    status = columns["status"][level.rows]
    good = int(np.count_nonzero(status == OK))
    row: dict[str, Any] = {"factor": level.factor, "value": level.value, "runs": len(status), OK: good}
    row["ok_interval"] = list(rates.interval(good, len(status))) if len(status) else None
    return row | {name: _mean_at(level, columns, name) for name in figures}


def _mean_at(level: Level, columns: dict[str, np.ndarray], name: str) -> Mean | None:
    found = columns[name][level.rows & (columns["status"] == OK)]
    found = found[[value is not None for value in found]].astype(float)
    return mean_of(found) if len(found) else None


def cliffs_delta(one: np.ndarray, other: np.ndarray) -> float:
    """How often a value of `one` is above one of `other`, less how often it is below, of all pairs."""
    ordered = np.sort(other)
    below, upto = (np.searchsorted(ordered, one, side=side) for side in ("left", "right"))
    return float((below.sum() - (len(other) - upto).sum()) / (len(one) * len(other)))


def _compared(one: str, other: str, columns: dict[str, np.ndarray], figures: list[str]) -> dict[str, Any]:
    """Two brains by the figures, over the runs that both have ended as they should."""
    factors = [name for name in columns if name in ("arena", "robot", "faults", "start", "seed") or "." in name]
    keys = list(zip(*(columns[name] for name in factors), strict=True))
    found: dict[str, Any] = {"brains": [one, other]}
    for name in figures:
        values: list[dict[Any, float]] = [
            {
                key: float(value)
                for key, value, brain, status in zip(
                    keys, columns[name], columns["brain"], columns["status"], strict=True
                )
                if brain == which and status == OK and value is not None
            }
            for which in (one, other)
        ]
        both = [key for key in values[0] if key in values[1]]
        if len(both) > 1:
            first, second = (np.array([those[key] for key in both]) for those in values)
            found[name] = {
                "pairs": len(both),
                "difference": mean_of(first - second),
                "cliffs_delta": cliffs_delta(first, second),
                "wilcoxon_p": _wilcoxon(first - second),
            }
    return found


def _wilcoxon(differences: np.ndarray) -> float:
    """How often chance alone makes such differences."""
    if not differences.any():
        return 1.0
    stats = missing.imported("scipy.stats", "a comparison of brains", "scipy", "sweep")
    return float(stats.wilcoxon(differences).pvalue)


def _words(name: str) -> str:
    """A figure's name as people read it, with its unit."""
    ((words, _, unit),) = figures_in_words.rows({name: 0})
    return f"{words} ({unit})" if unit else words


def _said_mean(mean: Mean) -> str:
    return f"{mean.mean:.3g} ({mean.least:.3g} to {mean.most:.3g})"


def _print(table: list[dict[str, Any]], compared: list[dict[str, Any]], figures: list[str]) -> None:
    rows = []
    for row in table:
        means = ["" if row[name] is None else _said_mean(row[name]) for name in figures]
        rows.append([row["factor"], row["value"], rates.in_words(row[OK], row["runs"]) if row["runs"] else "0", *means])
    output.print_columns(["factor", "value", "ok", *map(_words, figures)], rows)
    for pair in compared:
        for name in (name for name in figures if name in pair):
            two = pair[name]
            output.line(
                f"{' less '.join(pair['brains'])}, {_words(name)}: {_said_mean(two['difference'])} over "
                f"{two['pairs']} pairs; Cliff's delta {two['cliffs_delta']:.2f}, Wilcoxon p = {two['wilcoxon_p']:.2g}"
            )
    output.line("Intervals hold 95 %: Wilson's of rates, by bootstrap of means, which are of runs that are ok.")


def _drawn(path: Path, levels: list[Level], columns: dict[str, np.ndarray], figures: list[str]) -> Path:
    """A panel for each figure and factor."""
    from matplotlib.figure import Figure

    factors = list(dict.fromkeys(level.factor for level in levels))
    factors = factors[1:] or factors
    figure = Figure(figsize=(3.2 * len(factors) + 1, 2.4 * (len(figures) + 1)), layout="constrained")
    panels = figure.subplots(len(figures) + 1, len(factors), squeeze=False, sharex="col", sharey="row")
    for column, factor in enumerate(factors):
        own = [level for level in levels if level.factor == factor]
        for panel, name in zip(panels[:, column], [*figures, OK], strict=True):
            means = [_rate(level, columns) if name == OK else _mean_at(level, columns, name) for level in own]
            drawn = [(level, mean) for level, mean in zip(own, means, strict=True) if mean is not None]
            middle = np.array([mean.mean for _, mean in drawn])
            ends = np.array([[mean.mean - mean.least, mean.most - mean.mean] for _, mean in drawn]).reshape(-1, 2).T
            panel.errorbar([level.at for level, _ in drawn], middle, np.maximum(ends, 0), fmt="o", capsize=3)
            panel.set_xticks([level.at for level in own], [level.value for level in own], rotation=20, fontsize=7)
            panel.margins(x=0.2)
            panel.grid(axis="y", color="#dfe2ea")
        panels[-1, column].set_xlabel(factor)
    for panel, name in zip(panels[:, 0], [*figures, "share of runs ok"], strict=True):
        panel.set_ylabel(_words(name))
    try:
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise BoebotError(f"{path} cannot be written: {error.strerror or error}") from None
    return path


def _rate(level: Level, columns: dict[str, np.ndarray]) -> Mean | None:
    status = columns["status"][level.rows]
    good = int(np.count_nonzero(status == OK))
    return Mean(good / len(status), *rates.interval(good, len(status))) if len(status) else None
