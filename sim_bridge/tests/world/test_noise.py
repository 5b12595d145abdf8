"""Elementary functions and random draws of the world.

Truth of the functions is numpy's extended precision (64 bits of mantissa); their errors are counted in units
in the last place of the double nearest to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim_bridge.compiled import ffi, lib

WIDE = np.finfo(np.longdouble).nmant >= 63
needs_truth = pytest.mark.skipif(not WIDE, reason="this computer's long double is no longer than its double")


def sincos(angle: float) -> tuple[float, float]:
    sine, cosine = ffi.new("double *"), ffi.new("double *")
    lib.number_sincos(angle, sine, cosine)
    return sine[0], cosine[0]


def worst(values: list[float], truth: Any) -> float:
    """Largest error of `values` in units in the last place of `truth`."""
    exact = np.asarray(truth, dtype=np.longdouble)
    unit = np.spacing(np.abs(exact).astype(np.float64))
    return float(np.max(np.abs(np.array(values, dtype=np.longdouble) - exact) / unit))


def log_spread(low: float, high: float, count: int = 20_000, both: bool = True) -> Any:
    draw = np.random.default_rng(1)
    size = 10 ** draw.uniform(math.log10(low), math.log10(high), count)
    return size * draw.choice([-1.0, 1.0], count) if both else size


@given(st.floats(-1000, 1000))
def test_sine_and_cosine(angle: float) -> None:
    sine, cosine = sincos(angle)
    assert abs(sine - math.sin(angle)) < 4e-16
    assert abs(cosine - math.cos(angle)) < 4e-16


@needs_truth
@pytest.mark.parametrize(
    ("function", "truth", "arguments", "ulps"),
    [
        (lib.number_exp, np.exp, np.random.default_rng(2).uniform(-690, 690, 20_000), 2.0),
        (lib.number_exp, np.exp, log_spread(1e-12, 1), 2.0),
        (lib.number_log, np.log, log_spread(1e-300, 1e300, both=False), 2.0),
        (lib.number_log, np.log, 1 + log_spread(1e-12, 0.4), 2.0),
        (lib.number_tanh, np.tanh, log_spread(1e-12, 25), 3.0),
    ],
    ids=["exp", "exp-small", "log", "log-near-1", "tanh"],
)
def test_error_in_units_of_the_last_place(
    function: Callable[[float], float], truth: Callable[[Any], Any], arguments: Any, ulps: float
) -> None:
    values = [function(x) for x in arguments.tolist()]
    assert worst(values, truth(arguments.astype(np.longdouble))) < ulps


@needs_truth
def test_direction_in_units_of_the_last_place() -> None:
    y, x = log_spread(1e-6, 1e6), log_spread(1e-6, 1e6)[::-1].copy()
    x[::7] = y[::7] * (1 + 1e-9)  # close to the octants' borders
    x[::11] = y[::11] * 16 / 7
    values = [lib.number_atan2(a, b) for a, b in zip(y.tolist(), x.tolist(), strict=True)]
    assert worst(values, np.arctan2(y.astype(np.longdouble), x.astype(np.longdouble))) < 2.0


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_direction_is_that_of_the_library(y: float, x: float) -> None:
    """Also on the axes and for numbers too small to be normal; -pi and pi are one direction."""
    assume(x or y)  # 0, 0 has no direction
    assert abs(math.remainder(lib.number_atan2(y, x) - math.atan2(y, x), 2 * math.pi)) < 1e-15


def test_directions_of_the_axes() -> None:
    assert [lib.number_atan2(y, x) for y, x in [(0, 1), (1, 0), (0, -1), (-1, 0), (0, 0)]] == [
        0.0,
        math.pi / 2,
        math.pi,
        -math.pi / 2,
        0.0,
    ]


def test_functions_at_their_limits() -> None:
    assert lib.number_exp(0.0) == 1.0 and lib.number_log(1.0) == 0.0 and lib.number_tanh(0.0) == 0.0
    assert lib.number_exp(-1000.0) == 0.0 and math.isfinite(lib.number_exp(1000.0))
    assert lib.number_tanh(1e9) == 1.0 and lib.number_tanh(-1e9) == -1.0


@given(st.floats(-1e4, 1e4))
def test_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = lib.number_wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert abs(math.remainder(wrapped - angle, 2 * math.pi)) < 1e-11


def test_normal_draws_have_the_moments_of_3_1() -> None:
    """E11, noise (3.1): S = 0.5, sigma = 0.01, 10,000 draws."""
    draws = np.array([lib.noise_normal(7, 0, 5, step) for step in range(10_000)])
    readings = 0.5 * (1 + 0.01 * draws)
    assert readings.mean() == pytest.approx(0.5, abs=0.0002)
    assert readings.std() == pytest.approx(0.005, rel=0.03)
    assert abs((draws**3).mean()) < 0.1  # symmetric
    assert (draws**4).mean() == pytest.approx(3, abs=0.25)


def test_normal_draws_follow_the_bell_into_its_tails() -> None:
    """Kolmogorov-Smirnov at p = 0.001, and the share beyond the outermost layer (3.654) within its own spread."""
    count = 400_000
    draws = np.sort(np.array([lib.noise_normal(3, 1, 4, step) for step in range(count)]))
    expected = np.array([0.5 * math.erfc(-x / math.sqrt(2)) for x in draws])
    distance = np.abs(expected - (np.arange(count) + 0.5) / count).max()
    assert distance < 1.95 / math.sqrt(count)
    for bound in (2.0, 3.0, 3.654):
        share = math.erfc(bound / math.sqrt(2))
        seen = int((np.abs(draws) > bound).sum())
        assert abs(seen - share * count) < 4 * math.sqrt(share * count)


def test_layers_of_the_bell_have_equal_areas() -> None:
    """Of the table: rectangle i between the bell's heights at edges i + 1 and i; layer 0 with the tail."""
    edges = np.array(list(lib.noise_layer_edges))
    bell = np.exp(-0.5 * edges**2)
    area = edges[1] * bell[1] + math.sqrt(math.pi / 2) * math.erfc(edges[1] / math.sqrt(2))
    assert edges[-1] == 0.0 and (np.diff(edges) < 0).all()
    assert edges[0] * bell[1] == pytest.approx(area, rel=1e-13)
    layers = edges[1:256] * (bell[2:257] - bell[1:256])
    assert layers == pytest.approx(np.full(255, area), rel=1e-11)


def test_every_word_of_the_key_matters() -> None:
    base = (1, 2, 3, 4)
    values = {lib.noise_bits(*base)}
    for position in range(4):
        for bit in range(32):
            key = list(base)
            key[position] ^= 1 << bit
            values.add(lib.noise_bits(*key))
    assert len(values) == 1 + 4 * 32


def test_neighbouring_keys_are_not_correlated() -> None:
    a = np.array([lib.noise_normal(1, 0, 1, step) for step in range(5000)])
    for other in [(2, 0, 1), (1, 1, 1), (1, 0, 2)]:
        b = np.array([lib.noise_normal(*other, step) for step in range(5000)])
        assert abs(np.corrcoef(a, b)[0, 1]) < 0.05
    assert abs(np.corrcoef(a[1:], a[:-1])[0, 1]) < 0.05
