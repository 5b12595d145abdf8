"""Values that a test measures, and what they have to be."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from boebot.arguments import number
from boebot.errors import CallError

PASSES, MARGINAL, FAILS = "pass", "marginal", "fail"


@dataclass(frozen=True)
class Measurement:
    """A value that a test measured, its limits, and how near to one of them it is worth a look."""

    name: str
    value: float
    unit: str
    low: float | None
    high: float | None
    marginal: float

    @classmethod
    def of(
        cls, name: str, value: float, unit: str, low: float | None, high: float | None, marginal: float
    ) -> Measurement:
        """Raises CallError where these are no measurement and its limits."""
        if not isinstance(name, str) or not name:
            raise CallError(f"measure: the name is {name!r}; expected a text")
        value = number(f"measure: {name}", value, CallError)
        low, high = (
            None if one is None else number(f"measure: a limit of {name}", one, CallError) for one in (low, high)
        )
        if low is not None and high is not None and low > high:
            raise CallError(f"measure: {name} has the limits {low:g} and {high:g}; expected low <= high")
        return cls(name, value, unit, low, high, number(f"measure: marginal of {name}", marginal, CallError, least=0))

    @property
    def verdict(self) -> str:
        """PASSES, MARGINAL or FAILS."""
        rooms = [self.value - self.low] if self.low is not None else []
        rooms += [self.high - self.value] if self.high is not None else []
        room = min(rooms, default=self.marginal)
        return FAILS if room < 0 else MARGINAL if room < self.marginal else PASSES

    @property
    def limits(self) -> str:
        """In words, such as "1690 to 1710"."""
        if self.low is None or self.high is None:
            return f">= {self.low:g}" if self.low is not None else f"<= {self.high:g}" if self.high is not None else ""
        return f"{self.low:g} to {self.high:g}"

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**dataclasses.asdict(self), "verdict": self.verdict}

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        expected = f"; expected {self.limits}{unit}" if self.limits else ""
        return f"{self.name} is {self.value:g}{unit}{expected}"
