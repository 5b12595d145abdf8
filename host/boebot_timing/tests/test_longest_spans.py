"""The table of the longest spans that `make soak` prints: complete, replayable, red where something is too long."""

from __future__ import annotations

from dataclasses import replace

import pytest
from rich.console import Console
from rich.progress import Progress

from boebot_timing.emulated.measure import CLOCK_HZ, robot_of, span_at
from boebot_timing.emulated.scenarios import SILENCE
from boebot_timing.measured import Worst
from sim_bridge.boards.emulated import avr_image
from tools.timing_search import RUN_S, Found, beside_bounds, searched
from tools.timing_table import read_table

pytestmark = pytest.mark.emulated

FINE = Found("x", "receive", "interrupt", 48, Worst("figures", 1, 100), 53, 54, latency=640, latency_limit=640)


@pytest.mark.parametrize(
    ("change", "broken"),
    [({}, False), ({"largest": 54}, True), ({"bound": 60, "largest": 55}, True), ({"latency": 641}, True)],
)
def test_what_is_above_bound_budget_or_limit_is_broken(change: dict[str, int], broken: bool) -> None:
    assert replace(FINE, **change).is_broken == broken  # type: ignore[arg-type]


def test_every_task_and_interrupt_has_its_row_and_its_maximum_is_seen_again() -> None:
    image = avr_image("boebot")
    measured, whole = searched(image, RUN_S, 1, Progress(console=Console(quiet=True)))
    assert whole
    assert measured is not None
    rows = {row.name: row for row in beside_bounds("boebot", image, measured)}
    table = read_table()
    tasks = {task.name for task in table.tasks} - {"line"}  # that pin map has no line sensors
    assert set(rows) == tasks | {one.name for one in table.interrupts}
    row = rows["session"]
    length = RUN_S + (SILENCE / CLOCK_HZ if row.worst.scenario == "everything" else 0.0)
    assert span_at(image, robot_of(image), "session", row.worst, length)["net"] == row.largest
