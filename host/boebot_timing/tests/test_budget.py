"""Reports of budgets: figures counted by hand, planted faults, the command with its codes, and its pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib.image
import numpy as np
import pytest

from avr_timing.interrupts.byte_reads import RECEIVE
from avr_timing.interrupts.response import responses
from boebot.description.robots import load_robot
from boebot.errors import BoebotError, TimingError
from boebot_timing import budget, diagram, loads, realisable, shown
from boebot_timing.command import EXIT_BROKEN, EXIT_INPUT
from boebot_timing.firmware import load_firmware
from boebot_timing.measured import Measurement, Moment, Spans, Worst, merged
from boebot_timing.table import InterruptRow
from boebot_timing.tests.timing_program import build
from command import boebot as command

FIGURES = loads.LOADS["figures"]


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("program"))


@pytest.fixture(scope="module")
def report(image: Path) -> budget.Report:
    return budget.prove(image, FIGURES)


def spans(name: str, *cycles: int) -> Spans:
    values = np.array(cycles, dtype=np.uint32)
    return Spans(name, values, values, Worst("figures", 1, 0))


def measurement(first: int = 104, slot: int = 31, lowest_stack: int = 0x8F8, worst_tick: int = 700) -> Measurement:
    return Measurement(
        tasks={"first": spans("first", first - 1, first)},
        interrupts={"slot": spans("slot", slot)},
        lowest_stack=lowest_stack,
        seconds=1.0,
        load=0.1,
        worst_tick=worst_tick,
        scenarios=("figures",),
    )


def test_progress_is_the_share_of_tasks_and_interrupts_that_are_done(image: Path, report: budget.Report) -> None:
    """Two tasks and one interrupt."""
    shares: list[float] = []
    assert budget.prove(image, FIGURES, progress=shares.append).rows == report.rows
    assert shares == pytest.approx([1 / 3, 2 / 3, 1])


def test_bounds_are_those_counted_by_hand(report: budget.Report) -> None:
    """Nops and a return of 4; an interrupt has 4 of its entry and 3 of its vector besides."""
    assert {row.name: row.bound for row in report.rows} == {"first": 104, "second": 204, "slot": 4 + 3 + 20 + 4}
    assert {row.name: row.slack for row in report.rows} == {"first": 46, "second": 96, "slot": 9}
    assert report.memory.stack == 2 + 2 + 2 + 2 and report.memory.static == 10
    assert report.faults == []


def test_sums_follow_from_the_bounds(report: budget.Report) -> None:
    """Four slots with the first task, one with the second; a slot interrupt each. No poll: the program has none."""
    around = report.costs.round
    assert report.tick_work == 4 * 104 + 204 + 4 * around
    assert report.load_bound == pytest.approx((report.tick_work + 4 * 31) / 160_000)
    assert report.responses is not None
    assert report.responses.tick == report.tick_work + report.schedule.blocking + 31, "all within one slot"
    assert report.responses.pieces["second"] == report.schedule.blocking + around + 104 + 204 + 31


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"first_budget": 103}, "task first may take 104 cycles, 1 above its budget of 103"),
        ({"first_nops": 147}, "task first may take 151 cycles, 1 above its budget of 150"),
        ({"interrupt_budget": 30}, "interrupt slot may take 31 cycles, 1 above its budget of 30"),
        ({"reserve": 2041}, "the stack may need 8 bytes; 7 of 2048 are left for it"),
        ({"first_nops": 9990, "first_budget": 39_000}, None),
    ],
)
def test_planted_faults_are_found(tmp_path: Path, options: dict[str, int], sentence: str | None) -> None:
    faults = budget.prove(build(tmp_path, **options), FIGURES).faults
    assert faults == ([] if sentence is None else [sentence])


def judged(report: budget.Report, **cycles: int) -> budget.Report:
    """The same with other tasks."""
    costs = replace(report.costs, tasks=report.costs.tasks | cycles)
    schedule = costs.schedule(load_firmware(Path(report.path)))
    answers = responses(schedule, report.sources)
    return replace(report, costs=costs, schedule=schedule, responses=answers)


def test_tick_that_is_too_full_is_found(report: budget.Report) -> None:
    """Four slots of 45,000 are more than the tick has; of 90,000 in slot 1 it has time, of 125,000 not."""
    (fault,) = judged(report, first=45_000).faults
    assert fault.startswith("overload: under the load 'figures' the tick and interrupts may take 112.")
    assert judged(report, second=90_000).faults == []
    assert any("slot 1 may end 12" in fault for fault in judged(report, second=125_000).faults)


@pytest.mark.parametrize(
    ("measured", "sentence"),
    [
        (measurement(first=105), "task first took 105 cycles in the emulator, 1 above its bound of 104"),
        (measurement(slot=32), "interrupt slot took 32 cycles in the emulator, 1 above its bound of 31"),
        (measurement(lowest_stack=0x8F6), "the stack took 9 bytes in the emulator, 1 above its bound of 8"),
        (measurement(worst_tick=30_000), "tasks and interrupts of a tick took 30000 cycles in the emulator, "),
    ],
)
def test_measured_above_its_bound_is_a_fault(image: Path, measured: Measurement, sentence: str) -> None:
    """The stack begins at 0x8FF: with SP at 0x8F6, 9 bytes are in use."""
    (fault,) = budget.prove(image, FIGURES, measured).faults
    assert fault.startswith(sentence)


@pytest.mark.parametrize(
    ("figure", "sentence"),
    [
        ("worst_tick", "tasks and interrupts of a tick took"),
        ("busiest_tick", "instructions ran in"),
        ("between_polls", "cycles passed between two polls in the emulator"),
    ],
)
def test_scenario_is_compared_with_its_own_load(image: Path, report: budget.Report, figure: str, sentence: str) -> None:
    """What a tick took under another load says nothing about the bounds under this one."""
    assert report.gap is not None
    most = {"worst_tick": report.demand, "busiest_tick": report.executed, "between_polls": report.gap}[figure]
    quiet = replace(measurement(), worst_tick=0)
    less: dict[str, Any] = {figure: most}
    more: dict[str, Any] = {figure: most + 1}
    full, over = replace(quiet, **less), replace(quiet, **more)
    other = replace(over, scenarios=("noise",))
    assert budget.prove(image, FIGURES, merged([full, other])).faults == []
    assert budget.prove(image, FIGURES, other).faults == []
    (fault,) = budget.prove(image, FIGURES, merged([over, replace(full, scenarios=("noise",))])).faults
    assert sentence in fault and f"1 above its bound of {most}" in fault


def test_sums_of_a_tick_are_those_counted_by_hand(report: budget.Report) -> None:
    """A slot interrupt of 31 in each slot, which wakes the main loop: 4 cycles and a pass. No link, no encoder."""
    assert report.demand == report.schedule.blocking + report.tick_work + 4 * 31
    passes = 4 * (4 + report.costs.loop)
    assert report.executed == report.demand + passes + 3 * report.frames.cycles  # two come in a tick, one waited
    assert report.costs.frame == report.costs.edges == 0 and report.frames.cycles == 2 * report.costs.loop


def test_ratio_is_that_of_the_ticks_sum(image: Path, report: budget.Report) -> None:
    """Four times 104 and once 204 by bound; measured 100 and 150."""
    assert report.ratio is None
    one = measurement(first=100)
    one = replace(one, tasks=one.tasks | {"second": spans("second", 150)})
    measured = budget.prove(image, FIGURES, one)
    assert measured.ratio == pytest.approx((4 * 104 + 204) / (4 * 100 + 150))


def test_overload_judges_the_tick_and_no_ring(image: Path, report: budget.Report) -> None:
    found = budget.prove(image, loads.LOADS["overload"])
    assert found.faults == [] and found.ring is None and found.changes is None
    assert found.responses is not None and report.responses is not None
    assert found.responses.tick == report.responses.tick, "it has neither line nor encoders"


def test_ring_that_is_needed_is_shown_beside_the_one_there_is(
    report: budget.Report, capsys: pytest.CaptureFixture[str]
) -> None:
    full = replace(report, ring=129)
    shown.show_report(full)
    assert full.faults == ["129 bytes may wait for a poll of the link; the ring holds 127"]
    rows = {line.split("  ")[0].strip(): line.split() for line in capsys.readouterr().out.splitlines()}
    assert rows["receive ring needed"][3:] == ["129", "of", "127", "bytes"]
    assert rows["poll gap bound (bytes wait in the ring)"][-2:] == [f"{report.gap:,}", "cycles"]
    as_dict = full.as_dict()
    assert (as_dict["receive_ring_needed_bytes"], as_dict["receive_ring_bytes"]) == (129, 127)


def test_board_above_its_bound_is_a_fault(image: Path, report: budget.Report) -> None:
    """A board counts the interrupts in between, so its figure stands against the response."""
    assert report.responses is not None
    most = report.responses.pieces
    found = budget.prove(image, FIGURES, board={"first": most["first"] + 1, "second": most["second"]})
    assert found.faults == [
        f"task first took {most['first'] + 1} cycles on the board, 1 above its bound with interrupts of {most['first']}"
    ]


def test_image_without_a_table_is_refused(tmp_path: Path) -> None:
    source, bare = tmp_path / "bare.c", tmp_path / "bare.elf"
    source.write_text("int main(void) { for (;;) {} }\n")
    import subprocess

    subprocess.run(["avr-gcc", "-Os", "-mmcu=atmega328p", "-o", str(bare), str(source)], check=True)
    with pytest.raises(TimingError, match="carries no timing table"):
        budget.prove(bare, FIGURES)


def test_unknown_load_is_refused() -> None:
    with pytest.raises(BoebotError, match="there is no load 'heavy'; expected figures or overload"):
        loads.load_named("heavy")


def test_overload_asks_what_it_says() -> None:
    """50,000 bytes/s are one in 320 cycles; three lines of 4,000 edges/s one in 4,000 each, and noise on the fourth,
    which is masked after some in each tick."""
    row = InterruptRow("receive", RECEIVE, 60, 640, 320)
    (bytes_,) = loads.LOADS["overload"].sources(row, 53)
    assert bytes_.requests(16_000_000) == 50_000
    edges = loads.LOADS["overload"].sources(replace(row, vector=loads.ENCODERS), 113)
    assert sum(one.requests(16_000_000) for one in edges) == 3 * 4_000 + 100 * 16
    (tamed,) = FIGURES.sources(row, 53)
    assert tamed.requests(16_000_000) == 101 * realisable.COMMAND_BYTES  # of a host whose clock is 0.6 % fast
    assert FIGURES.sources(replace(row, vector=loads.TWO_WIRE), 99) == []


# ---- the command ----------------------------------------------------------------------------------------------------


def test_command_prints_the_table_and_its_code_says_whether_budgets_are_met(
    image: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--no-measure", "--json", "--out", str(tmp_path))
    answer = json.loads(out)
    assert code == 0 and answer["image"]["tasks"][0]["bound_cycles"] == 104
    assert answer["realisable"]["realisable"] and answer["image"]["faults"] == []
    assert {Path(file).name for file in answer["files"]} == {"timing.png", "timing.svg", "timing.json"}
    code, out, _ = command(capsys, "timing", "--elf", str(image), "--no-measure")
    assert code == 0 and "all budgets are met" in out and "bound" in out
    (tmp_path / "broken").mkdir()
    broken = build(tmp_path / "broken", first_budget=90)
    code, out, _ = command(capsys, "timing", "--elf", str(broken), "--no-measure")
    assert code == EXIT_BROKEN and "14 above its budget of 90" in " ".join(out.split())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--elf", "none.elf"), "none.elf"),
        (("--elf", __file__), "is not an ELF file"),
        (("--load", "heavy"), "there is no load 'heavy'"),
        (("--robot", "nobody"), "nobody"),
        (("--robot", "arsim", "--baud", "9600"), "robot 'arsim' has no board"),
        (("--robot", "arsim", "--brain", "nobody"), "nobody"),
        (("--seconds", "0"), "0 s cannot be measured; expected --seconds 0.1 to 3600"),
        (("--seconds", "3601"), "3601 s cannot be measured"),
        (("--seconds", "nan"), "nan s cannot be measured"),
        (("--seed", "-1"), "-1 is no seed; expected --seed 0 or more"),
    ],
)
def test_bad_input_is_one_sentence_and_code_2(
    arguments: tuple[str, ...], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = command(capsys, "timing", *arguments, "--no-measure")
    assert code == EXIT_INPUT and sentence in err and err.count("\n") == 1


def test_robot_without_a_board_is_judged_by_its_sensors(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = command(capsys, "timing", "--robot", "arsim", "--period", "10ms", "--step", "12ms", "--json")
    answer = json.loads(out)
    assert code == EXIT_BROKEN and answer["image"] is None
    assert "brain, 12 ms, ends 12 ms after the step began" in answer["realisable"]["faults"][0]


def test_line_too_slow_for_the_period_that_is_asked_for_is_code_1(
    image: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("timing", "--elf", str(image), "--no-measure", "--baud", "9600", "--period")
    code, out, _ = command(capsys, *arguments, "50ms")
    said = " ".join(out.split())
    assert code == EXIT_BROKEN and "all budgets are met" in said
    assert "brain period of 50 ms is not realisable: telemetry, " in said
    assert "expected a period of 100 ms or a line of 19200 bit/s" in said
    code, out, _ = command(capsys, *arguments, "0.1", "--json")
    answer = json.loads(out)["realisable"]
    assert code == 0 and answer["realisable"] and answer["period_s"] == answer["period_forced_s"] == 0.1


def test_brain_is_measured(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = command(capsys, "timing", "--robot", "arsim", "--brain", "wander", "--json", "--period", "1")
    (step,) = json.loads(out)["realisable"]["events"]
    assert code == 0 and step["kind"] == "process" and 0 < step["takes_s"] < 1


# ---- the diagram ----------------------------------------------------------------------------------------------------


def boxes(axes: Any) -> list[tuple[float, float]]:
    """Left edge and width of each, in the units of their axis."""
    return sorted((patch.get_x(), patch.get_width()) for patch in axes.patches)


def test_diagram_is_to_scale(report: budget.Report) -> None:
    """The widths of its boxes are the tasks' bounds: in cycles, none of them left out."""
    verdict = realisable.judge(load_robot("shieldbot"), 0.01, brain_s=0.002)
    step, slots = diagram.figure(report, verdict).axes
    byte_ms = 10 / 500
    telemetry, command_ms = realisable.TELEMETRY_BYTES * byte_ms, realisable.COMMAND_BYTES * byte_ms
    expected = [(0, telemetry), (telemetry, 2), (telemetry + 2, command_ms)]
    assert np.array(boxes(step)) == pytest.approx(np.array(expected))
    tasks = sorted([104] * 4 + [204])
    assert sorted(round(width) for _, width in boxes(slots)) == sorted(tasks + [report.costs.round] * 4)
    assert [text.get_text() for text in step.texts if "Δt" in text.get_text()] == ["Δt = 10 ms"]


def test_diagram_of_a_measured_tick(report: budget.Report) -> None:
    """Of the report's own load; the time between two tasks of a slot is marked, 1000 cycles here."""
    tick = (
        Moment("first", "task", 50, 185),
        Moment("slot", "interrupt", 60, 91),
        Moment("first", "task", 1185, 1289),
        Moment("first", "task", 40_050, 40_154),
    )
    measured = merged([replace(measurement(), scenarios=("noise",)), replace(measurement(), tick=tick)])
    (slots,) = diagram.figure(replace(report, measured=measured)).axes
    assert boxes(slots) == [(50, 104), (50, 135), (60, 31), (185, 1000), (1185, 104)]


def test_pictures_are_whole(report: budget.Report, tmp_path: Path) -> None:
    found = diagram.files(report, realisable.judge(load_robot("shieldbot"), 0.05))
    assert set(found) == {"timing.png", "timing.svg"}
    assert found == diagram.files(report, realisable.judge(load_robot("shieldbot"), 0.05)), "the same again"
    root = ElementTree.fromstring(found["timing.svg"])
    texts = {element.text for element in root.iter("{http://www.w3.org/2000/svg}text")}
    assert {"first", "second", "slot 3", "what is left", "task", "scheduler", "bytes on the line"} <= texts
    assert not any("poll" in (text or "") for text in texts), "the link is polled when no slot waits"
    (tmp_path / "timing.png").write_bytes(found["timing.png"])
    assert matplotlib.image.imread(tmp_path / "timing.png").shape[1] > 1000
