"""The emulated native board: own state for each, resets, the line, and runs that do not depend on how they are cut."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot_hil.rig import CYCLES_PER_S
from sim_bridge import _core
from sim_bridge.boards.board import Edge, Level, ResetCause
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.tests.boards.access import BoardAccess, SentByte
from sim_bridge.tests.rigs import SessionRig

MS = 16_000  # cycles
TICK = 10 * MS
BYTE = 320
SERVO_LEFT, SERVO_RIGHT, WHISKER_LEFT, ENCODER_LEFT = 13, 12, 5, 16

Maker = Callable[[], BoardAccess]


@pytest.fixture
def make() -> Iterator[Maker]:
    """Makes boards and closes them afterwards."""
    opened = []

    def one() -> BoardAccess:
        board = native_board(native_library("shieldbot"))
        access = BoardAccess(board)
        opened.append((access, board))
        return access

    yield one
    for access, board in opened:
        access.close()
        board.close()


class Alone:
    """A board with nothing around it, as a session that a SessionRig speaks with."""

    realtime = False

    def __init__(self, board: BoardAccess) -> None:
        self.board, self.transport, self.write = board, self, board.send

    def now(self) -> float:
        return self.board.now / CYCLES_PER_S

    def read(self, wait_s: float, quiet_s: float = 0.0) -> bytes:
        del quiet_s
        self.board.run(round(wait_s * CYCLES_PER_S))
        return self.board.received()[0]


def rig_of(board: BoardAccess) -> SessionRig:
    return SessionRig(Alone(board))


def drive(board: BoardAccess, left: int, right: int) -> SessionRig:
    """Opens a session, arms the motors and sends one set-point that lives for 2 s."""
    host = rig_of(board)
    host.open_session()
    known = host.first(messages.Telemetry, lambda now: now.supply > 0, 0.2, "a measured supply")
    assert host.request(messages.Arm, known.latches).status == messages.AnswerStatus.OK
    now = host.first(messages.Telemetry, lambda now: now.latch == 0, 0.2, "the end of the latch")
    host.send(messages.SetpointSignal(left, right, 2000, now.tick & 0xFFFF))
    return host


def said(sent: list[SentByte]) -> list[tuple[int, int, bytes]]:
    """The messages of the handshake in what left the board."""
    return frame.Decoder().feed(b"\0" + bytes(byte.byte for byte in sent))


def telemetry(host: SessionRig, seconds: float) -> messages.Telemetry:
    """The last telemetry of the seconds to come."""
    return host.listen(seconds)[-1]


def test_boards_do_not_share_state(make: Maker) -> None:
    one, other = make(), make()
    moving, still = drive(one, 5000, 5000), rig_of(other)
    still.open_session()
    assert telemetry(moving, 0.1).pulse_left == 1600 * 16
    assert telemetry(still, 0.1).pulse_left == 0


def test_says_hello_after_power_on(make: Maker) -> None:
    board = make()
    board.advance(TICK)
    number, sequence, payload = said(board.receive())[0]
    assert (number, sequence) == (messages.Hello.ID, 0)
    hello = messages.Hello.unpack(payload)
    assert hello.reset_cause == messages.ResetCause.POWER
    assert hello.schema_hash == messages.SCHEMA_HASH


@pytest.mark.parametrize("cause", list(ResetCause))
def test_reset_starts_the_program_anew_and_time_goes_on(make: Maker, cause: ResetCause) -> None:
    board = make()
    host = drive(board, 5000, 5000)
    board.drive(WHISKER_LEFT, Level.LOW)
    assert telemetry(host, 0.1).pulse_left > 0
    board.log()
    at = board.now
    board.reset(cause)
    board.run(1)
    released = {edge.pin: edge.level for edge in board.log() if edge.cycle == at}
    assert released[SERVO_LEFT] == Level.LOW, "released by the reset, then made an output by the program"
    board.advance(at + 5 * TICK)
    sent = board.receive()
    assert all(byte.cycle > at for byte in sent)
    hello = messages.Hello.unpack(said(sent)[0][2])
    assert messages.ResetCause(hello.reset_cause).name == cause.name
    assert hello.session == 0, "nor does the session outlive it"
    host.open_session()
    now = telemetry(host, 0.05)
    assert now.tick < 20
    assert now.pulse_left == 0, "a set-point does not outlive a reset"
    assert now.whiskers == messages.Whiskers.LEFT, "what drives the pins from outside outlives it"
    assert board.counters()["resets"] == 1


def test_many_resets(make: Maker) -> None:
    board = make()
    for _ in range(30):
        board.run(7 * MS)
        board.reset(ResetCause.EXTERNAL)
    board.run(TICK)
    assert board.counters()["resets"] == 30


def test_byte_in_flight_at_a_reset_is_lost(make: Maker) -> None:
    board = make()
    board.advance(10 * BYTE + BYTE // 2)  # the first hello is leaving
    board.reset()
    board.run(20 * BYTE)
    cycles = [byte.cycle for byte in board.receive()]
    assert 11 * BYTE not in cycles
    assert all(later - earlier >= BYTE for earlier, later in pairwise(cycles))


def test_bytes_take_ten_bit_times(make: Maker) -> None:
    board = make()
    board.advance(TICK)
    cycles = [byte.cycle for byte in board.receive()]
    hello = messages.Hello.STRUCT.size + frame.FRAME_OVERHEAD
    assert cycles[:hello] == [BYTE * (i + 1) for i in range(hello)]
    data = frame.encode(messages.Identify.ID, 0, b"")
    before = board.counters()["bytes_in"]
    board.send(data, at=2 * TICK)
    board.advance(2 * TICK + BYTE * len(data) - 1)
    assert board.counters()["bytes_in"] == before + len(data) - 1
    board.run(1)
    assert board.counters()["bytes_in"] == before + len(data)


def test_wrong_line_rate_is_framing_errors_and_garbage(make: Maker) -> None:
    board = make()
    board.line_rate(115_200)
    board.send(frame.encode(messages.Identify.ID, 0, b""))
    board.advance(30 * TICK)
    counters = board.counters()
    assert counters["framing_errors"] == counters["bytes_in"] > 0
    assert said(board.receive()) == []
    board.line_rate(500_000)
    board.run(20 * TICK)
    assert {number for number, _, _ in said(board.receive())} == {messages.Hello.ID}, (
        "what was garbled asked for nothing"
    )


def test_drive_replaces_what_was_queued_later(make: Maker) -> None:
    board = make()
    host = rig_of(board)
    host.open_session()
    host.request(messages.SetParameter, messages.PARAMETERS["encoder_gap"].id, 0)
    board.drive(ENCODER_LEFT, Level.LOW)
    before = telemetry(host, 0.06).encoder_left
    start = board.now
    for at in range(2 * TICK, 4 * TICK, MS):
        board.drive(ENCODER_LEFT, Level(at // MS % 2), at=start + at)
    board.drive(ENCODER_LEFT, Level.LOW, at=start + 2 * TICK + 5 * MS)
    # changes at 1, 2, 3, 4 ms, and at 5 ms none is left but low
    assert telemetry(host, 0.06).encoder_left - before == 4


def test_pin_states_follow_the_firmware(make: Maker) -> None:
    board = make()
    assert board.output(SERVO_LEFT) == Level.RELEASED
    board.advance(TICK)
    assert board.output(SERVO_LEFT) == Level.LOW
    assert board.output(WHISKER_LEFT) == Level.PULLED_UP
    assert board.output(ENCODER_LEFT) == Level.PULLED_UP


def run_in_pieces(board: BoardAccess, seed: int | None) -> tuple[list[Edge], list[SentByte]]:
    """A run of 30 ticks with everything going on, in one go or cut at random."""
    drive(board, 5000, 2000)
    start = board.now
    for number in range(300):
        board.drive(ENCODER_LEFT, Level(number % 2), at=start + TICK + number * 9001)
    board.board.on_edge(
        9, lambda cycle, level: board.drive(10, level, cycle + 100)
    )  # the left IR receiver follows its LED
    rng = random.Random(seed)
    end = start + 30 * TICK
    while board.now < end:
        board.advance(end if seed is None else min(end, board.now + 1 + rng.randrange(20_000)))
    return board.log(), board.receive()


def test_a_run_does_not_depend_on_how_it_is_cut(make: Maker) -> None:
    whole = run_in_pieces(make(), None)
    assert len(whole[0]) > 400
    assert run_in_pieces(make(), 1) == whole
    assert run_in_pieces(make(), 2) == whole


def test_files_that_are_no_firmware(tmp_path: Path) -> None:
    with pytest.raises(BoardError, match=r"missing\.so cannot be read"):
        native_board(tmp_path / "missing.so")
    (tmp_path / "text.so").write_text("not a library")
    with pytest.raises(BoardError, match=r"/text\.so cannot be loaded: (?!/tmp).*; expected one for this computer"):
        native_board(tmp_path / "text.so")
    (tmp_path / "empty.so").touch()
    with pytest.raises(BoardError, match=r"/empty\.so cannot be loaded: (?!/tmp)"):
        native_board(tmp_path / "empty.so")
    (tmp_path / "cut.so").write_bytes(native_library("shieldbot").read_bytes()[:20_000])
    with pytest.raises(BoardError, match=r"/cut\.so cannot be loaded: it is cut short"):
        native_board(tmp_path / "cut.so")
    with pytest.raises(BoardError, match="not a boebot firmware"):
        native_board(Path(str(_core.__file__)))


def test_a_run_ends_at_an_edge_and_goes_on_as_if_it_had_not(make: Maker) -> None:
    whole, cut = make(), make()
    for board in (whole, cut):
        drive(board, 5000, 2000)
        board.log()
    end = whole.now + 5 * TICK
    whole.advance(end)
    cut.board.stop_at([SERVO_LEFT, SERVO_RIGHT])
    found: list[Edge] = []
    stops = 0
    while cut.now < end:
        cut.advance(end)
        found += (edges := cut.log())
        if cut.now < end:
            stops += 1
            assert edges[-1].cycle == cut.now
    assert found == whole.log() and stops >= 8
    assert cut.receive() == whole.receive() and cut.counters() == whole.counters()


def test_an_edge_that_a_reset_makes_ends_the_run(make: Maker) -> None:
    board = make()
    board.advance(TICK)
    board.board.stop_at([SERVO_LEFT])
    board.reset()
    board.log()
    board.advance(2 * TICK)
    assert board.now == TICK and Edge(TICK, SERVO_LEFT, Level.RELEASED) in board.log()
    board.board.stop_at([])
    board.advance(2 * TICK)
    assert board.now == 2 * TICK and board.counters()["resets"] == 1


def test_what_a_reaction_raises_ends_the_run_and_is_raised(make: Maker) -> None:
    board = make()

    def react(cycle: int, level: Level) -> None:
        raise KeyError(cycle)

    board.board.on_edge(WHISKER_LEFT, react)
    with pytest.raises(KeyError) as raised:
        board.advance(TICK)
    assert raised.value.args == (board.now,)
