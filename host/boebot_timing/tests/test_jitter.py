"""Servo pulses, echoes and latencies of the untouched image at its pins and on its line, against what is promised and
what the schedule gives (boebot_timing.tests.latency_limits); and what an overload leaves behind: nothing."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from boebot import resources
from boebot.link import messages
from boebot_timing.emulated.line import Line
from boebot_timing.emulated.loads import TICK_CYCLES, Ping, wheels
from boebot_timing.emulated.scenarios import EDGES_PER_S
from boebot_timing.emulated.traffic import TIME_TO_LIVE_MS
from boebot_timing.tests.jitter import Distribution, distributions, lost, servo_pulses
from boebot_timing.tests.jitter_run import Asking, Run, drive, prepare
from boebot_timing.tests.latency_limits import SERVO_FRAME_CYCLES, SLOT_CYCLES
from sim_bridge.bench.bench import Bench
from sim_bridge.bench.pins import Pin
from sim_bridge.boards.board import Edge, Level

# Of the board's time, for each load; seeds begin at other phases.
CASES = [
    *(pytest.param((load, 1, 1.6), id=load) for load in ("figures", "overload")),
    *(
        pytest.param((load, seed, 10.0), id=f"{load}, seed {seed}", marks=pytest.mark.soak)
        for load in ("figures", "overload")
        for seed in range(1, 7)
    ),
]
LEFT, RIGHT = 13, 12  # pins of the servos
ENCODER_PINS = [(14, 15), (16, 17)]
SERVO_TOLERANCE = 16  # cycles: what is promised, of width and period
ECHO_TOLERANCE = 16  # cycles: the same, of an echo's length
RECOVERY = 10 * TICK_CYCLES  # after an overload
CYCLES_PER_MS = 16_000
MASKED = messages.Status.ENCODER_LEFT_MASKED | messages.Status.ENCODER_RIGHT_MASKED


def image() -> Path:
    """Four encoder lines and every device that the loads name."""
    return resources.folder("images") / "shieldbot-quad.elf"


@pytest.fixture(scope="module", params=CASES)
def run(request: pytest.FixtureRequest) -> Iterator[Run]:
    """What happened in each case."""
    load, seed, seconds = request.param
    with Bench(image(), record=False) as bench:
        yield drive(bench, load, seconds, seed, lambda share: None)


def seconds_of(run: Run) -> float:
    return (run.ended - run.begun) / 16e6


@pytest.fixture(scope="module")
def found(run: Run) -> dict[str, Distribution]:
    return {one.quantity: one for one in distributions(run)}


@pytest.mark.parametrize("side", ["left", "right"])
def test_servo_pulses_are_exact_to_16_cycles(run: Run, found: dict[str, Distribution], side: str) -> None:
    for quantity in ("width", "period"):
        errors = found[f"servo {quantity}, {side}"]
        assert len(errors.values) >= seconds_of(run) * 50 - 2, "a pulse is missing"
        assert np.all(np.abs(errors.values) <= SERVO_TOLERANCE), errors.values


def test_echoes_are_right_to_16_cycles(run: Run, found: dict[str, Distribution]) -> None:
    """Ping at its fastest: a trigger every 4 ticks."""
    errors = found["echo length"]
    assert len(errors.values) >= seconds_of(run) * 25 - 3, "an echo is missing"
    assert np.all(np.abs(errors.values) <= ECHO_TOLERANCE), errors.values


def test_latencies_keep_what_the_schedule_gives(run: Run, found: dict[str, Distribution]) -> None:
    """And in ticks: an edge, an echo or a whisker is observed in the second tick after it at the latest. Under an
    overload what is said of them may be dropped."""
    assert not [(one.quantity, min(one.values), max(one.values)) for one in found.values() if one.broken]
    if run.load == "overload":
        return
    assert len(found) == 13
    assert min(len(one.values) for one in found.values()) > 4
    for quantity, ticks in {
        "encoder left to observation": 2.0,
        "echo to observation": 2.0,
        "whisker left to observation": 2.0,
        "set-point to pulse, left": 2.5,
    }.items():
        assert max(found[quantity].values) <= ticks * TICK_CYCLES


def test_nothing_is_lost_but_in_an_overload_and_no_tick_there(run: Run) -> None:
    """No frame, no byte, no edge, no tick; no line is masked, nothing resets. In an overload the tick is kept, what is
    lost is reported, and so is the noise, in each tick."""
    losses = lost(run)
    if run.load != "overload":
        assert not any(asdict(losses).values()), losses
        return
    assert (losses.ticks, losses.late_ticks, losses.resets) == (0, 0, 0)
    (*_, counted) = (heard.message for heard in run.line.heard if isinstance(heard.message, messages.Counters))
    assert losses.bytes == 0 or counted.overrun > 0, "lost bytes are reported"
    reported = [heard.message for heard in run.line.telemetry if run.begun + 3 * TICK_CYCLES < heard.first < run.ended]
    assert len(reported) > seconds_of(run) * 90 and sum(bool(one.status & MASKED) for one in reported) > 0.97 * len(
        reported
    )


def test_the_loads_are_what_they_are_said_to_be(run: Run) -> None:
    """Overload: 50,000 bytes/s arrive; three lines at 4 kHz, noise on the fourth."""
    seconds = seconds_of(run)
    if run.load == "overload":
        assert run.bench.pins.counters()["bytes_in"] >= 50_000 * seconds
        assert [len(wheel) for wheel in run.encoders] == [0, 2]
    for train in (train for wheel in run.encoders for train in wheel):
        counted = bisect_right(train.edges, run.ended) - bisect_right(train.edges, run.begun)
        assert counted >= run.edges_per_s * seconds - 1


def test_phases_are_swept(run: Run) -> None:
    """Of encoder edges and echo ends against the tick; else a fixed phase would hide jitter."""
    edges = np.concatenate([train.edges for wheel in run.encoders for train in wheel])
    gaps = np.diff(np.sort(edges % TICK_CYCLES))
    assert gaps.max() < 1000
    falls = np.sort(np.array([fall for _, fall in run.ping.echoes]) % TICK_CYCLES)
    assert len(falls) >= 12 and np.diff(falls).max() < TICK_CYCLES // 4


def test_a_pulse_of_another_width_is_found(run: Run) -> None:
    """Twice as many cycles more in one pulse break a limit, so that the test above can fail."""
    log = run.bench.edges[LEFT]
    at = next(
        i for i, edge in enumerate(log) if edge.level == Level.LOW and edge.cycle > run.begun + SERVO_FRAME_CYCLES
    )
    true = log[at]
    log[at] = Edge(true.cycle + 2 * SERVO_TOLERANCE + 1, true.pin, true.level)
    try:
        broken = {one.quantity: one.broken for one in servo_pulses(run)}
    finally:
        log[at] = true
    assert broken["servo width, left"] == 1 and broken["servo width, right"] == 0


def test_all_is_normal_100_ms_after_an_overload() -> None:
    """Its line and its noise end together. 100 ms later set-points move the servos, telemetry says that all is well,
    and nothing more is lost."""
    with Bench(image(), record=False) as bench:
        run = drive(bench, "overload", 0.2, 5, lambda share: None)
        line, since = run.line, len(run.line.heard)
        trains = wheels(ENCODER_PINS, EDGES_PER_S["figures"], bench.now + TICK_CYCLES)
        bench.sources[:] = [Ping(run.pins["ping"]), *(train for wheel in trains for train in wheel)]
        bench.run_until(run.ended + RECOVERY)
        line.arm()
        begun, traffic = bench.now, Asking(line, bench.now)
        bench.sources.append(traffic)
        line.wait(messages.Counters, since)
        before = [heard.message for heard in line.heard if isinstance(heard.message, messages.Counters)][-1]
        bench.run(90 * TICK_CYCLES)
        after = [heard.message for heard in line.heard if isinstance(heard.message, messages.Counters)][-1]
        reported = [heard.message for heard in line.telemetry if heard.first > begun + TICK_CYCLES]
        assert np.all(np.diff([message.tick for message in reported]) == 1) and len(reported) > 80
        assert not any(message.status & (MASKED | messages.Status.TICK_OVERRUN) for message in reported)
        assert (after.bad, after.dropped, after.overrun) == (before.bad, before.dropped, before.overrun)
        assert len(Pin(bench, LEFT).all_pulses(begun + 5 * TICK_CYCLES + 1)) > 30


def test_frames_that_are_dropped_renew_no_time_to_live() -> None:
    """In an overload that goes on without set-points the pulses end with the life of the last one that was sent."""
    with Bench(image(), record=False) as bench:
        run = drive(bench, "overload", 0.2, 6, lambda share: None)
        run.traffic.muted = True
        trains = wheels(ENCODER_PINS, EDGES_PER_S["overload"], bench.now)
        bench.sources[:] = [run.ping, *(train for wheel in trains for train in wheel), run.traffic]
        bench.run(40 * TICK_CYCLES)
        last = max(int(Pin(bench, pin).all_pulses(1)[-1, 0]) for pin in (LEFT, RIGHT))
        life = run.traffic.newest + TIME_TO_LIVE_MS * CYCLES_PER_MS
        assert last <= life + SERVO_FRAME_CYCLES + 2 * TICK_CYCLES


@pytest.mark.parametrize("edges_per_s", [130, 900, 2500, 3300])
def test_no_edge_of_four_lines_is_lost(edges_per_s: int) -> None:
    with Bench(image(), record=False) as bench:
        run = drive(bench, "figures", 0.4, edges_per_s, lambda share: None, edges_per_s)
        assert not any(asdict(lost(run)).values())
        assert all(len(train.edges) > 0.4 * edges_per_s for wheel in run.encoders for train in wheel)


@pytest.fixture
def driving() -> Iterator[tuple[Bench, Line, Asking]]:
    """An armed board with a set-point each tick and four encoder lines at 4 kHz."""
    with Bench(image(), record=False) as bench:
        line = Line(bench)
        line.open()
        prepare(line)
        traffic = Asking(line, bench.now + TICK_CYCLES)
        trains = wheels(ENCODER_PINS, EDGES_PER_S["overload"], bench.now + TICK_CYCLES)
        bench.sources += [*(train for wheel in trains for train in wheel), traffic]
        bench.run(10 * TICK_CYCLES)
        yield bench, line, traffic


def check_whole(bench: Bench, begun: int) -> None:
    """Every pulse since then has one of the widths that were asked for: 24,000 + 3,200 x signal cycles, mirrored."""
    for pin, widths in ((LEFT, (24_960, 23_520)), (RIGHT, (24_960, 22_560))):
        pulses = Pin(bench, pin).all_pulses(begun + 1)
        assert len(pulses) > 10
        off = np.min(np.abs(pulses[:, 1, None] - np.array(widths)), axis=1)
        assert np.all(off <= SERVO_TOLERANCE), pulses[off > SERVO_TOLERANCE]
        assert bench.pins.output(pin) == Level.LOW, "a pulse that does not end"


def test_whatever_stops_the_pulses_leaves_them_whole_or_out(driving: tuple[Bench, Line, Asking]) -> None:
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
        last = max(int(Pin(bench, pin).all_pulses(1)[-1].sum()) for pin in (LEFT, RIGHT))
        assert bench.now - last > SLOT_CYCLES, "pulses go on"
        if number % 3 == 1:
            line.open()
        if number % 3 != 2:
            line.arm()
        traffic = Asking(line, bench.now + TICK_CYCLES)
        bench.sources.append(traffic)
    bench.run(3 * TICK_CYCLES)
    bench.sources.remove(traffic)
    bench.run(30 * TICK_CYCLES)
    check_whole(bench, begun)
