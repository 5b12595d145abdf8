"""A port beside a thread that computes: what its C thread and the short switch interval do, and what is without them.

The bounds are met by the median on any machine that is not overloaded; `make bench` measures the 99th percentiles.
"""

from __future__ import annotations

import pytest

from boebot.link.ports.descriptor import HAS_THREAD
from boebot.link.ports.switch_interval import INTERVAL_S
from tools.bench.busy import DEFAULT_INTERVAL_S, measure, measure_round_trips, per_cent

pytestmark = pytest.mark.skipif(not HAS_THREAD, reason="there is no C thread on this system")

COUNT = 150
STAMP_MS, WAKE_UP_MS, ROUND_TRIP_MS = 1.0, 5.0, 0.3


def test_stamps_do_not_wait_for_python() -> None:
    delays = measure(thread=True, interval_s=DEFAULT_INTERVAL_S, count=COUNT)
    assert delays.receipt.min() > 0, "never before the sending"
    assert per_cent(delays.receipt, 50) < STAMP_MS


def test_without_the_thread_they_do() -> None:
    delays = measure(thread=False, interval_s=DEFAULT_INTERVAL_S, count=COUNT)
    assert per_cent(delays.receipt, 50) > STAMP_MS


def test_brain_wakes_up_in_time_and_without_the_short_interval_does_not() -> None:
    assert per_cent(measure(thread=True, interval_s=INTERVAL_S, count=COUNT).wake_up, 75) < WAKE_UP_MS
    assert per_cent(measure(thread=True, interval_s=DEFAULT_INTERVAL_S, count=COUNT).wake_up, 75) > WAKE_UP_MS


def test_round_trip_is_short() -> None:
    assert per_cent(measure_round_trips(thread=True, count=500), 50) < ROUND_TRIP_MS
