"""Normal draws: each is, bit for bit, what its definition gives, and together they are normal.

The definition is written once more below, in numpy's and Python's own integers and doubles.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from sim_bridge.compiled import lib

Words = NDArray[np.uint64]
Floats = NDArray[np.float64]

WORD = 2**64
EDGES = np.array(list(lib.noise_layer_edges))
words = st.one_of(st.integers(0, WORD - 1), st.sampled_from([0, 1, WORD - 1, WORD - 5, 2**63, 2**32 - 1]))
halves = st.one_of(st.integers(0, 2**32 - 1), st.sampled_from([0, 2**32 - 1]))


def mixed(x: Words) -> Words:
    """hash_mix, element by element."""
    with np.errstate(over="ignore"):
        x = x + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return x ^ (x >> np.uint64(31))


def mix(x: int) -> int:
    return int(mixed(np.array([x], dtype=np.uint64))[0])


def unit(bits: int) -> float:
    return (bits >> 11) * 2.0**-53


def ziggurat(bits: int) -> float:
    """Marsaglia and Tsang's method with 256 layers: the bell is asked where the rectangle does not settle it."""
    while True:
        layer = bits & 255
        x = ((bits >> 11) * 2.0**-52 - 1.0) * EDGES[layer]
        if abs(x) < EDGES[layer + 1]:
            return float(x)
        if layer == 0:
            return tail(bits, x < 0.0)
        low, high = (lib.number_exp(-0.5 * edge * edge) for edge in EDGES[layer : layer + 2])
        bits = mix(bits)
        if low + unit(bits) * (high - low) < lib.number_exp(-0.5 * x * x):
            return float(x)
        bits = mix(bits)


def tail(bits: int, negative: bool) -> float:
    while True:
        bits = mix(bits)
        x = -lib.number_log(1.0 - unit(bits)) / EDGES[1]
        bits = mix(bits)
        if 2.0 * -lib.number_log(1.0 - unit(bits)) >= x * x:
            return float(-(EDGES[1] + x) if negative else EDGES[1] + x)


KEY = mix(mix(0))  # of seed, robot and device 0


def draws_of(keys: Iterable[int]) -> Floats:
    """The draws whose keys, mixed with their steps, are these."""
    return np.array([lib.noise_normal(0, 0, 0, KEY ^ key) for key in keys])


def same_bits(a: Any, b: Any) -> bool:
    return bool(np.array_equal(np.asarray(a).view(np.uint64), np.asarray(b).view(np.uint64)))


@given(words, halves, halves, words)
def test_a_draw_is_that_of_the_definition(seed: int, robot: int, device: int, step: int) -> None:
    key = mix(mix(seed) ^ (robot << 32 | device))
    assert lib.noise_normal(seed, robot, device, step) == ziggurat(mix(key ^ step))


def test_the_rare_draws_are_those_of_the_definition() -> None:
    """All of 300,000 keys whose place is outside their layer's rectangle, where shortcuts might decide otherwise."""
    keys = np.arange(300_000, dtype=np.uint64)
    bits = mixed(keys)
    layer = (bits & np.uint64(255)).astype(int)
    x = ((bits >> np.uint64(11)).astype(float) * 2.0**-52 - 1.0) * EDGES[layer]
    inside = np.abs(x) < EDGES[layer + 1]
    draws = draws_of(keys.tolist())
    assert same_bits(draws[inside], x[inside])
    rare = np.flatnonzero(~inside)
    assert 3000 < rare.size < 6000 and np.unique(layer[rare]).size > 250
    assert same_bits(draws[rare], np.array([ziggurat(int(bits[i])) for i in rare]))


def unmixed(bits: int) -> int:
    """The key of which hash_mix makes these bits: each of its steps can be undone."""

    def undo_shift(y: int, by: int) -> int:
        x = y
        for _ in range(64 // by + 1):
            x = y ^ (x >> by)
        return x

    x = undo_shift(bits, 31) * pow(0x94D049BB133111EB, -1, WORD) % WORD
    x = undo_shift(x, 27) * pow(0xBF58476D1CE4E5B9, -1, WORD) % WORD
    return (undo_shift(x, 30) - 0x9E3779B97F4A7C15) % WORD


def test_extreme_places_in_every_layer() -> None:
    """The first and the last place, the middle, and both sides of the rectangle's borders."""
    bits = []
    for layer in range(256):
        border = int(EDGES[layer + 1] / EDGES[layer] * 2**52)
        for place in (
            0,
            1,
            2**53 - 1,
            2**52,
            2**52 - 1,
            *(2**52 + s * (border + d) for s in (-1, 1) for d in (-1, 0, 1)),
        ):
            bits.append(min(max(place, 0), 2**53 - 1) << 11 | layer)
    keys = [unmixed(word) for word in bits]
    assert mixed(np.array(keys, dtype=np.uint64)).tolist() == bits
    assert same_bits(draws_of(keys), np.array([ziggurat(word) for word in bits]))


# ---- together they are normal ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def many() -> Floats:
    """Four million draws of one device."""
    return np.array([lib.noise_normal(11, 1, 7, step) for step in range(4_000_000)])


@pytest.mark.unsanitized
def test_distribution_by_kolmogorov_and_smirnov(many: Floats) -> None:
    assert stats.kstest(many[:1_000_000], "norm").pvalue > 1e-3
    assert stats.kstest(many[::4], "norm").pvalue > 1e-3


@pytest.mark.unsanitized
def test_moments(many: Floats) -> None:
    """Mean, variance, skewness and excess within four of their own standard errors."""
    found = (many.mean(), many.var() - 1.0, stats.skew(many), stats.kurtosis(many))
    errors = np.sqrt(np.array([1.0, 2.0, 6.0, 24.0]) / many.size)
    assert (np.abs(found) < 4 * errors).all()


@pytest.mark.unsanitized
@pytest.mark.parametrize("bound", [2.0, 3.0, 3.654, 3.9106, 4.0, 4.5, 5.0])
def test_tails_hold_what_the_bell_says(many: Floats, bound: float) -> None:
    """Each side by itself, as an exact binomial test; 3.654 and 3.9106 are the outermost layers' edges."""
    for seen in (int((many > bound).sum()), int((many < -bound).sum())):
        assert stats.binomtest(seen, many.size, stats.norm.sf(bound)).pvalue > 1e-3


@pytest.mark.unsanitized
def test_shape_within_the_tail(many: Floats) -> None:
    """Beyond the ziggurat's last edge, as the normal distribution is there."""
    begin = EDGES[1]
    beyond = np.abs(many[np.abs(many) > begin])
    assert beyond.size > 500
    assert stats.kstest(beyond, lambda x: 1.0 - stats.norm.sf(x) / stats.norm.sf(begin)).pvalue > 1e-3


@pytest.mark.unsanitized
def test_neighbours_are_not_correlated(many: Floats) -> None:
    for lag in (1, 2, 3, 4, 64):
        assert abs(np.mean(many[lag:] * many[:-lag])) < 4 / math.sqrt(many.size)
