"""Records what simavr does (README.md): `python record.py [--check] [--sources FOLDER]`.

simavr is Debian's packages libsimavr-dev and libelf-dev, or with --sources a folder of its sources that holds `sim` and
`cores`. Without --check the result is written to results.xz.
"""

from __future__ import annotations

import argparse
import lzma
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "results.xz"
PARTS = ("vectors.c", "cases.c", "programs.c", "instructions.c")
FLAGS = ("-std=gnu11", "-O1", "-Wall", "-Wextra", "-Werror")
# What simavr's makefile would find out.
CONFIGURATION = {
    "sim_core_config.h": '#define CONFIG_SIMAVR_VERSION "sources"\n#define CONFIG_MEGA328 1\n',
    "sim_core_decl.h": (
        '#include "sim_core_config.h"\nextern avr_kind_t mega328;\nextern avr_kind_t *avr_kind[];\n'
        "#ifdef AVR_KIND_DECL\navr_kind_t *avr_kind[] = {&mega328, NULL};\n#endif\n"
    ),
}
NOT_SIMAVR = ("run_avr", "sim_dwarf")  # its command line


def build(program: Path, machine: Sequence[str]) -> Path:
    """Compiles vectors.c with a machine: C files, libraries and flags of the compiler."""
    subprocess.run(["cc", *FLAGS, *(str(HERE / part) for part in PARTS), *machine, "-o", str(program)], check=True)
    return program


def printed(program: Path, *arguments: str) -> str:
    """What it prints."""
    return subprocess.run([str(program), *arguments], check=True, capture_output=True, text=True).stdout


def recorded() -> str:
    """The text that was recorded."""
    return lzma.decompress(RESULTS.read_bytes()).decode("ascii")


def simavr_of_debian() -> list[str]:
    """Its library, static: it is to take the peripherals of simavr_machine.c."""
    include = "/usr/include/simavr"
    return [str(HERE / "simavr_machine.c"), "-isystem", include, "-l:libsimavr.a", "-lelf", "-lutil", "-lpthread"]


def simavr_of_sources(folder: Path, build_folder: Path) -> list[str]:
    """Its sources, compiled into an archive."""
    for name, text in CONFIGURATION.items():
        (build_folder / name).write_text(text, encoding="ascii")
    includes = ["-isystem", str(build_folder), "-isystem", str(folder / "sim"), "-isystem", str(folder / "cores")]
    sources = [path for path in sorted((folder / "sim").glob("*.c")) if path.stem not in NOT_SIMAVR]
    sources.append(folder / "cores" / "sim_mega328.c")
    subprocess.run(["cc", "-O2", "-w", *includes, "-c", *map(str, sources)], check=True, cwd=build_folder)
    archive = build_folder / "simavr.a"
    subprocess.run(["ar", "rc", str(archive), *map(str, build_folder.glob("*.o"))], check=True)
    return [str(HERE / "simavr_machine.c"), *includes, str(archive), "-lutil", "-lpthread"]


def main() -> int:
    """Records or checks."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare with results.xz, write nothing")
    parser.add_argument("--sources", type=Path, help="simavr's folder with sim and cores, instead of Debian's package")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        sources = options.sources.resolve() if options.sources else None
        simavr = simavr_of_sources(sources, folder) if sources else simavr_of_debian()
        text = printed(build(folder / "vectors", simavr))
    if options.check:
        print("the same" if text == recorded() else "it differs from results.xz")
        return text != recorded()
    RESULTS.write_bytes(lzma.compress(text.encode("ascii"), preset=9 | lzma.PRESET_EXTREME))
    print(f"{RESULTS.name}: {len(text.splitlines())} lines, {RESULTS.stat().st_size} B")
    return 0


if __name__ == "__main__":
    sys.exit(main())
