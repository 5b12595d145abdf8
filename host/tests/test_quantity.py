"""Quantities at the command line: bare numbers, units, and what is none."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.cli import quantity
from boebot.errors import BoebotError


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("0.05", "s", 0.05),
        ("50ms", "s", 0.05),
        ("70 ms", "s", 0.07),
        ("2min", "s", 120.0),
        (".5h", "s", 1800.0),
        ("1e-2s", "s", 0.01),
        ("250us", "s", 250e-6),
        ("inf", "s", math.inf),
        ("-20cm", "m", -0.2),
        ("3.3mm", "m", 0.0033),
        ("+90deg", "rad", math.pi / 2),
        ("-1.5rad", "rad", -1.5),
        ("4800mV", "V", 4.8),
        ("1.5ms", "us", 1500.0),
        ("7", "ticks", 7.0),
        ("7ticks", "ticks", 7.0),
    ],
)
def test_a_number_has_the_given_unit_or_its_own(text: str, unit: str, expected: float) -> None:
    assert quantity.parse(text, unit) == expected


@pytest.mark.parametrize(
    ("text", "unit", "sentence"),
    [
        ("5m", "s", "'5m' is no time; expected a number, in s, or with another unit: h, min, ms, us"),
        ("ten", "m", "'ten' is no length; expected a number, in m, or with another unit: cm, mm"),
        ("90°", "rad", "'90°' is no angle; expected a number, in rad, or with another unit: deg"),
        ("", "s", "'' is no time; "),
        ("1.2.3", "s", "'1.2.3' is no time; "),
        ("1,5", "s", "'1,5' is no time; "),
        ("ms", "s", "'ms' is no time; "),
        ("3ms", "ticks", "'3ms' is no number of ticks; expected a number, in ticks"),
    ],
)
def test_what_is_none_is_refused_with_the_units_there_are(text: str, unit: str, sentence: str) -> None:
    with pytest.raises(BoebotError) as caught:
        quantity.parse(text, unit)
    assert str(caught.value).startswith(sentence)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_bare_number_is_read_as_python_reads_it(value: float) -> None:
    assert quantity.parse(repr(value), "s") == value
