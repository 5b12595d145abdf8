"""Small native programs for tests: C on the native hardware layer alone, in place of the firmware."""

from __future__ import annotations

import subprocess
import tempfile
from functools import cache
from pathlib import Path

from sim_bridge.boards.emulated import native_board
from sim_bridge.tests.boards.access import BoardAccess

# The tests may lie in a copy of the package below the checkout.
FIRMWARE = next(
    folder / "firmware" / "src" for folder in Path(__file__).resolve().parents if (folder / "firmware" / "src").is_dir()
)

# What the hardware layer expects of the firmware. A program defines start() and slot(), which comes every 2.5 ms; what
# it finds it says on the line.
PREAMBLE = """
#include "firmware.h"
#include "hal/hal.h"
#include "hal/interrupts.h"
static void start(void);
static void slot(void);
static inline void say(const void *bytes, uint8_t count) { hal_serial_send(bytes, count); }
void firmware_start(void) { hal_start_serial(5000u); start(); hal_start_timers(); }
void firmware_poll(void) {}
uint8_t firmware_due(void) { return 0; }
void schedule_on_slot(void) { hal_slot_arm((uint16_t)(hal_time() + HAL_SLOT_CYCLES)); slot(); }
void servo_on_edge(void) {}
void ping_on_edge(uint16_t time) { (void)time; }
void pin_changes_on_change(uint16_t time, uint8_t port_bits) { (void)time, (void)port_bits; }
void light_on_left_fall(uint16_t time) { (void)time; }
void port_d_on_change(uint16_t time) { (void)time; }
void two_wire_on_step(void) {}
"""


@cache
def compiled(source: str) -> bytes:
    """The library of the C program `source`; several tests use the same one."""
    with tempfile.TemporaryDirectory() as folder:
        program, library = Path(folder, "program.c"), Path(folder, "program.so")
        program.write_text(PREAMBLE + source, encoding="ascii")
        command = ["cc", "-std=gnu11", "-shared", "-fPIC", "-fvisibility=hidden", "-Wall", "-Wextra", "-Werror"]
        command += ["-DPIN_MAP_SHIELDBOT", f"-I{FIRMWARE}", "-o", str(library), str(program)]
        command += map(str, sorted((FIRMWARE / "hal" / "native").glob("*.c")))
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
        return library.read_bytes()


def native_program(source: str) -> BoardAccess:
    """A native board, powered on, that runs the C program `source`."""
    with tempfile.NamedTemporaryFile(suffix=".so") as library:
        library.write(compiled(source))
        library.flush()
        return BoardAccess(native_board(Path(library.name)))
