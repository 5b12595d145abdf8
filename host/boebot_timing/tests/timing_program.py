"""A small program for the ATmega328P whose times are known by counting: what the tests of budgets judge."""

from __future__ import annotations

import subprocess
from pathlib import Path

# Cycles of the tasks: the nops, ret (4). Of the interrupt: entry 4, jmp 3, nops, reti 4. The stack: main calls the
# scheduler (2), that a task (2), the interrupt's return address (2); main's own return address 2.
SOURCE = r"""
#include <avr/interrupt.h>
#include <avr/io.h>

#define NOPS(n) __asm__ volatile(".rept " #n "\n nop\n .endr")
#define ROW(text) __asm__(".pushsection .boebot.timing,\"\",@progbits\n .asciz \"" text "\"\n .popsection")

ROW("TASK first 1 0 FIRST_BUDGET");
ROW("TASK second 4 1 300");
ROW("INTERRUPT slot 12 INTERRUPT_BUDGET 1000 40000");
ROW("SENSOR ping 18500 5 20000");
CONSTANTS

__attribute__((noinline)) void first_task(void) { NOPS(FIRST_NOPS); }
__attribute__((noinline)) void second_task(void) { NOPS(200); }

ISR(TIMER1_COMPB_vect, ISR_NAKED) { __asm__ volatile(".rept 20\n nop\n .endr\n reti"); }

__attribute__((noinline)) void schedule_poll(void) {
  first_task();
  second_task();
}

unsigned char reserve[RESERVE];

int main(void) {
  reserve[0] = PINB;
  sei();
  for (;;) {
    schedule_poll();
  }
}
"""


CONSTANTS = {
    "slot_cycles": 40_000,
    "slots_per_tick": 4,
    "slots_kept": 8,
    "receive_ring": 127,
    "poll_bytes": 17,
    "changes_ring": 64,
    "changes_due": 8,
    "changes_storm": 5,
}
FIRMWARE = Path(__file__).resolve().parents[3] / "firmware" / "src"


def text(first_nops: int = 100, first_budget: int = 150, interrupt_budget: int = 40, reserve: int = 10) -> str:
    """Its source."""
    constants = "\n".join(f'ROW("CONSTANT {name} {value}");' for name, value in CONSTANTS.items())
    source = (
        SOURCE.replace("CONSTANTS", constants)
        .replace("FIRST_BUDGET", str(first_budget))
        .replace("FIRST_NOPS", str(first_nops))
    )
    return source.replace("INTERRUPT_BUDGET", str(interrupt_budget)).replace("RESERVE", str(reserve))


def compiled(folder: Path, source: str, *flags: str) -> Path:
    """The ELF file of a source."""
    program, image = folder / "program.c", folder / "program.elf"
    program.write_text(source)
    command = ["avr-gcc", "-Os", "-g", "-mmcu=atmega328p", "-fno-optimize-sibling-calls", *flags]
    subprocess.run([*command, "-o", str(image), str(program)], check=True)
    return image


def build(folder: Path, **changes: int) -> Path:
    """Compiles it, with other numbers than those of `text`; returns its ELF file."""
    return compiled(folder, text(**changes))
