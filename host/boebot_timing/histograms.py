"""A picture of distributions: one histogram for each quantity, all loads and firmwares in it, as SVG, PNG or PDF."""

from __future__ import annotations

import io
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from boebot.errors import BoebotError
from boebot.view import style

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from boebot_timing.distributions import Distribution

NAME = "jitter"
COLUMNS = 3
WIDTH_IN, HEIGHT_IN = 3.9, 2.4  # of one histogram
FRAME_IN = 0.9  # for title and legend
BINS = 60
MARGIN = 3.0  # cycles, beside a single value
TITLE = "Jitter and latency: in brackets, how many values"
LIMIT: dict[str, Any] = {"color": style.INK, "ls": (0, (1, 1.5)), "lw": 1.4}
FORMATS = (".svg", ".png", ".pdf")
MILLISECONDS_FROM = 10_000.0  # cycles; shorter ones are shown as they are


def draw(distributions: Sequence[Distribution], path: Path) -> Path:
    """Draws them into a file, by quantity in the order in which they come; returns its path.

    Raises:
        BoebotError: there is nothing to draw, the format is none, or the file cannot be written.
    """
    if path.suffix.lower() not in FORMATS:
        raise BoebotError(f"{path}: a picture cannot be written as {path.suffix!r}; expected {', '.join(FORMATS)}")
    drawn = _drawn(distributions, path.suffix.lower().removeprefix("."))
    try:
        path.write_bytes(drawn)
    except OSError as error:
        raise BoebotError(f"the picture cannot be written to {path}: {error.strerror or error}") from None
    return path


def files(distributions: Sequence[Distribution]) -> dict[str, bytes]:
    """The picture as jitter.png and jitter.svg; none where there is nothing to draw."""
    if not any(one.count for one in distributions):
        return {}
    return {f"{NAME}.{kind}": _drawn(distributions, kind) for kind in ("png", "svg")}


def _drawn(distributions: Sequence[Distribution], kind: str) -> bytes:
    by_quantity: dict[str, list[Distribution]] = {}
    for one in distributions:
        if one.count:
            by_quantity.setdefault(one.quantity, []).append(one)
    if not by_quantity:
        raise BoebotError("there are no distributions to draw; expected one value at least")
    rows = -(-len(by_quantity) // COLUMNS)
    target = io.BytesIO()
    with rc_context({**style.PLOTS, "svg.hashsalt": "boebot", "text.parse_math": False}):
        figure = Figure(figsize=(COLUMNS * WIDTH_IN, rows * HEIGHT_IN + FRAME_IN), layout="constrained")
        FigureCanvasAgg(figure)
        figure.suptitle(TITLE, color=style.INK, fontsize=13)
        figure.supylabel("share of all values", color=style.INK, fontsize=10)
        if any(limit is not None for one in distributions for limit in (one.least, one.most)):
            handle = Line2D((), (), **LIMIT, label="limit: what the values may be; further away limits are not shown")
            figure.legend(handles=[handle], loc="outside lower center", frameon=False, fontsize=9)
        fields = list(np.ravel(figure.subplots(rows, COLUMNS, squeeze=False)))
        for axes, (quantity, found) in zip(fields, by_quantity.items(), strict=False):
            _histogram(axes, quantity, found)
        for axes in fields[len(by_quantity) :]:
            axes.set_visible(False)
        figure.savefig(target, format=kind, dpi=style.DPI, metadata={"Date": None} if kind == "svg" else None)
    return target.getvalue()


def _histogram(axes: Axes, quantity: str, found: Sequence[Distribution]) -> None:
    """Shares of all values by bins, on a scale where one in a thousand is seen; limits as dashed lines."""
    values = np.concatenate([one.values for one in found])
    limits = sorted({limit for one in found for limit in (one.least, one.most) if limit is not None})
    scale = 16_000.0 if np.abs(values).max() > MILLISECONDS_FROM else 1.0
    low, high = float(values.min()), float(values.max())
    each_cycle = scale == 1.0 and high - low < BINS
    bins = int(np.clip(np.sqrt(len(values)), 8, BINS))  # few values in many bins would show nothing but gaps
    edges = np.arange(low - 0.5, high + 1.0) if each_cycle else np.linspace(low, high, bins + 1)
    for one, colour, dashes in zip(found, cycle(style.ROBOTS), cycle(style.DASHES), strict=False):
        label = one.load if one.subject == "boebot" else f"{one.subject}, {one.load}"
        shares = np.histogram(one.values, bins=edges)[0] / one.count
        axes.stairs(shares, edges / scale, label=f"{label} ({one.count})", color=colour, ls=dashes, lw=1.4)
    span = max(high - low, MARGIN)
    for limit in limits:
        if low - span <= limit <= high + span:  # else it would squeeze the values
            axes.axvline(limit / scale, **LIMIT)
    axes.set_yscale("log")
    axes.set_ylim(2e-4, 4.0)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:g} %"))
    if high == low:
        axes.set_xlim(low - MARGIN, high + MARGIN)
    axes.set_title(quantity)
    axes.set_xlabel("ms" if scale != 1.0 else "cycles")
    axes.legend(fontsize=6.5, loc="upper right")
