"""Normal draws in blocks: each is, bit for bit, the draw that noise.h gives for it alone, and together they are normal.

The definition is written once more below, in numpy's and Python's own integers and doubles.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import stats

from sim_bridge._core import ffi, lib

Words = NDArray[np.uint64]
Floats = NDArray[np.float64]

WORD = 2**64
EDGES = np.array([lib.noise_layer_edge(i) for i in range(257)])
words = st.one_of(st.integers(0, WORD - 1), st.sampled_from([0, 1, WORD - 1, WORD - 5, 2**63, 2**32 - 1]))
halves = st.one_of(st.integers(0, 2**32 - 1), st.sampled_from([0, 2**32 - 1]))


def mixed(x: Words) -> Words:
    """noise_mix, element by element."""
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


def block(keys: Words, offset: int = 0) -> Floats:
    """Draws of the keys, both arrays `offset` words behind a register's border; the words around stay as they are."""
    given_keys = np.zeros(keys.size + offset, dtype=np.uint64)
    given_keys[offset:] = keys
    draws = np.full(keys.size + offset + 1, np.inf)
    lib.noise_block_normals(
        ffi.from_buffer("uint64_t[]", given_keys) + offset, ffi.from_buffer("double[]", draws) + offset, keys.size
    )
    assert np.isinf(draws[:offset]).all() and np.isinf(draws[-1])
    return draws[offset:-1]


def same_bits(a: Any, b: Any) -> bool:
    return bool(np.array_equal(np.asarray(a).view(np.uint64), np.asarray(b).view(np.uint64)))


@given(words, halves, halves, words, st.integers(0, 150), st.integers(0, 3))
def test_a_source_gives_what_single_draws_give(
    seed: int, robot: int, device: int, step: int, count: int, offset: int
) -> None:
    """Any length, any place in memory, steps that roll over."""
    source, single = (
        ffi.new("noise_source *", {"seed": seed, "robot": robot, "device": device, "step": step, "on": 1})
        for _ in range(2)
    )
    draws = np.full(count + offset + 1, np.inf)
    lib.noise_block_next(source, ffi.from_buffer("double[]", draws) + offset, count)
    alone = [lib.noise_normal(seed, robot, device, (step + i) % WORD) for i in range(count)]
    assert same_bits(draws[offset:-1], np.array(alone, dtype=float))
    assert source.step == (step + count) % WORD and np.isinf(draws[:offset]).all() and np.isinf(draws[-1])
    # A second block goes on where the first one ended, whatever the lengths.
    lib.noise_block_next(single, ffi.from_buffer("double[]", draws), count // 3)
    lib.noise_block_next(single, ffi.from_buffer("double[]", draws) + count // 3, count - count // 3)
    assert same_bits(draws[:count], np.array(alone, dtype=float))


def test_a_source_that_is_off_gives_zeros_and_keeps_its_step() -> None:
    source = ffi.new("noise_source *", {"seed": 1, "step": 9, "on": 0})
    draws = np.full(10, np.inf)
    lib.noise_block_next(source, ffi.from_buffer("double[]", draws), 9)
    assert draws.tolist() == [0.0] * 9 + [math.inf] and source.step == 9


@given(st.lists(words, max_size=70), st.integers(0, 3))
def test_draws_of_keys_are_those_of_the_definition(keys: list[int], offset: int) -> None:
    asked = np.array(keys, dtype=np.uint64)
    assert same_bits(block(asked, offset), np.array([ziggurat(mix(key)) for key in keys]))


def test_the_rare_draws_are_those_of_the_definition() -> None:
    """All of 300,000 keys whose place is outside their layer's rectangle, where shortcuts might decide otherwise."""
    keys = np.arange(300_000, dtype=np.uint64)
    bits = mixed(keys)
    layer = (bits & np.uint64(255)).astype(int)
    x = ((bits >> np.uint64(11)).astype(float) * 2.0**-52 - 1.0) * EDGES[layer]
    inside = np.abs(x) < EDGES[layer + 1]
    draws = block(keys)
    assert same_bits(draws[inside], x[inside])
    rare = np.flatnonzero(~inside)
    assert 3000 < rare.size < 6000 and np.unique(layer[rare]).size > 250
    assert same_bits(draws[rare], np.array([ziggurat(int(bits[i])) for i in rare]))


def unmixed(bits: int) -> int:
    """The key of which noise_mix makes these bits: each of its steps can be undone."""

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
    assert same_bits(block(np.array(keys, dtype=np.uint64)), np.array([ziggurat(word) for word in bits]))


def test_heights_are_the_bell_at_the_edges() -> None:
    assert [lib.noise_layer_height(i) for i in range(257)] == [lib.number_exp(-0.5 * x * x) for x in EDGES]
    assert [lib.noise_layer_height(i) for i in (-1, 257)] == [0.0, 0.0]


# ---- together they are normal ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def many() -> Floats:
    """Four million draws of one device."""
    draws = np.empty(4_000_000)
    lib.noise_block_next(
        ffi.new("noise_source *", {"seed": 11, "robot": 1, "device": 7, "on": 1}),
        ffi.from_buffer("double[]", draws),
        draws.size,
    )
    return draws


def test_distribution_by_kolmogorov_and_smirnov(many: Floats) -> None:
    assert stats.kstest(many[:1_000_000], "norm").pvalue > 1e-3
    assert stats.kstest(many[::4], "norm").pvalue > 1e-3


def test_moments(many: Floats) -> None:
    """Mean, variance, skewness and excess within four of their own standard errors."""
    found = (many.mean(), many.var() - 1.0, stats.skew(many), stats.kurtosis(many))
    errors = np.sqrt(np.array([1.0, 2.0, 6.0, 24.0]) / many.size)
    assert (np.abs(found) < 4 * errors).all()


@pytest.mark.parametrize("bound", [2.0, 3.0, 3.654, 3.9106, 4.0, 4.5, 5.0])
def test_tails_hold_what_the_bell_says(many: Floats, bound: float) -> None:
    """Each side by itself, as an exact binomial test; 3.654 and 3.9106 are the outermost layers' edges."""
    for seen in (int((many > bound).sum()), int((many < -bound).sum())):
        assert stats.binomtest(seen, many.size, stats.norm.sf(bound)).pvalue > 1e-3


def test_shape_within_the_tail(many: Floats) -> None:
    """Beyond the ziggurat's last edge, as the normal distribution is there."""
    begin = EDGES[1]
    beyond = np.abs(many[np.abs(many) > begin])
    assert beyond.size > 500
    assert stats.kstest(beyond, lambda x: 1.0 - stats.norm.sf(x) / stats.norm.sf(begin)).pvalue > 1e-3


def test_neighbours_and_lanes_are_not_correlated(many: Floats) -> None:
    for lag in (1, 2, 3, 4, 64):
        assert abs(np.mean(many[lag:] * many[:-lag])) < 4 / math.sqrt(many.size)
    for lane in range(4):
        assert stats.kstest(many[lane:1_000_000:4], "norm").pvalue > 1e-3
