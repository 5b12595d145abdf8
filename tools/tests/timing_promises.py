"""Promises about the timing of every bundled image, each a figure of its reports. The tests of `boebot_timing`
hold them, the bench prints them. Pulses and echoes show at the pins (test_jitter.py there)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from boebot_timing.budget import Report, prove
from boebot_timing.emulated.measure import measure_image
from boebot_timing.firmware import load_firmware
from boebot_timing.loads import LOADS
from boebot_timing.measured import Measurement

TICK = 160_000  # cycles


def reports(elf: Path) -> dict[str, Report]:
    """Of an image, measured as `boebot timing` does, under each load by its name."""
    measured, firmware = measure_image(elf, seconds=1.0, seed=1), load_firmware(elf)
    return {name: prove(elf, load, measured, firmware=firmware) for name, load in LOADS.items()}


@dataclass(frozen=True, slots=True)
class Promise:
    """Of each image: `figure` of its report under a load is at most `most`, in `unit`; None: it is not known."""

    load: str
    what: str
    unit: str
    most: float
    figure: Callable[[Report], float | None]


def _percent(cycles: float | None) -> float | None:
    """Of a tick."""
    return None if cycles is None else 100 * cycles / TICK


def _tick(report: Report) -> int | None:
    return None if report.responses is None else report.responses.tick


def _infrared(report: Report) -> float | None:
    return None if report.responses is None else _percent(report.responses.pieces["infrared"])


def _lost(measured: Measurement | None, *kinds: str) -> int | None:
    return None if measured is None else sum(measured.losses[kind] for kind in kinds)


PROMISES = (
    Promise("figures", "load with frames, emulator", "%", 40, lambda r: None if r.own is None else 100 * r.own.load),
    Promise("figures", "work of the fullest tick, bound", "%", 25, lambda r: _percent(r.tick_work)),
    Promise("figures", "response of the tick, bound", "%", 60, lambda r: _percent(_tick(r))),
    Promise("figures", "bytes and edges lost, emulator", "", 0, lambda r: _lost(r.own, "bytes", "frames", "edges")),
    Promise("figures", "the tick's tasks, bound to longest measured", "", 1.5, lambda r: r.ratio),
    Promise("overload", "response of the tick, bound", "%", 100, lambda r: _percent(_tick(r))),
    Promise("overload", "response of the IR pairs' task, bound: bursts begin at 50 %", "%", 50, _infrared),
    Promise(
        "overload", "ticks missed, resets, emulator", "", 0, lambda r: _lost(r.own, "ticks", "late_ticks", "resets")
    ),
    Promise("everything", "flash", "bytes", 24 * 1024, lambda r: r.memory.flash),
    Promise("everything", "RAM and worst stack", "bytes", 1_750, lambda r: r.memory.static + r.memory.stack),
)
