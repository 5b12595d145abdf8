"""Settings of matplotlib for the figures of experiments and of the timing, so that all look alike."""

from __future__ import annotations

from typing import Any

from boebot.view import style

PLOTS: dict[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": style.FAINT,
    "axes.facecolor": style.FLOOR,
    "axes.grid": True,
    "axes.labelcolor": style.INK,
    "axes.prop_cycle": f"cycler('color', {style.ROBOTS})",
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": style.INK,
    "axes.titlesize": "medium",
    "figure.constrained_layout.h_pad": 0.08,  # inches
    "figure.constrained_layout.w_pad": 0.1,
    "figure.facecolor": style.PAPER,
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same picture everywhere
    "font.size": 10.0,
    "grid.color": style.GRID,
    "grid.linewidth": 0.8,
    "image.cmap": style.PATH,
    "legend.edgecolor": style.GRID,
    "legend.framealpha": 0.9,
    "lines.linewidth": 1.6,
    "path.simplify_threshold": 0.2,
    "savefig.facecolor": style.PAPER,
    "text.color": style.INK,
    "xtick.color": style.FAINT,
    "xtick.labelcolor": style.INK,
    "ytick.color": style.FAINT,
    "ytick.labelcolor": style.INK,
}
