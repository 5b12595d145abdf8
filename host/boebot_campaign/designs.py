"""Points of a design in the unit cube, a row for each point. The same seed gives the same points.

random      by chance
latin       a Latin hypercube (McKay, Beckman and Conover, Technometrics 21, 1979)
sobol       Sobol's sequence, scrambled
two-level   each axis at one of its ends: columns of a Hadamard matrix and their negative (Box and Hunter,
            Technometrics 3, 1961). Resolution IV: no effect of one axis is mixed with one of two axes together
saltelli    for Sobol indices (Saltelli et al., Computer Physics Communications 181, 2010)
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from boebot import missing

Design = Literal["grid", "random", "latin", "sobol", "two-level", "saltelli"]


def length(design: Design, count: int, axes: int) -> int:
    """How many points a design has that is asked for with `count`; of a grid that is arithmetic."""
    if design == "two-level":
        return 2 * _order(axes)
    return count * (axes + 2) if design == "saltelli" else count


def _order(axes: int) -> int:
    """Of the matrix: a power of two, with a column for each axis."""
    return 1 << max(axes - 1, 0).bit_length()


def points(design: Design, count: int, axes: int, seed: int) -> np.ndarray:
    """`length` points of `axes` coordinates, each from 0 to below 1; of a two-level design 0 or 1. Of a grid there are
    none. Sobol's sequence, and saltelli's, which is made of it, are balanced only where `count` is a power of two."""
    if design == "grid" or axes == 0:
        return np.empty((0, axes))
    if design == "random":
        return np.random.default_rng(seed).random((count, axes))
    what = f"a {design} design"
    if design == "two-level":
        signs = missing.imported("scipy.linalg", what, "scipy", "sweep").hadamard(_order(axes))[:, :axes]
        return np.asarray(np.vstack([signs, -signs]) > 0, dtype=float)
    if design == "saltelli":
        sobol = missing.imported("SALib.sample.sobol", what, "SALib", "learn")
        problem = {"num_vars": axes, "names": [str(axis) for axis in range(axes)], "bounds": [[0, 1]] * axes}
        return np.asarray(sobol.sample(problem, count, calc_second_order=False, seed=seed))
    qmc = missing.imported("scipy.stats.qmc", what, "scipy", "sweep")
    if design == "latin":
        return np.asarray(qmc.LatinHypercube(axes, rng=seed).random(count))
    return np.asarray(qmc.Sobol(axes, rng=seed).random(count))
