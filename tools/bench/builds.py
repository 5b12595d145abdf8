"""The simulator's C core in the builds that the figures compare.

* portable: the installed one, with the same bits everywhere.
* native: BOEBOT_NATIVE=1, for this machine: the same source with -O3, -march=native and contracted operations.
* free: what bit-equality forbids altogether: as native, and sin, cos, exp, log, tanh and atan2 of the C library.
"""

from __future__ import annotations

import functools
import io
import os
import subprocess
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout
from pathlib import Path
from typing import Literal

from sim_bridge import build_core

ROOT = Path(__file__).resolve().parents[2]
CORE = ROOT / "sim_bridge"
LIBM = ROOT / "tools/bench/libm_numbers.c"
Build = Literal["portable", "native", "free"]


def _newest_header() -> float:
    headers = [*CORE.rglob("*.h"), *(ROOT / "firmware/src").rglob("*.h"), Path(build_core.__file__)]
    return max(path.stat().st_mtime for path in headers)


@functools.cache
def _objects() -> dict[Path, Path]:
    """Object files of the native build, by their sources; compiled on all processors, only what has changed."""
    folder = ROOT / "build" / "bench_core"
    folder.mkdir(parents=True, exist_ok=True)
    generated = folder / "_core.c"
    with redirect_stdout(io.StringIO()):  # cffi says what it writes
        build_core.builder(CORE).emit_c_code(str(generated))
    sources = [path for pattern in build_core.SOURCES for path in sorted(CORE.glob(pattern))]
    includes = [f"-I{path}" for path in (CORE, ROOT / "firmware/src", sysconfig.get_paths()["include"])]
    newest = _newest_header()

    def compiled(source: Path) -> Path:
        name = "_".join(source.relative_to(CORE).with_suffix(".o").parts) if CORE in source.parents else source.stem
        made = folder / (name if name.endswith(".o") else f"{name}.o")
        if not made.exists() or made.stat().st_mtime < max(newest, source.stat().st_mtime):
            options = [*build_core.COMPILE_NATIVE, "-fPIC", *includes]
            subprocess.run(["cc", *options, "-c", str(source), "-o", str(made)], check=True)
        return made

    every = [generated, LIBM, *sources]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip(every, pool.map(compiled, every), strict=True))


@functools.cache
def core(build: Build) -> Path | None:
    """The extension `sim_bridge._core` of that build; None: the installed one."""
    if build == "portable":
        return None
    objects = dict(_objects())
    del objects[CORE / "world/numbers.c" if build == "free" else LIBM]
    made = ROOT / "build" / "bench_core" / f"_core_{build}.so"
    how = [*build_core.COMPILE_NATIVE, "-fPIC", "-shared"]
    subprocess.run(["cc", *how, *map(str, objects.values()), "-lm", *build_core.LIBRARIES, "-o", str(made)], check=True)
    return made
