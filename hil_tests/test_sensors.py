"""From pins to telemetry: encoders, whiskers, IR pairs, Ping."""

from __future__ import annotations

import itertools

import pytest

from boebot.link import messages
from rig import CYCLES_PER_S, CYCLES_PER_US, Rig


def test_edges_are_counted_and_timed(rig: Rig) -> None:
    before = rig.latest()
    rig.board.square_wave(16, period=2 * CYCLES_PER_S // 500, seconds=0.2)  # 500 edges/s: 100 edges
    rig.board.square_wave(17, period=2 * CYCLES_PER_S // 125, seconds=0.2)  # 125 edges/s: 25 edges
    frames = rig.listen(0.19)
    after = rig.listen(0.1)[-1]
    assert after.encoder_left - before.encoder_left == 100
    assert after.encoder_right - before.encoder_right == 25
    unit = 16  # us per count
    assert abs(frames[-1].edge_period_left * unit - 2000) <= 2 * unit
    assert abs(frames[-1].edge_period_right * unit - 8000) <= 2 * unit


def test_edge_period_is_forgotten_after_half_a_second(rig: Rig) -> None:
    rig.board.square_wave(16, period=2 * CYCLES_PER_S // 500, seconds=0.1)
    rig.listen(0.1)
    assert rig.latest().edge_period_left > 0
    rig.listen(0.6)
    assert rig.latest().edge_period_left == 0


def test_quadrature_counts_both_directions(board_url: str) -> None:
    with Rig.open(board_url, robot="shieldbot-quad") as rig:
        rig.start()
        now = rig.board.cycle + 64_000
        a_then_b = [(14, 1), (15, 1), (14, 0), (15, 0)]
        for i, (pin, level) in enumerate(a_then_b * 5):
            rig.board.drive(pin, level, now + i * 16_000)
        rig.listen(0.1)
        forward = rig.latest().encoder_left
        now = rig.board.cycle + 64_000
        for i, (pin, level) in enumerate([(15, 1), (14, 1), (15, 0), (14, 0)] * 3):
            rig.board.drive(pin, level, now + i * 16_000)
        rig.listen(0.1)
        assert abs(forward) == 20
        assert rig.latest().encoder_left == forward - (12 if forward > 0 else -12)


def test_noise_line_is_masked_and_the_tick_goes_on(rig: Rig) -> None:
    rig.board.square_wave(16, period=160, seconds=0.5)  # 100 kHz
    frames = rig.listen(0.4)
    assert len(frames) >= 39, "the tick stopped"
    assert frames[-1].overruns == frames[0].overruns
    assert any(f.status & messages.Status.ENCODER_LEFT_MASKED for f in frames)
    assert not any(f.status & messages.Status.ENCODER_RIGHT_MASKED for f in frames)
    rig.listen(0.3)
    assert not rig.latest().status & messages.Status.ENCODER_LEFT_MASKED


@pytest.mark.parametrize(("pin", "bit"), [(5, messages.Whiskers.LEFT), (7, messages.Whiskers.RIGHT)])
def test_whisker_shows_within_two_ticks(rig: Rig, pin: int, bit: int) -> None:
    for phase in range(0, 160_000, 23_000):
        pressed_at = rig.board.cycle + 200_000 + phase
        rig.board.drive(pin, 0, pressed_at)
        seen = [f for f in rig.listen(0.06) if f.whiskers & bit]
        assert seen, "the whisker never showed"
        tick_start = seen[0].time * CYCLES_PER_US + rig.board.reset_cycle
        assert tick_start - pressed_at <= 2 * 160_000
        rig.board.drive(pin, 2, rig.board.cycle)
        rig.listen(0.06)
        assert not rig.latest().whiskers


def test_bounce_of_a_millisecond_is_one_press(rig: Rig) -> None:
    start = rig.board.cycle + 100_000
    for i in range(9):
        rig.board.drive(5, 2 * (i % 2), start + i * 2_000)
    shown = [bool(f.whiskers & messages.Whiskers.LEFT) for f in rig.listen(0.1)]
    assert sum(a != b for a, b in itertools.pairwise(shown)) == 1 and shown[-1]


@pytest.mark.parametrize("distance", [0.10, 0.50, 1.00, 2.50])
def test_echo_becomes_distance(rig: Rig, distance: float) -> None:
    """A pulse of the data sheet's length on the pin, at 20 °C: 343.5 m/s, there and back."""
    echo_us = 2 * distance / (331.5 + 0.6 * 20) * 1e6
    rig.board.answer_ping(echo_us)
    rig.listen(0.15)
    now = rig.latest()
    assert abs(now.ping_echo - echo_us) <= 1.0
    assert now.ping_age <= 6


def test_silence_is_no_echo(rig: Rig) -> None:
    rig.board.answer_ping(500.0)
    rig.listen(0.15)
    assert rig.latest().ping_echo > 0
    rig.board.answer_ping(None)
    rig.listen(0.2)
    assert rig.latest().ping_echo == 0


def test_infrared_receiver_low_after_the_burst_is_an_object(rig: Rig) -> None:
    rig.listen(0.2)
    assert rig.latest().infrared == 0, "an empty field"
    rig.board.drive(10, 0, rig.board.cycle)
    rig.listen(0.15)
    now = rig.latest()
    assert now.infrared == messages.Infrared.LEFT
    assert now.infrared_age <= 6


def test_infrared_burst_is_38_khz_for_a_millisecond(rig: Rig) -> None:
    rig.listen(0.5)
    log = rig.board.pin_log()
    for pin in (9, 2):
        rises = [int(edge["cycle"]) for edge in log[log["pin"] == pin] if edge["level"] == 1]
        bursts: list[list[int]] = []
        for cycle in rises:
            if bursts and cycle - bursts[-1][-1] < 16_000:
                bursts[-1].append(cycle)
            else:
                bursts.append([cycle])
        assert 9 <= len(bursts) <= 11, "20 Hz"
        for burst in bursts[1:-1]:
            duration = burst[-1] - burst[0]
            assert 0.9e-3 <= duration / CYCLES_PER_S <= 1.1e-3
            frequency = (len(burst) - 1) * CYCLES_PER_S / duration
            assert abs(frequency - 38_000) <= 300
