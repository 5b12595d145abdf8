"""Leaky integrators: the memory of many behaviors of the notes, advanced exactly while their input is held.

dy/dt + a y = b x      y(t + Δt) = (b/a) x + (y(t) - (b/a) x) e^(-a Δt)        (4.1), (7.11), (7.12)
"""

from __future__ import annotations

import math


class LeakyIntegrator:
    """One of them.

    Attributes:
        value: y.
    """

    def __init__(self, decay: float, gain: float | None = None, value: float = 0.0) -> None:
        """
        Args:
            decay: a (1/s), above 0; 1/a is the time constant.
            gain: b (1/s); None: the same as a, so that y follows x.
            value: y at the beginning.
        """
        if not decay > 0:
            raise ValueError(f"a decay of {decay!r}; expected more than 0")
        self._decay = decay
        self._ratio = 1.0 if gain is None else gain / decay
        self.value = value

    def advance(self, x: float, elapsed: float) -> float:
        """By `elapsed` seconds with that input; the new value."""
        settled = self._ratio * x
        self.value = settled + (self.value - settled) * math.exp(-self._decay * elapsed)
        return self.value
