"""Elementary functions and random draws of the world."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge._core import ffi, lib


def sincos(angle: float) -> tuple[float, float]:
    sine, cosine = ffi.new("double *"), ffi.new("double *")
    lib.number_sincos(angle, sine, cosine)
    return sine[0], cosine[0]


@given(st.floats(-1000, 1000))
def test_sine_and_cosine(angle: float) -> None:
    sine, cosine = sincos(angle)
    assert abs(sine - math.sin(angle)) < 4e-16
    assert abs(cosine - math.cos(angle)) < 4e-16


@given(st.floats(-700, 700))
def test_exponential(x: float) -> None:
    assert lib.number_exp(x) == pytest.approx(math.exp(x), rel=1e-14)


@given(st.floats(1e-300, 1e300))
def test_logarithm(x: float) -> None:
    assert lib.number_log(x) == pytest.approx(math.log(x), rel=1e-14, abs=1e-15)


@given(st.floats(-50, 50))
def test_hyperbolic_tangent(x: float) -> None:
    assert lib.number_tanh(x) == pytest.approx(math.tanh(x), rel=1e-10, abs=1e-15)


@given(st.floats(-1e4, 1e4))
def test_wrapped_angle_is_the_same_direction(angle: float) -> None:
    wrapped = lib.number_wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert abs(math.remainder(wrapped - angle, 2 * math.pi)) < 1e-11


def test_normal_draws_have_the_moments_of_3_1() -> None:
    """Noise (3.1): S = 0.5, sigma = 0.01, 10,000 draws."""
    draws = np.array([lib.noise_normal(7, 0, 5, step) for step in range(10_000)])
    readings = 0.5 * (1 + 0.01 * draws)
    assert readings.mean() == pytest.approx(0.5, abs=0.0002)
    assert readings.std() == pytest.approx(0.005, rel=0.03)
    assert abs((draws**3).mean()) < 0.1  # symmetric
    assert (draws**4).mean() == pytest.approx(3, abs=0.25)


def test_uniform_draws_fill_the_unit_interval() -> None:
    draws = np.array([lib.noise_uniform(1, 2, 3, step) for step in range(20_000)])
    counts = np.histogram(draws, bins=20, range=(0, 1))[0]
    assert draws.min() >= 0 and draws.max() < 1
    assert ((counts - 1000) ** 2 / 1000).sum() < 45  # chi-square, 19 degrees of freedom, p = 0.0007


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
