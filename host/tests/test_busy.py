"""A port beside a thread that computes: what its C thread and the short switch interval do, and how it is without them.

Each is compared with its counterpart on the same machine; `make bench` measures times, and the round trip.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest

from boebot.link.ports.descriptor import HAS_THREAD
from boebot.link.ports.switch_interval import INTERVAL_S
from tools.bench.busy import PYTHONS_INTERVAL_S, delays, milliseconds, round_trips

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
        by_thread = delays(True, PYTHONS_INTERVAL_S, COUNT)[:, 0]
        by_caller = delays(False, PYTHONS_INTERVAL_S, COUNT)[:, 0]
        assert by_thread.min() > 0, "never before the sending"
        return milliseconds(by_thread, 50) < milliseconds(by_caller, 50) / 2

    assert holds_once(earlier)


def test_brain_wakes_up_earlier_by_the_short_interval() -> None:
    def earlier() -> bool:
        short = delays(True, INTERVAL_S, COUNT)[:, 1]
        usual = delays(True, PYTHONS_INTERVAL_S, COUNT)[:, 1]
        return milliseconds(short, 75) < milliseconds(usual, 75) / 1.5

    assert holds_once(earlier)


def test_every_request_is_answered() -> None:
    assert round_trips(500).min() > 0
