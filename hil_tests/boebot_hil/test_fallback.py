"""PROTOCOL.md, Fail-safe, the fallback: the board's own brain drives while the host is silent, if it may."""

from __future__ import annotations

import pytest

from boebot.link import messages
from boebot.link.messages import AnswerStatus, EventKind, Latch, Status
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, FRAME_CYCLES, TICK_S, Rig

pytestmark = [pytest.mark.emulated, pytest.mark.uno(robot="boebot", motors=False)]

LEFT = 13
AFTER_S = 0.4
WAITS_S = 0.5  # stands still when it has taken over (firmware/src/fallback.c)


@pytest.fixture
def rig(rig: Rig) -> Rig:
    """Of a robot with IR pairs and whiskers in an empty field."""
    rig.set("fallback_after", round(1000 * AFTER_S))
    return rig


def be_silent(rig: Rig, seconds: float) -> None:
    rig.alive = rig.acknowledges = False
    rig.listen(seconds)


def drives(rig: Rig) -> bool:
    """There was a pulse within the last two frames."""
    pulses = rig.uno.pin(LEFT).all_pulses()
    return len(pulses) > 0 and bool(pulses[-1, 0] > rig.board.cycle - 2 * FRAME_CYCLES)


@pytest.mark.promise("It takes over only while no set-point is in force, so the dead-man's stop comes first")
@pytest.mark.promise("the event `fallback` reports when it begins and when it ends")
def test_the_dead_mans_stop_comes_first_and_the_host_is_told_of_both(rig: Rig) -> None:
    """The time to live is longer than the silence after which the fallback would take over."""
    rig.set("fallback_after", 100)
    rig.drive(0.5, 0.5, 300)
    begun = rig.board.cycle
    be_silent(rig, 0.9)
    starts = rig.uno.pin(LEFT).all_pulses()[:, 0]
    (gap,) = [place for place in range(len(starts) - 1) if starts[place + 1] - starts[place] > FRAME_CYCLES + 16]
    assert 0.27 < (starts[gap] - begun) / CYCLES_PER_S < 0.33
    assert WAITS_S <= (starts[gap + 1] - starts[gap]) / CYCLES_PER_S < WAITS_S + 0.06
    assert rig.telemetry[-1].status & Status.FALLBACK
    rig.events.clear()
    rig.acknowledges = True
    rig.start(arm=False)
    for _ in range(20):
        rig.listen(TICK_S)
    events = sorted({event.number: event.kind for event in rig.events}.items())
    assert [kind for _, kind in events] == [EventKind.DEAD_MAN, EventKind.FALLBACK, EventKind.LATCH, EventKind.FALLBACK]


@pytest.mark.promise("and hands back at the next: no pulses until a set-point")
def test_it_hands_back_at_the_next_frame_of_the_host(rig: Rig) -> None:
    """In its session the host need not arm; after the session's end it must."""
    be_silent(rig, AFTER_S + WAITS_S + 0.1)
    assert rig.telemetry[-1].status & Status.FALLBACK and drives(rig)
    rig.alive = rig.acknowledges = True
    rig.listen(0.1)
    now = rig.telemetry[-1]
    assert now.status & (Status.FALLBACK | Status.LATCHED) == 0 and now.pulse_left == 0 and not drives(rig)
    rig.drive_for(1.0, 1.0, 0.1)
    assert rig.latest().pulse_left == 1700 * CYCLES_PER_US
    be_silent(rig, 3.0)
    assert drives(rig), "also when the session has ended"
    rig.start(arm=False)
    rig.drive_for(1.0, 1.0, 0.3)
    assert rig.latest().latch == Latch.SESSION_ENDED and not drives(rig)


@pytest.mark.promise("Every latch takes it away, also one that finds the motors latched")
@pytest.mark.parametrize("how", ["stop", "close", "low supply"])
def test_each_latch_takes_its_permission_until_a_host_arms(rig: Rig, how: str) -> None:
    be_silent(rig, AFTER_S + WAITS_S + 0.1)
    assert drives(rig)
    if how == "stop":
        rig.stop()
    elif how == "close":
        rig.send(messages.Close(rig.seed))
    else:
        rig.board.supply(3.5)
        rig.listen(0.2)
        rig.board.supply(None)
    be_silent(rig, 3.0)
    assert not drives(rig)
    rig.start()
    be_silent(rig, AFTER_S + WAITS_S + 0.1)
    assert drives(rig)


@pytest.mark.promise(
    "so does a start with `fallback_at_start` 1 after power or an external reset, never after another reset",
)
@pytest.mark.parametrize("at_start", [False, True])
def test_after_a_reset_it_drives_only_if_that_was_saved_and_nothing_was_wrong(rig: Rig, at_start: bool) -> None:
    rig.set("fallback_at_start", int(at_start))
    assert rig.request(messages.SaveParameters, within_s=1.0).status == AnswerStatus.OK
    for cause in ("watchdog", "brown_out", "external", "power"):
        rig.uno.reset(cause)
        be_silent(rig, 2.0)
        assert drives(rig) == (at_start and cause in ("external", "power")), cause
