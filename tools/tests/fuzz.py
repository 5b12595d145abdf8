"""Coverage-guided fuzzing of the firmware's and the world's C by libFuzzer with sanitizers: `make fuzz`; for seconds
in `make soak`, those of the frame in `make test`.

    python -m tools.tests.fuzz [--seconds N] [FUZZER ...]

The corpora start from the golden vectors and are kept under build/fuzz. An input that breaks an assertion is left
there as crash-..., and named.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware" / "src"
ARENAS = ROOT / "host" / "boebot" / "arenas"
BUILT = ROOT / "build" / "fuzz"
FRAME = FIRMWARE / "link" / "frame.c"
TEST = ROOT / "firmware" / "test"
SANITIZE = "-fsanitize=fuzzer,address,undefined"
FLAGS = (
    *("-O1", "-g", "-Wall", "-Wextra", "-Wno-unused-parameter", "-Wconversion", "-Wshadow", "-Werror"),
    *("-fno-omit-frame-pointer", SANITIZE, "-fno-sanitize-recover=all"),
    *("-DPIN_MAP_SHIELDBOT", f"-I{FIRMWARE}", f"-I{ARENAS}"),
)

MOST_MB = 2048  # of memory, libFuzzer's own limit


class Fuzzer(NamedTuple):
    """One program that libFuzzer feeds.

    Attributes:
        end: whose golden frames it starts from, "board" or "host"; "": none.
        sources: C files.
        flags: more for the compiler.
        size: longest input (bytes).
        seeds: inputs that it starts from, where there are no golden frames.
    """

    end: str
    sources: tuple[Path, ...]
    flags: tuple[str, ...] = ()
    size: int = 160
    seeds: tuple[tuple[int, ...], ...] = ()


def firmware_sources() -> tuple[Path, ...]:
    """All of the firmware for this computer."""
    return tuple(p for p in sorted(FIRMWARE.rglob("*.c")) if p.name != "main.c" and "avr" not in p.parts)


def world_sources() -> tuple[Path, ...]:
    """Worlds without boards."""
    simulator = ROOT / "sim_bridge"
    rooms = (ARENAS / "geometry", simulator / "vehicles", simulator / "world", simulator / "world" / "sensors")
    return tuple(path for room in rooms for path in sorted(room.glob("*.c")))


# Actions of link_fuzzer.cpp: opens; arms and moves; presses a whisker; lets the supply sag; a message of each kind.
RUN, OPEN, ARM, SET_POINT = (2, 40), (4, 7), (6,), (7, 50)
LINK = (
    (*RUN, *OPEN, *RUN),
    (*RUN, *OPEN, *RUN, *RUN, *ARM, *RUN, *SET_POINT, *RUN),
    (*RUN, *OPEN, *RUN, 3, 1, *RUN, 3, 0, *RUN),
    (*RUN, *OPEN, *RUN, *RUN, *SET_POINT, *RUN),
    (*RUN, *OPEN, 5, 0, *RUN, *RUN),
    *((*RUN, *OPEN, 1, kind, *[0] * 12, *RUN) for kind in range(24)),
)
# Of vehicles_fuzzer.c: a room; a triangle, wall, disc, patch, lamp, charger or moving disc in it; then drives, hands a
# state over as it is, spoilt, spoilt or cut with its checksum made good, drives by the brain, looks, starts anew.
TRIANGLE, PLAIN = (3, 105, 105, 120, 105, 110, 130), (120, 120, 120, 0)
SHAPES = (
    *((1, 1, *TRIANGLE, *PLAIN, kind, 120, 120, 95, 100) for kind in range(6)),
    (1, 1, *TRIANGLE, *PLAIN, 6, *(90, 120, 120, 90), *(120, 110, 115, 90), *(150, 90, 115, 90), 1, 0, 95, 1, 1),
)
DRIVE, BRAIN, LOOK, START = (
    (5, 105, 100, 2, 50),
    (3, 90, 90, 2, 100),
    (4, 95, 95, 110, 91),
    (0, 90, 90, 5, 1, 80, 80, 95),
)
WORLDS = tuple(
    (*shapes, *DRIVE, 2, 90, 90, 1, *exchange, *DRIVE, *more)
    for shapes in ((1, 0), (0, 0), *SHAPES)
    for exchange, more in (
        ((0, 1, 0), BRAIN),
        ((1, 181, 9, 1, 0), LOOK),
        ((1, 180, 7, 1, 1), START),
        ((0, 0, 64, 1), BRAIN),
    )
)
# Of core_fuzzer.c: choices, registers, a program of each kind: counts and branches; calls; loads and stores; interrupts
# and sleep; self-programming, of an instruction of two words, too.
REGISTERS = (1, 2, 3, 4, 50, 20, 0, 0, *range(26), 0, 2, 0, 3, 0, 4)
COUNTS, CALLS = "010F12270395E1F73196019F120303FD9894F6CF", "03D00E940400FCCF0F930FB70F910895"
MEMORY = "0D911993238131830090230100926400C8954591"
INTERRUPTS, PROGRAMMING = "78940EB900936E001D9A1D9B11E013BF8895F8941895", "F1E0E8E0E8953296099400910001FFFF"
PROGRAMS = tuple((*REGISTERS, *bytes.fromhex(words)) for words in (COUNTS, CALLS, MEMORY, INTERRUPTS, PROGRAMMING))

HERE = ROOT / "firmware" / "fuzz"
WORLD = ROOT / "sim_bridge" / "fuzz" / "vehicles_fuzzer.c"
CORE = ROOT / "sim_bridge" / "boards" / "avr" / "core"
FUZZERS = {
    "frame-board": Fuzzer("board", (HERE / "frame_fuzzer.c", FRAME)),
    "frame-host": Fuzzer("host", (HERE / "frame_fuzzer.c", FRAME), ("-DFRAME_OF_HOST",)),
    "link": Fuzzer(
        "", (HERE / "link_fuzzer.cpp", TEST / "host_frame.c", *firmware_sources()), (f"-I{TEST}",), 400, LINK
    ),
    "core": Fuzzer("", (WORLD.with_name("core_fuzzer.c"), *sorted(CORE.glob("*.c"))), (f"-I{CORE}",), 400, PROGRAMS),
    "board": Fuzzer(
        "",
        (WORLD.with_name("board_fuzzer.c"), *sorted(CORE.parent.rglob("[!_]*.c"))),
        (f"-I{CORE.parent}", f"-I{CORE.parents[1]}"),
        seeds=tuple(tuple(random.Random(number).randbytes(160)) for number in range(30)),
    ),
    "vehicles": Fuzzer("", (WORLD, *world_sources()), ("-fsanitize=float-cast-overflow",), 200, WORLDS),
}


def build(name: str, folder: Path, instead: Mapping[Path, Path] | None = None) -> Path:
    """Compiles a fuzzer into a folder; `instead` names files that take the place of sources."""
    fuzzer = FUZZERS[name]
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / name
    sources = [(instead or {}).get(source, source) for source in fuzzer.sources]

    def compiled(source: Path) -> str:
        made = folder / f"{name}-{source.stem}.o"
        language = "c++" if source.suffix == ".cpp" else "c"
        standard = "-std=gnu++17" if language == "c++" else "-std=gnu11"
        command = ["clang", "-x", language, standard, *FLAGS, *fuzzer.flags, "-c", str(source), "-o", str(made)]
        subprocess.run(command, check=True)
        return str(made)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = list(pool.map(compiled, sources))
    subprocess.run(["clang++", SANITIZE, *objects, "-o", str(program)], check=True)
    return program


def write_seeds(name: str, folder: Path) -> None:
    """The fuzzer's rows of actions, or the golden frames to its end, each behind its session's seed."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, actions in enumerate(FUZZERS[name].seeds):
        (folder / f"actions-{number}").write_bytes(bytes(actions))
    if not FUZZERS[name].end:
        return
    rows = json.loads((ROOT / "protocol" / "vectors" / "frames.json").read_text(encoding="utf-8"))
    for number, row in enumerate(rows):
        if (row["id"] >= 0x80) == (FUZZERS[name].end == "host"):
            seed = int(row["seed"]).to_bytes(3, "little")
            (folder / f"golden-{number}").write_bytes(seed + bytes.fromhex(row["frame"]))


def run(program: Path, folder: Path, limits: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Runs a fuzzer that keeps its corpus in a folder; its end is not 0 when an assertion broke or time ran out.

    Args:
        program: made by build().
        folder: of the corpus and of crash-... files.
        limits: how long, as libFuzzer says it: -runs=N, -max_total_time=SECONDS, -seed=N.
    """
    name = program.name
    write_seeds(name, folder / "seeds")
    (folder / "corpus").mkdir(exist_ok=True)
    # The peak of this process counts as the fuzzer's: it is kept when another program begins in its copy.
    inherited_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    command = [str(program), f"-max_len={FUZZERS[name].size}", "-timeout=5", f"-rss_limit_mb={MOST_MB + inherited_mb}"]
    command += [f"-artifact_prefix={folder}/", *limits, str(folder / "corpus"), str(folder / "seeds")]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def main() -> int:
    """Builds the fuzzers and runs them side by side."""
    parser = argparse.ArgumentParser(prog="python -m tools.tests.fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("fuzzer", nargs="*", help=f"of {', '.join(FUZZERS)}; default: all")
    parser.add_argument("--seconds", type=int, default=60, help="for each fuzzer")
    options = parser.parse_args()
    unknown = set(options.fuzzer) - set(FUZZERS)
    if unknown:
        parser.error(f"there is no fuzzer {', '.join(sorted(unknown))}; known: {', '.join(FUZZERS)}")

    def job(name: str) -> tuple[str, subprocess.CompletedProcess[str]]:
        folder = BUILT / name
        return name, run(build(name, folder), folder, [f"-max_total_time={options.seconds}", "-print_final_stats=1"])

    failed = False
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for name, done in pool.map(job, options.fuzzer or FUZZERS):
            failed = failed or done.returncode != 0
            lines = [line for line in done.stderr.splitlines() if line.startswith(("stat::number", "stat::new"))]
            print(
                f"{name}: {'FAILED' if done.returncode else 'passed'}; {'; '.join(' '.join(x.split()) for x in lines)}"
            )
            if done.returncode:
                print(done.stderr[-4000:])
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
