"""The serial line of a board, seen from the computer's end: bytes to it, and waiting for what it says."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from boebot.arguments import number, shown
from boebot.errors import CallError
from boebot.link.transport import Transport, stamped_read
from sim_bridge.bench.waiting import LONGEST_S, WaitError

SLICE_S = 0.000_5  # of waiting, between two looks at what has come
PORTION_S = 0.25  # of time that only passes
NOTHING_S = 1e-9
SHOWN = 200  # bytes of what came, in the text of an error


@dataclass
class Line:
    """What a serial line needs to know of its board.

    Attributes:
        transport: carries the bytes.
        is_heard: whether the board's receiver is on, so that a byte would not be lost.
        not_heard: why it would, in words.
        rates: in words: the bit rates of both ends, where a test chooses one.
        mark: is called with the instant of what was waited for, the end of a byte's stop bit, or of what was sent (s).
        starts_s: when a program that has said nothing yet has begun at the latest: a wait does not begin before.
        allowance_s: by which a wait is longer, as the way to a real board takes time that is not the board's.
    """

    transport: Transport
    is_heard: Callable[[], bool] = lambda: True
    not_heard: str = ""
    rates: Callable[[], str] = str
    mark: Callable[[float], object] = lambda at_s: None
    starts_s: float = 0.0
    allowance_s: float = 0.0


@dataclass
class Serial:
    """Bytes to and from a board. All times are by the board's clock (s).

    Attributes:
        heard: all that has come so far, where no time passes any more.
    """

    line: Line
    heard: bytearray = field(default_factory=bytearray)
    _ends_s: list[float] = field(default_factory=list)  # of the stop bit of each byte
    _begin: int = 0  # index of the first byte that `expect` looks at
    _sent_s: float = -1.0  # what has come until then is no answer

    def __post_init__(self) -> None:
        self.opened_s = 0.0 if not self.line.transport.realtime else self.line.transport.now()

    def stamped(self) -> Iterator[tuple[float, bytes]]:
        """The same byte by byte, with the end of its stop bit."""
        return zip(self._ends_s, (bytes([byte]) for byte in self.heard), strict=True)

    @property
    def text(self) -> bytes:
        """All that the board has said so far."""
        self._take(0.0)
        return bytes(self.heard)

    def now(self) -> float:
        """The board's clock, since it was opened."""
        return self.line.transport.now() - self.opened_s

    def listen(self, seconds: float) -> None:
        """Lets that much time pass."""
        end_s = self.line.transport.now() + seconds
        while (left_s := end_s - self.line.transport.now()) > NOTHING_S:
            self._take(min(left_s, PORTION_S), min(left_s, PORTION_S))

    def forget(self) -> None:
        """What the board has said until now is no answer: `expect` does not look at it any more."""
        self._begin, self._sent_s = len(self.heard), self.line.transport.now()

    def send(self, data: bytes, *, within: float = 1.0) -> None:
        """Sends bytes as soon as the board's receiver is on. What the board has said before is no answer.

        Raises:
            WaitError: the receiver was off for `within` seconds.
        """
        if not isinstance(data, bytes | bytearray):
            hint = f", as in b{data!r}" if isinstance(data, str) else ""
            raise CallError(f"send: got {shown(data)}; expected bytes{hint}")
        transport = self.line.transport
        begin_s = transport.now()
        while not self.line.is_heard():
            if transport.now() >= begin_s + _seconds("send", within):
                raise WaitError(f"waited {within:g} s to send {bytes(data)!r}: {self.line.not_heard}")
            self._take(SLICE_S)
        self._take(0.0)
        self.forget()
        self.line.mark(transport.now())
        transport.write(bytes(data))

    def expect(self, what: bytes | re.Pattern[bytes], *, within: float = 1.0) -> re.Match[bytes]:
        """Waits until the board has said that, behind what the last `expect` has found.

        A pattern is found as soon as it can be, byte by byte: end a number by what follows it, as in rb"(\\d+)\\r\\n".

        Raises:
            WaitError: it has not come within that time (s).
        """
        if not isinstance(what, bytes | re.Pattern) or not what or isinstance(getattr(what, "pattern", b""), str):
            hint = f", as in b{what!r}" if what and isinstance(what, str) else ""
            raise CallError(f"expect: got {shown(what)}; expected bytes or a compiled pattern of bytes{hint}")
        if isinstance(what, re.Pattern) and what.search(b""):
            raise CallError(f"expect: the pattern {what.pattern!r} is found where nothing came; expected one of bytes")
        begin_s = self.line.transport.now() if self.heard else max(self.line.transport.now(), self.line.starts_s)
        end_s = begin_s + _seconds("expect", within) + self.line.allowance_s
        looked = self._begin
        while (found := self._find(what, looked)) is None:
            left_s = end_s - self.line.transport.now()
            if left_s <= 0:
                raise WaitError(self._in_vain(what, within))
            looked = max(looked, len(self.heard))
            self._take(min(left_s, SLICE_S))
            looked = max(looked, self._begin)
        self._begin = found.end()
        self.line.mark(self._ends_s[found.end() - 1])
        return found

    def _find(self, what: bytes | re.Pattern[bytes], looked: int) -> re.Match[bytes] | None:
        """The match that ends first, of a byte from index `looked` on."""
        if isinstance(what, bytes):
            at = self.heard.find(what, self._begin)
            return None if at < 0 else re.compile(re.escape(what)).match(self.heard, at)
        found = (what.search(self.heard, self._begin, end) for end in range(looked + 1, len(self.heard) + 1))
        return next(filter(None, found), None)

    def _take(self, wait_s: float, quiet_s: float = 0.0) -> None:
        """Takes what comes in that time, of which `quiet_s` passes in any case."""
        for end_s, data in stamped_read(self.line.transport)(wait_s, quiet_s):
            self.heard += data
            self._ends_s += [end_s] * len(data)
            if end_s <= self._sent_s:
                self._begin = len(self.heard)

    def _in_vain(self, what: bytes | re.Pattern[bytes], within: float) -> str:
        wanted = f"{what!r}" if isinstance(what, bytes) else f"the pattern {what.pattern!r}"
        allowed = f" (and {self.line.allowance_s:g} s for the port)" if self.line.allowance_s else ""
        new, before = bytes(self.heard[self._begin :]), bytes(self.heard[: self._begin])
        saw = f"saw {_end_of(new)}" if new else "nothing came"
        earlier = f"; before that came {_end_of(before)}" if before else ""
        return f"waited {within:g} s{allowed} for {wanted} from the board: {saw}{earlier}{self.line.rates()}"


def _end_of(data: bytes) -> str:
    """Bytes for people: the newest of many."""
    return repr(data) if len(data) <= SHOWN else f"{len(data)} bytes that end by {data[-SHOWN:]!r}"


def _seconds(who: str, value: float) -> float:
    return number(f"{who}: within", value, CallError, least=0, most=LONGEST_S)
