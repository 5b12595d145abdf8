"""A line that fails as it is asked to: bytes dropped, doubled, flipped or late, a cable that is out, a host that stands
still.

It lies between the host's end of the link and any transport, and damages what passes, both ways, in the transport's own
time: it never sleeps. Outside the spans of its faults everything passes as it is. Each fault draws by itself, by its
name, direction, begin and the seed, so that neither another fault nor the way in which reads are cut changes its draws.
"""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Sequence
from typing import Self

from boebot.link.transport import Transport, stamped_read

TO_BOARD, TO_HOST = "to_board", "to_host"
BOTH = (TO_BOARD, TO_HOST)
AFTERMATH_S = 3.0  # that the board is left to itself after its host was killed
_STANDS_STILL = ("host.stopped", "host.killed")
_ROUNDING_S = 0.5e-6  # a clock of whole cycles may stop this much before what was waited for


class _Chance:
    """Which of the units that pass are hit: each as likely."""

    def __init__(self, share: float, draw: random.Random) -> None:
        self._log = math.log1p(-share) if share < 1.0 else -math.inf
        self._draw = draw
        self._next = self._gap()

    def _gap(self) -> int:
        """Units until the next one that is hit: geometrically distributed."""
        return int(math.log1p(-self._draw.random()) / self._log) if self._log else 1 << 62

    def hits(self, count: int) -> list[int]:
        """Of the next `count` units."""
        found = []
        while self._next < count:
            found.append(self._next)
            self._next += 1 + self._gap()
        self._next -= count
        return found


def _copied(data: bytes, hits: Sequence[int], copies: int) -> bytes:
    return b"".join(data[i : i + 1] * (copies if i in hits else 1) for i in range(len(data)))


def _flipped(data: bytes, hits: Sequence[int]) -> bytes:
    damaged = bytearray(data)
    for bit in hits:
        damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


_DAMAGE: dict[str, tuple[int, Callable[[bytes, Sequence[int]], bytes]]] = {
    "serial.dropped": (1, lambda data, hits: _copied(data, hits, 0)),
    "serial.doubled": (1, lambda data, hits: _copied(data, hits, 2)),
    "serial.flipped": (8, _flipped),
}
"""Units in a byte, and what becomes of bytes of which some units are hit."""


class _Fault:
    """One of them, with its span by the transport's clock. `fired`: how much it has changed so far."""

    def __init__(
        self, name: str, value: float, begin_s: float, end_s: float, ways: Sequence[str], seed: int | str
    ) -> None:
        self.name, self.value, self.begin_s, self.end_s, self.ways = name, value, begin_s, end_s, ways
        self.fired = 0
        share = value if name in _DAMAGE or name == "serial.repeated" else 0.0
        self._chances = {way: _Chance(share, random.Random(f"{name} {way} {begin_s:.6f} {seed}")) for way in ways}
        self._frames = {way: bytearray() for way in ways}  # that have begun

    def holds(self, time_s: float) -> bool:
        """It acts at that time."""
        return self.begin_s <= time_s + _ROUNDING_S < self.end_s

    def through(self, way: str, data: bytes) -> bytes:
        """The bytes as this fault leaves them."""
        if self.name == "serial.repeated":
            return self._repeated(self._chances[way], self._frames[way], data)
        if self.name in _DAMAGE:
            units, damage = _DAMAGE[self.name]
            hits = self._chances[way].hits(units * len(data))
            self.fired += len(hits)
            return damage(data, hits)
        self.fired += len(data) if self.name != "host.slow" else 0
        return b"" if self.name in ("cable.out", "host.killed") else data

    def _repeated(self, chance: _Chance, frame: bytearray, data: bytes) -> bytes:
        """Frames end with a byte of 0."""
        passed = bytearray()
        for byte in data:
            frame.append(byte)
            passed.append(byte)
            if byte == 0:
                again = len(chance.hits(1))
                passed += frame * again
                self.fired += again
                frame.clear()
        return bytes(passed)


class BadLine:
    """A `Transport` that fails, and stamps what comes.

    Attributes:
        name, realtime: of the transport that it carries.
        is_killed: the host was killed, and the board left to itself since.
    """

    def __init__(self, transport: Transport, seed: int = 1) -> None:
        """No fault yet: see `add`."""
        self._inner, self._seed = transport, seed
        self.name, self.realtime = transport.name, transport.realtime
        self.is_killed = False
        self._faults: list[_Fault] = []
        self._read = stamped_read(transport)
        self._late: dict[str, deque[tuple[float, bytes]]] = {way: deque() for way in BOTH}  # bytes and when due

    @classmethod
    def around(cls, transport: Transport, seed: int) -> Self:
        """The transport itself where it fails already."""
        return transport if isinstance(transport, cls) else cls(transport, seed)

    def add(
        self, name: str, value: float, begin_s: float, end_s: float = math.inf, ways: Sequence[str] = BOTH
    ) -> Callable[[], int]:
        """One more fault, from `begin_s` to `end_s` by the transport's clock; boebot.running.faults has names, units
        and meaning of `value`. Returns what says how often it has fired so far: how many bits, bytes, frames or steps
        it has changed."""
        if name == "host.killed":
            end_s = min(end_s, begin_s + AFTERMATH_S)
        fault = _Fault(name, value, begin_s, end_s, ways, self._seed)
        self._faults.append(fault)
        return lambda: fault.fired

    def slow_s(self) -> float:
        """How much longer the host's step takes that ends now (s)."""
        slow = [one for one in self._faults if one.name == "host.slow" and one.holds(self.now())]
        for one in slow:
            one.fired += 1
        return sum(one.value for one in slow)

    # ---- the transport -----------------------------------------------------------------------------------------------

    def now(self) -> float:
        """See `Transport`."""
        return self._inner.now()

    def close(self) -> None:
        """See `Transport`."""
        self._inner.close()

    def write(self, data: bytes) -> None:
        """See `Transport`."""
        now_s = self.now()
        self._pass(TO_BOARD, now_s, now_s, data)
        self._write_due(now_s)

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        """See `Transport`."""
        return b"".join(data for _, data in self.read_stamped(wait_s, quiet_s))

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        """See `boebot.link.transport.Stamping`. A host that stands still reads when it goes on: what has come by then
        has that stamp."""
        now_s = awake_s = self.now()
        end_s, listen_s = now_s + wait_s, now_s + quiet_s
        late = self._late[TO_HOST]
        while True:
            for one in self._faults:
                if one.name in _STANDS_STILL and one.holds(now_s):
                    awake_s = one.end_s
                    self.is_killed |= one.name == "host.killed"
            listen_s, end_s = max(listen_s, awake_s), max(end_s, awake_s)
            until_s = min([end_s, *(at_s for at_s in self._instants() if at_s > now_s + _ROUNDING_S)])
            step_s = max(until_s - now_s, 0.0)
            for stamp, data in self._read(step_s, min(max(listen_s - now_s, 0.0), step_s)):
                self._pass(TO_HOST, now_s, stamp, data)
            now_s = self.now()
            self._write_due(now_s)
            is_due = bool(late) and late[0][0] <= now_s + _ROUNDING_S
            if (is_due and now_s + _ROUNDING_S >= listen_s) or now_s + _ROUNDING_S >= end_s:
                return [(max(at_s, awake_s), data) for at_s, data in self._take_due(TO_HOST, now_s)]

    def _instants(self) -> list[float]:
        """When a fault begins or ends, or bytes are due."""
        spans = [at_s for one in self._faults for at_s in (one.begin_s, one.end_s)]
        return spans + [waiting[0][0] for waiting in self._late.values() if waiting]

    def _pass(self, way: str, since_s: float, due_s: float, data: bytes) -> None:
        """Bytes that were read from `since_s` on, and are due then, go on, damaged and delayed."""
        late = self._late[way]
        for one in self._faults:
            if way in one.ways and one.holds(since_s):
                data = one.through(way, data)
                due_s = {"serial.delayed": due_s + one.value, "serial.stalled": one.end_s}.get(one.name, due_s)
        if data and not self.is_killed:
            late.append((max(due_s, late[-1][0] if late else due_s), data))

    def _take_due(self, way: str, now_s: float) -> list[tuple[float, bytes]]:
        late, due = self._late[way], []
        while late and late[0][0] <= now_s + _ROUNDING_S:
            due.append(late.popleft())
        return due

    def _write_due(self, now_s: float) -> None:
        for _, data in self._take_due(TO_BOARD, now_s):
            self._inner.write(data)
