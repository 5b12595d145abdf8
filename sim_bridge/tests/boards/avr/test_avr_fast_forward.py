"""Many instructions in one go, and sleep that is passed over, are one rule: with the switch off, each instruction by
itself and sleep cycle by cycle, every cycle, byte and edge is the same."""

from __future__ import annotations

import random

import numpy as np
import pytest

from avr_timing.flow.instructions import decode
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot_timing.emulated import measure
from sim_bridge.boards import avr
from sim_bridge.boards.emulated import avr_image
from sim_bridge.tests.boards.avr.avr_program import Machine

WORDS = 3_000
# What soon ends in a fault: it leads to where no code is, or moves the stack. SLEEP sleeps for good.
ENDS = frozenset(("jmp", "call", "rcall", "rjmp", "ijmp", "icall", "ret", "reti", "pop", "spm", "sleep"))


def any_words(draw: random.Random) -> list[int]:
    """Instructions in any order: jumps, interrupts and registers that change everything."""
    found: list[int] = []
    while len(found) < WORDS:
        opcode = draw.randrange(0x10000)
        if opcode & 0xF80E == 0xB80C:  # OUT to the stack pointer, or beside it
            continue
        instruction = decode(opcode.to_bytes(2, "little") + b"\0\2", 0)
        if instruction is not None and instruction.mnemonic not in ENDS:
            found += [opcode, draw.randrange(0x100, 0x900)][: instruction.size // 2]
    return found


@pytest.mark.parametrize("seed", range(6))
def test_any_program_is_the_same_without_fast_forward(seed: int) -> None:
    program = any_words(random.Random(seed))
    source = "main: sei\n" + "".join(f" .word {word}\n" for word in program) + " jmp main"
    fast, slow = Machine(source), Machine(source)
    slow.avr.no_fast_forward()
    for until in range(200, 20_000, 401):  # cycles; not whole instructions
        states = []
        for machine in (fast, slow):
            try:
                machine.board.advance(until)
                fault = ""
            except BoardError as error:
                fault = str(error)
            board = machine.board
            states.append((fault, board.now, board.read_memory(0, 0x900), board.counters(), board.log()))
        assert states[0] == states[1], until
        if states[0][0]:
            break


@pytest.mark.parametrize(
    ("scenario", "pin_map", "seconds"),
    [("figures", "shieldbot", 0.1), ("overload", "shieldbot-quad", 0.05), ("everything", "boebot", 0.9)],
)
def test_a_firmware_is_the_same_without_fast_forward(
    scenario: str, pin_map: str, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, image = load_robot(pin_map), avr_image(pin_map)
    fast = measure.run(image, robot, scenario, seconds, 3, losses=False)
    create = avr.create

    def slowly(elf: object) -> avr.AvrBoard:
        board = create(elf)  # type: ignore[arg-type]
        board.no_fast_forward()
        return board

    monkeypatch.setattr(avr, "create", slowly)
    slow = measure.run(image, robot, scenario, seconds, 3, losses=False)
    assert len(fast.spans) > 500
    np.testing.assert_array_equal(fast.spans, slow.spans)
    assert (fast.cycles, fast.executed, fast.lowest_stack) == (slow.cycles, slow.executed, slow.lowest_stack)
    assert (fast.lost, fast.sent, fast.received) == (slow.lost, slow.sent, slow.received)
