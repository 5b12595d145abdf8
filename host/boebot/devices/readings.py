"""What the devices of a robot without a board say at one step: named readings in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

Layout = Mapping[str, slice]
"""Where the readings of each device of the description stand."""


class Readings(NamedTuple):
    """All readings at one step."""

    tick: int
    """steps since the start"""
    status: int
    """flags as in telemetry: MOTORS_ENABLED"""
    ages: tuple[float, ...]
    """s since each was sampled"""
    values: tuple[float, ...]
    """SI units; which stands where says the layout"""


def periods(devices: Mapping[str, Any], layout: Layout, count: int) -> tuple[float, ...]:
    """Seconds between two samples of each reading; 0: every step."""
    found = [0.0] * count
    for name, where in layout.items():
        period_s = getattr(devices[name], "period_s", 0.0)
        for index in range(where.start, where.stop):
            found[index] = period_s
    return tuple(found)


def ages(periods_s: tuple[float, ...], time_s: float, tick_s: float) -> tuple[float, ...]:
    """Age of each reading at a time: a sensor samples in the first step at or after each multiple of its period."""
    kinds, each = _kinds(periods_s)
    found = [_age(period_s, time_s, tick_s) for period_s in kinds]
    return tuple(map(found.__getitem__, each))  # a sweep has hundreds that are alike


@lru_cache(maxsize=32)
def _kinds(periods_s: tuple[float, ...]) -> tuple[list[float], list[int]]:
    """The different periods, and which of them each reading has."""
    kinds = list(dict.fromkeys(periods_s))
    place = {period_s: index for index, period_s in enumerate(kinds)}
    return kinds, [place[period_s] for period_s in periods_s]


def _age(period_s: float, time_s: float, tick_s: float) -> float:
    if period_s <= tick_s:
        return 0.0
    samples = math.floor(time_s / period_s + 1e-9)
    return max(0.0, time_s - math.ceil(samples * period_s / tick_s - 1e-9) * tick_s)
