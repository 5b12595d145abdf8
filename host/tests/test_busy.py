"""A port beside a thread that computes: what its C thread and the short switch interval do, and what is without them.

Each is compared with its counterpart on the same machine; `make bench` measures times, and the round trip.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from boebot.link.ports.descriptor import HAS_THREAD
from boebot.link.ports.switch_interval import INTERVAL_S
from tools.bench.busy import DEFAULT_INTERVAL_S, measure, measure_round_trips, per_cent

pytestmark = [
    pytest.mark.wall_clock,
    pytest.mark.skipif(not HAS_THREAD, reason="there is no C thread on this system"),
]

COUNT = 150
TRIES = 4


def holds_once(compare: Callable[[], bool]) -> bool:
    """One of some tries: what else runs on the machine may spoil a comparison, but makes none come true by itself."""
    return any(compare() for _ in range(TRIES))


def test_stamps_do_not_wait_for_python() -> None:
    """Without the thread, bytes are stamped after the computing thread's turn of 5 ms."""

    def earlier() -> bool:
        by_thread = measure(thread=True, interval_s=DEFAULT_INTERVAL_S, count=COUNT).receipt
        by_caller = measure(thread=False, interval_s=DEFAULT_INTERVAL_S, count=COUNT).receipt
        assert by_thread.min() > 0, "never before the sending"
        return per_cent(by_thread, 50) < per_cent(by_caller, 50) / 2

    assert holds_once(earlier)


def test_brain_wakes_up_earlier_by_the_short_interval() -> None:
    def earlier() -> bool:
        short = measure(thread=True, interval_s=INTERVAL_S, count=COUNT).wake_up
        usual = measure(thread=True, interval_s=DEFAULT_INTERVAL_S, count=COUNT).wake_up
        return per_cent(short, 75) < per_cent(usual, 75) / 1.5

    assert holds_once(earlier)


def test_every_request_is_answered() -> None:
    assert measure_round_trips(thread=True, count=500).min() > 0
