"""The rows measured in the emulated board: by the program itself, and by the edges at its pin 13."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from boebot.errors import BoardError
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.tests.boards.access import BoardAccess
from tools.tests.calibration.program import image
from tools.tests.calibration.talk import START, Talk, at_pin

STEP_CYCLES = CLOCK_HZ // 1000
QUIET_CYCLES = 2 * CLOCK_HZ  # no row takes as long
MARK_PIN = 13


@dataclass(frozen=True)
class Measured:
    """What was measured, row by row; None: not measured."""

    by_program: list[int | None]
    by_pin: list[int | None]


def measure() -> Measured:
    """All rows.

    Raises:
        BoardError: the program crashed or stopped talking.
    """
    with tempfile.TemporaryDirectory() as folder:
        elf = Path(folder, "calibration.elf")
        elf.write_bytes(image())
        avr = create(elf)
    board = BoardAccess(avr)
    talk = Talk()
    byte_cycles: list[int] = []
    edge_cycles: list[int] = []
    heard_at = 0
    board.send(START, at=STEP_CYCLES)
    try:
        while not talk.ended:
            board.run(STEP_CYCLES)
            edge_cycles += [edge.cycle for edge in board.log() if edge.pin == MARK_PIN]
            if sent := board.receive():
                heard_at = board.now
                byte_cycles += [byte.cycle for byte in sent]
                board.send(talk.hear(bytes(byte.byte for byte in sent)))
            elif board.now > heard_at + QUIET_CYCLES:
                raise BoardError(f"the program in the emulator has stopped talking; awaited: {talk.awaited}")
    finally:
        board.close()
        avr.close()
    return Measured(talk.values(), at_pin(talk, byte_cycles, edge_cycles))
