"""How long interrupts wait in the emulator, in each scenario: never longer than the bound from the machine code,
which is that of the scenario's own load where there is one."""

from __future__ import annotations

import pytest

from boebot import resources, robots
from boebot.timing.blocked import Blocked
from boebot.timing.costs import costs
from boebot.timing.graph import load_program
from boebot.timing.latency import HORIZON, Latencies
from boebot.timing.loads import CARRIER, EDGE, LOADS, RECEIVE, SLOT
from boebot.timing.program import Program
from boebot.timing.taken import DATA
from sim_bridge.tests.symbols import find_symbol
from sim_bridge.timing import latency_limits
from sim_bridge.timing.measure import run

IMAGE = resources.folder("images") / "shieldbot.elf"
SCENARIOS = (("figures", 0.2), ("saturated", 0.2), ("noise", 0.2), ("faults", 0.2), ("everything", 0.5))

# A byte is lost when the start bit of the fourth comes while two are kept and the third is in the shift register (data
# sheet, 20.7: data overrun). 500,000 bit/s: ten bits a byte, of 32 cycles; a stop bit is sampled 5/8 into it (20.8).
BIT = 32
OVERRUN = 2 * 10 * BIT + (BIT - 5 * BIT // 8)  # from the request of the first to the start bit of the fourth


@pytest.fixture(scope="module")
def program() -> Program:
    return load_program(IMAGE)


@pytest.fixture(scope="module")
def bounds(program: Program) -> dict[str, int]:
    """Whatever the load, at most."""
    found = Latencies(Blocked(program))
    return {row.name: found.of(row.vector) for row in program.table.interrupts}


def test_nobody_waits_for_ever(bounds: dict[str, int]) -> None:
    assert all(cycles < HORIZON for cycles in bounds.values()), bounds


@pytest.mark.parametrize(("scenario", "seconds"), SCENARIOS)
def test_no_interrupt_waits_longer_than_its_bound(
    program: Program, bounds: dict[str, int], scenario: str, seconds: float
) -> None:
    """The bounds of a load hold from where it begins; what prepares the board is none of it."""
    found = run(IMAGE, robots.load_robot("shieldbot"), scenario, seconds, seed=7)
    most = costs(program, LOADS[scenario]).latencies if scenario in LOADS else bounds
    loaded = found.spans[found.spans["begin"] >= (found.loaded_from if scenario in LOADS else 0)]
    spans = {name: loaded[loaded["id"] == vector] for vector, name in found.what.vectors.items()}
    waited = {name: int(each["latency"].max()) for name, each in spans.items() if len(each)}
    assert {"changes", "edge", "slot", "receive", "send"} <= waited.keys()
    assert {name: cycles for name, cycles in waited.items() if cycles > most[name]} == {}


def test_every_load_is_compared_with_its_own_scenario() -> None:
    assert LOADS.keys() <= {name for name, _ in SCENARIOS}


def cycles_up_to(program: Program, entry: str, mnemonic: str, address: int) -> int:
    """From an interrupt's acceptance, its entry and the vector's `rjmp` included, to the end of a load or store that
    no branch comes before; a skip takes as long as what it skips."""
    cycles = 4 + 2
    function = program.functions[program.by_name[entry]]
    code = {each.address: each for block in function.blocks.values() for each in block.instructions}
    for at in sorted(code):
        cycles += code[at].cycles
        if code[at].mnemonic == mnemonic and address in code[at].operands:
            return cycles
    raise AssertionError(f"no {mnemonic} of 0x{address:04X}")


def test_no_received_byte_is_lost(program: Program, bounds: dict[str, int]) -> None:
    """The latency's limit is the hardware's, and the bound keeps it under whatever load."""
    row = next(row for row in program.table.interrupts if row.vector == RECEIVE)
    assert row.latency + cycles_up_to(program, "__vector_18", "lds", DATA) <= OVERRUN
    assert bounds["receive"] <= row.latency


def test_tick_starts_within_its_limit(program: Program) -> None:
    """At a tick's start no exact edge and no burst is near."""
    rows = program.table.interrupts
    near = {row.vector: [] if row.vector in (EDGE, CARRIER) else LOADS["saturated"].sources(row, 1) for row in rows}
    wait = Latencies(Blocked(program), near).of(SLOT)
    slot = find_symbol(IMAGE, "schedule_slot").address & 0xFFFF
    most = latency_limits.TICK_START.most
    assert most is not None and wait + cycles_up_to(program, "__vector_12", "sts", slot) <= most
