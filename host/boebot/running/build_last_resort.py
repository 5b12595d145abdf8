"""Builder of `boebot.running._last_resort`, which ends a process that Python cannot end (last_resort.h), by cffi's API
mode, for setup.py. Not built on Windows."""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

HERE = Path("host/boebot/running")


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    header = (Path(__file__).resolve().parent / "last_resort.h").read_text("utf-8")
    built = FFI()
    built.cdef("\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", header, re.S)))
    built.set_source(
        "boebot.running._last_resort",
        '#include "last_resort.h"',
        sources=[(HERE / "last_resort.c").as_posix()],
        include_dirs=[HERE.as_posix()],
        extra_compile_args=["-std=gnu11", "-O2"],
        extra_link_args=["-lm"],
    )
    return built


ffi = builder()
