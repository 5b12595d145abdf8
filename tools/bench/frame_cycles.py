"""Cycles of the firmware's frame code on the emulated ATmega328P, interrupts not counted.

Run `python -m tools.bench.frame_cycles`. The program is frame_cycles.c, linked with the firmware in
place of main.c, with the flags of the image.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

from sim_bridge.boards.avr import create
from sim_bridge.boards.board import Edge, Level

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "firmware" / "src"
LEFT_SERVO, RIGHT_SERVO = 13, 12
FLAGS = ["-std=gnu11", "-Os", "-mmcu=atmega328p", "-DF_CPU=16000000UL", "-DPIN_MAP_SHIELDBOT"]
FLAGS += ["-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-Wl,--relax"]
OVERHEAD = 8  # bytes of a frame with both delimiters
RECEIVED = {"set-point": 8, "set-point of zeros": 8, "acknowledgement": 2}  # payload bytes
SENT = {"telemetry": 38, "identity": 60, "answer": 7, "counters": 20}
WORKED_ON = {"identify": (0, 60), "get_parameter": (3, 7), "clock_probe": (2, 6), "open": (9, 44)}  # and the answer's


def build(folder: Path) -> Path:
    """The program's ELF file."""
    image = folder / "frame_cycles.elf"
    firmware = [path for path in SOURCES.rglob("*.c") if path.name != "main.c" and "native" not in path.parts]
    sources = [str(path) for path in [Path(__file__).with_name("frame_cycles.c"), *firmware]]
    subprocess.run(["avr-gcc", *FLAGS, f"-I{SOURCES}", "-o", str(image), *sources], check=True)
    return image


def spans() -> list[int]:
    """How long the pin was high each time, in cycles, without what the measuring itself takes."""
    with tempfile.TemporaryDirectory() as folder:
        avr = create(build(Path(folder)))
        board = avr.access()
        edges: list[Edge] = []
        while not any(edge.pin == RIGHT_SERVO and edge.level == Level.HIGH for edge in edges):
            board.run(100_000)
            edges += board.log()
        cycles = [edge.cycle for edge in edges if edge.pin == LEFT_SERVO and edge.level in (Level.LOW, Level.HIGH)]
        cycles = cycles[len(cycles) % 2 :]  # the first may be the pin becoming an output
        measured = [low - high for high, low in zip(cycles[::2], cycles[1::2], strict=True)]
        return [span - measured[0] for span in measured[1:]]


def figures() -> dict[str, tuple[float, int]]:
    """By case: cycles per byte on the wire, and of the whole frame. Raises CalledProcessError if it does not build."""
    found = {}
    measured = iter(spans())
    for name, length in RECEIVED.items():
        cycles = next(measured) - next(measured)
        found[f"received {name}"] = (cycles / (length + OVERHEAD), cycles)
    for content in ("no zeros", "all zeros"):
        for name, length in SENT.items():
            cycles = next(measured)
            found[f"sent {name}, {content}"] = (cycles / (length + OVERHEAD), cycles)
    for name, (asked, answered) in WORKED_ON.items():
        cycles = next(measured)
        found[f"{name} with its answer, all in all"] = (cycles / (asked + answered + 2 * OVERHEAD), cycles)
    return found


if __name__ == "__main__":
    for case, (per_byte, whole) in figures().items():
        print(f"{case:40} {per_byte:6.1f} cycles/byte {whole:6} cycles")
