"""A board on real buses, at the wall clock's pace: python-can's, and our own that stock tools join."""

from __future__ import annotations

import contextlib
import itertools
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import can
import pytest

import boebot
from boebot.boards import BoardRequest, BoardSession, open_board
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.frame import encode
from boebot.link.link import Link
from boebot.robot import Robot
from boebot.running.loop import execute
from boebot.running.tasks import Request
from boebot_can.bridge import Bridge
from boebot_can.bus import Bus, BusName, PythonCanBus
from boebot_can.frames import CanFrame
from boebot_can.socketcand_server import SocketcandBus
from boebot_can.transport import open_can
from can_line import after, drive
from command import boebot as boebot_command

pytestmark = [pytest.mark.wall_clock, pytest.mark.unsanitized]


class Bridged:
    """A native board on a bus, in a thread of its own.

    Attributes:
        error: what ended the bridge.
        session: of the board; look at it once the thread has ended.
    """

    def __init__(self, bus: Bus | None = None, node: int = 1) -> None:
        """`bus`: None for one of our own."""
        request = BoardRequest(robot=load_robot("shieldbot"), arena="empty", realtime=True)
        self.session: BoardSession = open_board("native", request)
        self.bus = bus or SocketcandBus(0, self.session.transport.now)
        self.url = f"can:{self.bus.name}" + (f"&node={node}" if node > 1 else "")
        self.error: BoardError | None = None
        self.bridge = Bridge(self.session.transport, self.bus, node)
        self.bridge.wait_for_board()
        self._wanted = True
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def end(self) -> None:
        """The bridge ends."""
        self._wanted = False
        self._thread.join(5.0)
        self.bus.close()

    def ended(self) -> BoardError | None:
        """Why it ended by itself, at the latest after 5 s."""
        self._thread.join(5.0)
        return self.error

    def telemetry_afterwards(self) -> messages.Telemetry:
        """What the board says to the next host."""
        link = Link(self.session.transport)
        link.open()
        return after(link, 0.05)

    def _run(self) -> None:
        try:
            self.bridge.run(lambda: self._wanted)
        except BoardError as error:
            self.error = error


@contextlib.contextmanager
def bridged(bus: Bus | None = None, node: int = 1) -> Iterator[Bridged]:
    made = Bridged(bus, node)
    try:
        yield made
    finally:
        made.end()
        made.session.close()


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


def joined(board: Bridged) -> can.BusABC:
    """A stock client on the same bus."""
    assert isinstance(board.bus, SocketcandBus)
    return can.Bus(interface="socketcand", channel="can0", host="localhost", port=board.bus.port)


def test_brain_drives_over_a_bus_that_a_stock_tool_watches() -> None:
    with bridged() as board:
        with joined(board) as watcher:
            result = boebot.run(straight, on=board.url, seconds=1.0)
            seen = []
            while (message := watcher.recv(0.05)) is not None:
                seen.append(message)
        assert result.lost_frames == result.bad_frames == result.overview.dead_man_stops == result.resets == 0
        assert (result.odometry_distance or 0.0) > 0.05
        identifiers = {message.arbitration_id for message in seen}
        assert {0x120, 0x321, 0x32D, 0x621} <= identifiers, "set-points, telemetry, hello"
        stamps = [message.timestamp for message in seen if message.arbitration_id == 0x321]
        ticks = [int.from_bytes(message.data[:4], "little") for message in seen if message.arbitration_id == 0x321]
        assert len(ticks) > 80 and ticks == list(range(ticks[0], ticks[0] + len(ticks))), "none is missing"
        assert stamps == pytest.approx([tick / 100 for tick in ticks], abs=0.25), "simulated time"
        steps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
        assert all(0.005 < step < 0.015 for step in steps), "a tick apart, however busy this computer is"


def test_host_that_vanishes_leaves_no_motor_running() -> None:
    with bridged() as board, joined(board) as watcher:
        with contextlib.closing(open_can(board.url)) as transport:
            link = Link(transport)
            link.open()
            link.arm()
            drive(link, 0.3)
        time.sleep(0.5)  # its set-points live for 0.25 s
        pulses = []
        while (message := watcher.recv(0.0)) is not None:
            if message.arbitration_id == 0x329:
                pulses.append(int.from_bytes(message.data[6:], "little"))
        assert max(pulses) > 24_000 and pulses[-1] == 0


def test_lost_bus_stops_the_motors_and_is_told_at_both_ends() -> None:
    wire = SocketcandBus(0, time.perf_counter)
    until = threading.Event()

    def carry() -> None:
        while not until.is_set():
            wire.receive(0.01)
        wire.close()

    carrier = threading.Thread(target=carry)
    carrier.start()
    threading.Timer(1.0, until.set).start()
    gone = f"the CAN bus {wire.name} has gone: closed by the other side"
    unwritable = f"the CAN bus {wire.name} takes no frames: closed by the other side"
    with bridged(PythonCanBus(BusName.parse(wire.name))) as board:
        result = execute(Request.single(straight, on=board.url, seconds=20))
        for error in (result.error, board.ended()):
            assert str(error) in (gone, unwritable)
        assert (result.odometry_distance or 0.0) > 0.01
        stopped = board.telemetry_afterwards()
        assert stopped.pulse_left == 0 and stopped.latch != messages.Latch.NONE
    carrier.join()


@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        (
            CanFrame(0x329, bytes(8)),
            "another board on {} sends as node 1, too (frame 0x329); expected each board to have a node of its own: "
            "the motors were stopped",
        ),
        (
            CanFrame(0x120, bytes(5)),
            "somebody else uses the board's identifiers on {}: a frame 0x120 with 5 bytes; expected 8; "
            "the motors were stopped",
        ),
    ],
    ids=["two boards of one node", "foreign traffic"],
)
def test_others_with_our_identifiers_stop_the_motors(frame: CanFrame, sentence: str) -> None:
    with bridged() as board, contextlib.closing(open_can(board.url)) as transport:
        link = Link(transport)
        link.open()
        link.arm()
        assert drive(link, 0.3)[-1].pulse_left > 24_000
        with joined(board) as somebody:
            somebody.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=False))
            assert str(board.ended()) == sentence.format(board.bus.name)
        stopped = board.telemetry_afterwards()
        assert stopped.pulse_left == 0 and stopped.latch != messages.Latch.NONE


def test_host_that_another_program_sends_beside_stops_the_motors_and_ends_its_run() -> None:
    """With the host's own session and tick, so that the board obeys."""
    with bridged() as board, joined(board) as somebody:
        sent: list[can.Message] = []

        def beside(robot: Robot) -> None:
            robot.drive(0.5, 0.5)
            while not sent and robot.time > 0.2 and (message := somebody.recv(0.0)) is not None:
                if message.arbitration_id == 0x120:
                    message.data[:4] = bytes.fromhex("78EC78EC")  # -0.5, twice
                    message.data[7] = (message.data[7] + 1) & 0xFF  # the next set-point
                    somebody.send(message)
                    sent.append(message)

        result = execute(Request.single(beside, on=board.url, seconds=5))
        assert str(result.error) == (
            f"another program sends to the board at {board.url}, too (frame 0x120); expected each board to have one "
            "host: the motors were stopped"
        )
        assert result.run_time < 1.0 and board.error is None
        with contextlib.closing(open_can(board.url)) as transport:
            link = Link(transport)
            link.open()
            stopped = after(link, 0.05)
            assert stopped.pulse_left == 0 and stopped.latch == messages.Latch.STOP_COMMAND


def test_host_that_asked_for_a_session_in_vain_harms_no_other_one() -> None:
    """It sees all that the other one sends, and neither of them stops the motors."""
    with (
        bridged() as board,
        contextlib.closing(open_can(board.url)) as transport,
        contextlib.closing(open_can(board.url)) as in_vain,
    ):
        link = Link(transport)
        link.open()
        in_vain.write(b"\0" + encode(messages.Open.ID, 0, messages.Open(messages.PROTOCOL_VERSION, 1, 6).pack()))
        link.arm()
        seen = drive(link, 0.2)
        while in_vain.read(0.0):
            pass
        seen += drive(link, 0.1)
        assert seen[-1].latch == messages.Latch.NONE and seen[-1].pulse_left > 24_000 and board.error is None


def test_what_an_interface_brings_back_is_not_of_another_program() -> None:
    name = "virtual:mirror?receive_own_messages=true"
    with bridged(PythonCanBus(BusName.parse(name))) as board:
        result = boebot.run(straight, on=f"can:{name}", seconds=0.3)
        assert board.error is result.error is None and result.resets == 0 and result.steps > 0


def test_board_with_a_number_that_is_taken_does_not_join() -> None:
    name = BusName.parse("virtual:twins")
    with bridged(PythonCanBus(name)) as first, contextlib.closing(PythonCanBus(name)) as bus:
        with pytest.raises(BoardError, match="another board on virtual:twins sends as node 1, too"):
            Bridge(first.session.transport, bus, 1).listen()
        Bridge(first.session.transport, bus, 2).listen()
        assert first.error is None, "nothing was sent"


def test_bus_without_acknowledgement_stops_the_motors() -> None:
    with (
        bridged(PythonCanBus(BusName.parse("virtual:silent"))) as board,
        contextlib.closing(open_can(board.url)) as transport,
    ):
        link = Link(transport)
        link.open()
        link.arm()
        drive(link, 0.2)
        with can.Bus(interface="virtual", channel="silent") as wire:
            wire.send(can.Message(arbitration_id=0x20, is_error_frame=True, data=bytes(8)))
            assert str(board.ended()) == (
                "nobody acknowledges frames on the CAN bus virtual:silent; expected another node, at its bit rate"
            )
        assert board.telemetry_afterwards().pulse_left == 0


def test_two_robots_on_one_bus() -> None:
    with bridged() as first:
        assert isinstance(first.bus, SocketcandBus)
        name = BusName.parse(f"socketcand:can0?port={first.bus.port}")
        with bridged(PythonCanBus(name), node=2) as second:
            links = [Link(open_can(board.url)) for board in (first, second)]
            for link, speed in zip(links, (0.2, 0.8), strict=True):
                link.open()
                link.arm()
                seen = drive(link, 0.3, speed, speed)
                assert seen[-1].pulse_left == pytest.approx(24_000 + 3200 * speed, abs=1)
            with joined(first) as anybody:
                anybody.send(can.Message(arbitration_id=0x002, data=[9], is_extended_id=False))
            for link in links:
                assert after(link, 0.1).latch == messages.Latch.STOP_COMMAND, "a stop for all nodes"
                link.close()
                link.transport.close()
        assert first.error is None and second.error is None


def test_multicast_stays_on_this_computer_and_brings_no_echo() -> None:
    name = BusName.parse("udp_multicast:239.74.163.2?port=43119")
    try:
        bus = PythonCanBus(name)
        bus.send([CanFrame(0x7F0, b"")], 0.0)
    except BoardError as error:
        pytest.skip(f"no multicast on this machine: {error}")
    with bridged(bus) as board:
        result = boebot.run(straight, on=board.url, seconds=0.5)
        assert result.resets == 0 and (result.odometry_distance or 0.0) > 0.02
        assert board.error is None, "its own frames would be those of another board"


def test_command_puts_a_board_on_a_bus_and_says_what_it_carried(capsys: pytest.CaptureFixture[str]) -> None:
    command = [sys.executable, "-m", "boebot", "can", "bridge", "native", "--socketcand", "0", "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            url = json.loads(process.stdout.readline())["url"]
            with contextlib.closing(open_can(url)) as transport:
                link = Link(transport)
                link.open()
                assert transport.figures()["bus_error_frames"] == 0
                link.close()
            code, examined, _ = boebot_command(capsys, "doctor", url, "--json")
            assert code == 0, examined
            code, told, _ = boebot_command(capsys, "doctor", url, "--watch", "--seconds", "1", "--json")
            assert code == 0 and 0.14 < json.loads(told)["bus_load"] < 0.25, "telemetry alone takes 16 %"
            assert json.loads(told)["bus_error_frames"] == 0
        finally:
            process.terminate()
        carried = json.loads(process.stdout.readline())
    assert carried["from_board"] > 10 and carried["to_board"] >= 1 and carried["dropped"] == 0
