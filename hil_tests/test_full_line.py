"""A line full of one kind of message: what is bounded of it against what the emulator shows, and what a longer handler
of one message does to the bounds of all."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from boebot import resources
from boebot.link import messages
from boebot.robots import load_robot
from boebot.timing.budget import Report, prove
from boebot.timing.frames import FrameCost, frame_costs
from boebot.timing.graph import load_program
from boebot.timing.loads import LOADS
from sim_bridge.timing.one_kind import TO_BOARD, carry
from tools.bench import avr_program

pytestmark = pytest.mark.emulated

IMAGE = "shieldbot-quad"  # that with four encoder lines
SECONDS = 0.2  # of the board's time: 20 ticks
SEEN = (messages.SetpointSignal, messages.SetpointSpeed, messages.Buzzer, messages.SetParameter, messages.Identify)
SET_POINTS = {"setpoint_signal", "setpoint_speed", "setpoint_coast"}
PASSES = 66  # of a planted loop of 3 cycles each
PLANTED = 3 * PASSES  # cycles: 1 to load the counter, and 1 less for the last pass
FARTHER = 6  # cycles: what follows moves, and other registers are used


@pytest.fixture(scope="module")
def report() -> Report:
    """Under the saturated load."""
    return prove(resources.folder("images") / f"{IMAGE}.elf", LOADS["saturated"])


def test_every_message_to_the_board_has_its_bound(report: Report) -> None:
    lines = {line.cost.id: line for line in report.lines.lines}
    assert lines.keys() == {kind.ID for kind in TO_BOARD}
    assert all(lines[kind.ID].cost.bytes == kind.LENGTH + 8 for kind in TO_BOARD)
    assert max(line.cost.poll for line in lines.values()) <= report.costs.frame, "the bound of any frame"


@pytest.mark.parametrize("image", ["boebot", "shieldbot", IMAGE])
def test_set_points_are_proven_to_be_worked_off(image: str, report: Report) -> None:
    found = report if image == IMAGE else prove(resources.folder("images") / f"{image}.elf", LOADS["saturated"])
    proven = {line.cost.name for line in found.lines.lines if line.is_proven(found.ring_holds)}
    assert proven >= SET_POINTS
    assert found.lines.is_proven(found.ring_holds) and set(found.lines.mixed) == proven


@pytest.mark.parametrize("kind", SEEN)
def test_what_is_seen_is_within_the_bounds(kind: type[messages.Message], report: Report) -> None:
    line = next(line for line in report.lines.lines if line.cost.id == kind.ID)
    seen = carry(resources.folder("images") / f"{IMAGE}.elf", load_robot(IMAGE), kind, SECONDS)
    assert 0 < seen.poll <= line.cost.poll
    assert seen.per_tick == pytest.approx(line.carried, rel=0.02), "the line is full"
    if line.is_proven(report.ring_holds):
        assert (seen.frames_lost, seen.bytes_lost, seen.good) == (0, 0, seen.sent)
        assert line.ring is not None and 0 < seen.waiting <= line.ring


def test_a_line_full_of_questions_loses_frames_as_its_figure_says(report: Report) -> None:
    """So losses would be seen: the identity's 68 bytes cannot follow 62 times in a tick."""
    line = next(line for line in report.lines.lines if line.cost.name == "identify")
    assert line.answered is not None and line.answered < line.carried and line.ring is None
    seen = carry(resources.folder("images") / f"{IMAGE}.elf", load_robot(IMAGE), messages.Identify, SECONDS)
    assert seen.frames_lost > 0 and seen.bytes_lost > 0 and seen.good < seen.sent


def planted(folder: Path, source: str, before: str) -> dict[str, FrameCost]:
    """Of the firmware with a handler that takes longer."""
    sources = folder / "src"
    shutil.copytree(avr_program.SOURCES, sources)
    file = sources / source
    text = file.read_text(encoding="utf-8")
    assert text.count(before) == 1
    loop = f'__asm__ volatile("ldi r24, {PASSES}\\n 1: dec r24\\n brne 1b" ::: "r24");\n'
    file.write_text(text.replace(before, before + loop), encoding="utf-8")
    return costs_of(avr_program.build(folder / "planted.elf", folder=sources))


def costs_of(image: Path) -> dict[str, FrameCost]:
    """By the names of messages."""
    return {cost.name: cost for cost in frame_costs(load_program(image))}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, FrameCost]:
    """Of the firmware as it is."""
    return costs_of(avr_program.build(tmp_path_factory.mktemp("sound") / "sound.elf"))


@pytest.mark.parametrize(
    ("source", "before", "message"),
    [
        ("turret.c", "void turret_hold(int16_t angle) {\n", "turret"),
        ("link/dispatch.c", "static bool buzzer(const uint8_t *payload) {\n", "buzzer"),
        ("link/dispatch.c", "static void clock_probe(const uint8_t *payload) {\n", "clock_probe"),
    ],
)
def test_longer_handler_raises_the_bound_of_its_message_only(
    source: str, before: str, message: str, tmp_path: Path, sound: dict[str, FrameCost]
) -> None:
    slowed = planted(tmp_path, source, before)
    assert sound.keys() == slowed.keys()
    more = {name: slowed[name].poll - cost.poll for name, cost in sound.items()}
    assert abs(more.pop(message) - PLANTED) <= FARTHER
    assert all(abs(cycles) <= FARTHER for cycles in more.values()), more
