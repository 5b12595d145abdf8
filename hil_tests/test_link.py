"""What every board must do on its serial line: handshake, telemetry, parameters, and surviving garbage."""

from __future__ import annotations

import itertools
import random
from typing import Any

import pytest

from boebot.link import frame, messages
from boebot.robots import load_robot
from hil_tests.rig import Rig


def type_name(value: Any) -> str:
    return type(value).__name__


def text(field: bytes) -> str:
    return field.rstrip(b"\0").decode()


def test_handshake_names_version_schema_and_pin_map(rig: Rig) -> None:
    hello = rig.start()
    assert hello.protocol_version == messages.PROTOCOL_VERSION
    assert hello.schema_hash == messages.SCHEMA_HASH
    assert hello.tick_rate == 100
    assert text(hello.pin_map) == load_robot("shieldbot").pin_map
    expected = messages.Devices.SERVOS | messages.Devices.ENCODERS | messages.Devices.WHISKERS
    assert hello.devices == expected | messages.Devices.INFRARED | messages.Devices.PING


def test_identity_names_firmware_and_compiler(rig: Rig) -> None:
    identity = rig.ask(messages.Identify(), messages.Identity)
    assert text(identity.firmware_version) and text(identity.compiler)


def test_telemetry_comes_once_per_tick_with_board_time(rig: Rig) -> None:
    rig.latest()
    frames = rig.listen(1.0)
    assert 99 <= len(frames) <= 101
    for before, after in itertools.pairwise(frames):
        assert after.tick - before.tick == 1
        assert abs(after.time - before.time - 10_000) <= 1
    assert rig.decoder.bad == rig.decoder.lost == 0


def test_setpoint_is_acknowledged_by_its_sequence_number(rig: Rig) -> None:
    sequence = rig.drive(0.0, 0.0)
    assert rig.latest().setpoint_sequence == sequence


def test_parameter_is_set_read_and_refused_out_of_range(rig: Rig) -> None:
    spec = messages.PARAMETERS["servo_left_centre"]
    answer = rig.ask(messages.SetParameter(spec.id, 24016), messages.Parameter)
    assert (answer.value, answer.status) == (24016, messages.ParameterStatus.OK)
    rig.answers.clear()
    answer = rig.ask(messages.SetParameter(spec.id, spec.maximum + 1), messages.Parameter)
    assert (answer.value, answer.status) == (24016, messages.ParameterStatus.OUT_OF_RANGE)
    rig.answers.clear()
    answer = rig.ask(messages.GetParameter(spec.id), messages.Parameter)
    assert answer.value == 24016
    rig.answers.clear()
    answer = rig.ask(messages.GetParameter(250), messages.Parameter)
    assert answer.status == messages.ParameterStatus.UNKNOWN_PARAMETER


def test_garbage_is_survived_and_never_acted_upon(rig: Rig) -> None:
    draw = random.Random(7)
    for _ in range(20):
        rig.transport.write(draw.randbytes(200))
        rig.listen(0.01)
    # damaged set-points: one bit of each frame is wrong
    for _ in range(50):
        damaged = bytearray(
            frame.encode(messages.SetpointSignal.ID, 5, messages.SetpointSignal(9000, 9000, 2000, 0).pack())
        )
        damaged[draw.randrange(1, len(damaged) - 1)] ^= 1 << draw.randrange(8)
        rig.transport.write(bytes(damaged))
        rig.listen(0.01)
    now = rig.latest()
    assert now.pulse_left == now.pulse_right == 0, "a damaged set-point moved the robot"
    assert now.frames_bad > 0
    sequence = rig.drive(0.0, 0.0)
    assert rig.latest().setpoint_sequence == sequence, "the board no longer listens"
    assert rig.decoder.bad == 0


@pytest.mark.parametrize("requests_per_tick", [1, 2, 5, 10, 20])
@pytest.mark.parametrize(
    "request_message", [messages.HelloRequest(1), messages.Identify(), messages.GetParameter(1)], ids=type_name
)
def test_requests_do_not_silence_telemetry(rig: Rig, request_message: Any, requests_per_tick: int) -> None:
    """Telemetry comes every tick, however many requests and wherever in the tick they fall."""
    wire = frame.encode(request_message.ID, 0, request_message.pack()) * requests_per_tick
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
