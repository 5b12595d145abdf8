"""What every board must do on its serial line: handshake, telemetry, parameters, and surviving garbage."""

from __future__ import annotations

import itertools
import random
from typing import Any

import pytest

from boebot.description.robots import load_robot
from boebot.link import frame, messages
from boebot_hil.rig import Rig

pytestmark = pytest.mark.uno(robot="shieldbot", motors=False)


def type_name(value: Any) -> str:
    return type(value).__name__


def text(field: bytes) -> str:
    return field.rstrip(b"\0").decode()


@pytest.mark.promise(
    "Integers are little-endian; text is UTF-8, padded with NUL",
    "`protocol_version` is 16 × version + minor version",
    "`schema_hash` covers what all of one version have in common",
)
def test_handshake_names_version_schema_and_robot(rig: Rig) -> None:
    hello = rig.next(messages.Hello, within_s=0.3)
    assert hello.protocol_version == messages.PROTOCOL_VERSION
    assert hello.schema_hash == messages.SCHEMA_HASH
    assert hello.tick_rate == 100
    assert text(hello.robot) == "shieldbot"
    assert hello.session == rig.seed
    assert hello.session_time_out == 1000
    expected = messages.Devices.SERVO | messages.Devices.ENCODER | messages.Devices.WHISKER
    assert hello.devices == expected | messages.Devices.INFRARED | messages.Devices.PING


@pytest.mark.promise("Asks for the identity.", "name of the pin map that the image was built for")
def test_identity_names_firmware_compiler_and_pin_map(rig: Rig) -> None:
    identity = rig.ask(messages.Identify(), messages.Identity)
    assert text(identity.firmware_version) and text(identity.compiler)
    assert text(identity.pin_map) == load_robot("shieldbot").pin_map


@pytest.mark.promise("How the board understands one message. An index beyond the last gives id 0.")
def test_board_describes_every_message(rig: Rig) -> None:
    hello = rig.next(messages.Hello, within_s=0.3)
    reported = {}
    for index in range(len(messages.MESSAGES)):
        said = rig.ask(messages.Describe(index, hello.board_nonce), messages.Description)
        assert (said.index, said.count) == (index, len(messages.MESSAGES))
        reported[said.id] = (said.length, said.hash)
    assert reported == {number: (kind.LENGTH, messages.HASHES[number]) for number, kind in messages.MESSAGES.items()}


@pytest.mark.promise(
    "Everything the board knows, once per control tick",
    "`time` is the board's, in microseconds since its clock started",
)
def test_telemetry_comes_once_per_tick_with_board_time(rig: Rig) -> None:
    rig.latest()
    frames = rig.listen(1.0)
    assert 99 <= len(frames) <= 101
    for before, after in itertools.pairwise(frames):
        assert after.tick - before.tick == 1
        assert abs(after.time - before.time - 10_000) <= 1
    assert rig.decoder.bad == rig.decoder.lost == 0


@pytest.mark.promise(
    "sequence number of the last set-point that was accepted", "A host sends at most one for each telemetry"
)
def test_setpoint_is_acknowledged_by_its_sequence_number(rig: Rig) -> None:
    sequence = rig.drive(0.0, 0.0)
    assert rig.latest().setpoint_sequence == sequence


@pytest.mark.promise(
    "of get_parameter and set_parameter, refused or not: the value in force", "outside the parameter's range"
)
def test_parameter_is_set_read_and_refused_out_of_range(rig: Rig) -> None:
    spec = messages.PARAMETERS["servo_left_centre"]
    answer = rig.request(messages.SetParameter, spec.id, 24016)
    assert (answer.value, answer.status) == (24016, messages.AnswerStatus.OK)
    answer = rig.request(messages.SetParameter, spec.id, spec.maximum + 1)
    assert (answer.value, answer.status) == (24016, messages.AnswerStatus.OUT_OF_RANGE)
    assert rig.request(messages.GetParameter, spec.id).value == 24016
    assert rig.request(messages.GetParameter, 250).status == messages.AnswerStatus.UNKNOWN_PARAMETER


@pytest.mark.promise(
    "The board carries out the number that follows the last one it carried out; the last one it only answers again"
)
def test_request_that_comes_again_is_only_answered_again(rig: Rig) -> None:
    spec = messages.PARAMETERS["ping_period"]
    first = rig.numbered(messages.SetParameter, spec.id, 9)
    rig.send(first)
    rig.listen(0.05)
    rig.request(messages.GetParameter, spec.id)
    rig.answers.clear()
    other = rig.numbered(messages.SetParameter, spec.id, 11)
    for message in (first, other, other, first, other):
        rig.send(message)
        rig.listen(0.02)
    answers = [(a.number, a.value) for a in rig.answers if isinstance(a, messages.Answer)]
    assert answers == [(other.number, 11)] * 3, "an earlier one is not answered any more"
    assert rig.request(messages.GetParameter, spec.id).value == 11


@pytest.mark.promise("a frame of another session never has a matching checksum")
def test_frames_of_an_earlier_session_are_refused(rig: Rig) -> None:
    spec = messages.PARAMETERS["ping_period"]
    wire = rig.encode(rig.numbered(messages.SetParameter, spec.id, 9)) + rig.encode(messages.Stop(1))
    rig.send(messages.Close(rig.seed))
    rig.start()
    before = rig.latest()
    rig.transport.write(wire)
    rig.listen(0.1)
    now = rig.latest()
    assert (now.latch, now.latches) == (before.latch, before.latches)
    assert rig.request(messages.GetParameter, spec.id).value != 9


@pytest.mark.promise("a host that was silent for too long gets the events of the dead-man stop and the latch")
def test_stops_that_no_host_has_heard_of_are_told_in_the_next_session(rig: Rig) -> None:
    """A host has gone in mid-drive: dead-man, end of the session. The next one gets both events, with their times."""
    rig.drive_for(0.5, 0.5, 0.1)
    rig.drive(0.5, 0.5)
    answered, since = rig.telemetry[-1], len(rig.events)
    rig.alive = rig.acknowledges = False
    rig.listen(3.0)
    assert rig.hello is not None and rig.hello.session == 0
    del rig.events[since:]
    rig.acknowledges = True
    rig.start()
    rig.listen(0.1)
    reported = rig.events[since:]
    assert [(event.number, event.kind, event.value) for event in reported] == [
        (1, messages.EventKind.DEAD_MAN, answered.tick & 0xFFFF),
        (2, messages.EventKind.LATCH, messages.Latch.SESSION_ENDED),
        (3, messages.EventKind.LATCH, messages.Latch.NONE),
    ]
    after_ms = [(event.time - answered.time) / 1000 for event in reported]
    assert 250 <= after_ms[0] < 270 and 1000 <= after_ms[1] <= 1040 and after_ms[2] > 2900


@pytest.mark.promise("sends it again after `retry_time` until `acknowledge` brings its number")
def test_event_is_sent_again_until_it_is_acknowledged(rig: Rig) -> None:
    rig.arm()
    rig.listen(0.1)
    rig.acknowledges = False
    rig.events.clear()
    rig.stop()
    rig.listen(0.2)
    assert len(rig.events) >= 5 and len(set(rig.events)) == 1
    assert (rig.events[0].kind, rig.events[0].value) == (messages.EventKind.LATCH, messages.Latch.STOP_COMMAND)
    rig.send(messages.Acknowledge(rig.events[0].number))
    rig.listen(0.02)
    rig.events.clear()
    rig.listen(0.2)
    assert rig.events == []


@pytest.mark.promise("times that a good frame followed bad ones", "frames refused: length, checksum, stuffing or seed")
def test_garbage_is_survived_and_never_acted_upon(rig: Rig) -> None:
    draw = random.Random(7)
    for _ in range(20):
        rig.transport.write(draw.randbytes(200))
        rig.listen(0.01)
    # damaged set-points: one bit of each frame is wrong
    for _ in range(50):
        damaged = bytearray(frame.encode(messages.SetpointSignal.ID, 5, rig.signal(0.9, 0.9, 2000).pack(), rig.seed))
        damaged[draw.randrange(1, len(damaged) - 1)] ^= 1 << draw.randrange(8)
        rig.transport.write(bytes(damaged))
        rig.listen(0.01)
    now = rig.latest()
    assert now.pulse_left == now.pulse_right == 0, "a damaged set-point moved the robot"
    counted = rig.next(messages.Counters, within_s=0.7)
    assert counted.bad >= 50 and counted.resynchronised > 0
    sequence = rig.drive(0.0, 0.0)
    assert rig.latest().setpoint_sequence == sequence, "the board no longer listens"
    assert rig.decoder.bad == 0


@pytest.mark.promise("**telemetry**: the latest counts")
@pytest.mark.parametrize("requests_per_tick", [1, 2, 5, 10, 20])
@pytest.mark.parametrize(
    "request_message", [messages.Identify(), messages.ClockProbe(1), messages.GetParameter(2, 1)], ids=type_name
)
def test_requests_do_not_silence_telemetry(rig: Rig, request_message: Any, requests_per_tick: int) -> None:
    """Telemetry comes every tick, however many requests and wherever in the tick they fall."""
    probe = messages.ClockProbe(1)  # keeps the session, which requests of the handshake do not
    wire = frame.encode(probe.ID, 0, probe.pack(), rig.seed)
    wire += frame.encode(request_message.ID, 0, request_message.pack(), rig.seed) * requests_per_tick
    rig.latest()
    for phase in range(5):
        before = len(rig.telemetry)
        for _ in range(20):
            rig.transport.write(wire)
            rig.listen(0.010)
        assert len(rig.telemetry) - before >= 19, f"phase {phase}"
        rig.listen(0.102)  # the answers that still wait; and the next phase
    for earlier, later in itertools.pairwise(rig.telemetry):
        assert later.tick - earlier.tick == 1


@pytest.mark.promise(
    "A `clock_probe` is answered at once", "lies between its sending and its return by the host's clock"
)
def test_one_clock_fits_all_answers_to_probes(rig: Rig) -> None:
    offsets = []
    for token in range(60):
        sent = rig.transport.now()
        rig.send(messages.ClockProbe(token + 1))
        answer = rig.first(messages.ClockAnswer, lambda answer: answer.token > 0, 0.1, "the answer to a probe")
        assert answer.token == token + 1
        offsets.append((sent - answer.time / 1e6, rig.transport.now() - answer.time / 1e6))
        rig.listen(0.0077)
    assert max(low for low, _ in offsets) <= min(high for _, high in offsets), "no clock fits all of them"


@pytest.mark.promise("`task_time` of one task after another, in the order of their numbers, then `counters`")
@pytest.mark.promise("A time in the message is the longest of the session so far")
def test_times_of_tasks_and_counters_take_turns_of_four_ticks(rig: Rig) -> None:
    begun = len(rig.heard)
    rig.listen(2.0)
    tick, own = 0, []
    for message in rig.heard[begun:]:
        if isinstance(message, messages.Telemetry):
            tick = message.tick
        elif isinstance(message, messages.TaskTime | messages.Counters):
            own.append((tick, message))
    assert {after[0] - before[0] for before, after in itertools.pairwise(own)} <= {3, 4, 5} and len(own) >= 48
    turns = [message.task if isinstance(message, messages.TaskTime) else len(messages.Task) for _, message in own]
    assert turns == [(turns[0] + n) % (len(messages.Task) + 1) for n in range(len(turns))]
    longest = dict.fromkeys(messages.Task, 0)
    for _, message in own:
        if isinstance(message, messages.TaskTime):
            task = messages.Task(message.task)
            assert message.longest >= longest[task]
            longest[task] = message.longest
