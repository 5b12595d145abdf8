"""Slow devices from the board to the brain and back: what it sees and asks of them, and what the record keeps.

The board is the model of peer.py, whose truth is the protocol's page.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from channel import Channel
from hypothesis import given, settings
from hypothesis import strategies as st

from boebot.description.board_parameters import parameters_of
from boebot.description.robots import load_robot
from boebot.devices.latest import NO_MESSAGES, Latest, without_readings
from boebot.errors import BrainError
from boebot.link import messages
from boebot.link.link import Link
from boebot.record.columns import newest_messages
from boebot.result import RunResult
from boebot.robot import Equipment, Observation, Robot
from boebot.running import loop
from boebot.running.board_driver import message_ticks
from boebot.running.tasks import Request
from peer import FIELD_COUNTS, InProcess, Peer

BOEBOT, BASIC, SHIELDBOT = (load_robot(name) for name in ("boebot", "shieldbot-basic", "shieldbot"))
TICK_S = 0.01
NOTHING = without_readings(messages.DevicesTelemetry)


def latest(message: messages.DevicesTelemetry, tick: int) -> Latest:
    """That message as an observation of `tick` has it."""
    return Latest({messages.DevicesTelemetry: message}, tick)


def run_on(
    peer: Peer, brain: object, monkeypatch: pytest.MonkeyPatch, channel: Channel | None = None, **options: object
) -> RunResult:
    session = InProcess(peer, channel)
    monkeypatch.setattr(loop, "open_world", lambda url, requests: session)
    result: RunResult = loop.execute(Request.single(brain, robot=peer.robot, **options))
    return result


def test_brain_sees_what_the_board_sends(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(BOEBOT)
    seen: list[Observation] = []
    result = run_on(peer, lambda robot: seen.append(robot.observation), monkeypatch, seconds=1)
    assert result.error is None and len(seen) == 20
    last = seen[-1]
    assert last.light_left.decay_time == pytest.approx(800e-6)
    assert last.light_right.decay_time == pytest.approx(1600e-6)
    assert last.light_left.brightness == pytest.approx(1250) and last.light_left.valid
    assert last.battery.voltage == pytest.approx(2 * 3.6, abs=2 * 5.0 / 1024)
    assert last.compass.heading == pytest.approx(peer.heading, abs=1 / FIELD_COUNTS) and last.compass.valid
    assert last.turret.angle is None and last.turret.valid and last.buzzer.token == 0
    assert not last.analog_infrared.valid, "this board never measures it"


def test_ages_count_on_between_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(BASIC)
    ages: list[tuple[int, float]] = []
    peer.parameters[messages.PARAMETERS["devices_period"].id] = 50
    run_on(peer, lambda robot: ages.append((robot.tick, robot.light_left.age)), monkeypatch, seconds=2, period=0.01)
    # Messages go out at every fiftieth tick, after telemetry: in their own tick they are still on the line.
    sent_at = [(tick - 1) // 50 * 50 for tick, _ in ages]
    expected = [at % 4 * TICK_S + (tick - at) * TICK_S for (tick, _), at in zip(ages, sent_at, strict=True)]
    known = [(age, wanted) for (_, age), wanted in zip(ages, expected, strict=True) if not math.isinf(age)]
    assert len(known) > 150
    assert [age for age, _ in known] == pytest.approx([wanted for _, wanted in known])


@pytest.mark.parametrize(("tick", "since"), [(100, 0), (103, 3), (99, 0), (100 + 2**31 - 1, 2**31 - 1)])
def test_ticks_since_a_message(tick: int, since: int) -> None:
    assert latest(NOTHING._replace(tick=100), tick).of(messages.DevicesTelemetry)[1] == since
    rolled = latest(NOTHING._replace(tick=2**32 - 2), 1)
    assert rolled.of(messages.DevicesTelemetry)[1] == 3, "the count rolls over"


def test_old_readings_lose_their_validity_and_keep_their_value() -> None:
    message = NOTHING._replace(light_left=500, light_right=500, light_age=1, tick=0)
    readers = Equipment(BASIC, TICK_S).readers
    views = [readers["light_left"](None, latest(message, tick)) for tick in (0, 5, 6, 400)]
    assert [view.valid for view in views] == [True, True, False, False]
    assert [view.age for view in views] == pytest.approx([0.01, 0.06, 0.07, 4.01])
    assert all(view.decay_time == 500e-6 for view in views)
    never = readers["light_left"](None, NO_MESSAGES)
    assert not never.valid and math.isinf(never.age) and never.brightness is None
    buzzer = readers["buzzer"](None, NO_MESSAGES)
    assert not buzzer.valid and math.isinf(buzzer.age)


def test_needs_groups_and_refusals() -> None:
    slow = ["lights", "compass", "battery", "analog_infrared", "turret", "buzzer"]
    assert Equipment(BOEBOT, TICK_S).missing(slow) == []
    assert Equipment(BASIC, TICK_S).missing(slow) == ["compass", "battery", "analog_infrared", "turret"]
    robot = Robot("shieldbot", 0.05)
    robot.observation = Observation(
        messages.Telemetry(*(0,) * len(messages.Telemetry._fields)), Equipment(SHIELDBOT, TICK_S), 0.0
    )
    for name in ("light_left", "compass", "battery", "analog_infrared", "turret", "buzzer"):
        with pytest.raises(BrainError, match=f"robot 'shieldbot' has no {name}"):
            getattr(robot, name)
    with pytest.raises(BrainError, match=r"turn_turret\(\): robot 'shieldbot' has no turret"):
        robot.turn_turret(0.1)
    with pytest.raises(BrainError, match=r"release_turret\(\): robot 'shieldbot' has no turret"):
        robot.release_turret()
    with pytest.raises(BrainError, match=r"beep\(\): robot 'shieldbot' has no buzzer"):
        robot.beep(440, 0.1)
    assert robot.slow_command is None


def test_sweep_of_the_description_is_set_and_read(tmp_path: Path) -> None:
    path = tmp_path / "sweeping.toml"
    path.write_text('extends = "shieldbot"\nname = "sweeping"\n[device.infrared]\nsweep = true\n')
    robot = load_robot(path)
    assert parameters_of(robot)["infrared_sweep"] == 1 and parameters_of(SHIELDBOT)["infrared_sweep"] == 0
    message = NOTHING._replace(infrared_zone_left=3, infrared_zone_right=1, infrared_zone_age=2)
    telemetry = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))
    seen = Observation(telemetry, Equipment(robot, TICK_S), 0.0, slow=latest(message, 1))
    assert (seen.infrared_left.zone, seen.infrared_right.zone) == (3, 1)
    unswept = Observation(telemetry, Equipment(SHIELDBOT, TICK_S), 0.0, slow=latest(message, 1))
    assert unswept.infrared_left.zone is None


# ---- commands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda robot: robot.turn_turret(1.61), r"turn_turret\(1\.61\): angles go from -1\.6 to 1\.6 rad"),
        (lambda robot: robot.turn_turret(math.nan), r"turn_turret\(nan\): angles go"),
        (lambda robot: robot.turn_turret("left"), r"turn_turret\('left'\) expects a number"),
        (lambda robot: robot.beep(20, 0.1), r"beep\(20, 0\.1\): a tone of 20 Hz; expected 40 to 8000"),
        (lambda robot: robot.beep(440, 3), r"beep\(440, 3\): a tone of 3 s; expected 0 to 2\.55"),
        (lambda robot: robot.beep(None, "x"), r"beep\(None, 'x'\) expects two numbers"),
        (lambda robot: robot.beep(math.nan, 0.1), "a tone of nan Hz"),
    ],
)
def test_what_the_devices_cannot_do_is_refused(call: object, sentence: str, monkeypatch: pytest.MonkeyPatch) -> None:
    result = run_on(Peer(BOEBOT), call, monkeypatch, seconds=1)
    assert isinstance(result.error, BrainError)
    with pytest.raises(BrainError, match=sentence):
        raise result.error


@pytest.mark.parametrize("loss", [0.0, 0.3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_turret_and_tones_arrive_whatever_is_lost(loss: float, seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each tone once, and the turret where it shall be, though three of ten frames are lost either way."""
    peer = Peer(BOEBOT)
    angles: list[float | None] = []
    last: list[float | None] = []

    def step(robot: Robot) -> None:
        robot.drive(0.1, 0.1)
        if len(angles) < 4 and robot.time >= 0.5 + len(angles):
            angles.append(robot.turret.angle)  # what was asked for a second ago
            if len(angles) < 4:
                robot.turn_turret((0.7, -1.2, 0.0)[len(angles) - 1])
                robot.beep(1000 * len(angles), 0.2)
            else:
                robot.release_turret()
        last.append(robot.turret.angle)

    channel = Channel(loss=loss, duplication=loss / 3, seed=seed)
    result = run_on(peer, step, monkeypatch, channel, seconds=5)
    assert result.error is None
    assert peer.tones == [(1000, 0.2), (2000, 0.2), (3000, 0.2)]
    assert angles == [None, *(pytest.approx(angle, abs=2e-4) for angle in (0.7, -1.2, 0.0))] and last[-1] is None
    assert (result.link["host"]["retransmitted"] > 0) == (loss > 0)


def test_emergency_stop_frees_the_turret_and_silences_the_buzzer(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(BOEBOT)
    angles: dict[float, float | None] = {}

    def step(robot: Robot) -> None:
        at = round(robot.time, 2)
        angles[at] = robot.turret.angle
        if at == 0.2:
            robot.turn_turret(0.5)
        elif at == 0.6:
            robot.beep(440, 2.0)
        elif at == 1.0:
            robot.emergency_stop()
        elif at == 1.2:
            assert peer.sounding_until is None, "the stop has silenced it"
            robot.turn_turret(-0.5)  # waits for `arm`
            robot.beep(880, 0.1)  # moves nothing: sounds at once
        elif at == 1.6:
            assert peer.tones[-1] == (880, 0.1)
            robot.arm()

    result = run_on(peer, step, monkeypatch, seconds=2)
    assert result.error is None
    assert angles[0.9] == pytest.approx(0.5, abs=2e-4)
    assert angles[1.15] is None and angles[1.55] is None, "latched: it does not move"
    assert angles[1.95] == pytest.approx(-0.5, abs=2e-4)
    assert peer.turret_pulse == 0, "the end of the run frees it"


def test_turret_turns_back_after_a_reset_and_no_tone_is_repeated(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(BOEBOT)
    session = InProcess(peer)
    monkeypatch.setattr(loop, "open_world", lambda url, requests: session)
    seen: list[tuple[float, float | None]] = []

    def step(robot: Robot) -> None:
        robot.drive(0.1, 0.1)
        if robot.time == 0:
            robot.turn_turret(0.8)
            robot.beep(440, 0.1)
        seen.append((robot.time, robot.turret.angle))

    session.before_tick = lambda tick: peer.reset() if peer.starts == 1 and session.now() > 1.5 else None
    result = loop.execute(Request.single(step, robot=BOEBOT, seconds=4))
    assert result.error is None and result.resets == 1
    assert peer.tones == [(440, 0.1)]
    assert seen[-1][1] == pytest.approx(0.8, abs=2e-4)
    ages = result.series.number("turret", "age")
    assert len(ages) == result.ticks
    assert np.nanmax(ages) < 0.08, "nothing of before the reset stands after it"
    assert np.nanmin(ages) >= 0.0


def test_link_counts_lost_messages_of_slow_devices_as_lost_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    peer = Peer(BASIC)
    lost: list[messages.Message] = []
    send = peer._send

    def lossy(message: messages.Message) -> None:
        send(message)
        if isinstance(message, messages.DevicesTelemetry) and message.tick > 50 and len(lost) < 7:
            lost.append(message)
            peer._frames.pop()

    monkeypatch.setattr(peer, "_send", lossy)
    link = Link(InProcess(peer))
    link.open()
    peer.parameters[messages.PARAMETERS["devices"].id] = int(messages.Devices.LIGHT)
    end = link.transport.now() + 1.0
    while link.transport.now() < end:
        link.poll(0.1)
    assert len(lost) == 7 and link.counters().lost == 7
    assert len(link.devices.fetch()) > 30 and link.devices.latest and link.devices.fetch() == []


# ---- the record ------------------------------------------------------------------------------------------------------


def test_run_csv_has_the_slow_devices(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    result = run_on(Peer(BOEBOT), lambda robot: robot.turn_turret(0.25), monkeypatch, seconds=1)
    result.save(tmp_path, csv=True)
    with (tmp_path / "run.csv").open() as file:
        rows = list(csv.DictReader(file))
    last = rows[-1]
    assert (last["light_left_decay_time_s"], last["light_right_decay_time_s"], last["turret_angle_rad"]) == (
        "0.000800",
        "0.001600",
        "0.2500",
    )
    assert float(last["battery_voltage_v"]) == pytest.approx(7.2, abs=0.01) and last["analog_infrared_distance_m"] == ""
    plain = run_on(Peer(SHIELDBOT), lambda robot: None, monkeypatch, seconds=0.5)
    assert not plain.record.rows("devices_telemetry") and not any("light" in name for name in plain.series.columns())


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_arrays_have_the_newest_message_of_each_tick(data: st.DataObject) -> None:
    """Against the definition, over restarts of the board and the roll-over of its ticks."""
    ticks: list[int] = []
    starts: list[int] = []
    sent_at: list[tuple[int, messages.DevicesTelemetry]] = []
    expected: list[tuple[int, int] | None] = []  # (token, ticks since)
    for start in range(data.draw(st.integers(1, 3))):
        first = data.draw(st.sampled_from([5, 1000, 2**32 - 7]) if start == 0 else st.just(3))
        gaps = data.draw(st.lists(st.integers(1, 4), min_size=2, max_size=15))
        newest: tuple[int, int] | None = None
        at = 0
        for gap in gaps:
            at += gap
            if data.draw(st.booleans()):
                newest = (len(sent_at) % 200 + 1, at - data.draw(st.integers(0, gap - 1)))
                message = NOTHING._replace(tick=(first + newest[1]) % 2**32, buzzer_token=newest[0])
                sent_at.append((len(ticks), message))
            expected.append(None if newest is None else (newest[0], at - newest[1]))
            ticks.append((first + at) % 2**32)
            starts.append(start)
    restarted = np.diff(np.array(starts), prepend=0) > 0
    rows, sent = [row for row, _ in sent_at], [message for _, message in sent_at]
    newest_of, since = newest_messages(rows, sent, np.array(ticks, dtype=np.uint32), restarted)
    for index, age, wanted in zip(newest_of, since, expected, strict=True):
        if wanted is None:
            assert index == -1 and math.isnan(age)
        else:
            assert (sent[index].buzzer_token, age) == wanted


# ---- how long a reading is fresh -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("period", "baud", "ticks"),
    [(2, 500_000, 2), (2, 115_200, 2), (50, 500_000, 50), (2, 19_200, 9), (2, 9600, 17), (2, 0, 2)],
)
def test_messages_take_a_quarter_of_the_line_at_most(period: int, baud: int, ticks: int) -> None:
    """39 bytes of 10 bits each, in ticks of 10 ms: the firmware's figure (17 on the slowest line)."""
    assert message_ticks(period, 10 / baud if baud else 0.0, TICK_S) == ticks


@pytest.mark.parametrize("period", [2, 20])
def test_readings_stay_fresh_from_message_to_message(period: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However rarely the board sends: fresh up to three periods of the messages."""
    peer = Peer(BASIC)
    peer.parameters[messages.PARAMETERS["devices_period"].id] = period
    seen: list[tuple[float, bool]] = []

    def step(robot: Robot) -> None:
        seen.append((robot.light_left.age, robot.light_left.valid))
        if robot.time >= 1.0:
            peer.parameters[messages.PARAMETERS["devices"].id] = 0  # it says no more

    run_on(peer, step, monkeypatch, seconds=2.5, period=0.01)
    limit = 3 * max(period, 2) * TICK_S + 1e-9
    found = [(age, valid) for age, valid in seen if not math.isinf(age)]
    assert all(valid == (age <= limit) for age, valid in found)
    assert all(valid for _, valid in found[:80]) and not found[-1][1]
