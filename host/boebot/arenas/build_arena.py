"""Builder of `boebot.arenas._arena`, arenas and rays in C (geometry/), by cffi's API mode, for setup.py.

What Python may call is what stands between `/* python: begin */` and `/* python: end */` in the headers below. The
simulator's core is compiled with the same sources by the same rules (sim_bridge/build_core.py) and takes this
extension's arenas as they are.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

from cffi import FFI

HERE = Path("host/boebot/arenas")
HEADERS = ["numbers.h", "paths.h", "arena.h", "scene.h", "scan.h"]
WINDOWS = sys.platform == "win32"
WHOLE_PROGRAM = "-flto=auto"


def links_whole_program() -> bool:
    """Whether the compiler optimises across files when it links; the sanitizers' build goes without."""
    if WINDOWS or os.environ.get("BOEBOT_SANITIZE") == "1":
        return False
    compiler = shlex.split(os.environ.get("CC") or str(sysconfig.get_config_var("CC") or "cc"))
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "probe.c")
        source.write_text("int probe(void) { return 0; }\n", encoding="utf-8")
        command = [*compiler, WHOLE_PROGRAM, "-shared", "-fPIC", str(source), "-o", str(source.with_suffix(".so"))]
        try:
            return subprocess.run(command, capture_output=True, check=False).returncode == 0
        except OSError:
            return False


# Nothing but the module's entry is seen from outside: what is called within the library may be inlined there. Nobody
# asks for errno or floating-point traps: without them loops become vectors, with the same results.
INSIDE = [
    "-std=gnu11",
    "-fvisibility=hidden",
    "-fno-math-errno",
    "-fno-trapping-math",
    *([WHOLE_PROGRAM] if links_whole_program() else []),
]
# No fused multiply-add: the same bits on every machine.
COMPILE = ["/O2", "/fp:precise"] if WINDOWS else [*INSIDE, "-O2", "-ffp-contract=off"]
LINK = [] if WINDOWS else COMPILE  # code is made when linking, and by the same rules
SOURCES = sorted(path.as_posix() for path in (HERE / "geometry").glob("*.c"))


def declarations(header: Path) -> str:
    """What a header offers to Python."""
    return "\n".join(re.findall(r"/\* python: begin \*/(.*?)/\* python: end \*/", header.read_text("utf-8"), re.S))


def builder() -> FFI:
    """The extension, with its sources named from the repository's root."""
    built = FFI()
    built.cdef("\n".join(declarations(HERE / "geometry" / name) for name in HEADERS))
    built.set_source(
        "boebot.arenas._arena",
        "\n".join(f'#include "geometry/{name}"' for name in HEADERS),
        sources=SOURCES,
        include_dirs=[HERE.as_posix()],
        extra_compile_args=COMPILE,
        extra_link_args=LINK,
    )
    return built


ffi = builder()
