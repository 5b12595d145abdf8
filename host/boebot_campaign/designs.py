"""Points of a design in the unit cube, a row for each point: scattered by chance, as a Latin hypercube (McKay, Beckman
and Conover, Technometrics 21, 1979), or by Sobol's sequence, scrambled. The same seed gives the same points."""

from __future__ import annotations

from typing import Literal

import numpy as np

from boebot import missing

Design = Literal["grid", "random", "latin", "sobol"]


def points(design: Design, count: int, axes: int, seed: int) -> np.ndarray:
    """`count` points of `axes` coordinates, each from 0 to below 1. Of a grid there are none: it is arithmetic. Sobol's
    sequence is balanced only where `count` is a power of two."""
    if design == "grid" or axes == 0:
        return np.empty((0, axes))
    if design == "random":
        return np.random.default_rng(seed).random((count, axes))
    qmc = missing.imported("scipy.stats.qmc", f"a {design} design", "scipy", "sweep")
    if design == "latin":
        return np.asarray(qmc.LatinHypercube(axes, rng=seed).random(count))
    return np.asarray(qmc.Sobol(axes, rng=seed).random(count))
