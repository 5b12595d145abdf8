"""Parameters by name: their specification, and their values as they go over the wire."""

from __future__ import annotations

import math

from boebot.errors import BoebotError
from boebot.link import messages


def parameter_spec(name: str) -> messages.ParameterSpec:
    """The parameter of that name.

    Raises:
        BoebotError: there is none.
    """
    spec = messages.PARAMETERS.get(name)
    if spec is None:
        raise BoebotError(f"there is no parameter {name!r}; expected one of {', '.join(messages.PARAMETERS)}")
    return spec


def parameter_counts(name: str, value: float) -> int:
    """The value, in the parameter's unit, as it goes over the wire.

    Raises:
        BoebotError: there is no such parameter, or it cannot be that.
    """
    spec = parameter_spec(name)
    counts = round(value / spec.scale) if math.isfinite(value) else spec.maximum + 1
    if not spec.minimum <= counts <= spec.maximum:
        raise BoebotError(
            f"parameter {name} cannot be {value:g} {spec.unit}; "
            f"expected {spec.minimum * spec.scale:g} to {spec.maximum * spec.scale:g}"
        )
    return counts
