"""Jitter and latency of the untouched image at its pins and on its line, against figures to reach and limits that the
schedule gives (sim_bridge/timing/latency_limits.py derives those)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from boebot import resources
from boebot.link import messages
from boebot.timing.distributions import Distribution, JitterReport
from hil_tests.rig import CYCLES_PER_US
from sim_bridge.boards.board import Edge, Level
from sim_bridge.timing.jitter import lost, measure_jitter, servo_pulses
from sim_bridge.timing.jitter_run import Run, drive, prepare
from sim_bridge.timing.line import Line
from sim_bridge.timing.loads import (
    FIGURES,
    LOADS,
    SATURATED,
    SERVO_FRAME_CYCLES,
    SLOT_CYCLES,
    TICK_CYCLES,
    Bench,
    Load,
    PulseTrain,
    wheels,
)
from sim_bridge.timing.stamps import timer_start
from sim_bridge.timing.traffic import EachTick

pytestmark = pytest.mark.emulated

SECONDS = 2.5  # of the board's time, for each load
LEFT, RIGHT = 13, 12  # pins of the servos
ENCODER_PINS = [(14, 15), (16, 17)]
SERVO_TOLERANCE = 2  # cycles: figure to reach, of width and period
ECHO_TOLERANCE = 8  # cycles: figure to reach, of an echo's stamps
NAMES = [load.name for load in LOADS]


def image() -> Path:
    """Four encoder lines and every device that the loads name."""
    return resources.folder("images") / "shieldbot-quad.elf"


@pytest.fixture(scope="module")
def report() -> JitterReport:
    return measure_jitter(image(), seconds=SECONDS)


def of(report: JitterReport, load: str, quantity: str) -> Distribution:
    (found,) = (one for one in report.distributions if (one.load, one.quantity) == (load, quantity))
    return found


@pytest.mark.parametrize("load", NAMES)
@pytest.mark.parametrize("side", ["left", "right"])
def test_servo_width_and_period_are_exact_to_2_cycles(report: JitterReport, load: str, side: str) -> None:
    for quantity in ("width", "period"):
        errors = of(report, load, f"servo {quantity}, {side}")
        assert errors.count >= SECONDS * 50 - 2, "a pulse is missing"
        assert np.all(np.abs(errors.values) <= SERVO_TOLERANCE), errors.values


@pytest.mark.parametrize("load", NAMES)
def test_echo_stamps_are_right_to_8_cycles(report: JitterReport, load: str) -> None:
    """Ping at its fastest: a trigger every 4 ticks."""
    for quantity, most in (("echo stamp", ECHO_TOLERANCE), ("echo length, stamped", ECHO_TOLERANCE)):
        errors = of(report, load, quantity)
        assert errors.count >= SECONDS * 25 - 2, "an echo is missing"
        assert np.all(np.abs(errors.values) <= most), errors.values
    told = of(report, load, "echo length, told")
    assert np.all(np.abs(told.values) <= CYCLES_PER_US // 2), "rounded to the nearest microsecond"


@pytest.mark.parametrize("load", NAMES)
def test_latencies_keep_what_the_schedule_gives(report: JitterReport, load: str) -> None:
    found = [one for one in report.distributions if one.load == load]
    assert not [(one.quantity, one.minimum, one.maximum, one.least, one.most) for one in found if one.broken]
    assert len({one.quantity for one in found}) == len(found) == 19
    assert all(one.count > 10 for one in found), [(one.quantity, one.count) for one in found]


@pytest.mark.parametrize("load", NAMES)
def test_latencies_in_ticks(report: JitterReport, load: str) -> None:
    """What people are told: an edge or echo is observed in the second tick after it at the latest, a whisker in the
    second as well, infra-red after one sweep of five ticks and the tick that tells."""
    for quantity, ticks in {
        "encoder left to observation": 2.0,
        "echo to observation": 2.0,
        "whisker left to observation": 2.0,
        "ir left to observation": 6.0,
        "set-point to pulse, left": 2.5,
    }.items():
        assert of(report, load, quantity).maximum <= ticks * TICK_CYCLES


@pytest.mark.parametrize("load", NAMES)
def test_nothing_is_lost(report: JitterReport, load: str) -> None:
    """No frame, no byte, no edge, no tick; no line is masked, nothing resets."""
    (losses,) = (one for one in report.losses if one.load == load)
    assert not replace(losses, late_ticks=0).anything, losses


@pytest.mark.parametrize("load", [FIGURES.name, SATURATED.name])
def test_no_tick_is_late(report: JitterReport, load: str) -> None:
    """No tick's work goes on when the next one has begun."""
    (losses,) = (one for one in report.losses if one.load == load)
    assert losses.late_ticks == 0


@pytest.fixture(scope="module")
def start() -> int:
    return timer_start(image())


@pytest.fixture(scope="module")
def run(start: int) -> Iterator[Run]:
    with Bench(image()) as bench:
        yield drive(bench, start, FIGURES, 0.6, 3, lambda share: None)


def test_the_loads_are_what_they_are_said_to_be(start: int) -> None:
    """Saturated: 50,000 bytes/s arrive, and as many are sent to 2 %; four lines at 4 kHz."""
    with Bench(image()) as bench:
        run = drive(bench, start, SATURATED, 0.5, 4, lambda share: None)
        arrived = bench.access.counters()["bytes_in"]
        assert lost(run).frames == 0
        seconds = (run.ended - run.begun) / 16e6
        assert arrived >= 50_000 * seconds
        busy = [heard for heard in run.line.heard if run.begun < heard.first < run.ended]
        carried = sum(heard.message.LENGTH + 8 for heard in busy)
        assert carried >= 0.98 * 50_000 * seconds
        for train in (train for wheel in run.encoders for train in wheel):
            assert train.count(run.ended) - train.count(run.begun) >= 4000 * seconds - 1


def test_phases_are_swept(run: Run) -> None:
    """Of encoder edges and echo ends against the tick; else a fixed phase would hide jitter."""
    edges = np.concatenate([train.edges for wheel in run.encoders for train in wheel])
    gaps = np.diff(np.sort(edges % TICK_CYCLES))
    assert gaps.max() < 1000
    falls = np.sort(np.array([fall for _, fall in run.ping.echoes]) % TICK_CYCLES)
    assert len(falls) >= 12 and np.diff(falls).max() < TICK_CYCLES // 4


def test_a_pulse_of_another_width_is_found(run: Run) -> None:
    """3 cycles more in one pulse break a limit, so that the test above can fail."""
    log = run.bench.edges[LEFT]
    at = next(
        i for i, edge in enumerate(log) if edge.level == Level.LOW and edge.cycle > run.begun + SERVO_FRAME_CYCLES
    )
    true = log[at]
    log[at] = Edge(true.cycle + SERVO_TOLERANCE + 1, true.pin, true.level)
    try:
        broken = {one.quantity: one.broken for one in servo_pulses(run)}
    finally:
        log[at] = true
    assert broken["servo width, left"] == 1 and broken["servo width, right"] == 0


@pytest.mark.parametrize("edges_per_s", [130, 900, 2500, 3300])
def test_no_edge_is_lost_at_any_rate_up_to_4_khz(start: int, edges_per_s: int) -> None:
    """4 kHz itself is the saturated load."""
    with Bench(image()) as bench:
        run = drive(
            bench, start, Load(f"{edges_per_s}", edges_per_s, full_line=False), 0.4, edges_per_s, lambda s: None
        )
        assert not lost(run).anything
        for train in (train for wheel in run.encoders for train in wheel):
            assert len(run.edge_stamps.changes[train.pin - 14]) == len(train.edges) > 0.4 * edges_per_s


@pytest.fixture
def driving() -> Iterator[tuple[Bench, Line, EachTick]]:
    """An armed board with a set-point each tick and four encoder lines at 4 kHz."""
    with Bench(image()) as bench:
        line = Line(bench)
        line.open()
        prepare(line)
        traffic = EachTick(line, bench.now + TICK_CYCLES)
        trains = wheels(ENCODER_PINS, SATURATED.edges_per_s, bench.now + TICK_CYCLES)
        bench.sources += [*(train for wheel in trains for train in wheel), traffic]
        bench.run(10 * TICK_CYCLES)
        yield bench, line, traffic


@pytest.mark.parametrize("pin", [14, 17])
def test_noise_of_100_khz_is_masked_and_told_without_a_missed_tick(
    driving: tuple[Bench, Line, EachTick], pin: int
) -> None:
    bench, line, _ = driving
    masked = messages.Status.ENCODER_LEFT_MASKED if pin < 16 else messages.Status.ENCODER_RIGHT_MASKED
    bench.sources[:] = [source for source in bench.sources if getattr(source, "pin", None) != pin]
    bench.sources.append(PulseTrain(pin, 79, bench.now + 1_000))  # of 158 cycles: 101 kHz, in step with nothing
    begun = bench.now
    since = len(line.telemetry)
    bench.run(60 * TICK_CYCLES)
    told = [heard.message for heard in line.telemetry[since:]]
    assert all(message.status & masked for message in told[3:]), "noise is told in each tick"
    assert np.all(np.diff([message.tick for message in told]) == 1), "a tick without telemetry"
    assert told[-1].overruns == 0 and not any(message.status & messages.Status.TICK_OVERRUN for message in told)
    check_whole(bench, begun)


def check_whole(bench: Bench, begun: int) -> None:
    """Every pulse since then has one of the widths that were asked for: 24,000 + 3,200 x signal cycles, mirrored."""
    for pin, widths in ((LEFT, (24_960, 23_520)), (RIGHT, (24_960, 22_560))):
        pulses = bench.pulses(pin, begun)
        assert len(pulses) > 10
        off = np.min(np.abs(pulses[:, 1, None] - np.array(widths)), axis=1)
        assert np.all(off <= SERVO_TOLERANCE), pulses[off > SERVO_TOLERANCE]
        assert bench.access.output(pin) == Level.LOW, "a pulse that does not end"


def test_whatever_stops_the_pulses_leaves_them_whole_or_out(driving: tuple[Bench, Line, EachTick]) -> None:
    """Stop, end of the session and silence come at phases that sweep the servo frame."""
    bench, line, traffic = driving
    begun, last = bench.now, 0
    for number in range(24):
        bench.run(6 * TICK_CYCLES + number * 13_331)
        bench.sources.remove(traffic)
        if number % 3 == 0:
            line.send(messages.Stop(number))
        elif number % 3 == 1:
            line.send(messages.Close(line.seed))
        bench.run(3 * TICK_CYCLES if number % 3 != 2 else 28 * TICK_CYCLES)  # or a time to live of 250 ms ends
        last = max(int(bench.pulses(pin)[-1].sum()) for pin in (LEFT, RIGHT))
        assert bench.now - last > SLOT_CYCLES, "pulses go on"
        if number % 3 == 1:
            line.open()
        if number % 3 != 2:
            line.arm()
        traffic = EachTick(line, bench.now + TICK_CYCLES)
        bench.sources.append(traffic)
    bench.run(3 * TICK_CYCLES)
    bench.sources.remove(traffic)
    bench.run(30 * TICK_CYCLES)
    check_whole(bench, begun)
