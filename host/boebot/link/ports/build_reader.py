"""Builder of `boebot.link.ports._reader`, the thread that reads a port (reader.h), by cffi's API mode, for setup.py.

Where there is no POSIX `poll` for devices (Windows, macOS) it is not built, and the calling thread reads.
"""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

HERE = Path("host/boebot/link/ports")


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    header = (Path(__file__).resolve().parent / "reader.h").read_text("utf-8")
    built = FFI()
    built.cdef("\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", header, re.S)))
    built.set_source(
        "boebot.link.ports._reader",
        '#include "reader.h"',
        sources=[(HERE / "reader.c").as_posix()],
        include_dirs=[HERE.as_posix()],
        extra_compile_args=["-std=gnu11", "-O2"],
        extra_link_args=["-lpthread", "-lm"],
    )
    return built


ffi = builder()
