"""The other side of a line for the bench, in another process.

    python -m tools.bench.board_side ticks|answers FILE COUNT

    ticks     sends COUNT telemetry frames, one about every 10 ms; the payload begins with the instant of sending
    answers   answers COUNT clock probes, each with a clock answer of the same token

FILE is the number of an open descriptor.
"""

from __future__ import annotations

import contextlib
import os
import random
import struct
import subprocess
import sys
import time
import tty
from collections.abc import Iterator

from boebot.link import messages
from boebot.link.frame import Decoder, encode

PERIOD_S = 0.01
TELEMETRY = messages.Telemetry
SENT = struct.Struct("<d")  # s, monotonic clock


def send_ticks(file: int, count: int) -> None:
    """Not in step with anything at the other side: the period is dithered."""
    random.seed(1)
    due = time.monotonic()
    for number in range(count):
        due += PERIOD_S * random.uniform(0.5, 1.5)
        time.sleep(max(0.0, due - time.monotonic()))
        payload = SENT.pack(time.monotonic()).ljust(TELEMETRY.LENGTH, b"\1")
        os.write(file, encode(TELEMETRY.ID, number & 0xFF, payload))


def answer_probes(file: int, count: int) -> None:
    """Answers at once."""
    decoder = Decoder(to_board=True)
    sequence = 0
    while sequence < count:
        for _, _, payload in decoder.feed(os.read(file, 4096)):
            answer = messages.ClockAnswer(messages.ClockProbe.unpack(payload).token, 0)
            os.write(file, encode(answer.ID, sequence & 0xFF, answer.pack()))
            sequence += 1


@contextlib.contextmanager
def beside(what: str, count: int) -> Iterator[str]:
    """A port at whose other side such a process works; its path."""
    master, slave = os.openpty()
    tty.setraw(slave)
    command = [sys.executable, "-m", "tools.bench.board_side", what, str(master), str(count)]
    process = subprocess.Popen(command, pass_fds=[master])
    try:
        yield os.ttyname(slave)
    finally:
        process.kill()
        process.wait()
        os.close(master)
        os.close(slave)


if __name__ == "__main__":
    {"ticks": send_ticks, "answers": answer_probes}[sys.argv[1]](int(sys.argv[2]), int(sys.argv[3]))
