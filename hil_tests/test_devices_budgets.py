"""Every task of tasks.def within its budget on the AVR, with all devices on and all that a host can ask for: cycles of
the task itself, measured in the image that is flashed."""

from __future__ import annotations

import pytest

from boebot.robots import load_robot
from sim_bridge.boards.emulated import avr_image
from sim_bridge.timing.measure import measure
from tools.timing_table import fullest_slot, read_table

pytestmark = pytest.mark.emulated

SECONDS = 0.8  # of the board; 0.35 of it the host is silent, and the dead man stops the motors
TABLE = read_table()


@pytest.mark.parametrize("pin_map", ["shieldbot", "boebot"])
def test_each_task_keeps_its_budget(pin_map: str) -> None:
    result = measure(avr_image(pin_map), load_robot(pin_map), "everything", SECONDS)
    worst = {task.name: result.tasks[task.name].largest for task in TABLE.tasks}
    print("\n" + "\n".join(f"{pin_map:10} {t.name:10} {worst[t.name]:6} of {t.budget:6}" for t in TABLE.tasks))
    assert all(worst.values()), "a task has not run"
    over = {task.name: (worst[task.name], task.budget) for task in TABLE.tasks if worst[task.name] > task.budget}
    assert not over


def test_budgets_of_the_fullest_slot_leave_half_of_it() -> None:
    """Interrupts of a saturated line and four encoders take the other half at most, by their shares in tasks.def."""
    assert fullest_slot(TABLE) <= 20_000
