"""The Arduino core's Servo library in the same emulator, under the same overload, at the same pins as ours.

The library comes in the package `arduino-servo` of PyPI, which pip downloads (66 KB, pinned by its hash) into
build/arduino-servo; the core in Debian's package `arduino-core-avr`, where it is installed. No source of either is kept
in this repository. The sketch echoes what comes by the line, counts encoder edges and sends 30 bytes each 10 ms.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from boebot.errors import BoebotError
from boebot_timing.emulated.line import BYTE_CYCLES
from boebot_timing.emulated.loads import OVERLOAD, TICK_CYCLES, Bench, wheels

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "arduino-servo"
PACKAGE = "arduino-servo==0.1 --hash=sha256:a9e67d8004fa85ec6ae87a2b019b774b80265c7a978d32602721d2254ac3b251"
CORE = Path("/usr/share/arduino/hardware/arduino/avr")  # of arduino-core-avr
WIDTHS_US = {13: 1560, 12: 1440}
ENCODERS = [(14, 15), (16, 17)]
FRAME = bytes(range(1, 16)) + b"\0"  # of 16 bytes, as a set-point
SETTLE_CYCLES = 8 * TICK_CYCLES
FLAGS = ["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR"]
FLAGS += ["-DDECIMAL_DIG=__DECIMAL_DIG__"]  # which the float.h of Debian's avr-gcc keeps from C++
FLAGS += ["-Os", "-w", "-ffunction-sections", "-fdata-sections", "-flto", "-fuse-linker-plugin"]
COMPILERS = {
    ".c": ["avr-gcc", "-std=gnu11"],
    ".cpp": ["avr-g++", "-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics"],
}
SKETCH = """
#include <Arduino.h>
#include "Servo.h"
Servo left, right;
volatile uint16_t edges;
ISR(PCINT1_vect) { edges++; }
void setup() {
  Serial.begin(500000);
  left.attach(13);
  right.attach(12);
  left.writeMicroseconds(LEFT_US);
  right.writeMicroseconds(RIGHT_US);
  PCMSK1 = 0x0F;
  PCICR = _BV(PCIE1);
}
void loop() {
  static unsigned long last;
  static uint8_t report[30];
  while (Serial.available()) Serial.write(Serial.read());
  if (millis() - last >= 10) {
    last = millis();
    Serial.write(report, sizeof report);
  }
}
"""


class UnavailableError(BoebotError):
    """The library or the core cannot be had; the text says why and what to do."""


def library() -> Path:
    """The folder with Servo.cpp and Servo.h.

    pip unpacks the package and then finds that it is none for this Python: what was unpacked is all that is wanted.
    """
    if (FOLDER / "Servo.cpp").is_file() and (FOLDER / "Servo.h").is_file():
        return FOLDER
    unpacked = FOLDER / "unpacked"
    shutil.rmtree(FOLDER, ignore_errors=True)
    unpacked.mkdir(parents=True)
    (FOLDER / "requirements.txt").write_text(PACKAGE + "\n", encoding="ascii")
    command = [sys.executable, "-m", "pip", "download", "--no-clean", "--no-deps", "--no-binary", ":all:"]
    command += ["--no-build-isolation", "--disable-pip-version-check", "--require-hashes", "--dest", str(unpacked)]
    command += ["--requirement", str(FOLDER / "requirements.txt")]
    environment = {**os.environ, "TMPDIR": str(unpacked)}
    result = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    for name in ("Servo.h", "Servo.cpp"):
        found = next(unpacked.rglob(f"Arduino/Servo/{name}"), None)
        if found is None:
            last = (result.stderr.strip().splitlines() or ["no word"])[-1]
            raise UnavailableError(f"pip could not bring {PACKAGE.split()[0]}: {last}")
        shutil.copy(found, FOLDER / name)
    shutil.rmtree(unpacked)
    return FOLDER


def build(core: Path = CORE) -> Path:
    """The sketch's ELF file.

    Raises:
        UnavailableError: the core is not installed, the library cannot be downloaded, or they cannot be compiled.
    """
    if not (core / "cores" / "arduino" / "Arduino.h").is_file():
        raise UnavailableError("the Arduino core is not installed (Debian: apt install arduino-core-avr)")
    folder = library()
    sketch, elf = folder / "sketch.cpp", folder / "sketch.elf"
    defines = f"#define LEFT_US {WIDTHS_US[13]}\n#define RIGHT_US {WIDTHS_US[12]}\n"
    sketch.write_text(defines + SKETCH, encoding="ascii")
    sources = [sketch, folder / "Servo.cpp"]
    sources += [path for path in sorted((core / "cores" / "arduino").glob("*.c*")) if "USB" not in path.name]
    places = [f"-I{folder}", f"-I{core / 'cores' / 'arduino'}", f"-I{core / 'variants' / 'standard'}"]
    objects = []
    for source in sources:
        compiled = folder / f"{source.name}.o"
        _run([*COMPILERS[source.suffix], *FLAGS, *places, "-c", str(source), "-o", str(compiled)])
        objects.append(str(compiled))
    _run(["avr-gcc", *FLAGS, "-Wl,--gc-sections", "-o", str(elf), *objects, "-lm"])
    return elf


def _run(command: list[str]) -> None:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode:
        raise UnavailableError(f"the Arduino sketch cannot be compiled: {result.stderr.strip().splitlines()[0]}")


class FullLine:
    """Frames to the sketch, back to back. See Source."""

    def __init__(self, first: int) -> None:
        self._next = first

    def queue(self, bench: Bench, until: int) -> None:
        """See Source."""
        while self._next < until:
            bench.access.send(FRAME, at=self._next)
            self._next += len(FRAME) * BYTE_CYCLES


def largest_width_error(seconds: float) -> float:
    """Of both servos' pulses under the overload, in cycles. Raises UnavailableError."""
    with Bench(build()) as bench:
        bench.run(SETTLE_CYCLES)
        first = bench.now + TICK_CYCLES
        trains = wheels(ENCODERS, OVERLOAD.edges_per_s, first)
        bench.sources += [*(train for wheel in trains for train in wheel), FullLine(first)]
        begun = bench.now + 2 * TICK_CYCLES
        bench.run_until(begun + round(seconds * 16e6))
        errors = [np.abs(bench.pulses(pin, begun)[:, 1] - width * 16) for pin, width in WIDTHS_US.items()]
        return float(np.concatenate(errors).max())
