"""Cycles of the firmware's frame code on the emulated ATmega328P, interrupts not counted.

Run `python -m tools.bench.frame_cycles`. The program is frame_cycles.c, linked with the firmware in
place of main.c, with the flags of the image. Frame code is what turns bytes in the receive ring into
an accepted message, and a message into bytes in the send ring.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Iterator
from pathlib import Path

from boebot.link import messages
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Edge, Level
from tools.bench.avr_program import build

LEFT_SERVO, RIGHT_SERVO = 13, 12
OVERHEAD = 8  # bytes of a frame with both delimiters
FROM_BOARD = 0x80  # ids from here on are messages to the host
LENGTHS = {kind.ID: (name, kind.LENGTH) for kind in messages.MESSAGES.values() for name in [kind.__name__]}
WORKED_ON = {"identify": (0, 60), "get_parameter": (3, 7), "clock_probe": (2, 6), "open": (9, 44)}  # and the answer's


def spans() -> list[int]:
    """How long the pin was high each time, in cycles, without what the measuring itself takes."""
    with tempfile.TemporaryDirectory() as folder:
        image = build(Path(folder) / "frame_cycles.elf", Path(__file__).with_suffix(".c"))
        board = create(image).access()
        edges: list[Edge] = []
        while not any(edge.pin == RIGHT_SERVO and edge.level == Level.HIGH for edge in edges):
            board.run(100_000)
            edges += board.log()
        cycles = [edge.cycle for edge in edges if edge.pin == LEFT_SERVO and edge.level in (Level.LOW, Level.HIGH)]
        cycles = cycles[len(cycles) % 2 :]  # the first may be the pin becoming an output
        measured = [low - high for high, low in zip(cycles[::2], cycles[1::2], strict=True)]
        return [span - measured[0] for span in measured[1:]]


@functools.cache
def frame_code() -> dict[str, tuple[float, int]]:
    """Of every message, with and without zeros in its payload: cycles per byte on the wire, and of the whole frame."""
    return dict(_frame_code(iter(spans())))


def _frame_code(measured: Iterator[int]) -> Iterator[tuple[str, tuple[float, int]]]:
    for content in ("no zeros", "all zeros"):
        for way, to_host in (("received", False), ("sent", True)):
            for message_id in sorted(LENGTHS):
                if (message_id >= FROM_BOARD) == to_host:
                    name, length = LENGTHS[message_id]
                    cycles = next(measured)
                    yield f"{way} {name}, {content}", (cycles / (length + OVERHEAD), cycles)
    encoded, sent = next(measured), next(measured)
    yield "beside it in send_message()", (0.0, sent - encoded)
    received, worked_on, carried_out = next(measured), next(measured), next(measured)
    yield "beside it in link_poll(), with the session's", (0.0, worked_on - received - carried_out)
    for name, (asked, answered) in WORKED_ON.items():
        cycles = next(measured)
        yield f"{name} with its answer, all in all", (cycles / (asked + answered + 2 * OVERHEAD), cycles)
    if (left := sum(1 for _ in measured)) != 0:
        raise RuntimeError(f"{left} measurements too many")


def worst(way: str) -> float:
    """Cycles per byte of the costliest message, "received" or "sent"."""
    return max(per_byte for case, (per_byte, _) in frame_code().items() if case.startswith(way))


if __name__ == "__main__":
    for case, (per_byte, whole) in frame_code().items():
        print(f"{case:50} {f'{per_byte:6.1f} cycles/byte' if per_byte else '':18} {whole:6} cycles")
