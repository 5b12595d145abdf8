"""H-bridges: the exact current of any switching against an integration in steps of 1 us."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.compiled import ffi, lib

OHM, HENRY, GEAR = 7.5, 2e-3, 48.0
CONSTANT = (6.0 - OHM * 0.16) / (48 * 250 * 2 * math.pi / 60)  # of a TT motor: 6 V, 0.16 A, 250 rpm
DROP_V, DROP_OHM, DIODE_V, DIODE_OHM = 1.4, 1.15, 0.7, 0.2
PACK_V = 7.4
COAST, BRAKE, FORWARD, BACKWARD = range(4)
US = 1e-6


def motor(henry: float = HENRY) -> object:
    values = {"torque_constant": CONSTANT, "emf_constant": CONSTANT, "resistance_ohm": OHM, "inductance_h": henry}
    return ffi.new("motor_dc_parameters *", values | {"gear": GEAR, "efficiency": 1.0, "torque_maximum_n_m": 1e9})


def flow(spans: Sequence[tuple[int, float]], speed: float, start: float = 0.0, henry: float = HENRY) -> list[float]:
    """Current at the end, charge and what the pack gave, of those spans of (switches, s)."""
    bridge = ffi.new("h_bridge_parameters *", [DROP_V, DROP_OHM, DIODE_V, DIODE_OHM])
    found, what = ffi.new("h_bridge_flow *", [start, 0.0, 0.0]), motor(henry)
    for switches, seconds in spans:
        lib.h_bridge_run(bridge, what, found, switches, PACK_V, speed, seconds)
    return [found.current, found.charge, found.drawn]


def voltage(switches: int, current: float, pack_v: float) -> float:
    """At the motor's leads, of the transistors and diodes that a current of that sign goes through, by the circuit."""
    sign = math.copysign(1.0, current)
    transistors = DROP_V + DROP_OHM * abs(current)
    diode = DIODE_V + DIODE_OHM * abs(current)
    if switches == BRAKE:
        return -sign * (transistors / 2 + diode)
    driven = {FORWARD: 1.0, BACKWARD: -1.0}.get(switches)
    if driven == sign:
        return sign * (pack_v - transistors)
    return -sign * (pack_v + 2 * diode)


def integrated(
    spans: Sequence[tuple[int, float]], speed: float, start: float = 0.0, pack_v: float = PACK_V
) -> list[float]:
    """The same, in steps of 1 us: valves let a current pass one way."""
    current, charge, drawn, emf = start, 0.0, 0.0, CONSTANT * GEAR * speed
    for switches, seconds in spans:
        driven = {FORWARD: 1.0, BACKWARD: -1.0, BRAKE: 0.0}.get(switches, math.nan)
        for _ in range(round(seconds / US)):
            before = current
            if before == 0.0:
                tries = [US / HENRY * (voltage(switches, tiny, pack_v) - emf) for tiny in (1e-9, -1e-9)]
                current = tries[0] if tries[0] > 0 else min(tries[1], 0.0)
            else:
                current += US / HENRY * (voltage(switches, before, pack_v) - OHM * before - emf)
                current = 0.0 if current * before < 0 else current
            mean = (before + current) / 2
            charge += US * mean
            if switches != BRAKE:
                drawn += US * abs(mean) * (1 if driven == math.copysign(1, mean) else -1)
    return [current, charge, drawn]


SPEEDS = (0.0, 12.0, -9.0, 52.0)  # rad/s: at rest, driven, driven against, faster than the pack


@pytest.mark.parametrize("off", [COAST, BRAKE, BACKWARD])
@pytest.mark.parametrize("hertz", [490, 976])
def test_pwm_is_that_of_an_integration_in_steps_of_1_us(off: int, hertz: int) -> None:
    """Fast decay, slow decay and reversal; in some the current is discontinuous, or the motor gives some back."""
    for duty, speed in itertools.product((0.1, 0.6), SPEEDS):
        on_s = round(duty / hertz / US) * US
        off_s = round(1 / hertz / US) * US - on_s
        spans = [(FORWARD, on_s), (off, off_s)] * 3
        total = sum(seconds for _, seconds in spans)
        expected = [value / unit for value, unit in zip(integrated(spans, speed), (1, total, total), strict=True)]
        found = [value / unit for value, unit in zip(flow(spans, speed), (1, total, total), strict=True)]
        assert found == pytest.approx(expected, abs=2e-3), (duty, speed)


def test_coasting_ends_the_current_within_the_pulse() -> None:
    """From 0.5 A, R' = 7.9 ohm with two diodes: t = L / R' ln(1 + 0.5 R' / (pack + 1.4 V)); the charge flows back."""
    ohm, back = OHM + 2 * DIODE_OHM, PACK_V + 2 * DIODE_V
    ends_s = HENRY / ohm * math.log1p(0.5 * ohm / back)
    assert 0.05e-3 < ends_s < 0.11e-3
    current, charge, drawn = flow([(COAST, 1e-3)], 0.0, start=0.5)
    assert current == 0.0 and drawn == -charge
    assert charge == pytest.approx(0.5 * HENRY / ohm - back / ohm * ends_s, rel=1e-12)


@pytest.mark.parametrize("henry", [0.0, HENRY])
def test_steady_currents_by_hand(henry: float) -> None:
    """Stalled (7.4 - 1.4) / (7.5 + 1.15); braked by (e - 0.7 - 0.7) / (7.5 + 0.575 + 0.2), not at all below 1.4 V."""
    long = [(FORWARD, 1.0)]
    assert flow(long, 0.0, henry=henry)[0] == pytest.approx(6.0 / 8.65)
    emf = CONSTANT * GEAR * 20.0
    assert flow([(BRAKE, 1.0)], 20.0, henry=henry)[0] == pytest.approx(-(emf - 1.4) / 8.275)
    assert flow([(BRAKE, 1.0)], 7.5, start=0.0, henry=henry) == [0.0, 0.0, 0.0]
    assert flow([(FORWARD, 1.0)], 34.0, henry=henry) == [0.0, 0.0, 0.0]  # e = 6.2 V: more than the pack less its drop
    assert flow([(COAST, 1.0)], 52.0, henry=henry)[2] < 0.0  # e = 9.5 V: through the diodes into the pack


@given(
    st.lists(st.tuples(st.integers(0, 3), st.floats(0, 5e-3)), min_size=1, max_size=6),
    st.floats(-50, 50),
    st.floats(-2, 2),
    st.floats(0.05, 0.95),
)
def test_how_a_span_is_cut_changes_nothing(
    spans: list[tuple[int, float]], speed: float, start: float, share: float
) -> None:
    cut = [(switches, seconds * part) for switches, seconds in spans for part in (share, 1 - share)]
    assert flow(cut, speed, start) == pytest.approx(flow(spans, speed, start), rel=1e-9, abs=1e-12)
