"""How late a port's bytes are stamped and read while another Python thread computes; round trips over a pty."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.link.ports.serial_port import SerialTransport
from boebot.link.ports.switch_interval import INTERVAL_S
from tools.bench import board_side
from tools.bench.figures import Peer, figure

PYTHONS_INTERVAL_S = 0.005  # by default
WARM_UP = 20  # first messages, not counted
PEER = "calling thread reads, switch interval 5 ms"


@contextlib.contextmanager
def computing(interval_s: float) -> Iterator[None]:
    """A thread that computes in Python, at that switch interval."""
    done, before = threading.Event(), sys.getswitchinterval()

    def compute() -> None:
        value = 1
        while not done.is_set():
            for _ in range(1000):
                value = value * 1103515245 + 12345 & 0x7FFFFFFF

    thread = threading.Thread(target=compute)
    sys.setswitchinterval(interval_s)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()
        sys.setswitchinterval(before)


def delays(thread: bool, interval_s: float, count: int = 1000) -> NDArray[np.float64]:
    """Seconds from sending to receipt stamp and to Python's wake-up, a row for each message.

    Args:
        thread: the port is read by its thread in C, else by the calling thread.
        interval_s: Python's switch interval.
        count: messages; one comes about every 10 ms.
    """
    decoder = Decoder()
    found: list[tuple[float, float]] = []
    with (
        board_side.beside("ticks", count + 10) as path,
        contextlib.closing(SerialTransport(path, thread=thread)) as port,
        computing(interval_s),
    ):
        while len(found) < count:
            pieces = port.read_stamped(1.0)
            awake = time.monotonic()
            if not pieces:
                raise RuntimeError("the other side sends nothing")
            for stamp, data in pieces:
                for _, _, payload in decoder.feed(data):
                    (sent,) = board_side.SENT.unpack_from(payload)
                    found.append((stamp - sent, awake - sent))
    return np.array(found[WARM_UP:])


@cache
def round_trips(count: int = 3000) -> NDArray[np.float64]:
    """Times (s) of clock probes and their answers over a pseudo-terminal, which takes no wire time."""
    decoder = Decoder()
    times = []
    with board_side.beside("answers", count) as path, contextlib.closing(SerialTransport(path, thread=True)) as port:
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
    return np.array(times[WARM_UP:])


def milliseconds(times: NDArray[np.float64], percentile: float) -> float:
    """The percentile of times (s)."""
    return 1000 * float(np.percentile(times, percentile))


@cache
def worst(thread: bool, interval_s: float) -> tuple[float, float]:
    """The 99th percentiles (ms) of receipts and wake-ups."""
    receipts, wake_ups = delays(thread, interval_s).T
    return milliseconds(receipts, 99), milliseconds(wake_ups, 99)


@figure(
    "receipt stamp beside a Python thread that computes, p99",
    "ms",
    at_most=1,
    peers=[Peer(PEER, lambda: worst(False, PYTHONS_INTERVAL_S)[0])],
)
def receipt_stamp() -> float:
    return worst(True, INTERVAL_S)[0]


@figure(
    "brain's wake-up beside a Python thread that computes, p99",
    "ms",
    at_most=5,
    peers=[Peer(PEER, lambda: worst(False, PYTHONS_INTERVAL_S)[1])],
)
def wake_up() -> float:
    return worst(True, INTERVAL_S)[1]


@figure("request to answer over a pty, without wire time, p50", "ms", at_most=0.3)
def round_trip() -> float:
    return milliseconds(round_trips(), 50)


@figure("request to answer over a pty, without wire time, p99", "ms", at_most=1.0)
def round_trip_99() -> float:
    return milliseconds(round_trips(), 99)
