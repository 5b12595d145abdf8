"""The ring of changes: what it must hold by closed form, against a main loop cycle by cycle, and of a mutant."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
import timing_program
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot import resources
from boebot.cli import timing_tables
from boebot.timing import budget
from boebot.timing.changes import CHANGES_RING, most_waiting
from boebot.timing.costs import Costs
from boebot.timing.loads import LOADS
from boebot.timing.response import Piece, Schedule, Source, load
from tools.bench import avr_program

ROUND, LOOP, FRAME, CHANGE = 100, 20, 2000, 10
COSTS = Costs(
    tasks={},
    interrupts={},
    charged={},
    latencies={},
    loop=LOOP,
    round=ROUND,
    around=0,
    frame=FRAME,
    partial=0,
    edges=5,
    change=CHANGE,
    other=0,
    storm=0,
    changes_due=8,
)
LINE = Source("line", 0, 1000)


def slots(*cycles: int, every: int = 40_000) -> Schedule:
    return Schedule(tuple((Piece("all", one),) for one in cycles), every, 1)


def test_frame_comes_upon_changes_that_were_not_due() -> None:
    """By hand: 7 stay, and 20 + 2000 + 100 + 10 cycles pass until the first is worked off: 3 come in 2130."""
    assert most_waiting(COSTS, slots(ROUND), [], [LINE], 0) == COSTS.changes_due - 1 + 3
    assert most_waiting(COSTS, slots(ROUND), [], [LINE], 870) == COSTS.changes_due - 1 + 4  # at 3000 a fourth
    assert most_waiting(COSTS, slots(ROUND), [], [LINE, LINE], 0) == COSTS.changes_due - 1 + 6


@pytest.mark.parametrize(
    ("slot", "most"),
    [
        (11_660, 12),  # 12 found, 100 more, one worked off: 11,890; 12 lines have come, at 0, 1000, ... 11,000
        (11_790, 13),  # 10 found, as after a frame: just 12,000, when one more comes; 13 found: 12,030
    ],
)
def test_slot_lies_between_two_polls(slot: int, most: int) -> None:
    """By hand; that other slots wait does not matter, for each of them begins with a poll."""
    assert most_waiting(COSTS, slots(ROUND, slot), [], [LINE], 0) == most
    assert most_waiting(COSTS, slots(slot, slot, slot, every=1), [], [LINE], 0) == most


@pytest.mark.parametrize(
    ("slot", "most"),
    [
        (11_375, 48),  # 48 found: 11,375 + 480 + 100 + 10 = 11,965; four are worked off before, at 12,005, four come
        (11_405, 52),  # 11,995: but one is worked off when four come, 51; then 12,025, and it is 52 before any is
    ],
)
def test_four_lines_change_while_the_ring_is_worked_off(slot: int, most: int) -> None:
    """By hand: all four at once, each 1000 cycles; 48 until 12,000."""
    assert most_waiting(COSTS, slots(slot), [], [LINE] * 4, 0) == most


def test_interrupts_lengthen_what_lies_between() -> None:
    """By hand: 2130 cycles under 50 in each 100 take 4280, for 43 * 50 = 2150: 5 changes."""
    assert most_waiting(COSTS, slots(ROUND), [Source("i", 50, 100)], [LINE], 0) == COSTS.changes_due - 1 + 5


class Loop:
    """The main loop, cycle by cycle: slots before changes that are due before a frame, of which there is always one."""

    def __init__(self, found: Costs, works: list[int], every: int) -> None:
        self.found, self.works, self.every = found, works, every
        self.ring = self.most = self.slots_waiting = self.slot = 0

    def poll(self) -> Iterator[None]:
        for _ in range(self.ring):
            yield from [None] * self.found.change
            self.ring -= 1

    def run(self) -> Iterator[None]:
        while True:
            if self.slots_waiting:
                before = self.found.round // 2
                yield from [None] * before
                yield from self.poll()
                yield from [None] * (self.works[self.slot % len(self.works)] - before)
                self.slots_waiting -= 1
                self.slot += 1
            elif self.ring >= COSTS.changes_due:
                yield from [None] * self.found.loop
                yield from self.poll()
            else:
                yield from [None] * (self.found.loop + self.found.frame)

    def simulate(self, interrupts: list[Source], lines: list[Source], phases: list[int], end: int) -> int:
        main, stolen = self.run(), 0
        for now in range(end):
            stolen += sum(one.cycles for one in interrupts if now % one.interval == 0)
            coming = sum((now + phase) % one.interval == 0 for one, phase in zip(lines, phases, strict=False))
            self.ring += coming
            self.most = max(self.most, self.ring)
            self.slots_waiting += now % self.every == 0
            if stolen:
                stolen -= 1
            else:
                next(main)
        return self.most


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(8, 110), min_size=1, max_size=4),
    st.integers(0, 80),
    st.integers(1, 3),
    st.lists(st.integers(12, 40), min_size=1, max_size=4),
    st.lists(st.integers(0, 39), min_size=4, max_size=4),
    st.integers(0, 3),
)
def test_no_simulation_holds_more(
    works: list[int], frame: int, change: int, intervals: list[int], phases: list[int], stolen: int
) -> None:
    found = replace(COSTS, loop=3, round=8, frame=frame, change=change)
    lines, interrupts = [Source("line", 0, one) for one in intervals], [Source("i", stolen, 10)]
    schedule = slots(*works, every=200)
    worked_off = [replace(one, cycles=change) for one in lines]
    if load([*interrupts, *worked_off]) + schedule.mean_load >= 1:
        return
    bound = most_waiting(found, schedule, interrupts, lines, 0)
    assert bound is not None
    assert Loop(found, works, 200).simulate(interrupts, lines, phases, 2000) <= bound


# ---- of the firmware -----------------------------------------------------------------------------------------------

TASK = "void turret_task(void) {\n"


def mutant(folder: Path, passes: int) -> Path:
    """The firmware with a loop before the turret's task."""
    sources = folder / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    turret = sources / "turret.c"
    text = turret.read_text(encoding="utf-8")
    assert text.count(TASK) == 1
    loop = f'  BOUNDED({passes}u, for (uint16_t i = 0; i < {passes}u; i++)) {{ __asm__ volatile("nop"); }}\n'
    turret.write_text('#include "bounds.h"\n' + text.replace(TASK, TASK + loop), encoding="utf-8")
    return avr_program.build(folder / "mutant.elf", environment="env:uno_quad", folder=sources)


def shipped(name: str) -> Path:
    return resources.folder("images") / f"{name}.elf"


def sentences(report: budget.Report) -> list[str]:
    return [fault for fault in report.faults if fault.startswith("ring of changes: ")]


def test_slow_task_fills_the_ring(tmp_path: Path) -> None:
    """A pass is `nop`, `sbiw` and `brne` that is taken: 5 cycles. In 30,000 alone, which the sound image has not, four
    lines that change each 4,000 cycles change 28 times at the least, and what comes on top of it is longer for that."""
    passes = 6_000
    sound, slow = (
        budget.prove(image, LOADS["saturated"]) for image in (shipped("shieldbot-quad"), mutant(tmp_path, passes))
    )
    assert slow.costs.tasks["turret"] - sound.costs.tasks["turret"] in range(5 * passes - 1, 5 * passes + 10)
    assert sound.changes is not None and slow.changes is not None
    assert slow.changes >= sound.changes + 4 * (5 * passes // 4_000)
    assert (sound.changes_held, sound.is_met, sentences(sound)) == (63, True, [])
    assert sentences(slow) == [f"ring of changes: {slow.changes} may wait for a poll of the encoders; it holds 63"]


def test_ring_is_the_images_own(capsys: pytest.CaptureFixture[str]) -> None:
    """64 places of 4 bytes, of which one stays free."""
    report = budget.prove(shipped("shieldbot-quad"), LOADS["figures"])
    as_dict = report.as_dict()
    assert (as_dict["changes_ring_needed_entries"], as_dict["changes_ring_entries"]) == (report.changes, 256 // 4 - 1)
    assert report.changes is not None and sentences(replace(report, changes_held=report.changes)) == []
    assert len(sentences(replace(report, changes_held=report.changes - 1))) == 1
    unknown = replace(report, changes_held=None)
    assert sentences(unknown) == []
    assert f"whether {report.changes} changes fit its ring of them is not known: it has no {CHANGES_RING}" in (
        unknown.notes
    )
    timing_tables.show_report(report)
    (row,) = (line.split() for line in capsys.readouterr().out.splitlines() if "changes ring needed" in line)
    assert row[3:] == [str(report.changes), "of", "63"]


def test_image_without_encoders_has_no_changes(tmp_path: Path) -> None:
    report = budget.prove(timing_program.build(tmp_path), LOADS["figures"])
    assert report.changes is None and report.changes_held is None and sentences(report) == report.notes == []


def test_image_built_with_another_constant_has_another_bound(tmp_path: Path) -> None:
    """The main loop leaves twice as many changes before it works them off: the code is the same but for a number."""
    sources = tmp_path / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    header = sources / "encoder.h"
    text = header.read_text(encoding="utf-8")
    assert text.count("#define ENCODER_DUE_BYTES 0x20u") == 1
    header.write_text(text.replace("ENCODER_DUE_BYTES 0x20u", "ENCODER_DUE_BYTES 0x40u"), encoding="utf-8")
    later = avr_program.build(tmp_path / "later.elf", environment="env:uno_quad", folder=sources)
    sound, other = (budget.prove(image, LOADS["saturated"]) for image in (shipped("shieldbot-quad"), later))
    assert (sound.costs.changes_due, other.costs.changes_due) == (8, 16)
    assert other.costs.change == sound.costs.change
    assert other.costs.idle - sound.costs.idle == 8 * sound.costs.change
    assert sound.changes is not None and other.changes is not None and other.changes > sound.changes


def test_lines_that_come_back_are_counted_with_the_lights_edge(tmp_path: Path) -> None:
    """Where it waits the task leaves them to the next poll, whatever the load: 50 cycles more there are 50 more."""
    sources = tmp_path / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    encoder = sources / "encoder.c"
    text, begins = encoder.read_text(encoding="utf-8"), "take_back(void) {\n"
    assert text.count(begins) == 1
    nops = '  __asm__ volatile(".rept 50\\n nop\\n .endr");\n'
    encoder.write_text(text.replace(begins, begins + nops), encoding="utf-8")
    slow = avr_program.build(tmp_path / "slow.elf", folder=sources)
    sound, slower = (budget.prove(image, LOADS["everything"]).costs for image in (shipped("shieldbot"), slow))
    assert slower.other - sound.other == 50
    assert slower.idle - sound.idle == 50
