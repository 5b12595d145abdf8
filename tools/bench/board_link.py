"""What the link costs the board: cycles, flash, RAM, and what is lost when the line is full."""

from __future__ import annotations

import functools
import tempfile
from pathlib import Path

from hil_tests.test_uart_cycles import BYTES, cycles_per_byte
from tools.bench import frame_cycles, link_polls, link_size
from tools.bench.figures import figure
from tools.bench.saturation import Saturation, saturated

SECONDS = 60.0


@functools.cache
def full_line() -> Saturation:
    return saturated(SECONDS)


def _uart_cycles(to_send: int, to_receive: bytes) -> float:
    with tempfile.TemporaryDirectory() as folder:
        return cycles_per_byte(Path(folder), to_send, to_receive)


@figure("UART interrupt, a byte received, entry and return included", "cycles", at_most=50)
def uart_received() -> float:
    return max(_uart_cycles(0, BYTES * byte) for byte in (b"\x55", b"\0"))


@figure("UART interrupt, a byte sent, entry and return included", "cycles", at_most=45)
def uart_sent() -> float:
    return _uart_cycles(BYTES, b"")


@figure("frame code on the board, received: costliest message", "cycles/byte", at_most=50)
def frame_received() -> float:
    return frame_cycles.worst("received")


@figure("frame code on the board, sent: costliest message", "cycles/byte", at_most=50)
def frame_sent() -> float:
    return frame_cycles.worst("sent")


@figure("flash of frame, delivery and session, with tables", "B", at_most=3072)
def flash() -> float:
    return link_size.total().flash


@figure("RAM of frame, delivery and session, without the UART's rings", "B", at_most=350)
def ram() -> float:
    return link_size.total().ram


@figure("board, line saturated both ways for 60 s, all sensors on: bytes and frames lost", "", at_most=0)
def lost() -> float:
    return full_line().bytes_lost + full_line().frames_bad


@figure("board, line saturated both ways for 60 s, all sensors on: ticks missed", "ticks", at_most=0)
def ticks_missed() -> float:
    return full_line().ticks_missed


@figure("board, line saturated both ways for 60 s, all sensors on: CPU load", "% of its cycles", at_most=100)
def load() -> float:
    return 100.0 * full_line().load


@figure("board, line saturated both ways: longest time between two polls", "us", at_most=link_polls.RING * 20)
def poll_time() -> float:
    return link_polls.polls().longest_us


@figure("board, line saturated both ways: most bytes waiting in the receive ring", "B", at_most=link_polls.RING)
def poll_bytes() -> float:
    return link_polls.polls().most_waiting
