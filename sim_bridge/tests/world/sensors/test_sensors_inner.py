"""Sensor models that need no echo: compass, accelerometer, light; tables of samples, sample and hold, units (E70)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of
from sim_bridge.tests.world.sensors.test_sensors import OUTLINE, View, made, source

# ---- compass, accelerometer ------------------------------------------------------------------------------------------


def test_compass_reads_the_heading_with_bias_and_noise() -> None:
    view = View(arena_of(), (0, 0, 3.0))
    parameters = ffi.new("compass_parameters *", {"sigma": 0.05, "bias": 0.3})
    noise = source()
    reads = np.array([lib.compass_read(parameters, view.c, 0.0, noise) for _ in range(5000)])
    assert (np.abs(reads) <= math.pi).all() and reads.min() < 0 < reads.max(), "wrapped at pi"
    error = np.angle(np.exp(1j * (reads - 3.3)))
    assert error.mean() == pytest.approx(0, abs=0.004) and error.std() == pytest.approx(0.05, rel=0.05)
    parameters.sigma = 0.0
    assert lib.compass_read(parameters, view.c, 0.0, noise) == pytest.approx(3.3 - 2 * math.pi, abs=1e-12)


@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3, 3))
def test_one_turn_in_place_finds_the_hard_iron(iron_x: float, iron_y: float, current: float) -> None:
    """The circle's centre is the offset, motor current included; taking it away gives the true heading."""
    parameters = ffi.new(
        "compass_parameters *", {"iron_x": iron_x, "iron_y": iron_y, "current_x": 0.02, "current_y": -0.01}
    )
    view, x, y = View(arena_of()), ffi.new("double *"), ffi.new("double *")
    field = []
    for heading in np.arange(64) * 2 * math.pi / 64:
        lib.compass_field(parameters, view.place(0, 0, heading).c, current, x, y)
        field.append((x[0], y[0]))
        raw = math.atan2(-y[0], x[0])
        assert (
            abs(math.remainder(lib.compass_read(parameters, view.c, current, source(False)) - raw, 2 * math.pi)) < 1e-12
        )
    centre = np.mean(field, axis=0)
    assert centre == pytest.approx([iron_x + 0.02 * current, iron_y - 0.01 * current], abs=1e-12)


@pytest.mark.parametrize("dt", [1e-4, 1e-2, 0.1])
def test_accelerometer_settles_at_a_equals_k_z_over_m(dt: float) -> None:
    """Fig. 1.10: m a = k z, for a slow spring and a stiff one, at small steps and large ones."""
    for stiffness in (0.5, 1e4):
        parameters = ffi.new("accelerometer_parameters *", [1e-3, stiffness, 0.03, 40.0, 0.0, 0.0])
        state = ffi.new("accelerometer_state *")
        for _ in range(max(200, int(2.0 / dt))):
            lib.accelerometer_step(parameters, state, 2.5, dt)
        assert state.deflection == pytest.approx(1e-3 * 2.5 / stiffness, rel=1e-6)
        assert lib.accelerometer_read(parameters, state, source(False)) == pytest.approx(2.5, rel=1e-6)


def test_accelerometer_oscillates_at_its_own_frequency() -> None:
    """z(t) of an undamped spring: a m / k (1 - cos wt); the implicit step at 10 us loses little."""
    parameters, state = (
        ffi.new("accelerometer_parameters *", [1e-3, 10.0, 0.0, 40.0, 0.0, 0.0]),
        ffi.new("accelerometer_state *"),
    )
    dt, omega = 1e-6, 100.0
    for step in range(1, 40_001):
        lib.accelerometer_step(parameters, state, 1.0, dt)
        if step % 8000 == 0:
            assert state.deflection == pytest.approx(1e-4 * (1 - math.cos(omega * step * dt)), abs=1e-6)


# ---- light -----------------------------------------------------------------------------------------------------------


def test_light_of_several_lamps_and_what_hides_them() -> None:
    parameters = {"x": 0.05, "y": 0.02, "heading": 0.4, "height": 0.09, "near_distance": 0.05, "gain": 1.0}
    sensor = made("phototransistor", parameters)
    lamps = [(1.0, 0.5, 2.0), (-1.0, 0.0, 5.0), (0.5, 2.0, 1.0)]
    lit = arena_of(outline=OUTLINE)
    for lamp_x, lamp_y, power in lamps:
        assert lib.arena_add_light(lit.handle, lamp_x, lamp_y, 0.5, power) >= 0
    x, y, heading = 0.1, -0.2, 0.6

    def truth(visible: list[tuple[float, float, float]]) -> float:
        px = x + 0.05 * math.cos(heading) - 0.02 * math.sin(heading)
        py = y + 0.05 * math.sin(heading) + 0.02 * math.cos(heading)
        total = 0.0
        for lx, ly, power in visible:
            facing = math.cos(math.atan2(ly - py, lx - px) - heading - 0.4)
            total += power * max(0.0, facing) / (0.05**2 + (lx - px) ** 2 + (ly - py) ** 2)
        return total

    view = View(lit, (x, y, heading))
    assert lib.phototransistor_read(sensor, view.c, source(False)) == pytest.approx(truth(lamps), rel=1e-12)
    low = {"x": 0.6, "y": 0.2, "radius": 0.1, "height": 0.05}
    for height, visible in ((0.05, lamps), (0.2, lamps[1:])):
        hidden = View(lit, (x, y, heading), [low | {"height": height}])
        sensed = lib.phototransistor_read(sensor, hidden.c, source(False))
        assert sensed == pytest.approx(truth(visible), rel=1e-12)
    assert lib.phototransistor_read(sensor, View(arena_of(outline=OUTLINE)).c, source(False)) == 0.0


def test_decay_time_is_short_in_bright_light() -> None:
    assert lib.phototransistor_decay_time(2.0, 1e-3, 0.02) == pytest.approx(5e-4)
    assert lib.phototransistor_decay_time(0.0, 1e-3, 0.02) == 0.02


# ---- tables, sample and hold, units ----------------------------------------------------------------------------------


def table(distances: list[float], angles: list[float], samples: list[list[Any]]) -> Any:
    rows = [np.asarray(bin_samples, dtype=float) for row in samples for bin_samples in row]
    flat = np.concatenate(rows)
    handle = lib.table_noise_new(
        ffi.new("double[]", distances),
        len(distances),
        ffi.new("double[]", angles),
        len(angles),
        ffi.new("int[]", [len(row) for row in rows]),
        ffi.new("double[]", flat.tolist()),
    )
    return handle if handle == ffi.NULL else ffi.gc(handle, lib.table_noise_destroy)


def test_e70_table_fed_from_3_1_reproduces_it() -> None:
    """Samples S(d, angle) (1 + 0.02 xi); on a bin the table's readings have their mean and spread within 5 %."""
    draw = np.random.default_rng(4)
    distances, angles = [0.2, 0.4, 0.6, 0.8], [0.0, 0.3, 0.6]

    def clean(d: float, a: float) -> float:
        return (0.03 / d**2 + 0.1) * math.cos(a)

    samples = [[clean(d, a) * (1 + 0.02 * draw.standard_normal(2000)) for a in angles] for d in distances]
    sampler, noise = table(distances, angles, samples), source()
    for d in distances:
        for a in angles:
            reads = np.array([lib.table_noise_read(sampler, d, a, noise) for _ in range(4000)])
            assert reads.mean() == pytest.approx(clean(d, a), rel=0.05)
            assert reads.std() == pytest.approx(0.02 * clean(d, a), rel=0.05)


@given(st.floats(0, 1), st.floats(0, 1))
def test_table_interpolates_bilinearly(along: float, across: float) -> None:
    """A table of single samples of a bilinear function is that function."""
    sampler = table([1.0, 3.0], [-1.0, 1.0], [[[2.0], [4.0]], [[10.0], [20.0]]])
    truth = (2 + 2 * across) * (1 - along) + (10 + 10 * across) * along
    read = lib.table_noise_read(sampler, 1 + 2 * along, -1 + 2 * across, source())
    assert read == pytest.approx(truth, rel=1e-12)
    assert lib.table_noise_read(sampler, 0.0, -5.0, source()) == 2.0
    assert lib.table_noise_read(sampler, 9.0, 5.0, source()) == 20.0


def test_sample_and_hold_keeps_its_own_grid() -> None:
    hold = ffi.new("sample_hold *", {"period": 0.04})
    due = []
    for step in range(100):
        time = step * 0.01
        if lib.sample_hold_due(hold, time):
            lib.sample_hold_take(hold, time, step)
            due.append(step)
        assert time - hold.taken <= 0.04
    assert due == list(range(0, 100, 4))


def test_a_unit_keeps_its_bias_and_units_differ() -> None:
    draws = np.array([lib.unit_normal(serial, 3, 0) for serial in range(1, 2001)])
    assert draws.mean() == pytest.approx(0, abs=0.1) and draws.std() == pytest.approx(1, abs=0.06)
    assert lib.unit_normal(17, 3, 0) == draws[16] != lib.unit_normal(17, 3, 1)
    assert lib.unit_normal(0, 3, 0) == 0.0
