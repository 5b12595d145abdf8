"""Who reads a port, so that stamps and brain do not wait for a Python thread that computes.

Prints the table of docs/decisions/0003-port-thread.md: `python -m tools.decisions.port_thread`, from the repository.
Where other programs work at the same time the quietest seconds count, and the last column tells how much of a processor
they took.
"""

from __future__ import annotations

import contextlib
import os
import select
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from boebot.link.ports.serial_port import SerialTransport
from tools.bench import board_side
from tools.bench.busy import (
    Computing,
    Delays,
    Port,
    delays_of,
    measure,
    measure_round_trips,
    per_cent,
    round_trips,
    switching_after,
)

T = TypeVar("T")
Floats = NDArray[np.float64]
COUNT = 120  # messages, about one each 10 ms, in one piece
PIECES = 8
TRIES = 16
OTHERS_MAX = 0.1  # of one processor: quiet
COMPUTING_S = 1.0
WAYS = (("calling thread", False), ("thread in C", True), ("process", None))
HEAD = struct.Struct("<dI")  # receipt (s), bytes that follow


class ReadByProcess:
    """A port that a process of its own reads and stamps; a pipe brings what it read."""

    def __init__(self, path: str) -> None:
        self._port = os.open(path, os.O_RDWR | os.O_NOCTTY)
        self._pipe, far_end = os.pipe()
        command = [sys.executable, "-m", "tools.decisions.port_thread", "read", path, str(far_end)]
        self._process = subprocess.Popen(command, pass_fds=[far_end], stdout=subprocess.PIPE)
        os.close(far_end)
        assert self._process.stdout is not None
        self._process.stdout.readline()
        self._rest = b""

    def read_stamped(self, wait_s: float, quiet_s: float = 0.0) -> list[tuple[float, bytes]]:
        if not select.select([self._pipe], [], [], wait_s)[0]:
            return []
        data = self._rest + os.read(self._pipe, 65536)
        pieces = []
        while len(data) >= HEAD.size and len(data) >= HEAD.size + (size := HEAD.unpack_from(data)[1]):
            pieces.append((HEAD.unpack_from(data)[0], data[HEAD.size : HEAD.size + size]))
            data = data[HEAD.size + size :]
        self._rest = data
        return pieces or self.read_stamped(wait_s)

    def write(self, data: bytes) -> None:
        os.write(self._port, data)

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        os.close(self._port)
        os.close(self._pipe)


def read_for_another(path: str, pipe: int) -> None:
    """The process of ReadByProcess."""
    port = SerialTransport(path, thread=False)
    print("ready", flush=True)
    while True:
        for stamp, data in port.read_stamped(1.0):
            os.write(pipe, HEAD.pack(stamp, len(data)) + data)


@contextlib.contextmanager
def read_by_process(what: str, count: int) -> Iterator[Port]:
    with board_side.beside(what, count) as path, contextlib.closing(ReadByProcess(path)) as port:
        yield port


def processor_s() -> tuple[float, float]:
    """Processor time (s) that this program has taken, with what it has started and ended; and that all have."""
    own = os.times()
    user, nice, system, _, _, irq, soft_irq = (int(word) for word in Path("/proc/stat").read_text().split()[1:8])
    return sum(own[:4]), (user + nice + system + irq + soft_irq) / os.sysconf("SC_CLK_TCK")


def quietest(measure_piece: Callable[[], T], wanted: int = PIECES) -> tuple[list[T], float]:
    """The `wanted` pieces of up to TRIES during which other programs did least, and how much that was on average (1: a
    whole processor). No more tries than needed on a machine that does nothing else."""
    pieces: list[tuple[float, T]] = []
    for _ in range(TRIES):
        begun, (own, all_s) = time.monotonic(), processor_s()
        piece = measure_piece()
        own_after, all_after = processor_s()
        others = (all_after - all_s - (own_after - own)) / (time.monotonic() - begun)
        pieces.append((max(0.0, others), piece))
        if sum(others <= OTHERS_MAX for others, _ in pieces) == wanted:
            break
    pieces.sort(key=lambda entry: entry[0])
    del pieces[wanted:]
    return [piece for _, piece in pieces], float(np.mean([others for others, _ in pieces]))


def joined(pieces: list[Delays]) -> Delays:
    """Pieces as one."""
    return Delays(
        np.concatenate([piece.receipt for piece in pieces]),
        np.concatenate([piece.wake_up for piece in pieces]),
        float(np.mean([piece.rounds_per_s for piece in pieces])),
    )


def measure_process(interval_s: float) -> Delays:
    """As `measure`, with the port read by a process."""
    with read_by_process("ticks", COUNT + 100) as port, switching_after(interval_s):
        work = Computing()
        try:
            receipts, wake_ups = delays_of(port, COUNT)
        finally:
            rounds = work.stop()
    return Delays(np.array(receipts), np.array(wake_ups), rounds)


def computing_alone(threads: int, interval_s: float) -> float:
    """Rounds per second that so many computing threads make together, with no port open."""
    with switching_after(interval_s):
        works = [Computing() for _ in range(threads)]
        time.sleep(COMPUTING_S)
        return sum(work.stop() for work in works)


def trips(thread: bool | None) -> Floats:
    """Round trips by that way to read."""
    if thread is not None:
        return measure_round_trips(thread=thread, count=1000)
    with read_by_process("answers", 1000) as port:
        return round_trips(port, 1000)


def beside_computing(thread: bool | None, interval_s: float) -> Delays:
    """Delays by that way to read."""
    if thread is None:
        return measure_process(interval_s)
    return measure(thread=thread, interval_s=interval_s, count=COUNT)


def main() -> None:
    """Some seconds of telemetry and some thousand round trips for each way to read."""
    alone = float(np.mean(quietest(lambda: computing_alone(1, 0.005), 3)[0]))
    print(f"{'':33}{'receipt stamp (ms)':>18}{'wake-up (ms)':>18}{'round trip (ms)':>18}{'computing':>10}{'other':>10}")
    print(f"{'reader':18}switch interval" + f"{'p50':>9}{'p99':>9}" * 3 + f"{'thread':>10}{'programs':>10}")
    for name, thread in WAYS:
        times = np.concatenate(quietest(partial(trips, thread), 3)[0])
        for interval_s in (0.005, 0.001):
            pieces, others = quietest(partial(beside_computing, thread, interval_s))
            delays = joined(pieces)
            columns = (delays.receipt, delays.wake_up, times)
            figures = "".join(f"{per_cent(column, share):9.3f}" for column in columns for share in (50, 99))
            start = f"{name:18s}{1000 * interval_s:10.0f} ms  {figures}"
            print(f"{start}{delays.rounds_per_s / alone:10.0%}{others:10.0%}", flush=True)
    slow, fast = (np.mean(quietest(partial(computing_alone, 2, interval_s), 3)[0]) for interval_s in (0.005, 0.001))
    print(f"two threads that compute, no port: at 1 ms {fast / slow:.0%} of what they do at 5 ms")


if __name__ == "__main__":
    if sys.argv[1:2] == ["read"]:
        read_for_another(sys.argv[2], int(sys.argv[3]))
    else:
        main()
