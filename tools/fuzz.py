"""Coverage-guided fuzzing of the firmware's C by libFuzzer with sanitizers: `make fuzz`; for seconds in `make test`.

    python -m tools.fuzz [--seconds N] [FUZZER ...]

The corpora start from the golden vectors and are kept under build/fuzz. An input that breaks an assertion is left
there as crash-..., and named.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
FIRMWARE = ROOT / "firmware" / "src"
BUILT = ROOT / "build" / "fuzz"
FRAME = FIRMWARE / "link" / "frame.c"
FLAGS = (
    *("-std=gnu11", "-O1", "-g", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-fno-omit-frame-pointer"),
    *("-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all", "-DPIN_MAP_SHIELDBOT", f"-I{FIRMWARE}"),
)


class Fuzzer(NamedTuple):
    """One program that libFuzzer feeds.

    Attributes:
        end: whose messages it takes, "board" or "host".
        sources: C files.
        flags: more for the compiler.
        size: longest input (bytes).
    """

    end: str
    sources: tuple[Path, ...]
    flags: tuple[str, ...] = ()
    size: int = 160


def firmware_sources() -> tuple[Path, ...]:
    """All of the firmware for this computer."""
    return tuple(p for p in sorted(FIRMWARE.rglob("*.c")) if p.name != "main.c" and "avr" not in p.parts)


HERE = ROOT / "firmware" / "fuzz"
FUZZERS = {
    "frame-board": Fuzzer("board", (HERE / "frame_fuzzer.c", FRAME)),
    "frame-host": Fuzzer("host", (HERE / "frame_fuzzer.c", FRAME), ("-DFRAME_OF_HOST",)),
}


def build(name: str, folder: Path, instead: Path | None = None) -> Path:
    """Compiles a fuzzer into a folder; `instead` takes the place of frame.c."""
    fuzzer = FUZZERS[name]
    folder.mkdir(parents=True, exist_ok=True)
    program = folder / name
    sources = [instead if instead and source == FRAME else source for source in fuzzer.sources]
    subprocess.run(["clang", *FLAGS, *fuzzer.flags, *map(str, sources), "-o", str(program)], check=True)
    return program


def write_seeds(name: str, folder: Path) -> None:
    """The golden frames to the fuzzer's end, each behind its session's seed."""
    folder.mkdir(parents=True, exist_ok=True)
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
    command = [str(program), f"-max_len={FUZZERS[name].size}", "-timeout=5", f"-artifact_prefix={folder}/", *limits]
    command += [str(folder / "corpus"), str(folder / "seeds")]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def main() -> int:
    """Builds the fuzzers and runs them side by side."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz", description=__doc__.splitlines()[0])
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
