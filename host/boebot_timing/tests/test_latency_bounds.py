"""Limits of the timing table that are the hardware's or another part's, held against what sets them."""

from __future__ import annotations

import numpy as np
import pytest

from avr_timing.flow.graph import load_program
from avr_timing.interrupts.byte_reads import DATA, RECEIVE
from avr_timing.program import Program
from boebot import resources
from boebot.description import robots
from boebot_timing.emulated.measure import run
from boebot_timing.loads import ENCODERS, LOADS, SEND, TICK
from boebot_timing.table import read_table

IMAGE = resources.folder("images") / "shieldbot-quad.elf"

# A byte is lost when the start bit of the fourth comes while two are kept and the third is in the shift register (data
# sheet, 20.7: data overrun). 500,000 bit/s: ten bits a byte, of 32 cycles; a stop bit is sampled 5/8 into it (20.8).
BIT = 32
OVERRUN = 2 * 10 * BIT + (BIT - 5 * BIT // 8)  # from the request of the first to the start bit of the fourth


@pytest.fixture(scope="module")
def program() -> Program:
    return load_program(IMAGE)


def cycles_up_to(program: Program, entry: str, mnemonic: str, address: int) -> int:
    """From an interrupt's acceptance, its entry and the vector's `jmp` included, to the end of a load or store that
    no branch comes before; a skip takes as long as what it skips."""
    cycles = 4 + 3
    function = program.functions[program.by_name[entry]]
    code = {each.address: each for block in function.blocks.values() for each in block.instructions}
    for at in sorted(code):
        cycles += code[at].cycles
        if code[at].mnemonic == mnemonic and address in code[at].operands:
            return cycles
    raise AssertionError(f"no {mnemonic} of 0x{address:04X}")


def test_no_received_byte_is_lost_that_is_taken_in_time(program: Program) -> None:
    """The latency's limit is the hardware's."""
    row = next(row for row in read_table(IMAGE).interrupts if row.vector == RECEIVE)
    assert row.latency + cycles_up_to(program, "__vector_18", "lds", DATA) <= OVERRUN


def test_noise_asks_no_oftener_than_the_overload_says() -> None:
    """What masks a noisy line is the firmware; the load says how soon it does."""
    (row,) = (row for row in read_table(IMAGE).interrupts if row.vector == ENCODERS)
    found = run(IMAGE, robots.load_robot("shieldbot-quad"), "overload", 0.5, seed=7, losses=False)
    came = found.spans[(found.spans["id"] == ENCODERS) & (found.spans["begin"] >= found.loaded_from)]["begin"]
    in_a_tick = np.searchsorted(came, came + TICK) - np.arange(len(came))
    assert 100 < in_a_tick.max() <= sum(one.requests(TICK) for one in LOADS["overload"].sources(row, 1))


@pytest.mark.parametrize("load", ["figures", "overload"])
def test_sending_asks_no_oftener_than_the_load_says(load: str) -> None:
    """The first byte goes on to the shift register, and the next is asked for at once: two within 100 cycles."""
    (row,) = (row for row in read_table(IMAGE).interrupts if row.vector == SEND)
    found = run(IMAGE, robots.load_robot("shieldbot-quad"), load, 0.1, seed=3, losses=False)
    sent = found.spans[(found.spans["id"] == SEND) & (found.spans["begin"] >= found.loaded_from)]
    asked = np.sort(sent["begin"].astype(np.int64) - sent["latency"])
    assert np.diff(asked).min() < 100
    (source,) = LOADS[load].sources(row, 1)
    for more in range(1, 300):
        closest = (asked[more:] - asked[:-more]).min()
        assert more + 1 <= source.requests(int(closest) + 1), f"{more + 1} within {closest} cycles"
