"""PROTOCOL.md, its table of telemetry: what is at the pins, as telemetry tells it."""

from __future__ import annotations

import pytest

from boebot.link import messages
from boebot.link.messages import PingStatus
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, Rig
from sim_bridge.bench.uno import Uno
from sim_bridge.boards.board import Level

pytestmark = [pytest.mark.emulated, pytest.mark.uno(robot="shieldbot", motors=False)]

PING, LED, RECEIVER = 8, 9, 10
LOOK_S = 0.0002  # how often a test looks at what the board does to a pin: its answer is that late at the soonest
READINGS_S = 0.25  # five of the Ping's, and of the IR pairs'
MS = CYCLES_PER_S // 1000


@pytest.mark.promise("edges since reset", "time between the last two edges")
def test_edges_are_counted_and_timed(rig: Rig) -> None:
    rig.set("encoder_gap", 0)
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


@pytest.mark.promise("0: none within 0.5 s")
def test_edge_period_is_forgotten_after_half_a_second(rig: Rig) -> None:
    rig.board.square_wave(16, period=2 * CYCLES_PER_S // 500, seconds=0.1)
    rig.listen(0.1)
    assert rig.latest().edge_period_left > 0
    rig.listen(0.6)
    assert rig.latest().edge_period_left == 0


@pytest.mark.promise("signed only where the encoder knows direction")
@pytest.mark.uno(robot="shieldbot-quad")
def test_quadrature_counts_both_directions(uno: Uno) -> None:
    rig = Rig(uno)
    rig.start()
    rig.set("encoder_gap", 0)
    rig.latest()  # it counts from the next tick on
    now = rig.board.cycle + 64_000
    before = rig.telemetry[-1].encoder_left
    a_then_b = [(14, 1), (15, 1), (14, 0), (15, 0)]
    for i, (pin, level) in enumerate(a_then_b * 5):
        rig.board.drive(pin, level, now + i * 16_000)
    rig.listen(0.1)
    forward = rig.latest().encoder_left - before
    now = rig.board.cycle + 64_000
    for i, (pin, level) in enumerate([(15, 1), (14, 1), (15, 0), (14, 0)] * 3):
        rig.board.drive(pin, level, now + i * 16_000)
    rig.listen(0.1)
    assert abs(forward) == 20
    assert rig.latest().encoder_left - before == forward - (12 if forward > 0 else -12)


@pytest.mark.promise("the line fired above its limit in the last tick and was masked until the tick ended")
def test_noise_line_is_masked_and_the_tick_goes_on(rig: Rig) -> None:
    rig.set("encoder_gap", 0)
    rig.board.square_wave(16, period=160, seconds=0.5)  # 100 kHz
    rig.board.square_wave(17, period=2 * CYCLES_PER_S // 500, seconds=0.5)  # a wheel that turns
    before = rig.latest()
    frames = rig.listen(0.3)
    assert len(frames) >= 29, "the tick stopped"
    assert frames[-1].overruns == frames[0].overruns
    assert all(f.status & messages.Status.ENCODER_LEFT_MASKED for f in frames[1:])
    assert not any(f.status & messages.Status.ENCODER_RIGHT_MASKED for f in frames)
    assert not any(f.edge_period_left for f in frames[1:]), "noise is no speed"
    seconds = (frames[-1].tick - before.tick) * 0.010
    assert abs(frames[-1].encoder_right - before.encoder_right - 500 * seconds) <= 1, "the other wheel counts on"
    rig.listen(0.3)
    assert not rig.latest().status & messages.Status.ENCODER_LEFT_MASKED


@pytest.mark.promise("Whiskers, debounced: a set bit is a pressed whisker")
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


@pytest.mark.promise("length of the last echo pulse where ping_status is ok, else 0")
@pytest.mark.parametrize("distance", [0.10, 0.50, 1.00, 2.50])
def test_echo_becomes_distance(rig: Rig, distance: float) -> None:
    """A pulse of the data sheet's length on the pin, at 20 °C: 343.5 m/s, there and back."""
    echo_us = 2 * distance / (331.5 + 0.6 * 20) * 1e6
    before = Level.LOW

    def answer(cycle: int, level: Level) -> None:
        nonlocal before
        if before == Level.HIGH:  # a trigger ends
            begin = cycle + 750 * CYCLES_PER_US
            rig.board.drive(PING, 1, begin)
            rig.board.drive(PING, 0, begin + round(echo_us * CYCLES_PER_US))
        before = level

    rig.board.board.on_edge(PING, answer)
    rig.listen(0.15)
    now = rig.latest()
    assert now.ping_status == PingStatus.OK
    assert abs(now.ping_echo - echo_us) <= 1.0
    assert now.ping_age <= 6


@pytest.mark.promise("the sensor answered, but heard no echo")
@pytest.mark.promise("no rising edge after the trigger, or a pulse that does not end: no sensor, or its wire is broken")
def test_a_ping_that_comes_and_goes(rig: Rig) -> None:
    rig.listen(READINGS_S)
    assert rig.latest().ping_status == PingStatus.NOTHING_NEAR, "an empty field"
    rig.board.unplug("ping")
    rig.listen(READINGS_S)
    now = rig.latest()
    assert (now.ping_status, now.ping_echo) == (PingStatus.ABSENT, 0)
    rig.board.plug("ping")
    rig.listen(READINGS_S)
    assert rig.latest().ping_status == PingStatus.NOTHING_NEAR


@pytest.mark.promise("age of the older IR reading; 255: never or older")
def test_a_receiver_that_is_stuck_low_sees_no_object(rig: Rig) -> None:
    rig.board.drive(RECEIVER, 0)
    rig.listen(READINGS_S)
    frames = rig.listen(READINGS_S)
    assert {f.infrared for f in frames} == {0}
    assert max(f.infrared_age for f in frames) <= 7, "it goes on to measure"


@pytest.mark.promise("IR pairs at the last burst: a set bit is an object seen")
def test_a_receiver_that_answers_the_burst_sees_an_object(rig: Rig) -> None:
    seen = rig.board.cycle
    rig.board.drive(RECEIVER, 1)
    for _ in range(round(READINGS_S / LOOK_S)):
        rig.listen(LOOK_S)
        log = rig.board.pin_log(4000)
        lit = log["cycle"][(log["pin"] == LED) & (log["level"] == 1) & (log["cycle"] > seen + 5 * MS)]
        if len(lit):
            seen = int(lit[0])
            rig.board.drive(RECEIVER, 0, seen + 500 * CYCLES_PER_US)
            rig.board.drive(RECEIVER, 1, seen + 1300 * CYCLES_PER_US)
    now = rig.telemetry[-1]
    assert now.infrared == messages.Infrared.LEFT
    assert now.infrared_age <= 7


@pytest.mark.promise("supply voltage against the bandgap; 0: not yet measured")
def test_supply_is_told_in_millivolts(rig: Rig) -> None:
    """From a whole number: 1.1 V in 1/1024 of the supply (ATmega328P data sheet, 24.7)."""
    for volts in (4.4, 5.0, 5.5):
        rig.board.supply(volts)
        rig.listen(0.05)
        assert rig.latest().supply == 1100 * 1024 // int(1.1 * 1024 / volts)
