"""How late a port's bytes are stamped, and how late Python has them, while another Python thread computes."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.link.ports.serial_port import SerialTransport
from boebot.link.ports.switch_interval import INTERVAL_S
from tools.bench import board_side
from tools.bench.figures import Peer, figure

DEFAULT_INTERVAL_S = 0.005  # Python's own
_WARM_UP = 20  # first messages, not counted


class Port(Protocol):
    """What is needed of a transport."""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]: ...
    def write(self, data: bytes) -> None: ...


@dataclass(frozen=True)
class Delays:
    """Seconds after the sending; and how far the computing thread came."""

    receipt: NDArray[np.float64]
    wake_up: NDArray[np.float64]
    rounds_per_s: float


class Computing:
    """A thread that does nothing but compute, in Python."""

    def __init__(self) -> None:
        self._running = True
        self._rounds = 0
        self._thread = threading.Thread(target=self._compute)
        self._begun = time.monotonic()
        self._thread.start()

    def stop(self) -> float:
        """Ends it; how many rounds it made in a second."""
        self._running = False
        self._thread.join()
        return self._rounds / (time.monotonic() - self._begun)

    def _compute(self) -> None:
        value = 1
        while self._running:
            for _ in range(1000):
                value = value * 1103515245 + 12345 & 0x7FFFFFFF
            self._rounds += 1


@contextlib.contextmanager
def switching_after(interval_s: float) -> Iterator[None]:
    """Python's switch interval for as long as the block lasts."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(interval_s)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def delays_of(port: Port, count: int) -> tuple[list[float], list[float]]:
    """Receipts and wake-ups of `count` ticks of board_side."""
    decoder = Decoder()
    receipts: list[float] = []
    wake_ups: list[float] = []
    while len(receipts) < count:
        pieces = port.read_stamped(1.0)
        awake = time.monotonic()
        if not pieces:
            raise RuntimeError("the other side sends nothing")
        for stamp, data in pieces:
            for _, _, payload in decoder.feed(data):
                (sent,) = board_side.SENT.unpack_from(payload)
                receipts.append(stamp - sent)
                wake_ups.append(awake - sent)
    return receipts[_WARM_UP:], wake_ups[_WARM_UP:]


def measure(*, thread: bool, interval_s: float, count: int = 1000, computing: bool = True) -> Delays:
    """Reads `count` ticks beside a thread that computes.

    Args:
        thread: the port is read by its thread in C, else by the calling thread.
        interval_s: Python's switch interval.
        count: messages; one comes about every 10 ms.
        computing: False: nothing is computed beside.
    """
    with board_side.beside("ticks", count + 10) as path:
        port = SerialTransport(path, thread=thread)
        try:
            with switching_after(interval_s):
                work = Computing() if computing else None
                try:
                    receipts, wake_ups = delays_of(port, count)
                finally:
                    rounds = work.stop() if work is not None else 0.0
        finally:
            port.close()
    return Delays(np.array(receipts), np.array(wake_ups), rounds)


def round_trips(port: Port, count: int) -> NDArray[np.float64]:
    """Times (s) of `count` clock probes and their answers."""
    decoder = Decoder()
    times = []
    for number in range(count):
        begun = time.perf_counter()
        port.write(encode(messages.ClockProbe.ID, number & 0xFF, messages.ClockProbe(number & 0xFFFF).pack()))
        answered = False
        while not answered:
            pieces = port.read_stamped(1.0)
            if not pieces:
                raise RuntimeError("the other side does not answer")
            answered = any(decoder.feed(data) for _, data in pieces)
        times.append(time.perf_counter() - begun)
    return np.array(times[_WARM_UP:])


def measure_round_trips(*, thread: bool, count: int = 3000) -> NDArray[np.float64]:
    """The same over a pseudo-terminal, which takes no wire time, with nothing computed beside."""
    with board_side.beside("answers", count) as path:
        port = SerialTransport(path, thread=thread)
        try:
            return round_trips(port, count)
        finally:
            port.close()


def per_cent(values: NDArray[np.float64], share: float) -> float:
    """The percentile of times in s, in ms."""
    return 1000 * float(np.percentile(values, share))


# ---- figures ----------------------------------------------------------------------------------------------------


@cache
def _with_thread() -> Delays:
    return measure(thread=True, interval_s=INTERVAL_S)


@cache
def _without_thread() -> Delays:
    return measure(thread=False, interval_s=DEFAULT_INTERVAL_S)


def _plain_receipt() -> float:
    return per_cent(_without_thread().receipt, 99)


def _plain_wake_up() -> float:
    return per_cent(_without_thread().wake_up, 99)


@cache
def _round_trips() -> NDArray[np.float64]:
    return measure_round_trips(thread=True)


@figure(
    "receipt stamp beside a Python thread that computes, p99",
    "ms",
    at_most=1,
    peers=[Peer("calling thread reads, switch interval 5 ms", _plain_receipt)],
)
def receipt_stamp() -> float:
    return per_cent(_with_thread().receipt, 99)


@figure(
    "brain's wake-up beside a Python thread that computes, p99",
    "ms",
    at_most=5,
    peers=[Peer("calling thread reads, switch interval 5 ms", _plain_wake_up)],
)
def wake_up() -> float:
    return per_cent(_with_thread().wake_up, 99)


@figure("request to answer over a pty, without wire time, p50", "ms", at_most=0.3)
def round_trip() -> float:
    return per_cent(_round_trips(), 50)


@figure("request to answer over a pty, without wire time, p99", "ms", at_most=1.0)
def round_trip_99() -> float:
    return per_cent(_round_trips(), 99)
