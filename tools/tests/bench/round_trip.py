"""Round trips over a pty: from a request to its answer, without wire time."""

from __future__ import annotations

import contextlib
import time

import numpy as np
from numpy.typing import NDArray

from boebot.link import messages
from boebot.link.frame import Decoder, encode
from boebot.link.ports import open_serial
from tools.tests.bench import board_side
from tools.tests.bench.figures import figure, loop

WARM_UP = 20  # first messages, not counted


def round_trips(count: int = 3000) -> NDArray[np.float64]:
    """Times (s) of clock probes and their answers over a pseudo-terminal, which takes no wire time."""
    decoder = Decoder()
    times = []
    with board_side.answering(count) as path, contextlib.closing(open_serial(path, 500_000)) as port:
        for number in range(count):
            begun = time.perf_counter()
            port.write(encode(messages.ClockProbe.ID, number & 0xFF, messages.ClockProbe(number & 0xFFFF).pack()))
            answered = False
            while not answered:
                data = port.read(1.0)
                if not data:
                    raise RuntimeError("the other side does not answer")
                answered = bool(decoder.feed(data))
            times.append(time.perf_counter() - begun)
    return np.array(times[WARM_UP:])


@figure(
    "request to answer over a pty, without wire time, p50",
    "ms",
    times_at_most=10,
    peers=[loop(1000, 1000.0)],
)
def round_trip() -> float:
    return 1000 * float(np.percentile(round_trips(), 50))
