"""Values that a test measures, and what they have to be."""

from __future__ import annotations

from dataclasses import dataclass

from boebot.arguments import number
from boebot.errors import CallError

PASSES, MARGINAL, FAILS = "pass", "marginal", "fail"


@dataclass(frozen=True)
class Measurement:
    """A value that a test measured, its limits, how near to one of them it is worth a look, and what follows: PASSES,
    MARGINAL or FAILS, and a sentence."""

    name: str
    value: float
    unit: str
    low: float | None
    high: float | None
    marginal: float
    verdict: str
    text: str

    @classmethod
    def of(
        cls, name: str, value: float, unit: str, low: float | None, high: float | None, marginal: float
    ) -> Measurement:
        """Raises CallError where these are no measurement and its limits."""
        for what, text in ("name", name), ("unit", unit):
            if not isinstance(text, str) or not text.isprintable() or not (text or what == "unit"):
                raise CallError(f"measure: the {what} is {text!r}; expected a text of one line")
        value = number(f"measure: {name}", value, CallError)
        low, high = (
            None if one is None else number(f"measure: a limit of {name}", one, CallError) for one in (low, high)
        )
        if low is not None and high is not None and low > high:
            raise CallError(f"measure: {name} has the limits {low:g} and {high:g}; expected low <= high")
        marginal = number(f"measure: marginal of {name}", marginal, CallError, least=0)
        rooms = [value - low] if low is not None else []
        rooms += [high - value] if high is not None else []
        room = min(rooms, default=marginal)
        verdict = FAILS if room < 0 else MARGINAL if room < marginal else PASSES
        limits = [f">= {low:g}"] if low is not None else []
        limits += [f"<= {high:g}"] if high is not None else []
        expected = f"{low:g} to {high:g}" if len(limits) == 2 else "".join(limits)
        after = f" {unit}" if unit else ""
        text = f"{name} is {value:g}{after}" + (f"; expected {expected}{after}" if expected else "")
        return cls(name, value, unit, low, high, marginal, verdict, text)
