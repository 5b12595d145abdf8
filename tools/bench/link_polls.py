"""How long the link waits between two polls while the line is saturated, and what the receive ring must hold meanwhile.

Run `python -m tools.bench.link_polls [SECONDS]`. The image gets a probe around link_poll() (link_polls.c).
"""

from __future__ import annotations

import functools
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from boebot.boards import BoardRequest, open_board
from boebot.robots import load_robot
from hil_tests.rig import CYCLES_PER_US, Rig
from sim_bridge.tests.symbols import find_symbol
from tools.bench.avr_program import build
from tools.bench.saturation import saturate

RING = 255  # bytes that the receive ring holds


@dataclass(frozen=True)
class Polls:
    """The longest time between two polls (us), and the most bytes that waited at one."""

    longest_us: float
    most_waiting: int


@functools.cache
def polls(seconds: float = 10.0) -> Polls:
    """Of that long at saturation; the board's time."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(__file__).with_suffix(".c")
        image = build(Path(folder) / "link_polls.elf", source, extra=("-fno-lto", "-Wl,--wrap=link_poll"))
        longest, most = (find_symbol(image, name) for name in ("longest_gap", "most_waiting"))
        request = BoardRequest(robot=load_robot("shieldbot"), arena="room", image=str(image))
        with Rig(open_board("avr", request)) as rig:
            rig.start()
            for symbol in (longest, most):  # what happened at start does not count
                rig.board.write_memory(symbol.address, bytes(symbol.size))
            saturate(rig, seconds)
            cycles, waiting = (
                int.from_bytes(rig.board.read_memory(symbol.address, symbol.size), "little")
                for symbol in (longest, most)
            )
            return Polls(cycles / CYCLES_PER_US, waiting)


if __name__ == "__main__":
    found = polls(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
    print(f"longest time between polls {found.longest_us:.0f} us, most bytes waiting {found.most_waiting} of {RING}")
