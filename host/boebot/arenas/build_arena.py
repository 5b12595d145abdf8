"""Builder of `boebot.arenas._arena`, arenas and rays in C (geometry/), by cffi's API mode, for setup.py.

What Python may call is what stands between `/* python: begin */` and `/* python: end */` in the headers below. The
simulator's core is compiled with the same sources by the same rules (sim_bridge/build_core.py) and takes this
extension's arenas as they are.
"""

from __future__ import annotations

import re
from pathlib import Path

from cffi import FFI

HERE = Path("host/boebot/arenas")
HEADERS = ["numbers.h", "paths.h", "arena.h", "scene.h", "scan.h"]
# Nothing but the module's entry is seen from outside: what is called within the library may be inlined there. Nobody
# asks for errno or floating-point traps: without them loops become vectors, with the same results. So do loops of any
# length where that makes them faster, which gcc's -O2 leaves out.
# No fused multiply-add: the same bits on every machine.
COMPILE = [
    *("-std=gnu11", "-O2", "-fvisibility=hidden"),
    *("-fno-math-errno", "-fno-trapping-math", "-fvect-cost-model=dynamic"),
    "-ffp-contract=off",
]
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
    )
    return built


ffi = builder()
