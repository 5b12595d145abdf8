"""The board's own brain in its world: it wanders while the host is silent, and gives way when it speaks."""

from __future__ import annotations

import numpy as np
import pytest

from boebot.arenas import load_arena
from boebot.description.robots import load_robot
from boebot.link import messages
from boebot.link.messages import Status
from boebot_hil.rig import CYCLES_PER_US, FRAME_CYCLES
from sim_bridge.tests.circle.circle import arena_of, circle
from sim_bridge.tests.rigs import SessionRig

pytestmark = pytest.mark.unsanitized

LEFT, RIGHT = 13, 12
AFTER_MS = 400
WHISKER = 5
START = (-0.9, -0.8, 0.4)  # in the room
SLOW_US = 75  # three eighths of the full signal
AFTER_S, WAITS_S = AFTER_MS / 1000, 0.5
FORWARD = ((1500 + SLOW_US) * CYCLES_PER_US, (1500 - SLOW_US) * CYCLES_PER_US)
SPEED_M_S = 0.1  # about: the servos' curve and the pack's voltage say more
DEVICES = sum(bit for bit, device in messages.DEVICE_OF_BIT.items() if load_robot("boebot").has(device))


def be_silent(rig: SessionRig, seconds: float) -> None:
    rig.alive = rig.acknowledges = False
    rig.listen(seconds)


def switch_on(rig: SessionRig, after_ms: int = AFTER_MS) -> None:
    rig.set("fallback_after", after_ms)


# ---- what it does ----------------------------------------------------------------------------------------------------


def test_it_wanders_through_the_room_and_touches_nothing(board_url: str) -> None:
    """The IR pairs see each wall before a whisker or the body touches it; nothing there is low or dark."""
    with circle(board_url, load_arena("room"), pose=START) as rig:
        switch_on(rig)
        begun = rig.robot.body().distance
        be_silent(rig, 60.0)
        assert rig.robot.true_contacts == 0
        assert rig.robot.body().distance - begun > 0.5 * 60 * SPEED_M_S, "half of the time, at least, it drives ahead"
        assert rig.pulses(LEFT)[-1, 0] > rig.board.cycle - 2 * FRAME_CYCLES, "and does so to the end"


def test_with_whiskers_alone_it_pushes_against_nothing(board_url: str) -> None:
    """Its whiskers feel what is ahead; behind it is blind, and goes back for half a second at most. So it is never in
    contact for a second without getting anywhere. It may slide along a wall, beside its whiskers."""
    with circle(board_url, load_arena("room"), pose=START) as rig:
        rig.set("devices", DEVICES & ~messages.Devices.INFRARED)
        switch_on(rig)
        be_silent(rig, 0.0)
        steps = []
        for _ in range(600):
            rig.listen(0.1)
            body = rig.robot.body()
            steps.append((body.x, body.y, float(body.touching)))
        x, y, touching = np.array(steps).T
        moved = np.hypot(x[10:] - x[:-10], y[10:] - y[:-10])
        always = np.convolve(touching, np.ones(11), "valid") > 10
        assert not np.any(always & (moved < 0.02)), "it pushes"
        assert touching.mean() < 0.1
        assert rig.robot.body().distance > 0.5 * 60 * SPEED_M_S


def test_it_waits_first_whatever_is_touched(board_url: str) -> None:
    with circle(board_url, arena_of()) as rig:
        rig.board.drive(WHISKER, 0)
        switch_on(rig)
        be_silent(rig, AFTER_S + 0.8 * WAITS_S)
        assert rig.telemetry[-1].status & Status.FALLBACK and len(rig.pulses(LEFT)) == 0
        be_silent(rig, 0.4 * WAITS_S)
        assert rig.telemetry[-1].pulse_left == (1500 - SLOW_US) * CYCLES_PER_US, "it goes back"


def pulses_of_a_run(url: str, pose: tuple[float, float, float], seconds: float) -> list[np.ndarray]:
    """Of each wheel: starts, from the left one's first, and widths."""
    with circle(url, load_arena("room"), pose=pose) as rig:
        switch_on(rig)
        be_silent(rig, seconds)
        wheels = [rig.pulses(pin) for pin in (LEFT, RIGHT)]
    return [pulses - np.array([wheels[0][0, 0], 0]) for pulses in wheels]


def test_native_and_avr_board_give_the_same_pulses() -> None:
    """For 15 s with two walls. Not for ever: the pulses are equal to 1 us, until a reading comes out differently."""
    native, avr = (pulses_of_a_run(url, (0.0, 0.9, 1.2), 15.0) for url in ("native", "avr"))
    for ours, theirs in zip(native, avr, strict=True):
        assert ours.shape == theirs.shape and len(ours) > 650
        assert np.abs(ours - theirs).max() <= CYCLES_PER_US
    right = native[1]
    turns = right[:, 1] > 1500 * CYCLES_PER_US  # to the right
    assert np.count_nonzero(np.diff(turns.astype(int)) == 1) >= 2


# ---- when it drives --------------------------------------------------------------------------------------------------
