"""The stream of a record that holds the output edges of an emulated board's pins."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.errors import BoebotError
from boebot.record.record import Record
from boebot.running.again import again, recorded
from sim_bridge import pins

LEFT_SERVO, HIGH = 13, 1
EDGE = np.dtype([("pin", "u1"), ("level", "u1")])


def edges_of(record: Record, pin: int) -> list[tuple[float, int]]:
    """Time (s) and level of each edge of a pin."""
    rows = record.table("pins", EDGE)
    times = record.times_of("pins")
    assert len(times) == len(rows) and np.all(np.diff(times) >= 0)
    mine = rows["pin"] == pin
    return list(zip(times[mine].tolist(), rows["level"][mine].tolist(), strict=True))


@pytest.mark.parametrize("on", ["native", "avr"])
def test_servo_pulses_are_recorded(on: str) -> None:
    result = boebot.run(lambda robot: robot.drive(0.3, -0.3), on=on, arena="empty", seconds=0.6, pins=True)
    edges = edges_of(result.record, LEFT_SERVO)
    pulses = [(one[0], other[0] - one[0]) for one, other in itertools.pairwise(edges) if one[1] == HIGH]
    late = [length for begin, length in pulses if begin > result.clock_offset + 0.2]
    expected_us = result.series.number("servo_left", "pulse")[-1]
    assert len(late) >= 18 and np.allclose(np.array(late) * 1e6, expected_us, atol=1.0)
    assert np.allclose(np.diff([begin for begin, _ in pulses]), 0.02, atol=1e-5)


def test_no_edge_is_lost_between_two_drains(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the simulator keeps few of them."""

    def record() -> Record:
        return boebot.run("wander", seconds=2, pins=True).record

    whole = record()
    monkeypatch.setattr(pins, "EDGES_KEPT", 512)
    assert record().rows("pins") == whole.rows("pins") and whole.count("pins") > 1024
    assert boebot.run("wander", seconds=0.5).record.count("pins") == 0


def test_several_robots_and_repetition(tmp_path: Path) -> None:
    members = [boebot.Member(robot="shieldbot"), boebot.Member(robot="arsim", pose=(2.0, 1.5, 0.0))]
    result = boebot.run_together(members, "empty", seconds=0.5, pins=True, out=tmp_path)
    assert result.robots[0].record.count("pins") > 20 and result.robots[1].record.count("pins") == 0
    assert again(recorded(tmp_path)).is_equal


@pytest.mark.parametrize(("on", "robot"), [("/dev/ttyACM0", "shieldbot"), (None, "arsim")])
def test_other_pins_are_refused(on: str | None, robot: str) -> None:
    with pytest.raises(BoebotError, match="cannot be recorded; expected an emulated board"):
        boebot.run("wander", robot, on=on, pins=True)
