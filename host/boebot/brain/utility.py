"""Utility functions (8.4), (8.5) and gamma parameters (8.6) of the notes, section 8.2.

The utility of a process i follows the state variables z_k with a lag, and the lag is what keeps single wrong readings
from switching behaviors:

    τ_i du_i/dt + u_i = σ_i(Σ_k w_ik z_k + b_i + Γ_i),    σ_i(x) = tanh(c_i x)                         (8.4), (8.5)
    τΓ_i dΓ_i/dt = -Γ_i                                                                                   (8.6)

Over a time Δt in which state variables are held, both have closed solutions, which are used here: stable and the same
whatever Δt is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from boebot.errors import BrainError

HOLD = 10.0
"""A gamma parameter with which a process is active whatever the state variables: no usual sum is that large."""


@dataclass(frozen=True, kw_only=True)
class Utility:
    """The parameters of one process's utility function.

    Since only differences count, one motor behavior may do without weights: its utility then settles at tanh(c b).

    Args:
        b: bias.
        w: weights, by the name of the state variable.
        tau: time constant (s); the notes use 0.1 to 0.3.
        c: steepness of the sigmoid.
        tau_gamma: time constant (s) with which the gamma parameter decays.

    Raises:
        BrainError: a time constant or c is not above 0, or a number is not finite.
    """

    b: float = 0.0
    w: Mapping[str, float] = field(default_factory=dict)
    tau: float = 0.2
    c: float = 1.0
    tau_gamma: float = 0.5

    def __post_init__(self) -> None:
        if not isinstance(self.w, Mapping):
            raise BrainError(f"utility: w is {self.w!r}; expected weights by names, as in {{'near': 3.0}}")
        numbers = {"b": self.b, "tau": self.tau, "c": self.c, "tau_gamma": self.tau_gamma}
        numbers |= {f"w[{name!r}]": weight for name, weight in self.w.items()}
        for name, number in numbers.items():
            if not isinstance(number, int | float) or isinstance(number, bool) or not math.isfinite(number):
                raise BrainError(f"utility: {name} is {number!r}; expected a finite number")
            if name in ("tau", "c", "tau_gamma") and not number > 0:
                raise BrainError(f"utility: {name} is {number!r}; expected more than 0")


class Share(NamedTuple):
    """What one cause adds to the argument of the sigmoid."""

    cause: str
    """a state variable's name, "b" or "gamma\""""
    value: float


class Utilities:
    """Utilities and gamma parameters of a brain's processes, advanced together.

    Attributes:
        values: u_i, in the order of the functions.
        gammas: Γ_i, in the same order.
    """

    def __init__(self, functions: Sequence[Utility], variables: Sequence[str]) -> None:
        """Nothing is advanced yet: see `start`.

        Raises:
            BrainError: a weight belongs to no state variable.
        """
        self.values = [0.0] * len(functions)
        self.gammas = [0.0] * len(functions)
        self._variables = tuple(variables)
        self.follow(functions)

    def follow(self, functions: Sequence[Utility]) -> None:
        """From now on these, as many as before; values and gammas go on from where they are. Raises as above."""
        self._weights = [self._indexed(function) for function in functions]
        self._functions = tuple(functions)
        self._arguments = [(one.b, one.c, weights) for one, weights in zip(functions, self._weights, strict=True)]

    def _indexed(self, function: Utility) -> tuple[tuple[int, float], ...]:
        for name in function.w:
            if name not in self._variables:
                known = ", ".join(self._variables) or "none"
                raise BrainError(f"utility: w names the state variable {name!r}; this brain has {known}")
        return tuple((self._variables.index(name), weight) for name, weight in function.w.items())

    def start(self, z: Sequence[float]) -> None:
        """At rest in those state variables, without gamma: u_i = σ_i(Σ w z + b)."""
        self.gammas = [0.0] * len(self._functions)
        self.values = [_settled(argument, 0.0, z) for argument in self._arguments]

    def advance(self, z: Sequence[float], elapsed: float) -> None:
        """By `elapsed` seconds, in which the state variables are `z`: first gamma parameters, then utilities."""
        values, gammas, arguments = self.values, self.gammas, self._arguments
        for index, (lag, decay) in enumerate(self._factors_of(elapsed)):
            gammas[index] = gamma = gammas[index] * decay
            settled = _settled(arguments[index], gamma, z)
            values[index] = settled + (values[index] - settled) * lag

    def _factors_of(self, elapsed: float) -> list[tuple[float, float]]:
        """e^(-Δt/τ_i) and e^(-Δt/τΓ_i)."""
        return [(math.exp(-elapsed / one.tau), math.exp(-elapsed / one.tau_gamma)) for one in self._functions]

    def shares(self, index: int, z: Sequence[float]) -> list[Share]:
        """What now drives the utility of a process, the strongest first."""
        shares = [Share(self._variables[k], weight * z[k]) for k, weight in self._weights[index]]
        shares += [Share("b", self._functions[index].b), Share("gamma", self.gammas[index])]
        return sorted((share for share in shares if share.value), key=lambda share: -abs(share.value))


def _settled(of: tuple[float, float, tuple[tuple[int, float], ...]], gamma: float, z: Sequence[float]) -> float:
    """σ(Σ w z + b + Γ), of b, c and the weights by index."""
    b, c, weights = of
    argument = b + gamma
    for k, weight in weights:
        argument += weight * z[k]
    return math.tanh(c * argument)
