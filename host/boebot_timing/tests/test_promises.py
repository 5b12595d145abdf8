"""The gate of the timing: no image that is flashed has anything that `boebot timing` calls broken under any load, every
task and interrupt is bounded and was measured, and what is promised of the project holds (PROMISES)."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from boebot_timing.budget import Report
from boebot_timing.command import EXIT_BROKEN
from command import boebot as command
from tools import avr_program, timing_page
from tools.timing_promises import PROMISES

pytestmark = pytest.mark.emulated

PLANTED = 200  # cycles
FARTHER = 1  # cycle: what follows moves by 400 bytes, and a jump over more than 4 KB takes so much longer


@pytest.fixture(scope="module", params=list(avr_program.IMAGES))
def judged(request: pytest.FixtureRequest) -> dict[str, Report]:
    """A bundled image under each load."""
    return timing_page.reports(request.param, timing_page.measured(request.param))


def test_nothing_is_broken_under_any_load(judged: dict[str, Report]) -> None:
    """All for which `boebot timing` ends with EXIT_BROKEN."""
    assert {name: one.faults for name, one in judged.items() if one.faults} == {}
    assert {name: one.notes for name, one in judged.items() if one.notes} == {}, "all is bounded"


def test_every_row_was_measured(judged: dict[str, Report]) -> None:
    """Of a robot that has neither encoders nor a left light sensor no pin of port C is watched."""
    basic = judged["figures"].path.endswith("basic.elf")
    missing = {row.name for one in judged.values() for row in one.rows if row.emulator is None}
    assert missing == ({"changes"} if basic else set())


def test_promises_are_kept(judged: dict[str, Report]) -> None:
    broken = []
    for promise in PROMISES:
        found = promise.figure(judged[promise.load])
        if found is None or found > promise.most:
            broken.append(f"{promise.load}: {promise.what}: {found} {promise.unit}, at most {promise.most}")
    assert not broken, f"{Path(judged['figures'].path).name}: {'; '.join(broken)}"


def test_step_of_the_brain_is_realisable(judged: dict[str, Report]) -> None:
    name = Path(judged["figures"].path).stem
    assert timing_page.verdict(name, judged["figures"]).is_realisable


@pytest.mark.soak
def test_planted_slow_task_breaks_the_gate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nops at the turret task's beginning are as many cycles more; its budget is less."""
    sources = tmp_path / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    file, begins = sources / "turret.c", "void turret_task(void) {\n"
    text = file.read_text(encoding="utf-8")
    assert text.count(begins) == 1
    nops = f'  __asm__ volatile(".rept {PLANTED}\\n nop\\n .endr");\n'
    file.write_text(text.replace(begins, begins + nops), encoding="utf-8")
    image = avr_program.build(tmp_path / "planted.elf", folder=sources)
    before = next(row for row in timing_page.reports("shieldbot")["figures"].rows if row.name == "turret")
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--no-measure", "--json")
    assert code == EXIT_BROKEN
    found = json.loads(out)["image"]
    after = next(row for row in found["tasks"] if row["name"] == "turret")
    assert 0 <= after["bound_cycles"] - before.bound - PLANTED <= FARTHER
    more = after["bound_cycles"] - after["budget_cycles"]
    assert (
        f"task turret may take {after['bound_cycles']} cycles, {more} above its budget of {after['budget_cycles']}"
        in (found["faults"])
    )
