"""End to end: from a whisker's touch at the pin to the step of the brain that first sees it, in control ticks, through
firmware, line and host library."""

from __future__ import annotations

import numpy as np
import pytest

from boebot.boards import BoardRequest, open_board
from boebot.brains import LoadedBrain
from boebot.description.robots import load_robot
from boebot.robot import Robot
from boebot.running.board_driver import BoardDriver
from boebot.running.tasks import Request, Task
from boebot_hil.rig import CYCLES_PER_S, TICK_S
from boebot_timing.emulated.loads import TICK_CYCLES
from boebot_timing.tests.latency_limits import WHISKER

WHISKER_PIN = 5
TOUCH_EVERY, RELEASE_AFTER = 15, 10  # steps from one touch to the next, and to its end
PHASE_CYCLES = 61_001  # by which a touch is later in its tick than the one before: shares no factor with the tick
LIBRARY_CYCLES = 2 * 320 + 16  # the host's end of the line waits for two byte times of silence, and a rounding


@pytest.mark.parametrize("board_url", ["native", "avr"])
@pytest.mark.parametrize("period_ticks", [1, 5])
def test_a_touch_is_seen_by_the_brain_within_two_ticks_and_its_period(board_url: str, period_ticks: int) -> None:
    """Least and most as latency_limits.py derives them for telemetry; a brain that steps every n-th tick may wait for
    n - 1 ticks more."""
    touches: list[int] = []
    delays: list[int] = []
    session = open_board(board_url, BoardRequest(robot=load_robot("shieldbot"), arena="empty", noise=False))

    def step(robot: Robot) -> None:
        now = round(session.transport.now() * CYCLES_PER_S)
        number = len(steps)
        if number % TOUCH_EVERY == 0:
            touched = now + 1_000 + len(touches) * PHASE_CYCLES * period_ticks % (TICK_CYCLES * period_ticks)
            session.board.drive(WHISKER_PIN, 0, touched)  # type: ignore[attr-defined]
            touches.append(touched)
        elif number % TOUCH_EVERY == RELEASE_AFTER:
            session.board.drive(WHISKER_PIN, 1)  # type: ignore[attr-defined]
        elif robot.whisker_left.pressed and len(delays) < len(touches):
            delays.append(now - touches[-1])
        steps.append(now)
        robot.drive(0.1, 0.1)

    steps: list[int] = []
    request = BoardRequest(robot=load_robot("shieldbot"), arena="empty", noise=False)
    seconds = 40 * TOUCH_EVERY * period_ticks * TICK_S / (1 if period_ticks == 1 else 3)
    task = Task(
        request=Request.single(seconds=seconds),
        brain=LoadedBrain("touch", step),
        board=request,
        on=board_url,
        period_s=period_ticks * TICK_S,
        seed=1,
    )
    try:
        driver = BoardDriver(session, task)
        driver.begin()
        for _ in driver.steps():
            step(driver.robot)
        driver.end()
    finally:
        session.close()
    seen = np.array(delays)
    assert len(seen) >= len(touches) - 1 >= 10
    assert WHISKER.least is not None and WHISKER.most is not None
    most = WHISKER.most + LIBRARY_CYCLES + (period_ticks - 1) * TICK_CYCLES
    assert seen.min() >= WHISKER.least and seen.max() <= most
    assert most <= (period_ticks + 1) * TICK_CYCLES, "the limit is no more than the name of this test says"
    assert np.ptp(seen) >= 0.6 * period_ticks * TICK_CYCLES, "phases were not swept"
