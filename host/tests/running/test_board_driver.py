"""A board behind a real pseudo-terminal, at the wall clock's pace: what a serial port does to a run."""

from __future__ import annotations

import contextlib
import fcntl
import socket
import struct
import sys
import threading
import time

import pytest

import boebot
from boebot.errors import BoardError
from boebot.link.link import Link
from boebot.link.ports import open_serial
from boebot.robot import Robot
from boebot.running.loop import execute
from boebot.running.tasks import Request
from lines import line
from peer import Peer, Pty, pty

pytestmark = [
    pytest.mark.wall_clock,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


def test_run_over_a_port() -> None:
    with pty(Peer()) as served:
        result = boebot.run(straight, on=served.path, seconds=1.0)
        assert served.peer.command == (0.0, 0.0), "the motors are stopped at the end"
    assert result.truth is None and result.true_contacts is None and result.whisker_touches == 0
    assert result.lost_frames == result.bad_frames == result.overview.dead_man_stops == 0
    assert 0.5 < (result.wall_time or 0.0) < 2.0, "at the pace of the board, which catches up"
    assert result.true_distance is None and (result.odometry_distance or 0.0) > 0.05


def test_leftovers_of_an_earlier_run_do_no_harm() -> None:
    with pty(Peer()) as served:
        time.sleep(0.3)  # unread telemetry heaps up
        result = boebot.run(straight, on=served.path, seconds=0.3)
    assert result.lost_frames == result.bad_frames == result.resets == 0


def test_port_that_vanishes_in_mid_run() -> None:
    served = Pty(Peer())
    threading.Timer(0.5, served.unplug).start()
    result = execute(Request.single(straight, on=served.path, seconds=20))
    assert isinstance(result.error, BoardError)
    assert str(result.error) == f"{served.path} has gone: unplugged, or closed by the other side"
    assert result.record.ticks > 10 and len(result.series.time) == result.record.ticks


def test_late_brain_skips_steps_and_says_so() -> None:
    def slow(robot: Robot) -> None:
        robot.drive(0.1, 0.1)
        if robot.time < 0.1:
            time.sleep(0.25)

    with pty(Peer()) as served:
        result = boebot.run(slow, on=served.path, seconds=0.8, step_timeout=10)
    assert (result.late_steps or 0) >= 3
    assert result.steps + (result.late_steps or 0) >= 14


def test_silent_port_is_given_up_in_time() -> None:
    with line() as board:
        transport = open_serial(board.path, 500_000)
        begun = time.perf_counter()
        with pytest.raises(BoardError, match=r"nothing answers at .* within 4 s: is the robot on and flashed"):
            Link(transport).open()
        assert time.perf_counter() - begun < 10
        transport.close()


class RatedPty(Pty):
    """A board whose line has one bit rate: at any other, both sides get garbage."""

    def __init__(self, peer: Peer, rate: int) -> None:
        self.rate = rate
        self.took = peer.take
        peer.take = self.take_garbled  # type: ignore[method-assign]
        super().__init__(peer)
        self._receive = peer.receive
        peer.receive = self.receive_garbled  # type: ignore[method-assign]

    def at_its_rate(self) -> bool:
        settings = bytearray(44)  # struct termios2
        fcntl.ioctl(self._slave, 0x802C542A, settings)
        return bool(struct.unpack_from("I", settings, 40)[0] == self.rate)

    def take_garbled(self) -> list[bytes]:
        frames = self.took()
        return frames if self.at_its_rate() else [bytes(byte & 0xAA | 0x11 for byte in frame) for frame in frames]

    def receive_garbled(self, data: bytes) -> None:
        self._receive(data if self.at_its_rate() else bytes(byte & 0xAA for byte in data))


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux for the rate")
@pytest.mark.parametrize("rate", [9_600, 115_200, 250_000, 1_000_000])
def test_rate_is_found_on_the_port_itself(rate: int) -> None:
    served = RatedPty(Peer(), rate)
    transport = open_serial(served.path, 500_000)
    link = Link(transport)
    link.open()
    assert transport.baud == rate and served.at_its_rate()
    transport.close()
    served.unplug()


def test_run_over_tcp() -> None:
    """A pty's bytes carried over a socket, as `boebot serve --tcp` or a network adapter would."""
    with pty(Peer()) as served, socket.create_server(("127.0.0.1", 0)) as server:
        inner = open_serial(served.path, 500_000)

        def carry() -> None:
            connection, _ = server.accept()
            connection.setblocking(False)
            with contextlib.suppress(OSError, BoardError):
                while True:
                    connection.sendall(inner.read(0.002))
                    with contextlib.suppress(BlockingIOError):
                        data = connection.recv(4096)
                        if not data:
                            return
                        inner.write(data)

        carrier = threading.Thread(target=carry)
        carrier.start()
        result = boebot.run(straight, on=f"socket://127.0.0.1:{server.getsockname()[1]}", seconds=0.5)
        carrier.join(5)
        inner.close()
    assert result.lost_frames == result.bad_frames == 0 and (result.odometry_distance or 0.0) > 0.02
