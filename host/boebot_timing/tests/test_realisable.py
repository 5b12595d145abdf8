"""The notes' timing rule: sums by hand, a worked Boe-Bot, and runs that are refused or forced."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

import boebot
from boebot import Member
from boebot.description.robots import RobotDescription, load_robot, robot_names
from boebot.errors import BoebotError, NotRealisableError
from boebot.running import loop
from boebot_timing import realisable
from boebot_timing.realisable import BoardTimes, judge, telemetry_ticks
from boebot_timing.table import SensorRow, Table, TaskRow
from command import boebot as command
from peer import InProcess, Peer

SENSORS = ("infrared_left", "infrared_right", "infrared_back_left", "infrared_back_right")
PING = SensorRow("ping", 18_500, 5, 20_000)


def with_readings(count: int, reading_s: float, **more: float) -> RobotDescription:
    """The notes' robot with that number of IR sensors, each of which takes that time to read."""
    robot = load_robot("arsim")
    sensor = msgspec.structs.replace(robot.device["infrared_left"], reading_s=reading_s, **more)
    others = {name: device for name, device in robot.device.items() if not name.startswith("infrared")}
    return msgspec.structs.replace(robot, device=others | dict.fromkeys(SENSORS[:count], sensor))


def with_ping(period_ticks: int) -> RobotDescription:
    robot = load_robot("shieldbot")
    ping = msgspec.structs.replace(robot.device["ping"], period_ticks=period_ticks)
    return msgspec.structs.replace(robot, device=robot.device | {"ping": ping})


# ---- E17: the sum against the step ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("count", "reading_ms", "brain_ms", "fits"),
    [
        (2, 3.0, 1.0, True),  # 7 < 10
        (4, 3.0, 1.0, False),  # 13: the notes' two more sensors
        (2, 4.5, 1.0, False),  # just 10: the rule wants less
        (2, 4.5, 0.99, True),
        (3, 3.0, 0.0, True),
    ],
)
def test_readings_in_turn_add_up(count: int, reading_ms: float, brain_ms: float, fits: bool) -> None:
    verdict = judge(with_readings(count, reading_ms / 1000), 0.01, brain_s=brain_ms / 1000)
    assert verdict.seconds == pytest.approx((count * reading_ms + brain_ms) / 1000)
    assert verdict.is_realisable == fits


def test_verdict_names_what_breaks_and_what_mends() -> None:
    verdict = judge(with_readings(4, 0.003), 0.01)
    assert verdict.sentence == (
        "robot 'arsim' with a brain period of 10 ms is not realisable: infrared_back_right, 3 ms, ends 12 ms after the "
        "step began, and all 4 events need 12 ms; expected a period of 20 ms or an own period_s for infrared_left, "
        "which then holds its reading in between"
    )
    assert judge(with_readings(4, 0.003), 0.02).is_realisable, "the one"
    assert judge(with_readings(4, 0.003, period_s=0.04), 0.01).is_realisable, "the other"
    slow = judge(with_readings(2, 0.003), 0.01, brain_s=0.006)
    assert "a step of the brain of less than 4 ms" in slow.faults[0]


def test_held_reading_needs_a_period_that_it_fits_into() -> None:
    verdict = judge(with_readings(1, 0.05, period_s=0.04), 0.01)
    assert verdict.faults == (
        "infrared_left every 40 ms cannot be, a reading takes 50 ms; expected a period_s of at least 0.06",
    )


# ---- with a board ---------------------------------------------------------------------------------------------------


def test_ping_at_every_tick_cannot_be() -> None:
    board = BoardTimes((PING,))
    verdict = judge(with_ping(1), 0.01, board=board)
    assert verdict.faults == (
        "ping every 10 ms cannot be, a reading takes 18.5 ms; expected a period_ticks of at least 2",
    )
    assert judge(with_ping(2), 0.01, board=board).is_realisable
    sampled = judge(with_ping(5), 0.01, board=board)
    assert (
        sampled.is_realisable
        and "it is sampled every 50 ms, and the brain sees each of them 5 times" in (sampled.notes[0])
    )
    assert judge(load_robot("shieldbot-basic"), 0.01, board=board).events[-1].name != "ping", "it has none"


def test_line_and_brain_are_on_the_path() -> None:
    """At 115,200 bit/s a byte takes 86.8 us; the sum is that of both frames, the brain and the board's work."""
    board = BoardTimes(telemetry_s=0.001, set_point_s=0.0005)
    verdict = judge(load_robot("shieldbot"), 0.01, board=board, brain_s=0.002, baud=115_200)
    bytes_ = realisable.TELEMETRY_BYTES + realisable.COMMAND_BYTES
    assert verdict.seconds == pytest.approx(0.0035 + bytes_ * 10 / 115_200)
    ends = [event.end for event in verdict.events]
    assert ends == sorted(ends) and ends[-1] == pytest.approx(verdict.seconds)


def test_faster_line_is_named_where_it_would_do() -> None:
    """47 B up and 16 B down at 57,600 bit/s are 10.9 ms, at 115,200 half of that."""
    verdict = judge(load_robot("shieldbot"), 0.02, brain_s=0.01, baud=57_600)
    assert not verdict.is_realisable and verdict.faults[-1] == "a line of 115200 bit/s would do, too"
    assert judge(load_robot("shieldbot"), 0.02, brain_s=0.01, baud=115_200).is_realisable


def test_line_too_slow_for_each_step_is_no() -> None:
    """47 bytes at 9600 bit/s are 49.0 ms, at half of the line 97.9: every 100 ms. At 19,200 bit/s every 50 ms."""
    verdict = judge(load_robot("shieldbot"), 0.05, baud=9600)
    assert verdict.faults == (
        "telemetry, 47 B, comes every 100 ms over a line of 9600 bit/s, which a step every 50 ms does not go with; "
        "expected a period of 100 ms or a line of 19200 bit/s",
    )
    assert verdict.breaking == ["telemetry, 47 B"] and "with a brain period of 50 ms is not" in verdict.sentence
    assert judge(load_robot("shieldbot"), 0.1, baud=9600).is_realisable
    assert judge(load_robot("shieldbot"), 0.05, baud=19_200).is_realisable
    between = judge(load_robot("shieldbot"), 0.07, baud=19_200)
    assert "expected a period of 100 ms or a line of 115200 bit/s" in between.faults[0], "10 ms, as 20 ms do not go"


def test_full_step_over_a_slow_line_wants_a_period_that_the_line_goes_with() -> None:
    """47.9 + 16.7 ms of the line and 40 of the brain are 104.6 ms: of the multiples of 100 ms the second."""
    robot = load_robot("shieldbot")
    verdict = judge(robot, 0.1, baud=9600, brain_s=0.04)
    assert "expected a period of 200 ms" in verdict.faults[0]
    assert verdict.faults[1] == "a line of 19200 bit/s would do, too"


def slow_robot() -> RobotDescription:
    robot = load_robot("shieldbot")
    uart = msgspec.structs.replace(robot.device["uart"], baud=9600)
    return msgspec.structs.replace(robot, device=robot.device | {"uart": uart})


def test_run_over_a_slow_line_is_refused_and_takes_the_longer_period_by_force(monkeypatch: pytest.MonkeyPatch) -> None:
    """A board whose line is as slow as the description says sends telemetry every 100 ms."""

    def slow_board(url: object, request: object) -> InProcess:
        peer = Peer()
        peer.telemetry_period = 10
        return InProcess(peer)

    monkeypatch.setattr(loop, "open_world", slow_board)
    robot = slow_robot()
    with pytest.raises(NotRealisableError, match=r"telemetry, .* expected a period of 100 ms or a line of 19200 bit/s"):
        boebot.run(lambda robot: None, robot=robot, period=0.05, seconds=1)
    forced = boebot.run(lambda robot: None, robot=robot, period=0.05, seconds=1, force_timing=True)
    verdict = judge(robot, 0.05, board=realisable.of_image(robot))
    assert forced.period == pytest.approx(verdict.forced_s) == pytest.approx(0.1)
    assert forced.unrealisable == verdict.sentence
    fine = boebot.run(lambda robot: None, robot=robot, period=0.1, seconds=1)
    assert fine.period == pytest.approx(0.1) and fine.unrealisable is None


def test_json_names_the_events_that_break() -> None:
    robot = load_robot("shieldbot")
    assert judge(robot, 0.05, baud=123).as_dict()["breaking_events"] == [
        f"telemetry, {realisable.TELEMETRY_BYTES} B"
    ]  # in 3.7 s
    assert judge(robot, 0.05).as_dict()["breaking_events"] == []


def test_worked_example_of_a_boe_bot() -> None:
    """The rule of Fig. 3.2 by hand: with a sonar of 19.5 ms in the step the sum is 24 ms: 50 ms do, 20 ms not;
    without it they do. Its readings in turn, as by one processor; the line as time of the first and last event."""
    times = {"whiskers": 0.1, "infrared": 0.4, "sonar": 19.5, "telemetry": 2.1, "command": 0.9}
    template = load_robot("arsim").device["infrared_left"]

    def robot(names: list[str]) -> RobotDescription:
        devices = {name: msgspec.structs.replace(template, reading_s=times[name] / 1000) for name in names}
        base = load_robot("arsim")
        kept = {name: device for name, device in base.device.items() if name.startswith("motor")}
        return msgspec.structs.replace(base, device=kept | devices)

    everything = judge(robot(list(times)), 0.05, brain_s=0.001)
    assert everything.is_realisable and everything.seconds == pytest.approx(0.024)
    assert not judge(robot(list(times)), 0.02, brain_s=0.001).is_realisable
    assert judge(robot([name for name in times if name != "sonar"]), 0.02, brain_s=0.001).is_realisable


@pytest.mark.parametrize(
    ("baud", "ticks"), [(1_000_000, 1), (500_000, 1), (115_200, 1), (57_600, 2), (19_200, 5), (9_600, 10)]
)
def test_telemetry_fills_half_of_the_line(baud: int, ticks: int) -> None:
    """Frames of 47 bytes take 0.47, 0.94, 4.08, 8.16, 24.5, 49.0 ms; twice that, in 1, 2, 5, 10, ... ticks."""
    assert telemetry_ticks(baud) == ticks


def test_table_of_an_image_gives_the_boards_times() -> None:
    table = Table(
        (TaskRow("first", 1, 0, 1600), TaskRow("late", 4, 2, 4000), TaskRow("telemetry", 4, 0, 3200)), (), (PING,)
    )
    times = BoardTimes.of(table)
    assert times.telemetry_s == pytest.approx(300e-6) and times.set_point_s == pytest.approx(350e-6)
    assert times.sensors == (PING,)


# ---- input that is none ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "options", "sentence"),
    [
        ("shieldbot", {"period_s": 0.0}, "a brain period of 0 ms is none"),
        ("shieldbot", {"period_s": float("nan")}, "a brain period of nan ms is none"),
        ("shieldbot", {"period_s": 0.015}, "a brain period of 15 ms does not fit; expected a multiple of 10 ms"),
        ("shieldbot", {"period_s": 0.81}, "a brain period of 810 ms is too long; expected at most 800 ms"),
        ("shieldbot", {"baud": 0}, "a line of 0 bit/s is none"),
        ("shieldbot", {"brain_s": -1.0}, "a step of the brain cannot take -1000 ms"),
        ("arsim", {"baud": 9600}, "robot 'arsim' has no board"),
    ],
)
def test_bad_input_is_said(robot: str, options: dict[str, float], sentence: str) -> None:
    with pytest.raises(BoebotError, match=sentence):
        judge(load_robot(robot), **({"period_s": 0.05} | options))  # type: ignore[arg-type]


# ---- runs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in robot_names() if load_robot(name).takes_brain])
@pytest.mark.parametrize("period_s", [0.01, 0.02, 0.05])
def test_bundled_robots_are_not_refused(name: str, period_s: float) -> None:
    robot = load_robot(name)
    assert judge(robot, period_s, board=realisable.of_image(robot)).is_realisable


def test_run_is_refused_before_anything_moves() -> None:
    steps: list[float] = []
    with pytest.raises(NotRealisableError, match=r"infrared_back_right, 3 ms, ends 12 ms .* --force-timing"):
        boebot.run(lambda robot: steps.append(robot.time), robot=with_readings(4, 0.003), period=0.01, seconds=0.1)
    assert steps == []
    assert boebot.run(robot=with_readings(2, 0.003), period=0.01, seconds=0.1).unrealisable is None


def test_several_robots_are_refused_and_the_right_one_named() -> None:
    members = [Member(robot="arsim"), Member(robot=with_readings(4, 0.003), period=0.01)]
    with pytest.raises(NotRealisableError, match="robot 2: robot 'arsim' with a brain period of 10 ms is not"):
        boebot.run_together(members, seconds=0.1)
    forced = boebot.run_together(members, seconds=0.1, force_timing=True)
    assert [one.unrealisable is None for one in forced.robots] == [True, False]


FOUR = """
extends = "arsim"
name = "four"
[device.infrared_left]
reading_s = 0.003
[device.infrared_right]
reading_s = 0.003
[device.infrared_back_left]
type = "infrared_proximity"
position_m = [-0.141421, 0.141422]
heading_rad = 2.3562
reading_s = 0.003
[device.infrared_back_right]
type = "infrared_proximity"
position_m = [-0.141421, -0.141422]
heading_rad = -2.3562
reading_s = 0.003
"""


def test_command_refuses_and_the_record_of_a_forced_run_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "four.toml", tmp_path / "out"
    file.write_text(FOUR)
    arguments = ("run", "wander", "--robot", str(file), "--seconds", "0.2", "--period", "10ms", "--out", str(out))
    code, _, err = command(capsys, *arguments)
    assert code == 1 and "infrared_back_right, 3 ms, ends 12 ms after the step began" in err
    assert not (out / "summary.json").exists()
    code, _, err = command(capsys, *arguments, "--force-timing")
    assert code == 0 and "forced: robot 'four' with a brain period of 10 ms is not realisable" in err
    assert "infrared_back_right" in json.loads((out / "summary.json").read_text())["unrealisable"]
    assert command(capsys, *arguments[:-4], "--period", "20ms", "--out", str(out))[0] == 0
    assert json.loads((out / "summary.json").read_text())["unrealisable"] is None


def test_steps_longer_than_the_period_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock of the test's own: each third step takes 30 ms, the others 5."""
    now = [0.0]
    monkeypatch.setattr("boebot.running.stepping.wall.perf_counter", lambda: now[0])

    def step(robot: boebot.Robot) -> None:
        now[0] += 0.03 if robot.tick % 6 == 0 else 0.005

    result = boebot.run(step, robot="arsim", period=0.02, seconds=0.6)
    assert (result.steps, result.long_steps) == (30, 10) and result.longest_step == pytest.approx(0.03)
    figures = result.wall_clock()
    assert (figures["long_steps"], figures["longest_step_s"], figures["wall_time_s"]) == (10, 0.03, 0.4)
