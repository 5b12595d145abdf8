"""From set-point to pulse at the pin, and the dead-man."""

from __future__ import annotations

import numpy as np
import pytest

from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S, CYCLES_PER_US, FRAME_CYCLES, Rig
from sim_bridge.bench.uno import Uno

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)

LEFT, RIGHT = 13, 12
EDGE_TOLERANCE = 16  # cycles: 1 us


@pytest.mark.emulated
@pytest.mark.promise(
    "Motor signals: -1 full backward, 0 hold still, +1 full forward.", "servo pulse in force; 0: no pulses"
)
@pytest.mark.parametrize(
    ("left", "right"), [(0.0, 0.0), (1.0, 1.0), (-1.0, -1.0), (0.5, -0.25), (-0.7, 0.7), (0.0625, 0.125)]
)
def test_signal_becomes_pulse_width_at_the_pin(rig: Rig, left: float, right: float) -> None:
    rig.drive_for(left, right, 0.3)
    for pin, signal, mirror in ((LEFT, left, 1), (RIGHT, right, -1)):
        pulses = rig.uno.pin(pin).all_pulses()[1:]
        expected = (1500 + mirror * 200 * signal) * CYCLES_PER_US
        assert len(pulses) >= 10
        assert np.all(np.abs(pulses[:, 1] - expected) <= EDGE_TOLERANCE), (pin, pulses[:, 1] - expected)
        assert np.all(np.abs(np.diff(pulses[:, 0]) - FRAME_CYCLES) <= EDGE_TOLERANCE)
    now = rig.latest()
    assert now.pulse_left == round((1500 + 200 * left) * CYCLES_PER_US)
    assert now.pulse_right == round((1500 - 200 * right) * CYCLES_PER_US)


@pytest.mark.emulated
@pytest.mark.promise("edges of one encoder line in one tick above which the line is masked")
def test_width_holds_while_the_line_is_saturated_and_encoders_fire(rig: Rig) -> None:
    """With a line that is too full and both encoder lines at 1.5 kHz."""
    for pin in (16, 17):
        period = CYCLES_PER_S // 1500 + pin  # not in step with each other or with the tick
        rig.board.square_wave(pin, period, seconds=1.0)
    rig.flood(messages.SetpointSignal(3000, -3000, 250, 0), seconds=0.9)
    for pin, expected in ((LEFT, 1560 * CYCLES_PER_US), (RIGHT, 1560 * CYCLES_PER_US)):
        widths = rig.uno.pin(pin).all_pulses()[3:, 1]
        assert len(widths) >= 35
        assert np.all(np.abs(widths - expected) <= EDGE_TOLERANCE), widths - expected


@pytest.mark.promise("Wheel speeds along the ground, forward positive")
def test_speed_setpoint_scales_with_the_stored_maximum(rig: Rig) -> None:
    maximum = messages.PARAMETERS["wheel_speed_maximum"]
    rig.request(messages.SetParameter, maximum.id, 2000)  # 0.2 m/s at full signal
    for _ in range(5):
        rig.send(messages.SetpointSpeed(1000, -500, 250, rig.tick))
        rig.listen(0.05)
    now = rig.latest()
    assert now.pulse_left == 1600 * CYCLES_PER_US
    assert now.pulse_right == 1550 * CYCLES_PER_US


@pytest.mark.emulated
@pytest.mark.promise(
    "A set-point lives from the start of the tick that it answers for its `time_to_live`",
    "When the set-point in force has outlived itself the motors stop (*dead-man*) until the next valid one",
)
@pytest.mark.parametrize("time_to_live_ms", [60, 250, 1000])
def test_e67_dead_man_stops_the_pulses_after_the_time_to_live(rig: Rig, time_to_live_ms: int) -> None:
    """Sending stops, and with the usual 250 ms to live the motors 270 ms later at the latest: a servo frame more."""
    rig.latest()
    rig.drive(0.5, 0.5, time_to_live_ms)
    sent = rig.transport.now() * CYCLES_PER_S  # at most 3 ms after the start of the tick that it answers
    frames = rig.listen(time_to_live_ms / 1000 + 0.2)
    for pin in (LEFT, RIGHT):
        stopped_after = (rig.uno.pin(pin).all_pulses()[-1].sum() - sent) / CYCLES_PER_S
        assert time_to_live_ms / 1000 - 0.025 <= stopped_after <= time_to_live_ms / 1000 + 0.020
    assert frames[-1].pulse_left == frames[-1].pulse_right == 0
    assert frames[-1].status & messages.Status.DEAD_MAN
    rig.drive(0.5, 0.5)
    rig.listen(0.05)
    now = rig.latest()
    assert now.pulse_left and not now.status & messages.Status.DEAD_MAN, "a fresh set-point ends a dead-man stop"


@pytest.mark.emulated
@pytest.mark.promise("no more pulses, from the next servo frame (20 ms) on. A pulse is sent whole or not at all")
def test_stop_stops_at_once_and_pulses_are_whole(rig: Rig) -> None:
    """The stop comes at 21 phases of the servo frame: no pulse is ever cut."""
    for step in range(21):
        rig.drive(1.0, 1.0, 2000)
        rig.listen(0.06 + step * 0.001)
        rig.send(messages.Stop(step))
        rig.listen(0.045)
        now = rig.latest()
        assert now.pulse_left == now.pulse_right == 0
        assert now.latch == messages.Latch.STOP_COMMAND and now.status & messages.Status.LATCHED
        rig.arm()
    widths = {pin: rig.uno.pin(pin).all_pulses()[:, 1] for pin in (LEFT, RIGHT)}
    assert np.all(np.abs(widths[LEFT] - 1700 * CYCLES_PER_US) <= EDGE_TOLERANCE)
    assert np.all(np.abs(widths[RIGHT] - 1300 * CYCLES_PER_US) <= EDGE_TOLERANCE)


@pytest.mark.emulated
@pytest.mark.promise("a fresh set-point is in force")
def test_no_pulse_before_the_first_setpoint(rig: Rig) -> None:
    rig.listen(0.5)
    assert len(rig.uno.pin(LEFT).all_pulses()) == len(rig.uno.pin(RIGHT).all_pulses()) == 0


@pytest.mark.promise("It is refused when a field is out of range, and while the motors are latched")
@pytest.mark.parametrize("signal", [-10001, 10001, 32767])
def test_setpoint_out_of_range_is_refused(rig: Rig, signal: int) -> None:
    rig.send(messages.SetpointSignal(signal, 0, 250, rig.tick))
    rig.listen(0.05)
    assert rig.latest().pulse_left == 0


@pytest.mark.emulated
@pytest.mark.promise("A latch discards the set-point in force. Only `arm` ends it")
def test_latched_motors_do_not_move_until_they_are_armed(uno: Uno) -> None:
    rig = Rig(uno)
    rig.start(arm=False)
    assert rig.latest().latch == messages.Latch.START
    rig.drive_for(1.0, 1.0, 0.2)
    rig.arm()
    rig.listen(0.1)
    assert len(rig.uno.pin(LEFT).all_pulses()) == 0, "nor by what was sent before"
    rig.drive_for(1.0, 1.0, 0.1)
    rig.stop()
    count = len(rig.uno.pin(LEFT).all_pulses())
    assert count > 0
    rig.drive_for(1.0, 1.0, 0.2)
    assert len(rig.uno.pin(LEFT).all_pulses()) <= count + 1, "the pulse under way is whole, no other follows"


@pytest.mark.promise("`arm` names `latches`, and is refused if there has been another since")
def test_arm_that_does_not_know_of_the_latest_stop_is_refused(rig: Rig) -> None:
    known = rig.latest().latches
    rig.stop()
    answer = rig.request(messages.Arm, known)
    assert answer.status == messages.AnswerStatus.LATCHED_AGAIN
    assert rig.latest().latch == messages.Latch.STOP_COMMAND
    rig.arm()


@pytest.mark.emulated
@pytest.mark.promise("The session ends, and the motors are latched off")
def test_end_of_the_session_stops_and_latches(rig: Rig) -> None:
    rig.drive(0.5, 0.5, 2000)
    rig.listen(0.1)
    rig.send(messages.Close(rig.seed))
    closed_at = rig.board.cycle
    rig.alive = False
    rig.listen(0.2)
    assert (rig.uno.pin(LEFT).all_pulses()[-1].sum() - closed_at) / CYCLES_PER_S < 0.025
    rig.start(arm=False)
    assert rig.latest().latch == messages.Latch.SESSION_ENDED


@pytest.mark.emulated
@pytest.mark.promise("silence of the host after which the session ends and the motors are latched off")
def test_silence_of_the_host_ends_the_session(rig: Rig) -> None:
    """Though the set-point would live on: the board's patience ends first."""
    rig.request(messages.SetParameter, messages.PARAMETERS["session_time_out"].id, 300)
    rig.latest()
    rig.drive(0.5, 0.5, 2000)
    silent_from = rig.transport.now()
    rig.alive = rig.acknowledges = False
    rig.listen(0.6)
    stopped_after = rig.uno.pin(LEFT).all_pulses()[-1].sum() / CYCLES_PER_S - silent_from
    assert 0.28 <= stopped_after <= 0.34


@pytest.mark.emulated
@pytest.mark.promise("the board was reset, or has not heard it. It opens a new one")
def test_reset_in_mid_run_stops_the_motors_and_the_link_comes_back(rig: Rig) -> None:
    for cause in ("external", "brown_out"):
        rig.drive_for(0.5, 0.5, 0.2)
        rig.answers.clear()
        reset_at = rig.board.cycle
        rig.uno.reset(cause)
        hello = rig.wait_for(
            lambda: next((a for a in rig.answers if isinstance(a, messages.Hello)), None),
            1.0,
            "a hello after the reset",
        )
        assert hello.reset_cause == messages.ResetCause[cause.upper()]
        rig.start()
        rig.listen(0.3)
        pulses = rig.uno.pin(LEFT).all_pulses()
        assert np.all(pulses[:, 0] <= reset_at), "a pulse after the reset"
        assert rig.latest().tick < 60
    assert rig.board.cycle > reset_at, "the board's clock goes on across resets"
