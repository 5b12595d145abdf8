"""The gate of the timing budgets: of every image that is flashed, each task, interrupt, tick and byte of memory against
its bound, its budget and the figures that were set for it.

What does not hold today stands in KNOWN, with how far it is off and why. The table only ever gets shorter: a figure
that grows fails, and so does an entry whose figure holds again, so that it is removed.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from boebot import resources
from boebot.cli import timing
from boebot.robots import load_robot
from boebot.timing.budget import FLASH_BYTES, RATIO_MOST, STAMP_ROLLS_OVER, Report, Row, prove
from boebot.timing.graph import load_program
from boebot.timing.loads import LOADS
from boebot.timing.measured import Measurement, merged
from command import boebot as command
from sim_bridge.timing.measure import SCENARIOS, measure
from tools.bench import avr_program

pytestmark = pytest.mark.emulated

PIN_MAPS = ("boebot", "shieldbot", "shieldbot-quad")
SECONDS = 0.7  # of each scenario; half of it the host of "everything" is silent
# Figures that were set for the project, in cycles of a tick of 160,000 or in bytes.
TICK = 160_000
LOAD_MOST = 40 * TICK // 100  # executed in one tick, as asked for by "figures"
WORK_MOST = 25 * TICK // 100  # of the fullest tick, by static bound
MEMORY_MOST = 1_600  # static RAM and the deepest stack
FLASH_MOST = 16 * 1024
PLANTED = 200  # cycles
FARTHER = 1  # cycle: what follows moves by 400 bytes, and a jump over more than 4 KB takes so much longer


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


def checks(figures: Report, saturated: Report) -> list[Check]:
    """All of an image."""
    found = [check for row in figures.rows for check in _row_checks(row)]
    for report in (figures, saturated):
        found += _tick_checks(report)
    memory = figures.memory
    work = figures.tick_work
    own = figures.own
    assert own is not None
    return [
        *found,
        Check("goal: work of a tick", work, WORK_MOST),
        Check("goal: load", round(own.load * TICK), LOAD_MOST),
        Check("stack: bound <= RAM left", memory.stack, memory.left),
        Check("stack: measured <= bound", memory.stack_seen or 0, memory.stack),
        Check("goal: RAM and stack", memory.static + memory.stack, MEMORY_MOST),
        Check("flash: what there is", memory.flash, FLASH_BYTES),
        Check("goal: flash", memory.flash, FLASH_MOST),
    ]


def _row_checks(row: Row) -> Iterator[Check]:
    who = f"{row.kind} {row.name}"
    yield Check(f"{who}: bound <= budget", row.bound, row.budget)
    yield Check(f"{who}: measured <= bound", row.emulator or 0, row.bound)
    if row.kind == "task":
        ratio = float("inf") if row.ratio is None else round(row.ratio, 2)  # one that never ran has shown nothing
        yield Check(f"{who}: bound to measured", ratio, RATIO_MOST)
    if row.latency is not None and row.latency_limit is not None:
        yield Check(f"{who}: latency <= limit", row.latency, row.latency_limit)


def _tick_checks(report: Report) -> Iterator[Check]:
    """Under one load. With overload there is no response, and nothing to compare with it."""
    load = report.load.name
    own, answers = report.own, report.responses
    yield Check(f"{load}: response of the tick", float("inf") if answers is None else answers.tick, report.tick_cycles)
    assert own is not None, "a load that nobody measured"
    yield Check(f"{load}: lost in the emulator", _lost(own), 0)
    if answers is None:
        return
    due = [report.tick_cycles - slot % 4 * report.schedule.slot_cycles for slot in range(len(answers.slots))]
    late = max(cycles - left for cycles, left in zip(answers.slots, due, strict=True))
    yield Check(f"{load}: slots that end in the next tick", late, 0)
    yield Check(f"{load}: measured tick <= bound", own.worst_tick, report.demand)
    yield Check(f"{load}: measured busiest tick <= bound", own.busiest_tick, report.executed)
    assert report.gap is not None and report.edge_age is not None
    assert report.ring is not None and report.ring_holds is not None
    yield Check(f"{load}: measured gap of polls <= bound", own.between_polls, report.gap)
    yield Check(f"{load}: bytes in the receive ring", report.ring, report.ring_holds)
    yield Check(f"{load}: changes in their ring", report.changes or 0, report.changes_held or 0)
    yield Check(f"{load}: age of an edge when its time is told", report.edge_age, STAMP_ROLLS_OVER - 1)


def _lost(measured: Measurement) -> int:
    """Bytes, frames, edges, ticks: all that a run has lost, of each kind that must not be."""
    assert {"bytes", "frames", "edges", "ticks", "late_ticks", "masked", "resets"} <= measured.losses.keys()
    return sum(measured.losses.values())


@pytest.fixture(scope="module", params=PIN_MAPS)
def judged(request: pytest.FixtureRequest) -> tuple[str, list[Check]]:
    """An image and its checks. That there is an answer at all says that every loop is bounded."""
    name: str = request.param
    image = resources.folder("images") / f"{name}.elf"
    measured = merged(measure(image, load_robot(name), scenario, SECONDS) for scenario in SCENARIOS)
    program = load_program(image)
    figures, saturated = (prove(image, LOADS[load], measured, program=program) for load in ("figures", "saturated"))
    return name, checks(figures, saturated)


def test_every_image_keeps_its_budgets(judged: tuple[str, list[Check]]) -> None:
    name, found = judged
    known = {entry.what: entry.most for entry in KNOWN if name in entry.images}
    broken = [check for check in found if not check.holds]
    new = [check for check in broken if check.what not in known]
    worse = [check for check in broken if check.number > known.get(check.what, float("inf"))]
    assert not new and not worse, f"{name}: " + "; ".join(
        f"{check.what}: {check.number:,}, at most {known.get(check.what, check.limit):,}" for check in (*new, *worse)
    )


def test_known_exceptions_are_still_needed(judged: tuple[str, list[Check]]) -> None:
    name, found = judged
    broken = {check.what for check in found if not check.holds}
    mended = [entry.what for entry in KNOWN if name in entry.images and entry.what not in broken]
    assert not mended, f"{name}: these hold now, and shall leave the table: {mended}"


def test_exceptions_are_each_said_once_with_a_reason() -> None:
    said = [(entry.what, image) for entry in KNOWN for image in entry.images]
    assert len(set(said)) == len(said) and all(len(entry.why) > 20 for entry in KNOWN)


def test_planted_slow_task_breaks_the_gate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """So many nops at the turret task's beginning are so many cycles more; its budget is less."""
    sources = tmp_path / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    turret = sources / "turret.c"
    before = "void turret_task(void) {\n"
    text = turret.read_text(encoding="utf-8")
    assert text.count(before) == 1
    slow = f'{before}  __asm__ volatile(".rept {PLANTED}\\n nop\\n .endr");\n'
    turret.write_text(text.replace(before, slow), encoding="utf-8")
    monkeypatch.setattr(avr_program, "SOURCES", sources)
    image = avr_program.build(tmp_path / "slow.elf")

    def task(path: Path) -> Row:
        report = prove(path, LOADS["figures"])
        return next(row for row in report.rows if row.name == "turret")

    sound, slowed = task(resources.folder("images") / "shieldbot.elf"), task(image)
    assert sound.slack >= 0 and 0 <= slowed.bound - sound.bound - PLANTED <= FARTHER
    (check,) = [check for check in _row_checks(slowed) if check.what == "task turret: bound <= budget"]
    assert not check.holds and check.what not in {entry.what for entry in KNOWN}
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--no-measure")
    assert code == timing.EXIT_BROKEN
    over = slowed.bound - slowed.budget
    assert f"task turret may take {slowed.bound} cycles, {over} above its budget of {slowed.budget}" in " ".join(
        out.split()
    )
