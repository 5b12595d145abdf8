"""The instructions that the emulated ATmega328P executes without simavr's core: each does the same as there, in the
same time, whatever the registers hold; and a whole firmware does, and what is recorded of it."""

from __future__ import annotations

import random
from collections.abc import Iterator

import numpy as np
import pytest

from avr_timing.flow.instructions import decode
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot_timing.emulated import measure
from sim_bridge.boards import avr
from sim_bridge.boards.emulated import avr_image
from sim_bridge.tests.boards.avr.avr_program import Machine

WORDS = 12_000
RAM = range(0x100, 0x900)
# What would lead elsewhere, sleep, write program memory or let the outside in: jumps back and returns have tests of
# their own; interrupts are in the firmware's.
ELSEWHERE = frozenset(("rjmp", "rcall", "jmp", "call", "ijmp", "eijmp", "icall", "eicall", "ret", "reti"))
ELSEWHERE |= frozenset(("sleep", "break", "spm", "elpm", "out", "sbi", "cbi", "sei", "wdr"))
IN_SREG = 0xB60F
END = """
  .rept 16
  nop
  .endr
  ldi r16, 0xA5
1: rjmp 1b
"""


def opcodes() -> list[int]:
    """All opcodes of one word that an ATmega328P has and that lead on, by branch or skip at most."""
    found = []
    for opcode in range(0x10000):
        instruction = decode(opcode.to_bytes(2, "little") + b"\0\0", 0)
        if instruction is None or instruction.size != 2 or instruction.mnemonic in ELSEWHERE:
            continue
        if not instruction.mnemonic.startswith("br"):
            found.append(opcode)
    return found


def words(draw: random.Random, plain: list[int]) -> Iterator[int]:
    """A program that goes forward: any instruction, pointers mostly in RAM, flags that are looked at."""
    while True:
        kind = draw.random()
        register = draw.randrange(32)
        if kind < 0.12:
            yield IN_SREG | register << 4
        elif kind < 0.24:
            yield 0xE000 | draw.randrange(1, 9) | draw.choice((11, 13, 15)) << 4  # ldi r27/r29/r31, 1..8
        elif kind < 0.30:
            yield 0xF000 | draw.randrange(2) << 10 | draw.randrange(8) << 3 | draw.randrange(8)  # a branch forward
        elif kind < 0.33:
            yield 0xC000 | draw.randrange(8)  # rjmp
        elif kind < 0.40:
            yield (0x9000, 0x9200)[draw.randrange(2)] | register << 4  # lds, sts
            yield draw.choice(RAM)
        else:
            yield draw.choice(plain)


@pytest.mark.parametrize("seed", range(3))
def test_any_instruction_does_what_it_does_in_simavr(seed: int) -> None:
    draw = random.Random(seed)
    stream = words(draw, opcodes())
    program = [next(stream) for _ in range(WORDS)]
    source = (
        "main:\n"
        + "".join(f" .word {word}\n" for word in program)
        + " .rept 16\n nop\n .endr\n ldi r16, 0xA5\n1: rjmp 1b\n"
    )
    ours, simavr = Machine(source), Machine(source)
    simavr.avr.one_by_one()
    for until in range(200, 40_000, 401):  # cycles; not whole instructions
        ours.board.advance(until)
        simavr.board.advance(until)
        assert ours.board.now == simavr.board.now
        assert ours.board.read_memory(0, 0x900) == simavr.board.read_memory(0, 0x900), until
    assert ours.board.counters() == simavr.board.counters()
    assert ours.board.read_memory(16, 1) == b"\xa5"  # it has come to its end


CALLS = """
  sub: push r24
    in r25, SPL
    in r26, SPH
    pop r24
    ret
  main: ldi r30, pm_lo8(sub)
    ldi r31, pm_hi8(sub)
  1: rcall sub
    call sub
    icall
    sbrc r24, 0
    jmp 2f
    sbrs r24, 1
    lds r20, 0x0200
    cpse r24, r20
    sts 0x0200, r24
  2: inc r24
    adiw r28, 1
    push r24
    push r28
    ldi r30, pm_lo8(3f)
    ldi r31, pm_hi8(3f)
    ijmp
    nop
  3: pop r28
    pop r24
    lpm r3, Z+
    lpm r4, Z
    rjmp main
"""


def test_calls_jumps_skips_and_the_stack_do_what_they_do_in_simavr() -> None:
    ours, simavr = Machine(CALLS), Machine(CALLS)
    simavr.avr.one_by_one()
    for until in range(100, 20_000, 37):
        ours.board.advance(until)
        simavr.board.advance(until)
        assert ours.board.now == simavr.board.now
        assert ours.board.read_memory(0, 0x900) == simavr.board.read_memory(0, 0x900), until
    assert ours.board.read_memory(24, 1)[0] > 20  # it went round


def test_a_stack_in_the_registers_is_a_fault_in_both() -> None:
    source = """
      main: ldi r24, 0
        out SPH, r24
        ldi r24, 0x14
        out SPL, r24
      1: push r24
        rcall 2f
      2: pop r20
        inc r24
        rjmp 1b
    """
    ours, simavr = Machine(source), Machine(source)
    simavr.avr.one_by_one()
    for machine in (ours, simavr):
        with pytest.raises(BoardError, match="the stack overflows: it reaches 0x0015, variables end below 0x0100"):
            machine.board.run(400)
    assert ours.board.read_memory(0, 0x20) == simavr.board.read_memory(0, 0x20)
    assert ours.board.now == simavr.board.now


@pytest.mark.parametrize(
    ("scenario", "pin_map", "seconds"),
    [("figures", "shieldbot", 0.1), ("overload", "shieldbot-quad", 0.05), ("everything", "boebot", 0.9)],
)
def test_what_is_recorded_of_a_firmware_is_what_each_instruction_by_itself_gives(
    scenario: str, pin_map: str, seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, image = load_robot(pin_map), avr_image(pin_map)
    fast = measure.run(image, robot, scenario, seconds, 3, losses=False)
    create = avr.create

    def slowly(elf: object) -> avr.AvrBoard:
        board = create(elf)  # type: ignore[arg-type]
        board.one_by_one()
        return board

    monkeypatch.setattr(avr, "create", slowly)
    slow = measure.run(image, robot, scenario, seconds, 3, losses=False)
    assert len(fast.spans) > 500
    np.testing.assert_array_equal(fast.spans, slow.spans)
    assert (fast.cycles, fast.executed, fast.lowest_stack) == (slow.cycles, slow.executed, slow.lowest_stack)
    assert (fast.lost, fast.sent, fast.received) == (slow.lost, slow.sent, slow.received)
