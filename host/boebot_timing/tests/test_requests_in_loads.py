"""Every load admits what its own scenario asks for: else what is bounded under the load is not bounded in the scenario.

A request of an interrupt is counted at its acceptance less what it waited, both by the emulator to the cycle.
"""

from __future__ import annotations

import numpy as np
import pytest

from boebot.description.robots import load_robot
from boebot_timing.emulated.measure import run
from boebot_timing.emulated.scenarios import SILENCE
from boebot_timing.loads import LOADS
from boebot_timing.realisable import CLOCK_HZ
from boebot_timing.table import read_table
from sim_bridge.boards.emulated import avr_image

BEYOND = {("everything", "receive")}  # docs/reference/timing.md, "What is promised": more than the slots can bear


@pytest.mark.parametrize("image", ["boebot", "shieldbot-quad"])
@pytest.mark.parametrize("name", LOADS)
@pytest.mark.parametrize("seed", [1, 2])
def test_no_interrupt_comes_oftener_than_its_load_admits(seed: int, name: str, image: str) -> None:
    """In windows of every length: n + 1 requests that lie d cycles apart, first to last, are in one of d + 1 cycles."""
    elf = avr_image(image)
    seconds = 0.4 + (SILENCE / CLOCK_HZ if name == "everything" else 0.0)
    found = run(elf, load_robot(image), name, seconds, seed, losses=False)
    spans = found.spans[found.spans["begin"] >= found.loaded_from]
    above, requests = set(), 0
    for row in read_table(elf).interrupts:
        own = spans[spans["id"] == row.vector]
        at = np.sort(own["begin"].astype(np.int64) - own["latency"].astype(np.int64))
        requests += len(at)
        for more in range(len(at)):
            window = int((at[more:] - at[: len(at) - more]).min()) + 1
            if more + 1 > sum(source.requests(window) for source in LOADS[name].sources(row, 1)):
                above.add((name, row.name))
                break
    assert requests > 1_000
    assert above == {each for each in BEYOND if each[0] == name}
