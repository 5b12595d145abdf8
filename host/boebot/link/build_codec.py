"""Builder of `boebot.link._codec`, the firmware's frame code for Python (codec.h), by cffi's API mode, for setup.py."""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

HERE = Path("host/boebot/link")
COMPILE = ["-std=gnu11", "-O2", "-fvisibility=hidden"]


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    header = (Path(__file__).resolve().parent / "codec.h").read_text("utf-8")
    built = FFI()
    built.cdef("\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", header, re.S)))
    built.set_source(
        "boebot.link._codec",
        '#include "codec.h"',
        sources=[(HERE / name).as_posix() for name in ("codec_to_board.c", "codec_to_host.c")],
        include_dirs=[HERE.as_posix(), "firmware/src"],
        extra_compile_args=COMPILE,
    )
    return built


ffi = builder()
