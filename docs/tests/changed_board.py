"""What a board does that runs the image of docs/how-to/change-the-firmware.md, as JSON; by the Python packages that
the page has changed: `python changed_board.py IMAGE.elf`."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path

from boebot.link import messages
from boebot_timing.emulated.scenarios import EDGES_PER_S
from boebot_timing.tests.jitter import lost, servo_pulses
from boebot_timing.tests.jitter_run import drive
from sim_bridge.bench.bench import Bench
from sim_bridge.boards.board import Level
from sim_bridge.tests.boards.symbols import find_symbol

SECONDS = 2.0
BUZZER, LAMP = 4, 14  # pins
LAMP_ID = 0x1A
MM_PER_EDGE, TICKS_PER_S = 3.25, 100


def seen(elf: Path) -> dict[str, object]:
    """With set-points and telemetry in each tick, and encoders at 1,500 edges a second."""
    with Bench(elf, record=False) as bench:
        text = find_symbol(elf, "ride_text").address
        rides: list[bytes] = []
        ridden = drive(bench, "figures", SECONDS, 1, lambda _: rides.append(bench.pins.read_memory(text, 16)))
        pulses = servo_pulses(ridden)
        steady = EDGES_PER_S["figures"] * MM_PER_EDGE * math.sqrt(1 - (1 - 1 / TICKS_PER_S) ** (SECONDS * TICKS_PER_S))
        clicks = [edge.cycle for edge in bench.edges[BUZZER] if ridden.begun < edge.cycle < ridden.ended]
        switched = []
        for on in (1, 0):
            ridden.line.send(messages.MESSAGES[LAMP_ID](on))
            bench.run(160_000)
            switched.append(bench.pins.output(LAMP) == Level.HIGH)
        return {
            "pulses": [len(one.values) for one in pulses],
            "broken pulses": sum(one.broken for one in pulses),
            "lost": asdict(lost(ridden)),
            "ride to steady": int(rides[-1].split(b" mm/s\0")[0]) / steady,
            "cycles between clicks": sorted({after - before for before, after in pairwise(clicks)}),
            "lamp": switched,
        }


if __name__ == "__main__":
    print(json.dumps(seen(Path(sys.argv[1]))))
