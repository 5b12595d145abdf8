"""The other side of a line for the bench, in another process: answers clock probes, each with a clock answer of the
same token.

    python -m tools.tests.bench.board_side FILE COUNT

FILE is the number of an open descriptor.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tty
from collections.abc import Iterator

from boebot.link import messages
from boebot.link.frame import Decoder, encode


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
def answering(count: int) -> Iterator[str]:
    """A port at whose other side such a process works; its path."""
    master, slave = os.openpty()
    tty.setraw(slave)
    process = subprocess.Popen(
        [sys.executable, "-m", "tools.tests.bench.board_side", str(master), str(count)], pass_fds=[master]
    )
    try:
        yield os.ttyname(slave)
    finally:
        process.kill()
        process.wait()
        os.close(master)
        os.close(slave)


if __name__ == "__main__":
    answer_probes(int(sys.argv[1]), int(sys.argv[2]))
