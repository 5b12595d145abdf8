"""How long interrupts wait in the emulator, in each scenario: never longer than the bound from the machine code."""

from __future__ import annotations

import pytest

from boebot import resources, robots
from boebot.timing.blocked import Blocked
from boebot.timing.graph import load_program
from boebot.timing.latency import HORIZON, Latencies
from sim_bridge.timing.measure import run

IMAGE = resources.folder("images") / "shieldbot.elf"


@pytest.fixture(scope="module")
def bounds() -> dict[str, int]:
    program = load_program(IMAGE)
    found = Latencies(Blocked(program))
    return {row.name: found.of(row.vector) for row in program.table.interrupts}


def test_nobody_waits_for_ever(bounds: dict[str, int]) -> None:
    assert all(cycles < HORIZON for cycles in bounds.values()), bounds


@pytest.mark.parametrize(
    ("scenario", "seconds"),
    [("figures", 0.2), ("saturated", 0.2), ("noise", 0.2), ("faults", 0.2), ("everything", 0.5)],
)
def test_no_interrupt_waits_longer_than_its_bound(bounds: dict[str, int], scenario: str, seconds: float) -> None:
    found = run(IMAGE, robots.load_robot("shieldbot"), scenario, seconds, seed=7)
    spans = {name: found.spans[found.spans["id"] == vector] for vector, name in found.what.vectors.items()}
    waited = {name: int(each["latency"].max()) for name, each in spans.items() if len(each)}
    assert {"changes", "edge", "slot", "receive", "send"} <= waited.keys()
    assert {name: cycles for name, cycles in waited.items() if cycles > bounds[name]} == {}
