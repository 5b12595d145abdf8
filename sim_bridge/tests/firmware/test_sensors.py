"""From pins to telemetry: encoders, whiskers, IR pairs, Ping."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
import pytest

from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, FRAME_CYCLES, TICK_S
from sim_bridge.tests.rigs import SessionRig

pytestmark = pytest.mark.unsanitized


def test_sensors_go_on_when_parameters_are_reset(rig: SessionRig) -> None:
    assert rig.request(messages.ResetParameters).status == messages.AnswerStatus.OK
    rig.listen(0.3)
    seen = rig.latest()
    assert seen.ping_age < 10 and seen.infrared_age < 10


@pytest.mark.parametrize("robot", ["boebot", "shieldbot", "shieldbot-quad"])
def test_wheels_at_rest_count_nothing_from_power_on(board_url: str, robot: str) -> None:
    with SessionRig.open(board_url, robot=robot) as rig:
        rig.start()
        seen = rig.latest()
        assert (seen.encoder_left, seen.encoder_right) == (0, 0)


@dataclass(frozen=True)
class Noise:
    """What a bad line does: a rise every `period` cycles, a fall `high` cycles later; on every line of `pins`."""

    period: int
    high: int
    pins: tuple[int, ...] = (16,)
    robot: str = "shieldbot"

    def __str__(self) -> str:
        return f"{self.robot}-{len(self.pins)}x{self.high}of{self.period}"

    def drive(self, rig: SessionRig, seconds: float) -> None:
        start = rig.board.cycle + 100
        for i, pin in enumerate(self.pins):
            for rise in range(start + 3 * i, start + round(seconds * CYCLES_PER_S), self.period):
                rig.board.drive(pin, 1, rise)
                rig.board.drive(pin, 0, rise + self.high)


SQUARE = [Noise(2 * half, half) for half in (30, 40, 56, 72, 80, 100, 150, 200)]
SPIKES = [Noise(period, high) for period in (80, 110, 160, 200, 240, 266) for high in (8, 16, 24)]
MANY = [Noise(p, h, (16, 17)) for p, h in ((160, 80), (200, 8), (400, 200))]
QUAD = [Noise(p, h, (14, 15, 16, 17), "shieldbot-quad") for p, h in ((160, 80), (266, 8), (400, 200))]


@pytest.mark.soak_on_native
@pytest.mark.parametrize("noise", SQUARE + SPIKES + MANY + QUAD, ids=str)
def test_noise_and_a_saturated_line_disturb_neither_tick_nor_pulse(board_url: str, noise: Noise) -> None:
    """With the UART saturated both ways: no tick missed, pulses exact to a microsecond, the noise reported. Bytes may
    be lost."""
    with SessionRig.open(board_url, robot=noise.robot) as rig:
        rig.start()
        rig.set("encoder_gap", 0)
        request = rig.numbered(messages.GetParameter, 0)

        def saturate() -> None:
            """In a tick: 456 of 500 bytes come in, as many go out."""
            wire = b""
            for _ in range(12):
                wire += rig.encode(rig.signal(0.3, -0.3)) + rig.encode(request) * 2
            rig.transport.write(wire)
            rig.listen(TICK_S)

        for _ in range(5):
            saturate()
        first = len(rig.telemetry) + 2
        before = rig.board.counters()
        for _ in range(12):
            noise.drive(rig, TICK_S)
            saturate()
        frames = rig.telemetry[first:]
        assert [f.tick - frames[0].tick for f in frames] == list(range(len(frames)))
        assert len(frames) >= 9
        assert frames[-1].overruns == 0
        assert all(f.status & messages.Status.ENCODER_LEFT_MASKED for f in frames)
        assert rig.board.counters()["resets"] == before["resets"]
        for pin in (13, 12):
            pulses = rig.pulses(pin)[1:]
            assert len(pulses) >= 5
            assert np.all(np.abs(pulses[:, 1] - 1560 * CYCLES_PER_US) <= 16)
            assert np.all(np.abs(np.diff(pulses[:, 0]) - FRAME_CYCLES) <= 16)


def test_a_line_that_comes_back_has_no_period_across_the_gap(rig: SessionRig) -> None:
    """Switched off and on, and after noise: the first period is that of two edges that were both seen."""
    devices = messages.PARAMETERS["devices"]
    expected = 13_000  # us between edges
    rig.board.square_wave(16, period=2 * expected * CYCLES_PER_US, seconds=1.0)
    rig.listen(0.1)
    everything = rig.request(messages.GetParameter, devices.id).value
    rig.request(messages.SetParameter, devices.id, everything & ~int(messages.Devices.ENCODER))
    rig.listen(0.1)
    assert rig.latest().edge_period_left == 0
    rig.request(messages.SetParameter, devices.id, everything)
    periods = {f.edge_period_left * 16 for f in rig.listen(0.2)}
    assert all(period == 0 or abs(period - expected) <= 16 for period in periods), periods
    assert max(periods) > 0

    rig.board.square_wave(16, period=160, seconds=0.05)
    rig.listen(0.06)
    rig.board.square_wave(16, period=2 * expected * CYCLES_PER_US, seconds=1.0)
    rig.latest()
    periods = {f.edge_period_left * 16 for f in rig.listen(0.2)}
    assert all(period == 0 or abs(period - expected) <= 16 for period in periods), periods
    assert max(periods) > 0


PHASES_S = (0.0, 0.0011, 0.0037, 0.0062, 0.0093)  # where in the tick a test begins


@pytest.mark.parametrize("phase_s", PHASES_S)
def test_bounce_of_a_millisecond_is_one_press(rig: SessionRig, phase_s: float) -> None:
    rig.listen(0.02 + phase_s)
    shown = [bool(rig.telemetry[-1].whiskers & messages.Whiskers.LEFT)]
    start = rig.board.cycle + 100_000
    for i in range(9):
        rig.board.drive(5, 2 * (i % 2), start + i * 2_000)
    shown += [bool(f.whiskers & messages.Whiskers.LEFT) for f in rig.listen(0.1)]
    assert sum(a != b for a, b in itertools.pairwise(shown)) == 1 and shown[-1]
    presses = {event.number for event in rig.events if event.kind == messages.EventKind.WHISKERS}
    assert len(presses) == 1, "reported once, however often it is repeated"


@pytest.mark.parametrize("phase_s", PHASES_S)
def test_noise_on_the_ping_pin_is_no_echo(rig: SessionRig, phase_s: float) -> None:
    """Of a measurement that begins in the noise. One that was under way ends with the first edge of the noise: in an
    empty field the Ping holds its pulse for 18.5 ms, and noise that cuts it short looks like an echo."""
    rig.listen(0.05 + phase_s)
    rig.board.square_wave(8, period=160, seconds=0.5)
    period_s = TICK_S * rig.request(messages.GetParameter, messages.PARAMETERS["ping_period"].id).value
    rig.listen(period_s + 2 * TICK_S)
    frames = rig.listen(0.4)
    assert {f.ping_echo for f in frames} == {0}
    assert max(f.ping_age for f in frames) <= period_s / TICK_S + 2, "it goes on to measure"


@pytest.mark.parametrize("phase_s", PHASES_S)
def test_infrared_burst_is_38_khz_for_a_millisecond(rig: SessionRig, phase_s: float) -> None:
    rig.listen(phase_s)
    start = rig.board.cycle
    rig.listen(0.5)
    log = rig.board.pin_log()
    log = log[log["cycle"] >= start]
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


def test_infrared_burst_ends_with_its_led_off_when_its_last_toggle_waits(rig: SessionRig) -> None:
    """Edges of both encoders at the end of a burst keep the interrupt of its last toggle waiting, until one more is
    requested while that runs."""
    ticks = rig.request(messages.GetParameter, messages.PARAMETERS["infrared_period"].id).value
    period = ticks * round(TICK_S * CYCLES_PER_S)
    rig.listen(2 * period / CYCLES_PER_S)
    for early in range(0, 400, 8):
        log = rig.board.pin_log()
        end = int(log["cycle"][log["pin"] == 9][-1]) + period
        for edge in range(4):
            rig.board.drive(16 + edge % 2, edge < 2, end - early + 100 * edge)
        rig.listen(period / CYCLES_PER_S)
    log = rig.board.pin_log()
    cycles, levels = (log[name][log["pin"] == 9] for name in ("cycle", "level"))
    ends = np.flatnonzero(np.diff(cycles, append=rig.board.cycle) > period // 2)[1:]  # the first is the start's
    assert len(ends) >= 50
    assert not levels[ends].any()
    assert set(np.diff(ends)) == {76}
