"""A board behind a real pseudo-terminal, at the wall clock's pace: what a serial port does to a run."""

from __future__ import annotations

import sys
import threading
import time

import pytest

import boebot
from boebot.errors import BoardError
from boebot.link.session import Link
from boebot.link.transport import SerialTransport
from boebot.robot import Robot
from boebot.runner import execute
from peer import Peer, Pty, pty

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


def test_run_over_a_port() -> None:
    with pty(Peer()) as served:
        result = boebot.run(straight, on=served.path, seconds=1.0)
        assert served.peer.command == (0.0, 0.0), "the motors are stopped at the end"
    assert result.truth is None and result.contacts == 0
    assert result.lost_frames == result.bad_frames == result.dead_man_stops == 0
    assert 0.9 < result.wall_time < 2.0
    assert result.distance > 0.05, "by odometry"


def test_leftovers_of_an_earlier_run_do_no_harm() -> None:
    with pty(Peer()) as served:
        time.sleep(0.3)  # telemetry heaps up that nobody reads
        result = boebot.run(straight, on=served.path, seconds=0.3)
    assert result.lost_frames == result.bad_frames == result.resets == 0


def test_port_that_vanishes_in_mid_run() -> None:
    served = Pty(Peer())
    threading.Timer(0.5, served.unplug).start()
    result = execute(straight, on=served.path, seconds=20)
    assert isinstance(result.error, BoardError)
    assert str(result.error) == f"{served.path} has gone: unplugged, or closed by the other side"
    assert result.ticks > 10 and len(result.series.time) == result.ticks


def test_late_brain_skips_steps_and_says_so() -> None:
    def slow(robot: Robot) -> None:
        robot.drive(0.1, 0.1)
        if robot.time < 0.1:
            time.sleep(0.25)

    with pty(Peer()) as served:
        result = boebot.run(slow, on=served.path, seconds=0.8)
    assert result.late_steps >= 3
    assert result.steps + result.late_steps >= 14


def test_silent_port_is_given_up_in_time() -> None:
    peer = Peer()
    peer.answers = False
    peer.reset()
    peer.tick = lambda: b""  # type: ignore[method-assign]
    with pty(peer) as served:
        transport = SerialTransport(served.path)
        with pytest.raises(BoardError, match=r"nothing answers at .* within 0\.5 s: is the robot on and flashed"):
            Link(transport).handshake(timeout_s=0.5)
        transport.close()


def test_request_round_trip_is_quick() -> None:
    with pty(Peer()) as served:
        link = Link(SerialTransport(served.path))
        link.handshake()
        begun = time.perf_counter()
        for _ in range(20):
            link.get_parameter("infrared_period")
        assert (time.perf_counter() - begun) / 20 < 0.02
        link.transport.close()
