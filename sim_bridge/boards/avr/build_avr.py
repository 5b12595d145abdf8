"""Builds `sim_bridge.boards.avr._avr`: simavr and our board layer in one extension, GPL-3.0-or-later.

setup.py takes `ffi` from here, once `python tools/fetch_simavr.py` has fetched simavr's sources.
"""

from __future__ import annotations

import re
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

# Ours that Python may call (what is between their marks).
HEADERS = ("board.h", "avr/avr_board.h", "avr/avr_spans.h", "avr/avr_debug.h", "avr/avr_checks.h")


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


def make_ffi() -> FFI:
    """The builder of the extension."""
    simavr = simavr_folder()
    write_configuration()
    ours = sorted(path.relative_to(ROOT) for path in (ROOT / HERE).glob("*.c"))
    builder = FFI()
    texts = "".join((ROOT / BOARDS / name).read_text("utf-8") for name in HEADERS)
    builder.cdef("\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", texts, re.S)))
    builder.set_source(
        "sim_bridge.boards.avr._avr",
        "\n".join(f'#include "{name}"' for name in HEADERS),
        sources=[
            *map(str, ours),
            *(str(simavr / "sim" / f"{name}.c") for name in SIMAVR_SOURCES),
            str(simavr / CHIP_SOURCE),
        ],
        include_dirs=[str(path) for path in (HERE, BOARDS, simavr / "sim", simavr / "cores", CONFIGURATION)],
        extra_compile_args=COMPILER_FLAGS,
    )
    return builder


ffi = make_ffi()
