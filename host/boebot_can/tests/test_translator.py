"""The link over CAN frames, in simulated time, and what it takes: frames, both ends, load, names, database."""

from __future__ import annotations

import contextlib
import random
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import cantools.database
import pytest

from boebot.boards import BoardRequest, BoardSession, open_board
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import messages
from boebot.link.frame import encode, text
from boebot.link.link import Link
from boebot_can.bus import BusName, PythonCanBus
from boebot_can.frames import Assembler, CanFrame, ForeignFrameError, FrameMaker, whole_tick
from boebot_can.iso_tp import LongMessages
from boebot_can.load import BusLoad, frame_bits
from boebot_can.transport import open_can
from can_line import CanLine, Carry, after, drive
from command import boebot


@contextmanager
def over_can(carry: Carry = lambda frame: [frame], node: int = 1) -> Iterator[tuple[Link, CanLine, BoardSession]]:
    """A link to a native board, over CAN frames."""
    session = open_board("native", BoardRequest(robot=load_robot("shieldbot"), arena="empty", record=False))
    line = CanLine(session.transport, node, carry)
    try:
        link = Link(line)
        link.open()
        yield link, line, session
    finally:
        session.close()


def test_everything_that_the_link_does_goes_over_can() -> None:
    with over_can(node=5) as (link, line, _):
        assert text(link.identity().pin_map) == "shieldbot", "longer than CAN frames"
        assert link.parameters.get("ping_period") == 5
        link.arm()
        seen = drive(link, 1.0)
        assert seen[-1].encoder_left > 30 and seen[-1].encoder_right > 30
        assert link.stop_and_confirm()
        assert seen[-1].setpoint_sequence != seen[0].setpoint_sequence, "the board names the host's own numbers"
        link.close()
        assert {frame.identifier >> 5 & 7 for frame in line.seen} == {5}
        assert line.host_end.assembler.lost == line.board_end.assembler.lost == line.host_end.stale == 0
        counted = link.counters()
        assert counted.lost == counted.bad == counted.sessions_lost == 0


def test_set_point_outlives_no_more_than_on_the_line() -> None:
    """The dead-man: no set-points for longer than their time to live."""
    with over_can() as (link, _, _):
        link.arm()
        drive(link, 0.3)
        alive = after(link, 0.22)
        assert alive.pulse_left != 0
        late = after(link, 0.08)
        assert late.pulse_left == 0 and late.status & messages.Status.DEAD_MAN


def test_lost_frames_are_counted_and_harm_nothing_else() -> None:
    draw = random.Random("lost frames")
    with over_can(lambda frame: [] if draw.random() < 0.02 else [frame]) as (link, line, _):
        link.arm()
        seen = drive(link, 5.0)
        lost = link.counters().lost
        assert lost >= 20 and link.counts.sessions == 1
        assert lost == line.host_end.assembler.lost, "a message of which a part is missing is a gap for the link"
        ticks = [telemetry.tick for telemetry in seen]
        assert ticks == sorted(set(ticks)) and len(seen) > 350
        assert link.parameters.get("ping_period") == 5


def test_frames_of_another_session_are_dropped() -> None:
    with over_can() as (link, line, session):
        link.arm()
        drive(link, 0.3)
        (old,) = [frame for frame in line.seen if frame.identifier >> 8 == 1][-1:]
        for _ in range(3):  # the byte of a new session may by chance be that of the old one
            link.close()
            link.open()
            if line.board_end.session & 0xFF != old.data[6]:
                break
        link.arm()
        telemetry = drive(link, 0.2, 0.0, 0.0)[-1]
        before = line.board_end.stale
        fresh = old._replace(data=old.data[:5] + bytes([telemetry.tick & 0xFF]) + old.data[6:])
        assert line.board_end.to_board(fresh) == b"" and line.board_end.stale == before + 1
        own = fresh._replace(data=fresh.data[:6] + bytes([line.board_end.session & 0xFF, fresh.data[7]]))
        assert line.board_end.to_board(own) != b"", "the session's byte alone made the difference"
        del session


def test_stop_reaches_the_board_also_as_one_for_all_nodes() -> None:
    with over_can(node=3) as (link, line, session):
        link.arm()
        drive(link, 0.3)
        assert not line.board_end.assembler.takes(0x100), "a set-point is never for all"
        assert line.board_end.assembler.takes(0x002)
        session.transport.write(line.board_end.to_board(CanFrame(0x002, b"\x07")))
        assert after(link, 0.05).latch == messages.Latch.STOP_COMMAND


@pytest.mark.parametrize(("wanted_ms", "carried_ms"), [(0, 0), (1, 10), (9, 10), (10, 10), (259, 250), (2000, 2000)])
def test_time_to_live_is_never_longer_than_wanted(wanted_ms: int, carried_ms: int) -> None:
    payload = messages.SetpointCoast(wanted_ms, 1000).pack()
    (frame,) = FrameMaker(1).frames(messages.SetpointCoast.ID, payload, 0x1234, 9)
    message = Assembler(True, frozenset({1})).add(frame)
    assert message is not None and message.sequence == 9 and message.session == 0x34
    assert messages.SetpointCoast.unpack(message.payload).time_to_live == carried_ms


@pytest.mark.parametrize("newest", [0, 200, 255, 256, 65_535, 65_536, 65_791, 2**32 - 1])
@pytest.mark.parametrize("age", [0, 1, 128, 255])
def test_tick_is_the_latest_up_to_the_newest(newest: int, age: int) -> None:
    answered = newest - age & 0xFFFF
    carried = messages.SetpointCoast(100, answered & 0xFF).pack()
    assert messages.SetpointCoast.unpack(whole_tick(carried, newest)).answers_tick == answered


def test_part_of_another_message_completes_none() -> None:
    maker, assembler = FrameMaker(1), Assembler(False, frozenset({1}))
    first, second = (maker.frames(messages.Telemetry.ID, bytes([tick] * 39), 1, 0) for tick in (1, 2))
    assert [assembler.add(frame) for frame in (*first[:3], *second[3:])] == [None] * 7
    assert assembler.lost == 1
    assert assembler.add(first[6]) is None, "alone"
    complete = [assembler.add(frame) for frame in second]
    assert complete[-1] is not None and complete[-1].payload == bytes([2] * 39)


@pytest.mark.parametrize(
    ("frame", "sentence"),
    [
        (CanFrame(0x321, bytes(7)), "a frame 0x321 with 7 bytes; expected 8"),
        (CanFrame(0x323, bytes([0, 3, 0, 0, 0, 0])), "a frame 0x323 that calls itself part 3; expected 2"),
    ],
)
def test_foreign_frame_is_told(frame: CanFrame, sentence: str) -> None:
    with pytest.raises(ForeignFrameError, match=sentence):
        Assembler(False, frozenset({1})).add(frame)


def test_set_points_are_withheld_while_the_bus_is_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is 256 ticks old would look fresh: a tick is one byte."""
    clock = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: clock[0])
    transport = open_can("can:virtual:ahead")
    wire = PythonCanBus(BusName.parse("virtual:ahead"))
    set_point = encode(messages.SetpointCoast.ID, 0, messages.SetpointCoast(100, 1).pack(), 5)
    stop = encode(messages.Stop.ID, 1, messages.Stop(7).pack(), 5)
    with contextlib.closing(wire), contextlib.closing(transport):
        transport.write(b"\0" + encode(messages.Open.ID, 0, messages.Open(messages.PROTOCOL_VERSION, 0, 5).pack()))
        assert [frame.identifier for frame in wire.receive(0.0)] == [0x620]
        for seconds, arriving in ((0.0, [0x124, 0x022]), (1.1, [0x022])):
            clock[0] = seconds
            transport.write(set_point + stop)
            assert [frame.identifier for frame in wire.receive(0.0)] == arriving
        assert transport.figures()["bus_stale_messages"] == 1
        transport.read(0.0)
        transport.write(set_point)
        assert len(wire.receive(0.0)) == 1, "nothing waits any more"


def test_broken_long_messages_are_counted_and_say_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    """What nobody reads from standard error would stop the bridge."""
    answers: list[CanFrame] = []
    long = LongMessages(1, answers.append, at_board=True)
    for _ in range(3):
        assert long.receive(CanFrame(0x53E, bytes([0x10, 20, 1, 2, 3, 4, 5, 6]))) == [], "the rest never comes"
    assert long.failed == 2 and len(answers) == 3
    assert capfd.readouterr() == ("", "")


def test_load_is_the_share_of_the_last_second() -> None:
    load, frame = BusLoad(500_000), CanFrame(0x123, bytes(8))
    assert load.share(0.0) is None
    for i in range(200):
        load.add(i / 100, frame)
    assert load.share(2.0) == pytest.approx(100 * frame_bits(frame) / 500_000, rel=0.02)
    assert load.share(4.0) == 0.0


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("can0", "'can0' names no CAN bus; expected INTERFACE:CHANNEL, as in socketcan:can0 or virtual:lab"),
        ("socketcam:can0", "python-can knows no interface 'socketcam'; did you mean 'socketcan'?"),
        ("virtual:x?", ""),
        ("virtual:x?node", "'virtual:x?node' has the setting 'node'; expected KEY=VALUE"),
        ("virtual:x?node=8", "there is no node 8 on a CAN bus; expected 1 to 7"),
        ("virtual:x?node=two", "there is no node 'two' on a CAN bus; expected 1 to 7"),
        ("socketcand:can0", "'socketcand:can0' names no port; expected socketcand:CHANNEL?host=HOST&port=PORT"),
        ("socketcand:can0?port=1", "the CAN bus socketcand:can0?port=1 cannot be joined: nobody listens there"),
        ("socketcan:no_such", "the CAN bus socketcan:no_such cannot be joined: "),
    ],
)
def test_name_that_leads_to_no_bus_is_one_sentence(name: str, sentence: str) -> None:
    if not sentence:
        open_can(f"can:{name}").close()
        return
    with pytest.raises(BoardError) as told:
        open_can(f"can:{name}")
    assert str(told.value).startswith(sentence) and "\n" not in str(told.value)


def test_port_that_does_not_greet_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boebot_can.bus.CONNECT_S", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        name = f"socketcand:can0?host=127.0.0.1&port={silent.getsockname()[1]}"
        with pytest.raises(BoardError, match="cannot be joined: no answer in time"):
            PythonCanBus(BusName.parse(name))


def test_settings_of_a_bus_reach_its_interface() -> None:
    name = BusName.parse("socketcand:can0?host=::1&port=29536&tcp_tune=true")
    assert name.settings == {"host": "::1", "port": 29536, "tcp_tune": True}
    bus = PythonCanBus(BusName.parse("virtual:settings?receive_own_messages=true"))
    bus.send([CanFrame(0x7FF, b"own")], 0.0)
    assert bus._bus.recv(0.1).data == b"own"
    bus.send([CanFrame(0x7FF, b"own")], 0.0)
    assert bus.receive(0.1) == [], "what comes back is not of others"
    bus.close()


def test_nothing_of_can_is_imported_before_it_is_used() -> None:
    lines = "import sys, boebot.cli, boebot.boards, boebot_can.command, boebot_can.bridge, boebot_can.transport\n"
    lines += "print(*{'can', 'isotp', 'cantools', 'msgpack'} & set(sys.modules))"
    ended = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == ""


def test_without_its_packages_one_sentence_says_so(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "can", None)
    code, _, err = boebot(capsys, "run", "wander", "--on", "can:virtual:x", "--seconds", "1")
    assert code == 1
    assert err == "boebot: CAN needs python-can, which is not installed: pip install 'boebot[can]'\n"


def test_database_of_a_node(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = tmp_path / "robot.dbc"
    assert boebot(capsys, "can", "dbc", str(made), "--node", "3")[0] == 0
    loaded: Any = cantools.database.load_file(made, strict=True)
    assert {message.frame_id >> 5 & 7 for message in loaded.messages} == {3}
    assert loaded.get_message_by_name("setpoint_signal").frame_id == 0x160
    assert loaded.dbc.attributes["SchemaHash"].value == f"0x{messages.SCHEMA_HASH:08X}"
