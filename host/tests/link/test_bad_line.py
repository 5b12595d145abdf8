"""A line that fails as asked: shares, times and order of what passes, in the transport's own time."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from boebot.link.bad_line import BOTH, TO_BOARD, TO_HOST, BadLine

BYTE_S = 1e-4


class Source:
    """A transport that sends byte `i % 255 + 1` at the end of its time `(i + 1) * BYTE_S`, and keeps what it gets."""

    name, realtime = "source", False

    def __init__(self) -> None:
        self.time_s, self.sent, self.got = 0.0, 0, []  # type: tuple[float, int, list[tuple[float, bytes]]]

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        end_s = self.time_s + wait_s
        first = self.sent + 1
        count = max(int(end_s / BYTE_S + 1e-6) - self.sent, 0)
        listening = max(math.ceil((self.time_s + quiet_s) / BYTE_S - 1e-6) - self.sent, 1)
        if count > listening:  # returns as soon as something has come
            count = listening
            end_s = (self.sent + count) * BYTE_S
        self.time_s = end_s
        self.sent += count
        return [(self.sent * BYTE_S, bytes(i % 255 + 1 for i in range(first - 1, self.sent)))] if count else []

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def write(self, data: bytes) -> None:
        self.got.append((self.time_s, data))

    def now(self) -> float:
        return self.time_s

    def close(self) -> None:
        pass


def heard(line: BadLine, until_s: float, wait_s: float = 0.01) -> tuple[bytes, list[float]]:
    """All bytes that come until then, each with its stamp."""
    data, stamps = b"", []
    while line.now() < until_s - 1e-9:
        for stamp, piece in line.read_stamped(min(wait_s, until_s - line.now())):
            assert stamp <= line.now() + 1e-9
            data += piece
            stamps += [stamp] * len(piece)
    return data, stamps


def clean(count: int) -> bytes:
    return bytes(i % 255 + 1 for i in range(count))


def test_without_faults_all_passes() -> None:
    line = BadLine(Source())
    data, stamps = heard(line, 1.0)
    assert data == clean(10_000) and stamps == sorted(stamps)


def test_shares_are_of_the_span_only() -> None:
    """Within five standard deviations of a binomial share."""
    line = BadLine(Source())
    fired = {
        name: line.add(f"serial.{name}", 0.05, begin, begin + 1.0) for name, begin in (("dropped", 1), ("doubled", 3))
    }
    bits = line.add("serial.flipped", 0.01, 5.0, 6.0)
    data, _ = heard(line, 7.0, 0.05)
    for one in fired.values():
        assert abs(one() - 500) < 5 * math.sqrt(10_000 * 0.05 * 0.95)
    assert len(data) == 70_000 - fired["dropped"]() + fired["doubled"]()
    assert data[:9_990] == clean(9_990)
    shift = len(data) - 20_010
    before = data[shift : shift + 10_000]
    expected = bytes(i % 255 + 1 for i in range(49_990, 59_990))
    wrong = sum((a ^ b).bit_count() for a, b in zip(before, expected, strict=True))
    assert wrong == bits() and abs(wrong - 800) < 5 * math.sqrt(80_000 * 0.01 * 0.99)


def test_draws_do_not_depend_on_other_faults_or_cuts() -> None:
    results = []
    for wait_s, others in ((0.003, False), (0.05, False), (0.01, True)):
        line = BadLine(Source())
        line.add("serial.flipped", 0.01, 0.2, 0.4)
        if others:
            line.add("serial.dropped", 0.5, 0.5, 0.6)
        results.append(heard(line, 0.45, wait_s)[0][:4_400])
    assert results[0] == results[1] == results[2]


def test_a_share_of_1_is_all() -> None:
    line = BadLine(Source())
    fired = line.add("serial.dropped", 1.0, 0.1, 0.2)
    data, _ = heard(line, 0.3)
    assert len(data) == 2_000 and fired() == 1_000


def test_whole_frames_come_twice() -> None:
    source = Source()
    line = BadLine(source)
    fired = line.add("serial.repeated", 1.0, 0.0, ways=[TO_BOARD])
    for piece in (b"ab", b"c\0d", b"\0"):
        line.write(piece)
    assert b"".join(data for _, data in source.got) == b"abc\0abc\0d\0d\0" and fired() == 2


@pytest.mark.parametrize("ways", [BOTH, (TO_HOST,)])
def test_late_bytes_come_in_order(ways: Sequence[str]) -> None:
    """Those of the span later by the delay, those after it no sooner than the ones before."""
    source = Source()
    line = BadLine(source)
    line.add("serial.delayed", 0.2, 0.5, 0.6, ways)
    data, stamps = heard(line, 0.55)
    line.write(b"x")
    rest, late = heard(line, 1.5)
    assert data + rest == clean(15_000)
    stamps += late
    came = [(i + 1) * BYTE_S for i in range(15_000)]
    for at_s, stamp in zip(came, stamps, strict=True):
        delay_s = 0.2 if 0.5 < at_s - 1e-6 < 0.6 else max(0.8 - at_s, 0.0) if at_s > 0.6 else 0.0
        assert stamp - at_s == pytest.approx(delay_s, abs=0.011), at_s
    assert [at_s for at_s, _ in source.got] == [pytest.approx(0.75 if TO_BOARD in ways else 0.55, abs=1e-6)]


def test_a_stall_lets_all_go_at_its_end() -> None:
    source = Source()
    line = BadLine(source)
    line.add("serial.stalled", 0.0, 0.1, 0.4, [TO_BOARD])
    for at_s in (0.05, 0.15, 0.25, 0.5):
        heard(line, at_s)
        line.write(b"x")
    assert [at_s for at_s, _ in source.got] == [pytest.approx(at_s, abs=1e-6) for at_s in (0.05, 0.4, 0.4, 0.5)]


def test_a_cable_that_is_out_carries_nothing() -> None:
    source = Source()
    line = BadLine(source)
    fired = line.add("cable.out", 0.0, 0.1, 0.3)
    heard(line, 0.2)
    line.write(b"lost")
    data, _ = heard(line, 0.4)
    assert not source.got and fired() == 4 + 2_000 and len(data) == 1_000


def test_a_host_that_stands_still_reads_when_it_goes_on() -> None:
    line = BadLine(Source())
    fired = line.add("host.stopped", 0.0, 0.1, 0.5)
    heard(line, 0.095, 0.005)
    pieces = line.read_stamped(0.02, 0.02)
    assert line.now() == pytest.approx(0.5) and fired() == 4_000
    assert {round(stamp, 6) for stamp, _ in pieces} == {0.5}
    assert len(b"".join(data for _, data in pieces)) == 4_050


def test_a_killed_host_neither_hears_nor_speaks() -> None:
    source = Source()
    line = BadLine(source)
    fired = line.add("host.killed", 0.0, 0.1)
    heard(line, 0.1)
    assert not line.is_killed and line.read_stamped(0.01) == [] and line.is_killed
    assert line.now() == pytest.approx(3.1) and fired() == 30_000
    line.write(b"stop")
    assert line.read_stamped(0.1) == [] and not source.got
