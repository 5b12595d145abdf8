"""A simulated robot as the host opens it, on the native board."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError
from boebot.link import frame, messages
from boebot.link.link import Link
from boebot.record.record import Record
from sim_bridge.boards.board import CLOCK_HZ, Damage
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import NATIVE, open_on
from sim_bridge.tests.simulated import happened


def open_with(**wishes: Any) -> SimSession:
    """A session in an empty field without noise, unless wished otherwise."""
    return open_on(
        NATIVE, BoardRequest(**{"robot": load_robot("shieldbot"), "arena": "empty", "noise": False, **wishes})
    )


@pytest.fixture
def session() -> Iterator[SimSession]:
    opened = open_with()
    yield opened
    opened.close()


def drive(session: SimSession, left: float, right: float, seconds: float) -> bytes:
    """Opens a link, arms and sends motor signals every 50 ms; returns what the board said."""
    memory = Record()
    link = Link(session.transport, memory.append)
    link.open()
    link.arm()
    end = session.transport.now() + seconds
    while session.transport.now() < end - 1e-9:
        payload = link.poll(0.05, 0.045)[-1][0]
        link.send_signal(left, right, 250, messages.Telemetry.unpack(payload).tick)
    link.close()
    return b"".join(data for _, data in memory.rows("to_host"))


def test_board_says_hello_and_sends_a_message_per_tick(session: SimSession) -> None:
    link = Link(session.transport)
    assert link.open().tick_rate == 100
    ticks = [messages.Telemetry.unpack(payload).tick for payload, *_ in link.poll(1.0, 1.0)]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert len(ticks) in (99, 100, 101)


def test_memory_is_within_reach(session: SimSession) -> None:
    session.transport.read(0.01, 0.01)
    assert session.board.read_eeprom() == b"\xff" * 1024
    session.board.write_eeprom(1020, b"abcd")
    session.board.eeprom_damage(Damage.GARBAGE, 0x33)
    session.board.reset("power")
    session.transport.read(0.1, 0.1)
    assert session.board.read_eeprom()[1020:] == b"abcd"
    with pytest.raises(BoardError, match="no data memory"):
        session.board.read_memory(0x100, 1)


def test_each_read_brings_one_whole_message(session: SimSession) -> None:
    session.transport.read(0.08, 0.08)
    for _ in range(20):
        assert [kind for kind, _, _ in frame.Decoder().feed(session.transport.read(0.3, 0.05))] == [messages.Hello.ID]


def test_it_drives_straight_and_records_it(session: SimSession) -> None:
    drive(session, 0.5, 0.5, 3.0)
    truth = happened(session.robot)
    assert truth is not None
    assert truth.x[-1] == pytest.approx(3.0 * 0.15, abs=0.05)
    assert abs(truth.y[-1]) < 0.01
    assert truth.time[-1] == pytest.approx(session.transport.now(), abs=0.02)
    assert not truth.contact.any()
    counters = session.counters()
    assert counters["true_distance_m"] == pytest.approx(np.hypot(np.diff(truth.x), np.diff(truth.y)).sum(), abs=0.005)
    assert counters["true_contacts"] == 0
    assert counters["bytes_in"] > 0 and counters["overruns"] == 0


def test_it_turns_left_for_a_slower_left_wheel(session: SimSession) -> None:
    drive(session, -0.5, 0.5, 1.0)
    assert session.robot.body().heading > 1.0


def test_same_request_same_bytes() -> None:
    def heard(seed: int) -> tuple[bytes, int]:
        session = open_with(arena="room", noise=True, seed=seed)
        data = drive(session, 0.6, 0.5, 6.0)
        result = data, session.sim.hash()
        session.close()
        return result

    assert heard(1) == heard(1)
    assert heard(1)[1] != heard(2)[1]


def test_sessions_side_by_side_share_nothing() -> None:
    one, other = open_with(), open_with()
    drive(one, 0.5, 0.5, 0.5)
    other.transport.read(0.5, 0.5)
    assert one.robot.body().x > 0.02
    assert other.robot.body().x == 0
    one.close()
    drive(other, 0.5, 0.5, 0.5)
    assert other.robot.body().x > 0.02
    other.close()


def test_reset_starts_the_program_again(session: SimSession) -> None:
    drive(session, 0.5, 0.5, 0.5)
    before = session.robot.body().x
    at = round(session.transport.now() * CLOCK_HZ)
    session.board.reset("external")
    heard = frame.Decoder().feed(session.transport.read(0.2, 0.2))
    assert heard[0][0] == messages.Hello.ID
    assert session.board.counters()["resets"] == 1
    assert session.board.reset_cycle == at
    assert session.robot.body().x > before  # the world went on


def test_pose_is_heeded() -> None:
    session = open_with(pose=(0.3, -0.2, 1.0))
    body = session.robot.body()
    assert (body.x, body.y, body.heading) == (0.3, -0.2, 1.0)
    session.close()


def test_close_may_come_twice(session: SimSession) -> None:
    session.close()
    session.close()


def test_wrong_requests_are_told_in_a_sentence(tmp_path: Path) -> None:
    robot = load_robot("shieldbot")
    no_library = tmp_path / "firmware.so"
    no_library.write_text("nothing")
    for error, message, wishes in (
        (ArenaError, "there is no arena 'moon'", {"arena": "moon"}),
        (ArenaError, "cannot start", {"arena": "room", "pose": (9.0, 9.0, 0.0)}),
        (BoardError, "there is no firmware image", {"image": "no.such.so"}),
        (BoardError, "firmware.so", {"image": str(no_library)}),
        (
            BoardError,
            "no firmware for this computer",
            {"robot": msgspec.structs.replace(robot, pin_map="other")},
        ),
    ):
        with pytest.raises(error, match=message):
            open_with(**wishes)
