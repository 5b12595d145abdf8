"""The gate of the timing budgets: no image that is flashed has anything that `boebot timing` calls broken under any
load, every task and interrupt was measured, and the figures that were set for the project are kept.

What the command calls broken has no exceptions. A figure of the project that is missed today stands in KNOWN, with how
far it is off and why. The table only ever gets shorter: a figure that grows fails, and so does an entry whose figure
holds again, so that it is removed.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from boebot import resources
from boebot.cli import timing
from boebot.timing.budget import RATIO_MOST, Report, prove
from boebot.timing.graph import load_program
from boebot.timing.loads import LOADS
from boebot.timing.measured import Measurement
from command import boebot as command
from sim_bridge.timing.measure import measure_image
from tools import timing_page
from tools.bench import avr_program

pytestmark = pytest.mark.emulated

PIN_MAPS = ("boebot", "shieldbot", "shieldbot-quad")
SEED = 1
SECONDS = 0.7  # of each scenario; half of it the host of "everything" is silent
# Figures that were set for the project, in cycles of a tick of 160,000 or in bytes.
TICK = 160_000
LOAD_MOST = 40 * TICK // 100  # executed in one tick, as asked for by "figures"
WORK_MOST = 25 * TICK // 100  # of the fullest tick, by static bound
MEMORY_MOST = 1_600  # static RAM and the deepest stack
FLASH_MOST = 16 * 1024
PLANTED = 200  # cycles
FARTHER = 1  # cycle: what follows moves by 400 bytes, and a jump over more than 4 KB takes so much longer
# The wait of an exact edge under the saturated load is 586 cycles of 600 (tasks.def), and four lines change at once
# meanwhile: four more in each change are too many.
CHANGE_LATER = 4  # cycles


@dataclass(frozen=True, slots=True)
class Check:
    """It holds where `number` is at most `limit`."""

    what: str
    number: float
    limit: float

    @property
    def holds(self) -> bool:
        return self.number <= self.limit


@dataclass(frozen=True, slots=True)
class Known:
    """A check that does not hold: how large its number is at most, in which images, and why."""

    what: str
    most: float
    why: str
    images: tuple[str, ...] = PIN_MAPS


KNOWN: tuple[Known, ...] = ()


@dataclass(frozen=True, slots=True)
class Judged:
    """What is said of an image. That there is an answer at all says that every loop is bounded."""

    name: str
    faults: tuple[str, ...]  # what the command calls broken, after the load
    checks: tuple[Check, ...]  # of the figures that were set
    unmeasured: frozenset[str]  # tasks and interrupts that never came


def judge(image: Path, name: str) -> Judged:
    """An image for the robot of that name, measured once and judged under each load."""
    measured = measure_image(image, seconds=SECONDS, seed=SEED)
    program = load_program(image)
    reports = [prove(image, load, measured, program=program) for load in LOADS.values()]
    return Judged(
        name=name,
        faults=tuple(f"{one.load.name}: {fault}" for one in reports for fault in _faults(name, one)),
        checks=tuple(check for report in reports for check in (*_load_checks(report), *_goals(report))),
        unmeasured=frozenset(row.name for one in reports for row in one.rows if row.emulator is None),
    )


def _faults(name: str, report: Report) -> tuple[str, ...]:
    """All for which `boebot timing` ends with EXIT_BROKEN."""
    return (*report.faults, *timing_page.verdict(name, report).faults)


def _load_checks(report: Report) -> Iterator[Check]:
    """What was measured under a load, and that nothing is missing which its faults would be told by."""
    load, own = report.load.name, report.own
    assert own is not None, f"{load}: a load that nobody measured"
    yield Check(f"{load}: lost in the emulator", _lost(own), 0)
    figures = (report.responses, report.gap, report.ring, report.ring_holds, report.edge_age, report.memory.stack_seen)
    yield Check(f"{load}: figures that nobody knows", sum(figure is None for figure in figures), 0)
    for row in report.rows:
        if row.kind == "task" and row.ratio is not None:
            yield Check(f"{load}: task {row.name}: bound to measured", round(row.ratio, 2), RATIO_MOST)


def _goals(report: Report) -> Iterator[Check]:
    """The project's figures, which are about one load."""
    memory, own = report.memory, report.own
    if report.load.name != "figures" or own is None:
        return
    yield Check("goal: work of a tick", report.tick_work, WORK_MOST)
    yield Check("goal: load", round(own.load * TICK), LOAD_MOST)
    yield Check("goal: RAM and stack", memory.static + memory.stack, MEMORY_MOST)
    yield Check("goal: flash", memory.flash, FLASH_MOST)


def _lost(measured: Measurement) -> int:
    """Bytes, frames, edges, ticks: all that a run has lost, of each kind that must not be. "everything" damages frames
    and stops encoders on purpose; no byte may be lost by it, and no reset come."""
    kinds = {"bytes", "resets"}
    if measured.scenarios != ("everything",):
        kinds |= {"frames", "edges", "ticks", "late_ticks", "masked"}
    assert kinds <= measured.losses.keys()
    return sum(measured.losses.values())


@pytest.fixture(scope="module", params=PIN_MAPS)
def judged(request: pytest.FixtureRequest) -> Judged:
    """A bundled image."""
    return judge(resources.folder("images") / f"{request.param}.elf", request.param)


def test_nothing_is_broken_under_any_load(judged: Judged) -> None:
    assert judged.faults == (), judged.name


def test_every_row_was_measured(judged: Judged) -> None:
    assert not judged.unmeasured, judged.name


def test_every_image_keeps_the_figures_that_were_set(judged: Judged) -> None:
    name, found = judged.name, judged.checks
    known = {entry.what: entry.most for entry in KNOWN if name in entry.images}
    broken = [check for check in found if not check.holds]
    new = [check for check in broken if check.what not in known]
    worse = [check for check in broken if check.number > known.get(check.what, float("inf"))]
    assert not new and not worse, f"{name}: " + "; ".join(
        f"{check.what}: {check.number:,}, at most {known.get(check.what, check.limit):,}" for check in (*new, *worse)
    )


def test_known_exceptions_are_still_needed(judged: Judged) -> None:
    name, found = judged.name, judged.checks
    broken = {check.what for check in found if not check.holds}
    mended = [entry.what for entry in KNOWN if name in entry.images and entry.what not in broken]
    assert not mended, f"{name}: these hold now, and shall leave the table: {mended}"


def test_exceptions_are_each_said_once_with_a_reason() -> None:
    said = [(entry.what, image) for entry in KNOWN for image in entry.images]
    assert len(set(said)) == len(said) and all(len(entry.why) > 20 for entry in KNOWN)


def planted(folder: Path, source: str, before: str, added: str) -> Path:
    """The Shield-Bot's image with something added behind a text that a source has once."""
    sources = folder / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    file = sources / source
    text = file.read_text(encoding="utf-8")
    assert text.count(before) == 1
    file.write_text(text.replace(before, before + added), encoding="utf-8")
    return avr_program.build(folder / "planted.elf", folder=sources)


def test_planted_slow_task_breaks_the_gate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """So many nops at the turret task's beginning are so many cycles more; its budget is less."""
    nops = f'  __asm__ volatile(".rept {PLANTED}\\n nop\\n .endr");\n'
    image = planted(tmp_path, "turret.c", "void turret_task(void) {\n", nops)
    sound, slowed = (prove(path, LOADS["figures"]) for path in (resources.folder("images") / "shieldbot.elf", image))
    before, after = (next(row for row in one.rows if row.name == "turret") for one in (sound, slowed))
    assert before.slack >= 0 and 0 <= after.bound - before.bound - PLANTED <= FARTHER
    fault = f"task turret may take {after.bound} cycles, {-after.slack} above its budget of {after.budget}"
    assert fault in _faults("shieldbot", slowed)
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--no-measure")
    assert code == timing.EXIT_BROKEN and fault in " ".join(out.split())


def test_wait_that_is_too_long_under_one_load_only_breaks_the_gate(tmp_path: Path) -> None:
    """A little more in each of an encoder's changes: none of the loads but the saturated has four lines of them."""
    nops = f'\n      ".rept {CHANGE_LATER}\\n nop\\n .endr\\n"'
    image = planted(tmp_path, "hal/avr/changes_avr.c", "HAL_ISR(PCINT1_vect) {\n  __asm__ volatile(", nops)
    (fault,) = judge(image, "shieldbot").faults
    assert fault.startswith("saturated: interrupt edge may wait ") and fault.endswith("its latency limit of 600")
