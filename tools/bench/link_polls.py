"""How long the link waits between two polls while the line is full both ways, and what the receive ring must hold
meanwhile.

Run `python -m tools.bench.link_polls [SECONDS]`. The image is the one that is flashed: polls are seen by the emulator's
recorder, the ring by its head and tail, which the firmware keeps in two registers (hal_avr.h).
"""

from __future__ import annotations

import functools
import sys
from dataclasses import dataclass

from boebot.robots import load_robot
from sim_bridge.boards.emulated import avr_image
from sim_bridge.timing.loads import CYCLES_PER_US, Bench
from sim_bridge.timing.measure import CLOCK_HZ, run
from sim_bridge.timing.scenarios import load, numbers_of, prepare

RING = 255  # bytes that the receive ring holds
HEAD, TAIL = 0x4A, 0x48  # GPIOR1, OCR0B
STEP = 160  # cycles from look to look, half the time of a byte: what is seen is too small by one byte at most
SCENARIO, SEED = "saturated", 1


@dataclass(frozen=True)
class Polls:
    """The longest time between two polls (us), sleep not counted, and the most bytes that waited."""

    longest_us: float
    most_waiting: int


@functools.cache
def polls(seconds: float = 2.0) -> Polls:
    """Of that long at saturation; the board's time."""
    image, robot = avr_image("shieldbot"), load_robot("shieldbot")
    longest = run(image, robot, SCENARIO, seconds, SEED, losses=False).measurement().between_polls
    most, cycles = 0, round(seconds * CLOCK_HZ)
    with Bench(image) as bench:
        line = prepare(bench, robot, SCENARIO)
        load(bench, line, robot, SCENARIO, numbers_of(SEED), cycles)
        end = bench.now + cycles
        while bench.now < end:
            bench.run(STEP)
            head, tail = (bench.access.read_memory(register, 1)[0] for register in (HEAD, TAIL))
            most = max(most, (head - tail) & 0xFF)
    return Polls(longest / CYCLES_PER_US, most)


if __name__ == "__main__":
    found = polls(float(sys.argv[1]) if len(sys.argv) > 1 else 2.0)
    print(f"longest time between polls {found.longest_us:.0f} us, most bytes waiting {found.most_waiting} of {RING}")
