"""Builds `sim_bridge.boards.avr._avr`: simavr and our board layer in one extension, GPL-3.0-or-later.

setup.py takes `ffi` from here. Run by itself, this script puts the extension in place in a checkout:
`python tools/fetch_simavr.py && python sim_bridge/boards/avr/build_avr.py`.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parents[3]
HERE = Path("sim_bridge/boards/avr")
BOARDS = HERE.parent
BUILD = Path("build/simavr")
CONFIGURATION = BUILD / "configuration"

# Of simavr: the instruction core and what it cannot do without, and program memory. Everything that has to do
# with time or pins is ours.
SIMAVR_SOURCES = (
    *(
        "sim_avr",
        "sim_cmds",
        "sim_core",
        "sim_cycle_timers",
        "sim_elf",
        "sim_gdb",
        "sim_hex",
        "sim_interrupts",
    ),
    *("sim_io", "sim_irq", "sim_utils", "sim_vcd_file", "avr_flash"),
)
CHIP_SOURCE = "cores/sim_mega328.c"

# What simavr's makefile would find out.
CONFIGURATION_HEADERS = {
    "sim_core_config.h": '#define CONFIG_SIMAVR_VERSION "crate"\n#define CONFIG_MEGA328 1\n',
    "sim_core_decl.h": (
        '#include "sim_core_config.h"\n'
        "extern avr_kind_t mega328;\n"
        "extern avr_kind_t *avr_kind[];\n"
        "#ifdef AVR_KIND_DECL\n"
        "avr_kind_t *avr_kind[] = {&mega328, NULL};\n"
        "#endif\n"
    ),
}

# -w: simavr has warnings; ours are errors in tools/warnings.sh. The other flags let the compiler join the core's many
# small functions: a quarter faster than -O2.
COMPILER_FLAGS = [
    *("-std=gnu11", "-fwrapv", "-w", "-fvisibility=hidden", "-O3"),
    *("--param=inline-unit-growth=400", "--param=max-inline-insns-auto=200"),
]

DECLARATIONS = """
board *avr_board_create(const uint8_t *elf, size_t size, char *error, size_t error_size);
uint8_t *avr_board_flash(board *self);
void avr_board_one_by_one(board *self);
typedef struct { uint64_t begin, executed; uint32_t gross, net, latency; uint16_t id, depth; ...; } avr_span;
typedef struct {
  const uint32_t *entries;
  size_t entry_count;
  uint64_t patience;
  ...;
} avr_watch;
#define AVR_FUNCTION_IDS ...
#define AVR_FUNCTIONS_MAXIMUM ...
bool avr_board_record(board *self, const avr_watch *watch);
void avr_board_stop_recording(board *self);
const avr_span *avr_board_spans(const board *self, size_t *count);
void avr_board_forget_spans(board *self);
uint16_t avr_board_lowest_stack(const board *self);
"""

PREAMBLE = """
#include "avr_board.h"
#include "avr_spans.h"
#include "../board_access.h"

static uint8_t *avr_board_flash(board *self) { return self->op->extension(self, AVR_BOARD_FLASH); }
"""


def simavr_folder() -> Path:
    """The folder of simavr that holds `sim` and `cores`, relative to the repository."""
    for source in sorted((ROOT / BUILD).glob("*/vendor/simavr/simavr/sim/sim_avr.c")):
        return source.parents[1].relative_to(ROOT)
    raise SystemExit("simavr's sources are not there; run: python tools/fetch_simavr.py")


def write_configuration() -> None:
    """Writes the headers that simavr's makefile would generate."""
    folder = ROOT / CONFIGURATION
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in CONFIGURATION_HEADERS.items():
        file = folder / name
        if not file.exists() or file.read_text(encoding="ascii") != text:
            file.write_text(text, encoding="ascii")


def headers() -> list[Path]:
    """Our headers."""
    return [*(ROOT / HERE).glob("*.h"), *(ROOT / BOARDS).glob("*.h")]


def make_ffi() -> FFI:
    """The builder of the extension."""
    simavr = simavr_folder()
    write_configuration()
    ours = sorted(path.relative_to(ROOT) for path in (ROOT / HERE).glob("*.c"))
    builder = FFI()
    builder.cdef((ROOT / BOARDS / "board_access.cdef").read_text(encoding="ascii") + DECLARATIONS)
    builder.set_source(
        "sim_bridge.boards.avr._avr",
        PREAMBLE,
        sources=[
            *(str(source) for source in ours if source.name != "_avr.c"),
            str(BOARDS / "board_access.c"),
            *(str(simavr / "sim" / f"{name}.c") for name in SIMAVR_SOURCES),
            str(simavr / CHIP_SOURCE),
        ],
        include_dirs=[str(path) for path in (HERE, simavr / "sim", simavr / "cores", CONFIGURATION)],
        depends=[str(HERE / "build_avr.py"), *(str(path.relative_to(ROOT)) for path in headers())],
        extra_compile_args=COMPILER_FLAGS,
    )
    return builder


ffi = make_ffi()


def main() -> int:
    """Compiles the extension and puts it beside this file."""
    from setuptools import Distribution

    os.chdir(ROOT)
    extension = ffi.distutils_extension(tmpdir="build/avr")
    extension.py_limited_api = True  # type: ignore[attr-defined]  # the same name as setup.py gives it
    command = Distribution({"ext_modules": [extension]}).get_command_obj("build_ext")
    command.inplace = True
    command.build_temp = "build/avr"
    command.parallel = os.cpu_count()
    command.ensure_finalized()
    command.run()
    return 0


if __name__ == "__main__":
    sys.exit(main())
