"""Potential fields: (6.1) to (6.4) of the notes, with potentials that may be rotated.

    φ(x, y) = α exp(-(u / β)² - (v / γ)²)           (6.1)    (u, v): from (x_p, y_p), along the potential's own axes
    Φ = Σ φ_i                                        (6.2)
    ∂φ/∂u = -2 u / β² φ,   ∂φ/∂v = -2 v / γ² φ       (6.3)
    φ_ref = atan2(-∂Φ/∂y, -∂Φ/∂x)                    (6.4)

α below 0 attracts, above 0 repels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from boebot.errors import BrainError
from boebot.navigation.frames import Point

Floats = NDArray[np.float64]
_TURNS = 50  # of Newton's method
_STEP_M = 0.1  # of it, at most


@dataclass(frozen=True)
class Potential:
    """One potential, an ellipse of Gauss's form."""

    x: float
    """of its middle (m)"""
    y: float
    """of its middle (m)"""
    alpha: float
    """height: below 0 a valley, above 0 a hill"""
    beta: float
    """half-width along its own x axis (m)"""
    gamma: float
    """half-width across (m)"""
    heading: float = 0.0
    """of its own x axis (rad)"""

    def __post_init__(self) -> None:
        numbers = (self.x, self.y, self.alpha, self.beta, self.gamma, self.heading)
        if not all(map(math.isfinite, numbers)) or self.beta <= 0 or self.gamma <= 0:
            raise BrainError(f"{self}: expected finite numbers, and beta and gamma above 0")

    def moved(self, x: float, y: float) -> Potential:
        """The same at another place (m)."""
        return replace(self, x=x, y=y)


@dataclass(frozen=True)
class PotentialField:
    """A sum of potentials."""

    potentials: tuple[Potential, ...]

    @classmethod
    def of(cls, potentials: Iterable[Potential]) -> PotentialField:
        """Of these."""
        return cls(tuple(potentials))

    def value(self, points: ArrayLike) -> Floats:
        """Φ at points (m), shape (..., 2); shape (...)."""
        at = np.asarray(points, dtype=np.float64)
        total = np.zeros(at.shape[:-1])
        for one in self.potentials:
            total += _parts(one, at)[0]
        return total

    def gradient(self, points: ArrayLike) -> Floats:
        """∂Φ/∂x and ∂Φ/∂y (1/m) at points (m), shape (..., 2); the same shape."""
        at = np.asarray(points, dtype=np.float64)
        total = np.zeros(at.shape)
        for one in self.potentials:
            phi, u, v, cosine, sine = _parts(one, at)
            along, across = -2.0 * u / one.beta**2 * phi, -2.0 * v / one.gamma**2 * phi
            total[..., 0] += cosine * along - sine * across
            total[..., 1] += sine * along + cosine * across
        return total

    def minimum_near(self, x: float, y: float) -> Point | None:
        """The minimum of Φ to which Newton's method leads from a place (m); None: to none."""
        at = np.array((x, y))
        for _ in range(_TURNS):
            slope = self.gradient(at)
            curvature = self._curvature(at)
            if np.linalg.eigvalsh(curvature)[0] > 0:
                step = -np.linalg.solve(curvature, slope)
            else:
                step = -slope / (np.hypot(*slope) or 1.0) * _STEP_M
            length = float(np.hypot(*step))
            at = at + step * min(1.0, _STEP_M / length if length else 1.0)
            if length < 1e-10:
                break
        if np.hypot(*self.gradient(at)) > 1e-6 or np.linalg.eigvalsh(self._curvature(at))[0] <= 0:
            return None
        return float(at[0]), float(at[1])

    def _curvature(self, at: Floats) -> Floats:
        """Second derivatives of Φ, shape (2, 2)."""
        total = np.zeros((2, 2))
        for one in self.potentials:
            phi, u, v, cosine, sine = (float(part) for part in _parts(one, at))
            b, c = one.beta**2, one.gamma**2
            own = phi * np.array(
                [[4 * u * u / b**2 - 2 / b, 4 * u * v / (b * c)], [4 * u * v / (b * c), 4 * v * v / c**2 - 2 / c]]
            )
            turn = np.array([[cosine, -sine], [sine, cosine]])
            total += turn @ own @ turn.T
        return total


def check_goal(field: PotentialField, goal: Point, tolerance: float) -> None:
    """Raises BrainError where the field's minimum is not at the goal: a robot that follows it would not arrive.

    Args:
        goal: where it should be (m). tolerance: of arriving (m); the minimum may be half as far away.
    """
    found = field.minimum_near(*goal)
    off = math.inf if found is None else math.dist(found, goal)
    if off > tolerance / 2:
        where = (
            "no minimum is near it"
            if found is None
            else f"the minimum is at ({found[0]:.3f}, {found[1]:.3f}), {off:.3f} m off"
        )
        raise BrainError(
            f"the field's goal is at ({goal[0]:g}, {goal[1]:g}), but {where}; expected {tolerance / 2:g} m at most: "
            "a wider goal, or lower and narrower hills beside it"
        )


def waypoints(path: Sequence[Point], alpha: float = -1.2, width: float = 0.6) -> list[Potential]:
    """Small valleys at the corners of a path (m), without its ends."""
    return [Potential(x, y, alpha, width, width) for x, y in path[1:-1]]


def _parts(one: Potential, at: Floats) -> tuple[Floats, Floats, Floats, float, float]:
    """φ, u, v, and the potential's cosine and sine."""
    cosine, sine = math.cos(one.heading), math.sin(one.heading)
    dx, dy = at[..., 0] - one.x, at[..., 1] - one.y
    u, v = cosine * dx + sine * dy, cosine * dy - sine * dx
    return one.alpha * np.exp(-((u / one.beta) ** 2) - (v / one.gamma) ** 2), u, v, cosine, sine
