"""PROTOCOL.md, Fail-safe: what latches the motors, what a set-point must be to move them, and what a stop stops."""

from __future__ import annotations

import pytest

from boebot.link import messages
from boebot.link.messages import AnswerStatus, Latch, Status
from boebot_hil.rig import TICK_S, Rig
from sim_bridge.bench.uno import Uno

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)

LEFT, TURRET, BUZZER = 13, 11, 4
FULL, HALF = 27_200, 25_600  # pulses of the left servo, in 1/16 us


@pytest.mark.promise("the first cause stays in `latch`, `latches` counts all")
def test_the_first_cause_of_a_latch_stays(rig: Rig) -> None:
    rig.arm()
    before = rig.latest().latches
    rig.stop()
    rig.stop()
    rig.send(messages.Close(rig.seed))
    rig.start(arm=False)
    now = rig.latest()
    assert (now.latch, (now.latches - before) & 0xFF) == (Latch.STOP_COMMAND, 2)
    assert now.status & Status.LATCHED


@pytest.mark.promise(
    "when a set-point is in force that answers a later tick, or the same tick with the same or a later sequence number",
)
@pytest.mark.promise(
    "the one in which the motors were armed, or than that of the last set-point that has outlived itself",
)
def test_set_points_that_were_overtaken_are_late(rig: Rig) -> None:
    rig.stop()
    before = rig.signal(1.0, 1.0, 2000)
    rig.arm()
    rig.send(before)
    assert rig.latest().pulse_left == 0
    first = rig.encode(rig.signal(1.0, 1.0, 2000))
    second = rig.encode(rig.signal(0.5, 0.5, 100))
    rig.transport.write(second + first + second)
    assert rig.latest().pulse_left == HALF
    outlived = rig.tick
    rig.listen(0.2)
    assert rig.latest().status & Status.DEAD_MAN
    rig.send(messages.SetpointSignal(10_000, 10_000, 2000, (outlived - 4) & 0xFFFF))
    assert rig.latest().pulse_left == 0
    rig.drive(1.0, 1.0)
    rig.listen(0.03)
    assert rig.latest().pulse_left == FULL


@pytest.mark.emulated
@pytest.mark.promise(
    "when two measurements in a row (one per tick) were below `supply_minimum`, until one is 0.1 V above it",
)
@pytest.mark.promise("The motors are *latched* off at start, by `stop`, at the end of a session, and by a low supply")
@pytest.mark.promise("While the supply is low or not yet measured it is refused too")
def test_a_low_supply_latches_and_keeps_the_motors_from_being_armed(rig: Rig) -> None:
    rig.set("supply_minimum", 4500)
    rig.arm()
    rig.drive(1.0, 1.0, 2000)
    rig.listen(0.05)
    for low_s in (0.4 * TICK_S, 0.9 * TICK_S):  # one measurement at most
        rig.board.supply(4.3)
        rig.listen(low_s)
        rig.board.supply(5.0)
        rig.listen(0.1)
        assert rig.latest().latch == Latch.NONE
    rig.board.supply(4.3)
    rig.listen(4 * TICK_S)
    for volts, is_low in ((4.3, True), (4.55, True), (4.7, False), (4.55, False)):
        rig.board.supply(volts)
        now = rig.latest()
        assert (now.latch, now.pulse_left) == (Latch.SUPPLY_LOW, 0)
        assert bool(now.status & Status.SUPPLY_LOW) == is_low, volts
        if is_low:
            assert rig.request(messages.Arm, now.latches).status == AnswerStatus.SUPPLY_LOW
    rig.arm()


@pytest.mark.emulated
@pytest.mark.promise(
    "Whatever stops the motors, latch or dead-man, releases the turret (no pulses) and silences the buzzer"
)
@pytest.mark.promise("While latched `turret` is refused, unless it releases; `buzzer` is not: it moves nothing")
@pytest.mark.parametrize("how", ["stop", "dead-man", "close"])
@pytest.mark.uno(robot="boebot")
def test_what_stops_the_motors_stops_turret_and_buzzer(uno: Uno, how: str) -> None:
    rig = Rig(uno)
    rig.start(arm=False)
    rig.send(messages.Turret(3000, 1))
    rig.send(messages.Buzzer(1000, 10, 1))
    assert rig.devices(after_s=0.05).turret_pulse == 0
    assert rig.devices().buzzer_token == 1 and len(rig.uno.pin(BUZZER).all_pulses()) > 30
    rig.arm()
    rig.drive(0.5, 0.5, 100)
    rig.send(messages.Turret(3000, 1))
    rig.send(messages.Buzzer(1000, 250, 2))
    assert rig.devices(after_s=0.05).turret_pulse > 0
    if how == "stop":
        rig.stop()
    elif how == "close":
        rig.alive = False
        rig.send(messages.Close(rig.seed))
    rig.listen(0.1)
    stopped = rig.board.cycle
    rig.listen(0.3)
    for pin in (TURRET, BUZZER):
        pulses = rig.uno.pin(pin).all_pulses()
        assert len(pulses) and pulses[-1, 0] < stopped, pin
