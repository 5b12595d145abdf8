"""What both ends of the link count."""

from __future__ import annotations

from linked import listen, open_link

from boebot.link import messages
from boebot.link.counters import HostCounters

ROUND_S = 0.04 * (len(messages.Task) + 1)
"""In which the time of each task and the counters come once, one of them with every fourth telemetry."""


def test_both_ends_count_by_the_same_names() -> None:
    same = {"good", "bad", "unknown", "resynchronised", "retransmitted", "duplicate", "overrun", "dropped", "late"}
    assert same == set(HostCounters().as_dict()) & set(messages.Counters._fields)


def test_overruns_are_those_that_the_transport_knows_of() -> None:
    link, _, session = open_link()
    assert link.counters().overrun == 0
    session.overruns = 7  # type: ignore[attr-defined]
    assert link.counters().overrun == 7


def test_board_counters_are_unwrapped() -> None:
    link, peer, _ = open_link()
    peer.counts["late"] = 65500
    listen(link, ROUND_S)
    peer.counts["late"] = 65536 + 20
    listen(link, ROUND_S)
    assert link.board_counters.values["late"] == 65556
    before = link.board_counters.values["late"]
    peer.reset()
    listen(link, 0.1)
    peer.counts["late"] = 3
    listen(link, ROUND_S)
    assert link.board_counters.values["late"] == before + 3
