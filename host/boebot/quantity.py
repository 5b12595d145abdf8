"""Quantities that people write: a bare number has the unit of the API (s, m, rad), and others may be said: `50ms`,
`2min`, `20cm`, `90deg`."""

from __future__ import annotations

import math
import re
from decimal import Decimal

from boebot.errors import BoebotError

_KINDS: tuple[tuple[str, dict[str, Decimal]], ...] = (
    (
        "time",
        {"s": Decimal(1), "ms": Decimal("1e-3"), "us": Decimal("1e-6"), "min": Decimal(60), "h": Decimal(3600)},
    ),
    ("length", {"m": Decimal(1), "cm": Decimal("1e-2"), "mm": Decimal("1e-3")}),
    ("angle", {"rad": Decimal(1), "deg": Decimal(math.pi) / 180}),
    ("frequency", {"Hz": Decimal(1), "kHz": Decimal(1000)}),
    ("voltage", {"V": Decimal(1), "mV": Decimal("1e-3")}),
    ("share or number", {"": Decimal(1), "%": Decimal("1e-2")}),
)
_FORM = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?inf|nan) ?([^\d\s.]*)")


def parse(text: str, unit: str) -> float:
    """The number that `text` says, in `unit`.

    Raises:
        BoebotError: it is none.
    """
    kind, factors = next(
        ((name, units) for name, units in _KINDS if unit in units), (f"number of {unit}", {unit: Decimal(1)})
    )
    match = _FORM.fullmatch(text.strip())
    if match is None or (match[2] and match[2] not in factors):
        others = ", ".join(sorted(factors.keys() - {unit}))
        said = f", or with another unit: {others}" if others else ""
        raise BoebotError(f"{text!r} is no {kind}; expected a number{unit and f', in {unit}'}{said}")
    number = Decimal(match[1])
    return float(number * factors[match[2]] / factors[unit]) if match[2] else float(number)
