"""Describes `sim_bridge.boards.avr._avr`, the emulated ATmega328P, to cffi; setup.py takes `ffi` from here."""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

ROOT = Path(__file__).resolve().parents[3]
HERE = Path("sim_bridge/boards/avr")
BOARDS = HERE.parent
# The last two keep gcc from undoing what makes the interpreter fast (core/avr_execute.c).
COMPILER_FLAGS = ["-std=gnu11", "-fvisibility=hidden", "-O3", "-fno-gcse", "-fno-tree-slp-vectorize"]

# What Python may call (what is between their marks).
HEADERS = ("board.h", "avr/avr_board.h", "avr/avr_spans.h", "avr/avr_debug.h", "avr/avr_checks.h")


def make_ffi() -> FFI:
    """The builder of the extension."""
    sources = sorted(path.relative_to(ROOT) for path in (ROOT / HERE).rglob("*.c"))
    builder = FFI()
    texts = "".join((ROOT / BOARDS / name).read_text("utf-8") for name in HEADERS)
    builder.cdef("\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", texts, re.S)))
    builder.set_source(
        "sim_bridge.boards.avr._avr",
        "\n".join(f'#include "{name}"' for name in HEADERS),
        sources=list(map(str, sources)),
        include_dirs=[str(path) for path in (HERE, BOARDS)],
        extra_compile_args=COMPILER_FLAGS,
    )
    return builder


ffi = make_ffi()
