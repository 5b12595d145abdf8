"""The board's clock against the host's: the stated bound always holds, and the error is small, whatever the delays."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator

import pytest
from channel import Latency, none, uniform
from wire import Wire, clock_on, probes_in

from boebot.link import messages
from boebot.link.clock import DRIFT_LIMIT, BoardClock
from boebot.link.line import NEVER

BYTE_S = 2e-5
PROBE_S, ANSWER_S, TELEMETRY_S = 10 * BYTE_S, 14 * BYTE_S, 45 * BYTE_S  # on the line, one delimiter counted
WARM_UP_S = 10.0
USB = uniform(0.1e-3, 5e-3)
DRIFTS = [0.0, 100e-6, -100e-6, 5000e-6, -5000e-6]


class Line:
    """A board with its own clock, probes at the link's intervals, telemetry at every tick, and latencies."""

    def __init__(
        self,
        drift: float,
        seed: int,
        latency: Latency = none,
        batch_s: float = 0.0,
        first_us: int = 0,
        wander: float = 0.0,
    ) -> None:
        self.draw = random.Random(f"clock {seed}")
        self.start_s = 1000.0 + self.draw.random()  # host time of the board's reset
        self.drift, self.wander, self.first_us = drift, wander, first_us
        self.latency, self.batch_s = latency, batch_s
        self.clock = BoardClock(BYTE_S)

    def board_s(self, host_s: float) -> float:
        since = host_s - self.start_s
        return self.first_us * 1e-6 + since * (1 + self.drift) + self.wander * since**2 / 2

    def host_s(self, board_s: float) -> float:
        host_s = self.start_s + (board_s - self.first_us * 1e-6) / (1 + self.drift)
        for _ in range(3):
            host_s -= (self.board_s(host_s) - board_s) / (1 + self.drift)
        return host_s

    def _received(self, left_s: float) -> float:
        at_s = left_s + self.latency(self.draw)
        if self.batch_s:
            at_s = self.start_s + ((at_s - self.start_s) // self.batch_s + 1) * self.batch_s
        return at_s

    def run(self, seconds: float) -> Iterator[tuple[float, float, float]]:
        """For each telemetry: host time since the start, error of its stamp, and the bound stated for it (s)."""
        arrivals: list[tuple[float, float, float]] = []  # received, sent (or -1: telemetry), board time
        at_s = self.start_s + 0.01
        while at_s < self.start_s + seconds:
            worked_on_s = (
                at_s + PROBE_S + self.latency(self.draw) + self.draw.choice((0.0, 0.0, self.draw.uniform(0, 4e-4)))
            )
            arrivals.append((self._received(worked_on_s + ANSWER_S), at_s, self.board_s(worked_on_s)))
            at_s += (0.02 if at_s - self.start_s < 6 else 0.05) * self.draw.uniform(0.5, 1.0)
        for tick in range(round(seconds * 100)):
            board_s = self.first_us * 1e-6 + tick * 0.01
            left_s = self.host_s(board_s) + 3e-4 + TELEMETRY_S
            arrivals.append((self._received(left_s), -1.0, board_s))
        for received_s, sent_s, board_s in sorted(arrivals):
            if sent_s >= 0:
                self.clock.probe(sent_s, int(board_s * 1e6) & 0xFFFFFFFF, received_s)
                continue
            unwrapped_us = round(board_s * 1e6)
            stamp = self.clock.observe(unwrapped_us & 0xFFFFFFFF, received_s)
            assert abs(stamp[0] * 1e6 - (unwrapped_us - self.first_us // 2**32 * 2**32)) < 1
            yield received_s - self.start_s, stamp[1] - self.host_s(unwrapped_us * 1e-6), stamp[2]


def quantile(values: list[float], share: float) -> float:
    return sorted(values)[int(share * len(values))]


@pytest.mark.parametrize("drift", DRIFTS)
@pytest.mark.parametrize(
    ("latency", "batch_s", "limit_s"),
    [(none, 0.0, 5e-6), (USB, 0.0, 100e-6), (none, 4e-3, 100e-6)],
    ids=["none", "uniform", "batches"],
)
def test_error_is_small_and_the_bound_holds(latency: Latency, batch_s: float, limit_s: float, drift: float) -> None:
    """At most 100 us at p99 with 0.1 to 5 ms of latency each way, or 4 ms batches on the way back."""
    errors: list[float] = []
    for seed in range(6):
        line = Line(drift, seed, latency, batch_s)
        for since_s, error, bound in line.run(40.0):
            assert abs(error) <= bound
            if since_s > WARM_UP_S:
                errors.append(abs(error))
        assert line.clock.restarts == 0
        assert abs(line.clock.drift - drift) < 50e-6
    assert quantile(errors, 0.99) <= limit_s


@pytest.mark.parametrize("before_s", [0.5, 15.0])
def test_board_time_rolls_over(before_s: float) -> None:
    """Starts that time before the roll-over after 71.6 min; the stamps go on."""
    line = Line(5000e-6, 1, USB, first_us=2**32 - round(before_s * 1e6))
    times = []
    for _, error, bound in line.run(30.0):
        assert abs(error) <= bound
        times.append(bound)
    assert line.clock.restarts == 0 and times[-1] < 1e-3


def test_board_time_is_known_after_a_long_silence() -> None:
    clock = BoardClock(BYTE_S)
    clock.observe(1_000_000, 100.0)
    us = 1_000_000 + 3 * 2**32 + 500  # 3.6 h later, on a clock that runs true within a few minutes
    assert clock.unwrap(us & 0xFFFFFFFF, 100.0 + us / 1e6 - 1 + 60.0) == us


def test_first_stamp_of_a_session_knows_how_often_time_has_rolled_over() -> None:
    clock = BoardClock(BYTE_S)
    us = 5 * 2**32 + 123_456_789
    clock.expect(us / 1e6 + 0.3, 100.0)  # by the count of ticks
    assert clock.observe(us & 0xFFFFFFFF, 100.0)[0] == pytest.approx(us / 1e6)


def test_wander_within_its_allowance_is_covered() -> None:
    for wander in (0.015e-6, -0.015e-6):
        line = Line(1e-3, 3, uniform(0.0, 1e-4), wander=wander)
        for _, error, bound in line.run(120.0):
            assert abs(error) <= bound
        assert line.clock.restarts == 0


def test_clock_that_jumps_is_noticed_and_found_again() -> None:
    line = Line(0.0, 1, uniform(0.0, 2e-4))
    for _ in line.run(10.0):
        pass
    jumped = Line(0.0, 2, uniform(0.0, 2e-4))
    jumped.start_s = line.start_s - 0.5
    jumped.clock = line.clock
    settled = [abs(error) <= bound for since_s, error, bound in jumped.run(20.0) if since_s > 12.0]
    assert line.clock.restarts >= 1 and all(settled)


def test_line_that_is_faster_than_its_rate_says_is_noticed() -> None:
    """A pseudo-terminal has a rate that means nothing: messages that need no time on it contradict the bounds once."""
    line = Line(100e-6, 1, uniform(0.0, 1e-4))
    line.clock = BoardClock(10 / 9600)
    settled = [abs(error) <= bound < 1e-3 for since_s, error, bound in line.run(10.0) if since_s > 2.0]
    assert line.clock.restarts == 1 and all(settled)


def test_nothing_is_claimed_before_both_sides_are_bounded() -> None:
    clock = BoardClock(BYTE_S)
    _, host_s, bound = clock.observe(5_000_000, 100.0)
    assert bound > 1000.0 and host_s == pytest.approx(100.0 - TELEMETRY_S)
    clock.probe(100.01, 5_015_800, 100.012)
    assert clock.bound < 1.1e-3


def test_drift_beyond_resonators_is_beyond_the_model() -> None:
    """Not promised: the bounds contradict each other, and that is counted."""
    line = Line(2 * DRIFT_LIMIT, 1)
    for _ in line.run(5.0):
        pass
    assert line.clock.restarts > 0


def test_bounds_that_meet_in_a_point_pile_up_no_corners() -> None:
    """Delays that are always the same, as in a simulated run: the polygons stay small."""
    clock = BoardClock(BYTE_S)
    most = 0
    for tick in range(1, 6000):
        board_us, now_s = tick * 10_000, 5.0 + tick * 0.01
        if tick % 10 == 0:
            clock.probe(now_s - 2e-3, board_us, now_s + ANSWER_S + 3e-4)
        clock.observe(board_us, now_s + TELEMETRY_S + 1e-4)
        most = max(most, *(len(polygon) for polygon in clock._polygons))
    assert 3 <= most <= 24


# ---- probes ----------------------------------------------------------------------------------------------------------


def test_probes_are_irregular_and_often_enough_for_the_session() -> None:
    wire = Wire()
    clock = clock_on(wire)
    dues = [0.0]
    for _ in range(500):
        dues.append(clock.service(dues[-1], 0.2))
        assert clock.service(dues[-1] - 1e-6, 0.2) == dues[-1], "none before its time"
    waits = [later - earlier for earlier, later in itertools.pairwise(dues)]
    assert max(waits) <= 0.05 and len(set(waits)) > 400
    assert len(clock._waiting) == 64


def test_probe_tokens_roll_over() -> None:
    wire = Wire()
    clock = clock_on(wire)
    clock.begin(0.0, 0, 0.0)
    clock._token = 0xFFFF - 2
    due, tokens = 0.0, list[int]()
    for _ in range(5):
        wire.time = due
        due = clock.service(due, 1.0)
        (token,) = probes_in(wire)
        tokens.append(token)
        clock.receive(messages.ClockAnswer(token, round(wire.time * 1e6) + 500).pack(), wire.time + 0.001)
        clock.receive(messages.ClockAnswer(token, 0).pack(), wire.time + 0.9)  # a copy
    assert tokens == [0xFFFE, 0xFFFF, 0, 1, 2]
    assert clock.estimate.probes == 5 and clock.round_trips.longest() == pytest.approx(0.001)
    assert (
        clock.estimate.bounded
        and abs(clock.estimate.observe(round(wire.time * 1e6), wire.time + 0.001)[1] - wire.time) < 600e-6
    )


def test_clock_begins_anew_with_a_session_and_with_another_rate() -> None:
    wire = Wire()
    clock = clock_on(wire)
    clock.begin(7.0, 7_000_123, 0.0)
    assert clock.began_us == 7_000_123
    clock.session_ended()
    assert clock.began_us is None and clock.service(9.0, 1.0) == NEVER
    estimate = clock.estimate
    clock.session_opened(1.0)
    assert clock.estimate is estimate and not estimate.known
    clock._line.known_byte_s = 1e-4
    clock.session_opened(2.0)
    assert clock.estimate is not estimate
