"""What keeping the board's clock costs the host: one probe's answer, one observation's stamp."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from functools import cache

from boebot.link.clock import BoardClock
from tools.bench.figures import figure

BYTE_S = 2e-5
ROUNDS, REPEATS = 200, 15


@cache
def _costs() -> dict[str, float]:
    """Least mean time (us) of each in a session of 20 s, with a USB adapter's latencies of 0.1 to 5 ms."""
    draw = random.Random("clock")
    clock = BoardClock(BYTE_S)
    at_s = 1000.0

    def probe() -> None:
        clock.probe(at_s - draw.uniform(0.3e-3, 5e-3), int(at_s * 1e6) & 0xFFFFFFFF, at_s + draw.uniform(0.4e-3, 5e-3))

    def stamp() -> None:
        clock.observe(int(at_s * 1e6) & 0xFFFFFFFF, at_s + 3e-3)

    for step in range(2000):
        at_s += 0.01
        if step % 4 == 0:
            probe()
        stamp()
    uses: dict[str, Callable[[], None]] = {"probe": probe, "stamp": stamp}
    least = dict.fromkeys(uses, 1.0)
    for _ in range(REPEATS):
        for name, use in uses.items():
            begun = time.perf_counter()
            for _ in range(ROUNDS):
                at_s += 1e-3
                use()
            least[name] = min(least[name], (time.perf_counter() - begun) / ROUNDS)
    return {name: 1e6 * cost for name, cost in least.items()}


@figure("board's clock, the answer to a probe", "us", at_most=20)
def probe_cost() -> float:
    return _costs()["probe"]


@figure("board's clock, an observation's stamp", "us", at_most=2)
def stamp_cost() -> float:
    return _costs()["stamp"]
