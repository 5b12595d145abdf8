"""The rows of tasks.def stand in every image as they stand there, and every interrupt that the image uses has one."""

from __future__ import annotations

import re

import pytest

from boebot.image.elf import read_image
from boebot_timing.table import read_table
from sim_bridge.boards.emulated import avr_image
from tools.tests.avr_program import IMAGES, SOURCES

ROW = re.compile(r"^(TASK|INTERRUPT|SENSOR)\((\w+)((?:, \d+)+)\)$", re.MULTILINE)


@pytest.mark.parametrize("image", IMAGES)
def test_image_carries_the_table(image: str) -> None:
    text = (SOURCES / "tasks.def").read_text(encoding="utf-8")
    rows = [(kind, name, [int(one) for one in numbers.split(", ")[1:]]) for kind, name, numbers in ROW.findall(text)]
    assert len(rows) == len(re.findall(r"^(?:TASK|INTERRUPT|SENSOR)\(", text, re.MULTILINE)) > 30
    table = read_table(avr_image(image))
    found = [("TASK", one.name, [one.period, one.phase, one.budget]) for one in table.tasks]
    found += [("INTERRUPT", i.name, [i.vector, i.budget, i.latency, i.interval]) for i in table.interrupts]
    found += [("SENSOR", one.name, [one.conversion, one.period, one.age]) for one in table.sensors]
    assert sorted(found) == sorted(row for row in rows if row[:2] != ("TASK", "line") or image == "shieldbot-line")
    assert all(age >= conversion for kind, _, (conversion, *_, age) in rows if kind == "SENSOR")
    names = {one.name for one in read_image(avr_image(image)).symbols if one.strength == 0}
    vectors = {int(name.removeprefix("__vector_")) for name in names if re.fullmatch(r"__vector_\d+", name)}
    assert vectors == {row.vector for row in table.interrupts}
