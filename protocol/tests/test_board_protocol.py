"""The board against PROTOCOL.md: a host written from that page alone, on the plainest frame codec (reference_frame).

Nothing here knows the kit's library, its codecs or its generated messages. What is in this file is what another
implementation needs.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import pytest
import reference_frame

from sim_bridge.bench.bench import Bench, bare
from sim_bridge.boards.board import Level

CYCLES_PER_S = 16_000_000
MS = CYCLES_PER_S // 1000
TICK = 10 * MS
SERVO_FRAME = 20 * MS
SERVO_LEFT, SERVO_RIGHT, WHISKER_LEFT = 13, 12, 5

HANDSHAKE_SEED = 0x155555
VERSION = 3 * 16 + 1  # 3.1

# Messages to the board: id and layout (PROTOCOL.md, "Messages"), all little-endian.
OPEN, IDENTIFY, DESCRIBE, STOP, CLOSE = 0x01, 0x02, 0x03, 0x08, 0x09
SIGNAL, SPEED, COAST = 0x10, 0x11, 0x12
GET, SET, SAVE, RESET, ARM, ACKNOWLEDGE, PROBE = 0x25, 0x21, 0x22, 0x23, 0x24, 0x28, 0x30
HANDSHAKE = {OPEN, IDENTIFY, DESCRIBE, 0x80, 0x81, 0x82}

# Messages from the board: id, name, layout, fields.
FROM_BOARD: dict[int, tuple[str, str, str]] = {
    0x80: (
        "hello",
        "<BIIIHHBIBBI16s",
        "protocol_version schema_hash board_nonce session tick_rate session_time_out telemetry_period boot_counter "
        "reset_cause parameters_saved devices robot",
    ),
    0x81: ("identity", "<12s24s16sII", "firmware_version compiler pin_map image_size image_hash"),
    0x82: ("description", "<BBBBI", "index count id length hash"),
    0x88: ("stopped", "<B", "token"),
    0x90: (
        "telemetry",
        "<IIiiHHBBBHBBHHHHBBBB",
        "tick time encoder_left encoder_right edge_period_left edge_period_right whiskers infrared infrared_age "
        "ping_echo ping_age ping_status pulse_left pulse_right supply status latch latches setpoint_sequence overruns",
    ),
    0x91: (
        "counters",
        "<11H",
        "good bad unknown resynchronised retransmitted duplicate overrun dropped late refused deferred",
    ),
    0x93: ("task_time", "<BH", "task longest"),
    0xA0: ("answer", "<HBi", "number status value"),
    0xA1: ("event", "<HBHI", "number kind value time"),
    0xB0: ("clock_answer", "<HI", "token time"),
}
MOTORS_ENABLED, DEAD_MAN, LATCHED = 1, 2, 4  # status bits
START, STOP_COMMAND, SESSION_ENDED = 1, 2, 3  # latch
OK, UNKNOWN_PARAMETER, OUT_OF_RANGE, LATCHED_AGAIN = 0, 1, 2, 5  # answer_status
TASKS = 21
WHISKERS, LATCH, DEAD_MAN_EVENT = 0, 1, 2  # event_kind
TIME_TO_LIVE, TRACK_WIDTH = 1, 12  # parameters


# The native board has none: there in `make soak` alone.
ABOUT_TIMING = pytest.mark.parametrize("board_url", [pytest.param("native", marks=pytest.mark.soak), "avr"])


@dataclass
class Message:
    """A message from the board: its name, sequence number, fields, and the cycle at which its last byte had left."""

    name: str
    sequence: int
    fields: dict[str, Any]
    cycle: int

    def __getattr__(self, field: str) -> Any:
        return self.fields[field]


def unstuff(block: bytes) -> bytes | None:
    """COBS backwards, or None where a code byte points outside."""
    found = bytearray()
    at = 0
    while at < len(block):
        end = at + block[at]
        if end > len(block):
            return None
        found += block[at + 1 : end]
        found += b"\0" if end < len(block) else b""
        at = end
    return bytes(found)


class Host:
    """A host on the bench of one board. Keeps every message in order; time is the board's, in CPU cycles."""

    def __init__(self, board: Bench) -> None:
        self.board = board
        self.seed: int | None = None
        self.messages: list[Message] = []
        self.refused = 0
        self.sequence = 0
        self.number = 0
        self.acknowledges = True
        self.seen_event = 0
        self.events: list[Message] = []
        self._block = bytearray()

    # ---- frames ------------------------------------------------------------------------------------------------------

    def frame(self, message_id: int, layout: str = "<", *values: int, seed: int | None = None) -> bytes:
        if seed is None:
            seed = HANDSHAKE_SEED if message_id in HANDSHAKE or self.seed is None else self.seed
        self.sequence = (self.sequence + 1) & 0xFF
        return reference_frame.frame(message_id, self.sequence, struct.pack(layout, *values), seed)

    def send(self, message_id: int, layout: str = "<", *values: int) -> None:
        self.board.send(self.frame(message_id, layout, *values))

    def run(self, cycles: int) -> None:
        """Lets time pass, in steps of at most a quarter of a tick, and takes what the board says."""
        end = self.board.now + cycles
        while self.board.now < end:
            self.board.run_until(min(end, self.board.now + TICK // 4))
            for byte, cycle in zip(*self.board.robot.received(), strict=True):
                if byte != 0:
                    self._block.append(byte)
                elif self._block:
                    self._take(bytes(self._block), cycle)
                    self._block.clear()

    def _take(self, block: bytes, cycle: int) -> None:
        stuffed, check = block[:-3], block[-3:]
        content = unstuff(stuffed)
        if content is None or len(content) < 2 or content[0] not in FROM_BOARD or min(check) < 0x80:
            self.refused += 1
            return
        name, layout, fields = FROM_BOARD[content[0]]
        seed = HANDSHAKE_SEED if content[0] in HANDSHAKE else self.seed
        value = (check[0] & 0x7F) << 14 | (check[1] & 0x7F) << 7 | (check[2] & 0x7F)
        if seed is None or struct.calcsize(layout) != len(content) - 2 or reference_frame.crc21(stuffed, seed) != value:
            self.refused += 1
            return
        values = dict(zip(fields.split(), struct.unpack(layout, content[2:]), strict=True))
        message = Message(name, content[1], values, cycle)
        self.messages.append(message)
        if name == "event" and self.acknowledges:
            self._take_event(message)

    def _take_event(self, event: Message) -> None:
        if event.number == (self.seen_event + 1) & 0xFFFF:
            self.seen_event = event.number
            self.events.append(event)
        if event.number == self.seen_event:
            self.send(ACKNOWLEDGE, "<H", event.number)

    # ---- waiting -----------------------------------------------------------------------------------------------------

    def all(self, name: str) -> list[Message]:
        return [message for message in self.messages if message.name == name]

    def last(self, name: str) -> Message:
        return self.all(name)[-1]

    def wait(self, condition: Callable[[], Any], within: int, what: str) -> Any:
        end = self.board.now + within
        while not (value := condition()):
            assert self.board.now < end, f"waited in vain for {what}"
            self.run(MS // 2)
        return value

    def next(self, name: str, within: int = 3 * TICK) -> Message:
        """The next message of that name."""
        count = len(self.all(name))
        self.wait(lambda: len(self.all(name)) > count, within, name)
        return self.last(name)

    def live(self, cycles: int) -> None:
        """Lets time pass and keeps the session open."""
        end = self.board.now + cycles
        while self.board.now < end:
            self.send(PROBE, "<H", 0)
            self.run(min(10 * TICK, end - self.board.now))

    # ---- session, requests, motion -----------------------------------------------------------------------------------

    def hello(self) -> Message:
        return self.next("hello", 100 * TICK)

    def open(self, host_nonce: int = 0x5A5A5) -> Message:
        """PROTOCOL.md, Session, steps 2 to 4."""
        hello = self.hello()
        assert hello.protocol_version == VERSION
        return self.open_as(hello.board_nonce, host_nonce)

    def open_as(self, board_nonce: int, host_nonce: int) -> Message:
        self.seed = board_nonce ^ host_nonce
        self.number = self.seen_event = 0
        self.events.clear()
        for _ in range(10):
            self.send(OPEN, "<BII", VERSION, board_nonce, host_nonce)
            self.run(2 * TICK + 100 * 20 * MS // 1000)
            if any(hello.session == self.seed for hello in self.all("hello")):
                return self.last("hello")
        raise AssertionError("the board does not open the session")

    def request(self, message_id: int, layout: str, *values: int) -> Message:
        """Asks, again and again, until the answer with its number comes."""
        self.number = (self.number + 1) & 0xFFFF
        wire = self.frame(message_id, "<H" + layout, self.number, *values)
        for _ in range(100):
            self.board.send(wire)
            self.run(TICK + 100 * 20 * MS // 1000)
            for answer in self.all("answer"):
                if answer.number == self.number:
                    return answer
        raise AssertionError("no answer")

    def arm(self) -> int:
        """Arms; returns the tick from whose telemetry on set-points move the motors."""
        answer = self.request(ARM, "B", self.next("telemetry").latches)
        assert answer.status == OK
        tick: int = self.next("telemetry").tick
        return tick

    def signal(self, left: int, right: int, time_to_live: int = 250, answers: int | None = None) -> None:
        tick = self.last("telemetry").tick if answers is None else answers
        self.send(SIGNAL, "<hhHH", left, right, time_to_live, tick & 0xFFFF)

    def drive(self, left: int, right: int, cycles: int) -> None:
        """A set-point for each telemetry."""
        end = self.board.now + cycles
        while self.board.now < end:
            self.next("telemetry")
            self.signal(left, right)

    def start(self) -> None:
        self.open()
        self.live(2 * TICK)
        self.arm()


def pulses(board: Bench, pin: int) -> list[tuple[int, int]]:
    """(rise, width) of each whole pulse so far."""
    found, rise = [], None
    for edge in board.edges[pin]:
        if edge.level == Level.HIGH:
            rise = edge.cycle
        elif rise is not None:
            found.append((rise, edge.cycle - rise))
            rise = None
    return found


@pytest.fixture(params=["native", "avr"])
def board_url(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def board(board_url: str) -> Iterator[Bench]:
    """With nothing around it: native, or the AVR image on the emulated ATmega328P."""
    with Bench(on=board_url, robot=bare("shieldbot")) as board:
        board.drive(WHISKER_LEFT, Level.HIGH)
        yield board


@pytest.fixture
def host(board: Bench) -> Host:
    return Host(board)


# ---- session ---------------------------------------------------------------------------------------------------------


def test_board_without_a_session_only_says_hello(host: Host) -> None:
    host.run(60 * TICK)
    hellos = host.all("hello")
    assert hellos == host.messages
    assert host.refused == 0
    assert all(hello.session == 0 and hello.tick_rate == 100 for hello in hellos)
    for earlier, later in itertools.pairwise(hellos):
        assert abs(later.cycle - earlier.cycle - 10 * TICK) <= MS or earlier is hellos[0]


def test_session_opens_and_telemetry_comes_every_tick_in_it(host: Host) -> None:
    nonce = host.hello().board_nonce
    hello = host.open_as(nonce, 0x12345)
    assert hello.session == nonce ^ 0x12345
    assert hello.board_nonce != nonce
    host.live(100 * TICK)
    ticks = [message.tick for message in host.all("telemetry")]
    assert len(ticks) >= 100
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    for message in host.all("telemetry"):
        assert message.time == message.tick * 10_000
    sequence = [message.sequence for message in host.messages]
    assert all((later - earlier) & 0xFF == 1 for earlier, later in itertools.pairwise(sequence))
    assert host.refused == 0


def test_times_of_tasks_and_counters_take_turns_of_four_ticks(host: Host) -> None:
    host.hello()
    host.open()
    host.live(200 * TICK)
    own = [message for message in host.messages if message.name in ("task_time", "counters")]
    assert len(own) >= 49
    turns = [message.task if message.name == "task_time" else TASKS for message in own]
    assert turns == [(turns[0] + n) % (TASKS + 1) for n in range(len(turns))]
    for earlier, later in itertools.pairwise(own):
        assert later.cycle - earlier.cycle == pytest.approx(4 * TICK, abs=TICK / 2)
    longest = dict.fromkeys(range(TASKS), 0)
    for message in own:
        if message.name == "task_time":
            assert message.longest >= longest[message.task]
            longest[message.task] = message.longest


def test_frames_of_no_session_and_of_another_one_do_nothing(host: Host) -> None:
    host.hello()
    host.seed = 0x0ABCDE
    host.send(STOP, "<B", 1)
    host.run(2 * TICK)
    host.open()
    host.live(2 * TICK)
    latches = host.next("telemetry").latches
    host.board.send(host.frame(STOP, "<B", 2, seed=host.seed ^ 1))
    host.board.send(host.frame(STOP, "<B", 3, seed=HANDSHAKE_SEED))
    host.run(4 * TICK)
    assert not host.all("stopped")
    assert host.last("telemetry").latches == latches
    host.send(STOP, "<B", 4)
    assert host.next("stopped").token == 4


def test_open_with_a_nonce_that_was_used_before_is_dropped(host: Host) -> None:
    first = host.hello().board_nonce
    host.open_as(first, 0x11111)
    second = host.open(0x22222)
    host.send(OPEN, "<BII", VERSION, first, 0x11111)
    host.live(45 * TICK)
    assert host.last("hello").session == second.session == host.seed


def test_silence_and_close_end_the_session(host: Host) -> None:
    hello = host.open()
    time_out = hello.session_time_out * MS
    host.send(PROBE, "<H", 1)
    host.run(time_out - TICK)
    assert host.last("hello").session == host.seed
    host.run(5 * TICK)
    assert host.last("hello").session == 0
    host.open(0x33333)
    assert host.seed is not None
    host.send(CLOSE, "<I", host.seed ^ 1)
    host.run(2 * TICK)
    count = len(host.all("telemetry"))
    host.run(2 * TICK)
    assert len(host.all("telemetry")) > count
    host.send(CLOSE, "<I", host.seed)
    assert host.hello().session == 0


def test_board_describes_every_message(host: Host) -> None:
    nonce = host.hello().board_nonce
    known = {}
    index = 0
    while True:
        host.send(DESCRIBE, "<BI", index, nonce)
        described = host.next("description")
        if described.id == 0:
            break
        known[described.id] = described.length
        index += 1
    assert index == host.last("description").count
    for message_id, (_, layout, _) in FROM_BOARD.items():
        assert known[message_id] == struct.calcsize(layout)
    assert known[SIGNAL] == 8
    assert known[OPEN] == 9
    host.send(IDENTIFY)
    assert host.next("identity").pin_map.rstrip(b"\0") == b"shieldbot"


def test_reset_ends_the_session_and_the_next_one_opens_within_a_second(host: Host) -> None:
    host.start()
    host.drive(5000, 5000, 20 * TICK)
    old_seed, nonce = host.seed, host.last("hello").board_nonce
    host.board.pins.reset()
    reset_at = host.board.now
    hello = host.hello()
    assert hello.session == 0
    assert hello.board_nonce != nonce
    assert hello.board_nonce ^ 0x5A5A5 != old_seed
    host.open_as(hello.board_nonce, 0x5A5A5)
    telemetry = host.next("telemetry")
    assert host.board.now - reset_at < CYCLES_PER_S
    assert telemetry.latch == START
    host.run(5 * TICK)
    assert all(rise <= reset_at for rise, _ in pulses(host.board, SERVO_LEFT))


# ---- motion ----------------------------------------------------------------------------------------------------------


def test_motors_run_only_when_armed_and_for_the_time_to_live(host: Host) -> None:
    host.open()
    host.live(3 * TICK)
    host.signal(5000, 5000, 500)
    host.live(5 * TICK)
    assert host.last("telemetry").latch == START
    assert host.last("telemetry").status & LATCHED
    assert not pulses(host.board, SERVO_LEFT)
    tick = host.arm()
    host.signal(5000, 5000, 200, tick)
    begun = host.last("telemetry").cycle  # a little after the start of that tick
    host.run(10 * TICK)
    assert host.last("telemetry").status & MOTORS_ENABLED
    host.live(30 * TICK)
    left, right = pulses(host.board, SERVO_LEFT), pulses(host.board, SERVO_RIGHT)
    assert all(abs(width - 1600 * 16) <= 16 for _, width in left)
    assert all(abs(width - 1400 * 16) <= 16 for _, width in right)
    assert left[-1][0] + left[-1][1] <= begun + 200 * MS + SERVO_FRAME
    assert left[-1][0] >= begun + 200 * MS - SERVO_FRAME - TICK
    assert host.last("telemetry").status & DEAD_MAN
    assert host.events[-1].kind == DEAD_MAN_EVENT
    assert host.events[-1].value == tick & 0xFFFF
    host.signal(1000, 1000)
    host.run(4 * TICK)
    assert host.last("telemetry").pulse_left == 24000 + 320


def test_stop_latches_until_armed_with_the_count_of_latches(host: Host) -> None:
    host.start()
    host.drive(5000, 5000, 10 * TICK)
    host.send(STOP, "<B", 9)
    assert host.next("stopped").token == 9
    stopped = host.board.now
    host.drive(5000, 5000, 20 * TICK)
    assert all(rise <= stopped + SERVO_FRAME for rise, _ in pulses(host.board, SERVO_LEFT))
    telemetry = host.last("telemetry")
    assert (telemetry.latch, telemetry.pulse_left) == (STOP_COMMAND, 0)
    assert host.request(ARM, "B", (telemetry.latches - 1) & 0xFF).status == LATCHED_AGAIN
    assert host.next("telemetry").latch == STOP_COMMAND
    host.arm()
    host.drive(5000, 5000, 10 * TICK)
    assert host.last("telemetry").pulse_left == 25600
    kinds = [(event.kind, event.value) for event in host.events if event.kind == LATCH]
    assert kinds == [(LATCH, 0), (LATCH, STOP_COMMAND), (LATCH, 0)]


def test_old_reordered_and_future_setpoints_are_late(host: Host) -> None:
    host.start()
    late = host.next("counters", 80 * TICK).late
    host.live(10 * TICK)
    tick = host.next("telemetry").tick
    host.signal(5000, 5000, 1000, tick)
    host.run(MS)
    host.signal(1000, 1000, 1000, tick - 1)  # older than the one in force
    host.signal(1000, 1000, 2000, tick + 5)  # of a tick to come
    host.signal(1000, 1000, 100, tick - 20)  # its time to live has passed
    host.run(4 * TICK)
    assert host.last("telemetry").pulse_left == 25600
    host.send(COAST, "<HH", 500, host.last("telemetry").tick & 0xFFFF)
    host.run(4 * TICK)
    assert host.last("telemetry").pulse_left == 0
    assert host.last("telemetry").status & MOTORS_ENABLED
    host.acknowledges = True
    count = len(host.all("counters"))
    while len(host.all("counters")) == count:
        host.live(10 * TICK)
    assert host.last("counters").late == late + 3


def test_motion_of_a_stalled_line_is_not_carried_out_later(host: Host) -> None:
    host.start()
    tick = host.last("telemetry").tick
    stalled = b"".join(host.frame(SIGNAL, "<hhHH", 9000, 9000, 2000, tick & 0xFFFF) for _ in range(50))
    host.run(2 * CYCLES_PER_S)
    host.board.send(stalled)
    host.run(20 * TICK)
    assert not pulses(host.board, SERVO_LEFT)


# ---- exactly once ----------------------------------------------------------------------------------------------------


def test_requests_are_carried_out_once_and_answered_as_often_as_they_come(host: Host) -> None:
    host.open()
    assert host.request(SET, "Bi", TIME_TO_LIVE, 100).value == 100
    copy = host.frame(SET, "<HBi", host.number, TIME_TO_LIVE, 100)
    assert host.request(SET, "Bi", TIME_TO_LIVE, 200).value == 200
    answers = len(host.all("answer"))
    host.board.send(copy)  # of the one before the last: dropped
    host.send(SET, "<HBi", host.number + 2, TIME_TO_LIVE, 300)  # out of order: dropped
    host.run(3 * TICK)
    assert len(host.all("answer")) == answers
    host.send(SET, "<HBi", host.number, TIME_TO_LIVE, 400)  # the last number: only answered again
    assert host.next("answer").value == 200
    assert host.request(GET, "B", TIME_TO_LIVE).value == 200
    assert host.request(GET, "B", 200).status == UNKNOWN_PARAMETER
    answer = host.request(SET, "Bi", TIME_TO_LIVE, 5)
    assert (answer.status, answer.value) == (OUT_OF_RANGE, 200)


def test_events_are_repeated_unchanged_until_acknowledged(host: Host) -> None:
    host.open()
    host.acknowledges = False
    touched = host.board.now + TICK
    host.board.drive(WHISKER_LEFT, Level.LOW, at=touched)
    host.board.drive(WHISKER_LEFT, Level.HIGH, at=touched + 10 * TICK)
    host.live(30 * TICK)
    events = host.all("event")
    assert len(events) > 5
    assert all(event.fields == events[0].fields for event in events)
    assert (events[0].number, events[0].kind, events[0].value) == (1, WHISKERS, 0x0101)
    for earlier, later in itertools.pairwise(events):
        assert 24 * MS - MS // 2 <= later.cycle - earlier.cycle <= 28 * MS
    host.acknowledges = True
    host.live(10 * TICK)
    assert [(event.number, event.value) for event in host.events] == [(1, 0x0101), (2, 0)]
    assert abs(host.events[1].time - host.events[0].time - 100_000) <= 10_000  # us; released after 4 samples
    count = len(host.all("event"))
    host.live(10 * TICK)
    assert len(host.all("event")) == count


def test_saved_parameter_is_answered_when_it_is_written_and_outlives_a_reset(host: Host) -> None:
    host.open()
    assert host.request(SET, "Bi", TRACK_WIDTH, 12345).status == OK
    begun = host.board.now
    assert host.request(SAVE, "").status == OK
    assert host.board.now - begun > 40 * 34 * MS // 10  # more than 40 cells of 3.4 ms
    assert len([answer for answer in host.all("answer") if answer.number == host.number]) == 1
    assert host.request(RESET, "").status == OK
    host.board.pins.reset()
    hello = host.open()
    assert hello.parameters_saved == 1
    assert host.request(GET, "B", TRACK_WIDTH).value == 12345


def test_clock_probe_is_answered_between_its_sending_and_its_return(host: Host) -> None:
    host.open()
    host.live(2 * TICK)
    offsets = []
    for token in range(60):
        sent = host.board.now
        host.send(PROBE, "<H", token)
        answer = host.next("clock_answer")
        assert answer.token == token
        offsets.append((sent / 16 - answer.time, answer.cycle / 16 - answer.time))
        host.run(7 * MS + 12_345)
    assert max(low for low, _ in offsets) <= min(high for _, high in offsets), "no clock fits all of them"


# ---- load ------------------------------------------------------------------------------------------------------------


@ABOUT_TIMING
@pytest.mark.parametrize("setpoint", ["signals", "speeds"])
def test_line_that_is_too_full_drops_whole_frames_and_misses_no_tick(host: Host, setpoint: str) -> None:
    """Set-points and clock probes without a gap, 50,000 bytes/s, with answers and telemetry on the way back."""
    kind = SIGNAL if setpoint == "signals" else SPEED
    host.start()
    first = host.next("telemetry")
    end = host.board.now + 2 * CYCLES_PER_S
    while host.board.now < end:
        wire = bytearray()
        tick = host.last("telemetry").tick & 0xFFFF
        while len(wire) < 500:
            wire += host.frame(kind, "<hhHH", 5000, -5000, 250, tick)
            wire += host.frame(PROBE, "<H", 7) + host.frame(PROBE, "<H", 8)
        host.board.send(bytes(wire))
        host.run(len(wire) * 320)
    host.live(80 * TICK)
    telemetry = [message for message in host.all("telemetry") if message.tick >= first.tick]
    assert [message.tick for message in telemetry] == list(range(first.tick, first.tick + len(telemetry)))
    assert telemetry[-1].overruns == 0
    assert host.last("counters").bad == 0
    assert host.refused == 0


@ABOUT_TIMING
@pytest.mark.parametrize("setpoint", ["signals", "speeds"])
def test_line_full_of_set_points_misses_no_tick(host: Host, setpoint: str) -> None:
    kind = SIGNAL if setpoint == "signals" else SPEED
    host.start()
    end = host.board.now + CYCLES_PER_S
    while host.board.now < end:
        tick = host.last("telemetry").tick & 0xFFFF
        wire = b"".join(host.frame(kind, "<hhHH", 5000, -4321, 250, tick) for _ in range(31))
        host.board.send(wire)
        host.run(len(wire) * 320)
    host.live(2 * TICK)
    last = host.last("telemetry")
    assert last.overruns == 0
    assert host.board.pins.counters()["resets"] == 0
