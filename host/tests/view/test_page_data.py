"""Events that the page marks on its time axis, and the edges of pins."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import boebot
from boebot.link.messages import Status
from boebot.record.record import Record
from boebot.view import page_data


def series(
    ticks: list[int],
    status: list[int] | None = None,
    pressed: list[bool] | None = None,
    contact: list[bool] | None = None,
    first: int = 0,
) -> Any:
    """Of control ticks 0.01 s apart."""
    raw = np.array([(tick,) for tick in ticks], dtype=[("tick", "<u4")])
    return SimpleNamespace(
        time=np.arange(len(ticks)) * 0.01 if ticks != sorted(ticks) else np.array(ticks) * 0.01,
        status=np.array(status or [int(Status.MOTORS_ENABLED)] * len(ticks), dtype=np.uint16),
        raw=raw,
        contact=np.array(contact or [False] * len(ticks)),
        first=first,
        flag=lambda device, name: np.array(pressed or [False] * len(ticks)),
    )


def found(series: Any) -> list[tuple[float, str, str]]:
    events = page_data.events(series, ["whisker_left"])
    return [(round(time, 6), kind, text) for time, kind, text in events]


def test_nothing_happens_in_an_even_run() -> None:
    assert found(series(list(range(50)))) == []
    assert found(series([])) == [] and found(series([7])) == []


def test_frames_that_never_came() -> None:
    ticks = [tick for tick in range(40) if tick not in (10, 20, 21, 22)]
    assert found(series(ticks)) == [
        (0.11, "lost", "1 frame of telemetry lost"),
        (0.23, "lost", "3 frames of telemetry lost"),
    ]


def test_board_that_restarts() -> None:
    assert found(series([100, 101, 102, 0, 1, 2])) == [(0.03, "reset", "the board restarted")]
    assert found(series([2**32 - 2, 2**32 - 1, 0, 1])) == [], "its count of ticks rolls over"


def test_faults_touches_and_contacts() -> None:
    """Where they begin; what is so from the start is not told."""
    dead = int(Status.DEAD_MAN)
    late = int(Status.WATCHDOG_RESET)
    status = [late, late, late | dead, late | dead, late, late]
    pressed = [True, False, False, True, True, False]
    contact = [False, True, True, False, False, False]
    assert found(series(list(range(6)), status, pressed, contact)) == [
        (0.01, "contact", "true contact"),
        (0.02, "fault", "motors stopped by the dead-man"),
        (0.03, "touch", "whisker left pressed"),
    ]
    assert found(series(list(range(6)), status, pressed, contact, first=3)) == [
        (0.03, "touch", "whisker left pressed")
    ], "the ticks before were in another chunk"


def test_pins_by_name_on_the_clock_of_the_run() -> None:
    """Of pins that change while the run goes on: those of the servos, and not one that was set before."""
    record, robot = Record(), boebot.load_robot("boebot")
    for time, pin, level in ((0.5, 4, 0), (0.9, 13, 0), (1.25, 13, 1), (1.2515, 13, 0), (1.3, 14, 1)):
        record.append("pins", time, bytes((pin, level)))
    pins = page_data.pins(record.block("pins"), robot, 1.0)
    assert list(pins) == ["13 servo left", "A0 battery"]
    times, levels = pins["13 servo left"]
    assert times == pytest.approx([-0.1, 0.25, 0.2515]) and levels.tolist() == [0, 1, 0]
