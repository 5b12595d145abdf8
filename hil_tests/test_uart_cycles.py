"""Cycles that the UART's interrupts take, counted by a program that does nothing else but count."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from sim_bridge.boards.avr import create
from sim_bridge.tests.symbols import find_symbol
from tools.bench import avr_program
from tools.timing_table import read_table

pytestmark = pytest.mark.emulated

SOURCES = Path(__file__).resolve().parents[1] / "firmware" / "src"
BUDGETS = {row.name: row.budget for row in read_table().interrupts}
ROUND_CYCLES = 16  # of the counting loop
BYTES = 100
END = 100_000  # until then all bytes have come or gone, 320 cycles each
PROGRAM = """
#include "hal/hal.h"
volatile uint8_t rounds[3];
int main(void) {
  uint8_t bytes[SEND + 1];
  hal_start_serial(5000);
  TCCR1B = _BV(CS10);
  hal_serial_send(bytes, SEND);
  while (TCNT1 < 25000) { /* the count begins at the same time, however much is to be sent */
  }
  sei();
  __asm__ volatile(
      "ldi r24, 0 \\n ldi r25, 0 \\n ldi r26, 0 \\n"
      "1: subi r24, -1 \\n sbci r25, -1 \\n sbci r26, -1 \\n"
      "cli \\n sts rounds, r24 \\n sts rounds+1, r25 \\n sts rounds+2, r26 \\n sei \\n"
      "nop \\n nop \\n nop \\n rjmp 1b \\n");
}
"""


def rounds(folder: Path, to_send: int, to_receive: bytes) -> int:
    """Rounds of the counting loop up to cycle END."""
    program, image = folder / "program.c", folder / "program.elf"
    program.write_text(PROGRAM, encoding="ascii")
    command = ["avr-gcc", *avr_program.flags(), "-w", f"-DSEND={to_send}", f"-I{SOURCES}", "-o", str(image)]
    command += [str(program), str(SOURCES / "hal" / "avr" / "serial_avr.c")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    board = create(image).access()
    board.send(to_receive, at=40_000)
    board.advance(END)
    assert len(board.receive()) == to_send
    assert board.counters()["overruns"] == 0
    assert board.counters()["interrupts"] == to_send + len(to_receive)
    return int.from_bytes(board.read_memory(find_symbol(image, "rounds").address, 3), "little")


def cycles_per_byte(folder: Path, to_send: int, to_receive: bytes) -> float:
    """What one byte takes from the loop, from the interrupt's entry to its return, to a sixth of a cycle."""
    idle = rounds(folder, to_send=0, to_receive=b"")
    busy = rounds(folder, to_send, to_receive)
    return (idle - busy) * ROUND_CYCLES / (to_send + len(to_receive))


def test_a_byte_received_keeps_the_budget(tmp_path: Path) -> None:
    for byte in (b"\x55", b"\0"):
        assert 20 < round(cycles_per_byte(tmp_path, 0, BYTES * byte)) <= BUDGETS["receive"]


def test_a_byte_sent_keeps_the_budget(tmp_path: Path) -> None:
    assert 20 < round(cycles_per_byte(tmp_path, BYTES, b"")) <= BUDGETS["send"]
