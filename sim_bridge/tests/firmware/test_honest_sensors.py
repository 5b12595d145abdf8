"""What is no reading is not reported as one: a Ping that is missing, cut off or too near, encoders that bounce, an IR
receiver that is stuck."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterator

import msgspec
import pytest

from boebot.description.robots import RobotDescription, load_robot
from boebot.link import messages
from boebot.link.messages import PingStatus
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US
from sim_bridge.boards.board import Level
from sim_bridge.tests.rigs import SessionRig

pytestmark = pytest.mark.unsanitized

PING, LED, RECEIVER, ENCODER = 8, 9, 10, 16
LOOK_S = 0.0002  # how often a test looks at what the board does to a pin: its answer is that late at the soonest
READINGS_S = 0.25  # five of the Ping's, and of the IR pairs'
MS = CYCLES_PER_S // 1000

Change = tuple[float, int]  # us after what the board did, level


def pulse(begin_us: float, length_us: float) -> list[Change]:
    return [(begin_us, 1), (begin_us + length_us, 0)]


def fallen(rig: SessionRig, pin: int, since: int) -> list[int]:
    """When the board drove a pin low."""
    log = rig.board.pin_log(4000)
    of_pin = (log["pin"] == pin) & (log["level"] == 0) & (log["cycle"] > since)
    return [int(cycle) for cycle in log["cycle"][of_pin]]


# ---- Ping ------------------------------------------------------------------------------------------------------------


def ping_that_does(rig: SessionRig, changes: list[Change], seconds: float = READINGS_S) -> messages.Telemetry:
    """The last reading of a sensor that does this to its line after each trigger."""
    seen = rig.board.cycle
    for _ in range(round(seconds / LOOK_S)):
        rig.listen(LOOK_S)
        for triggered in fallen(rig, PING, seen):
            if triggered > seen + 20 * MS:  # not the line that is held low between two measurements
                for after_us, level in changes:
                    rig.board.drive(PING, level, triggered + round(after_us * CYCLES_PER_US))
            seen = triggered
    return rig.telemetry[-1]


def unplugged(name: str) -> RobotDescription:
    robot = load_robot("shieldbot")
    device = msgspec.structs.replace(robot.device[name], plugged=False)
    return msgspec.structs.replace(robot, device=robot.device | {name: device})


def test_a_ping_that_was_never_there_is_absent(board_url: str) -> None:
    with SessionRig.open(board_url, robot=unplugged("ping")) as rig:
        rig.start()
        now = rig.listen(READINGS_S)[-1]
    assert (now.ping_status, now.ping_echo) == (PingStatus.ABSENT, 0)
    assert now.ping_age <= 7


@pytest.mark.parametrize("phase_ms", [0.5, 2, 10, 18])
def test_a_wire_that_breaks_in_mid_echo_is_no_empty_field(rig: SessionRig, phase_ms: float) -> None:
    """From the next measurement on; in this one the line may fall, as it does at the end of an echo."""
    rig.listen(READINGS_S)
    triggered = fallen(rig, PING, 0)[-1]
    while fallen(rig, PING, triggered) == []:
        rig.listen(LOOK_S)
    rig.listen(phase_ms / 1000)
    rig.board.unplug("ping")
    rig.listen(0.08)
    seen = {frame.ping_status for frame in rig.listen(READINGS_S)}
    assert seen == {PingStatus.ABSENT}


NOISE = list(itertools.chain.from_iterable(pulse(at, 10) for at in range(300, 720, 60)))


def test_noise_in_the_hold_off_is_no_echo(rig: SessionRig) -> None:
    now = ping_that_does(rig, NOISE)
    assert (now.ping_status, now.ping_echo) == (PingStatus.ABSENT, 0)


def test_noise_in_the_hold_off_hides_no_echo(rig: SessionRig) -> None:
    now = ping_that_does(rig, [*NOISE, *pulse(755, 3000)])
    assert now.ping_status == PingStatus.OK
    assert abs(now.ping_echo - 3000) <= 1


def test_a_line_that_is_stuck_is_absent(rig: SessionRig) -> None:
    for level in (1, 0):
        rig.board.drive(PING, level)
        rig.listen(READINGS_S)
        assert rig.latest().ping_status == PingStatus.ABSENT


@pytest.mark.parametrize("length_us", [1, 2, 3, 5, 8, 13, 20, 40, 80, 95])
def test_an_echo_that_is_too_short_is_too_near(rig: SessionRig, length_us: float) -> None:
    now = ping_that_does(rig, pulse(755, length_us))
    assert (now.ping_status, now.ping_echo) == (PingStatus.TOO_NEAR, 0)


def test_a_short_echo_is_measured_or_too_near(rig: SessionRig) -> None:
    """The line full both ways and noise on an encoder's line: the interrupt that stamps the echo comes late."""
    before = Level.LOW

    def answer(cycle: int, level: Level) -> None:
        nonlocal before
        if before == Level.HIGH:  # a trigger ends
            for after_us, to in pulse(755, length_us):
                rig.board.drive(PING, to, cycle + round(after_us * CYCLES_PER_US))
        before = level

    rig.board.board.on_edge(PING, answer)
    for length_us in (115, 116, 118, 122, 130, 145, 175):
        rig.board.square_wave(ENCODER, period=1600, seconds=0.3)
        first = len(rig.telemetry) + 10
        rig.flood(rig.signal(0.3, -0.3), 0.25)
        for frame in rig.telemetry[first:]:
            reported = (frame.ping_status, frame.ping_echo)
            assert reported in [(PingStatus.TOO_NEAR, 0), *((PingStatus.OK, length_us + d) for d in (-1, 0, 1))]


# ---- encoders --------------------------------------------------------------------------------------------------------


def bouncing(rig: SessionRig, edges: list[tuple[int, int, int]]) -> None:
    """Edges (cycle from now on, pin, level), each with two more 20 us apart."""
    start = rig.board.cycle + 2 * MS
    for cycle, pin, level in edges:
        for extra in range(3):
            rig.board.drive(pin, level ^ (extra & 1), start + cycle + extra * 20 * CYCLES_PER_US)
        rig.listen((cycle - (rig.board.cycle - start)) / CYCLES_PER_S - 0.001) if cycle > 50 * MS else None


def one_line(count: int, period: int) -> list[tuple[int, int, int]]:
    return [(i * period, ENCODER, (i + 1) % 2) for i in range(count)]


def test_a_bouncing_encoder_counts_each_edge_once(rig: SessionRig) -> None:
    """75 edges at the wheel's top speed count 75, and the speed is that of the wheel."""
    period = 19_000 * CYCLES_PER_US
    before = rig.latest().encoder_left
    bouncing(rig, one_line(75, period))
    frames = rig.listen(0.1)
    assert frames[-1].encoder_left - before == 75
    reported = {f.edge_period_left * 16 for f in rig.telemetry[-40:] if f.edge_period_left}
    assert reported and all(abs(period_us - 19_000) <= 32 for period_us in reported)


def test_without_a_gap_every_edge_counts(rig: SessionRig) -> None:
    rig.set("encoder_gap", 0)
    before = rig.latest().encoder_left
    bouncing(rig, one_line(20, 10 * MS))
    assert rig.listen(0.1)[-1].encoder_left - before == 60


def test_a_wheel_that_stands_for_long_counts_its_next_edge(rig: SessionRig) -> None:
    """Whatever the time since its last one is modulo that of any counter: 4.096 ms, 1.05 s."""
    before = rig.latest().encoder_left
    for number, rest_s in enumerate((0.0045, 0.0085, 0.03, 0.3, 1.04, 1.05, 1.06, 2.1)):
        rig.listen(max(rest_s - 0.003, 0.0))
        bouncing(rig, [(MS, ENCODER, (number + 1) % 2)])
        rig.listen(0.004)
    assert rig.latest().encoder_left - before == 8


@contextlib.contextmanager
def with_two_lines(board_url: str) -> Iterator[SessionRig]:
    """A robot whose left encoder has two lines, both low."""
    with SessionRig.open(board_url, robot="shieldbot-quad") as rig:
        rig.start()
        for pin in (14, 15):
            rig.board.drive(pin, 0)
        rig.listen(0.05)
        yield rig


def quadrature(steps: list[int], period: int) -> list[tuple[int, int, int]]:
    """Edges of the left wheel's two lines, A leading B forward; steps of +1 or -1."""
    levels, place, found = [(0, 0), (1, 0), (1, 1), (0, 1)], 0, []
    for i, step in enumerate(steps):
        was, place = levels[place], (place + step) % 4
        line = 0 if was[0] != levels[place][0] else 1
        found.append((i * period, (14, 15)[line], levels[place][line]))
    return found


@pytest.mark.parametrize(
    "steps", [[1] * 40, [-1] * 40, [1] * 9 + [-1] * 6, [1, -1] * 10, [1, 1, -1] * 7], ids=lambda steps: str(steps[:4])
)
def test_two_lines_that_bounce_count_each_edge_once(board_url: str, steps: list[int]) -> None:
    """Also where the wheel turns back; a wheel that rocks about an edge gives edges of one line faster than the gap."""
    with with_two_lines(board_url) as rig:
        before = rig.latest().encoder_left
        bouncing(rig, quadrature(steps, 9_500 * CYCLES_PER_US))
        frames = rig.listen(0.1)
        assert frames[-1].encoder_left - before == sum(steps)
        if abs(sum(steps)) == len(steps):
            reported = {f.edge_period_left * 16 for f in rig.telemetry[-30:] if f.edge_period_left}
            assert reported and all(abs(period_us - 9_500) <= 32 for period_us in reported)


def test_a_wheel_that_rocks_within_the_gap_comes_back(board_url: str) -> None:
    """Back over an edge of A within the gap, then on backward: what A did is known when B changes."""
    with with_two_lines(board_url) as rig:
        before = rig.latest().encoder_left
        start = rig.board.cycle + MS
        for at_ms, pin, level in [(0, 14, 1), (2, 14, 0), (12, 15, 1), (22, 14, 1), (32, 15, 0), (42, 14, 0)]:
            rig.board.drive(pin, level, start + at_ms * MS)
        rig.listen(0.1)
        assert rig.latest().encoder_left - before == -4


# ---- IR pairs --------------------------------------------------------------------------------------------------------
