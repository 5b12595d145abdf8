"""Faults of a run: how they are written, what they do, that they fire, and that a run repeats with them."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import boebot
from boebot.description.robots import load_robot
from boebot.errors import BoardError, BoebotError, CallError
from boebot.record.interventions import Fault, happenings
from boebot.result import read_run
from boebot.robot import Robot
from boebot.running.again import again, recorded
from boebot.running.faults import UnfiredError, known, read
from peer import Peer, pty
from sim_bridge.tests.boards.avr.avr_program import compiled

SHIELDBOT = load_robot("shieldbot")
TIME_TO_LIVE_S = 0.25
STOPPED_S = TIME_TO_LIVE_S + 0.0025 + 0.020  # until the last pulse begins: + a servo's slot and a frame


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


# ---- how they are written --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("serial.dropped@3s..5s", Fault("serial.dropped", 0.01, 3.0, 5.0)),
        ("serial.dropped=5%@3..5", Fault("serial.dropped", 0.05, 3.0, 5.0)),
        ("serial.delayed=20ms@0.5", Fault("serial.delayed", 0.02, 0.5)),
        ("cable.out@500ms..1min", Fault("cable.out", None, 0.5, 60.0)),
        ("board.reset@1", Fault("board.reset", "external", 1.0)),
        ("board.reset=watchdog@1", Fault("board.reset", "watchdog", 1.0)),
    ],
)
def test_read(text: str, fault: Fault) -> None:
    assert read(text, SHIELDBOT) == fault
    assert read(str(fault), SHIELDBOT) == fault, "what it says of itself can be read"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("serial.droped@3", "robot 'shieldbot' has no 'serial.droped'; did you mean 'serial.dropped'?"),
        ("serial.explosions@3", "expected one of serial.dropped"),
        ("compass.off@3", "boebot faults lists all"),
        ("serial.dropped", "it says no time"),
        ("serial.dropped@", "'' is no time"),
        ("serial.dropped@3..", "'' is no time"),
        ("serial.dropped@x..4", "'x' is no time"),
        ("serial.dropped=2@3", "its value is 2.0; expected 0 to 1"),
        ("serial.dropped=nan@3", "its value is nan; expected 0 to 1"),
        ("serial.delayed=3V@3", "'3V' is no time"),
        ("cable.out=1@3", "cable.out takes no value"),
        ("cable.out=@3", "cable.out takes no value"),
        ("serial.delayed=@3", "there is no value behind its ="),
        ("board.reset=power@3", "'power' is none of external, watchdog"),
        ("board.reset@3..4", "board.reset happens at one time; expected no END"),
        ("cable.out@3..2", "ends at 2 s; expected a finite time later than its begin"),
        ("host.stopped@3..inf", "ends at inf s; expected a finite time"),
        ("host.stopped@3..1e9", "fault host.stopped@3s..1000000000s outlasts the run of 5 s; expected an earlier END"),
        ("host.stopped@1", "host.stopped@1s never ends; expected an END"),
        ("serial.delayed=0@1..2", "fault serial.delayed=0@1s..2s changes nothing; expected another value than 0"),
        ("serial.dropped=0@0", "fault serial.dropped=0@0s changes nothing"),
        ("board.brown_out=5@1", "fault board.brown_out=5@1s changes nothing"),
        ("servo_left.weak=100%@1", "fault servo_left.weak=1@1s changes nothing"),
        ("cable.out@1..2 cable.out@1s..2s", "fault cable.out@1s..2s is there twice"),
        ("cable.out@-1", "begins at -1 s; expected a time of the run"),
        ("cable.out@9", "is never: the run ends at 5 s"),
        ("3:cable.out@1", "there is no robot 3 in the run"),
    ],
)
def test_mistakes_are_one_sentence(text: str, sentence: str) -> None:
    with pytest.raises(CallError) as caught:
        boebot.run(straight, on="native", seconds=5.0, faults=text.split())
    assert sentence in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("faults", ["cable.out@1", [3], 7])
def test_a_wrong_kind_is_one_sentence(faults: object) -> None:
    with pytest.raises(BoebotError, match=r"faults is .*; expected"):
        boebot.run(straight, on="native", seconds=5.0, faults=faults)  # type: ignore[arg-type]


def test_what_a_robot_without_a_board_cannot_have() -> None:
    assert not known(load_robot("arsim"))
    with pytest.raises(CallError, match=r"robot 'arsim' has no 'cable\.out'"):
        boebot.run(straight, robot="arsim", seconds=1.0, faults=["cable.out@0.5"])


# ---- what they do ----------------------------------------------------------------------------------------------------


def still_from(result: boebot.RunResult, time_s: float) -> bool:
    """The wheels do not move any more from then on."""
    truth = result.truth
    assert truth is not None and truth.left_speed is not None
    later = truth.time > time_s + result.clock_offset
    return bool(later.any()) and float(np.abs(truth.left_speed[later]).max()) < 1e-3


@pytest.mark.parametrize(
    "fault", ["host.killed@1s", "host.stopped@1s..2s", "cable.out@1s..2s", "host.slow=0.9@1s..1.5s"]
)
def test_motors_stop_where_no_host_speaks(fault: str) -> None:
    """The last pulse begins within the time to live, a slot and a frame of the last set-point, which answers a tick of
    50 ms before at most; the wheel has run down 0.3 s later."""
    result = boebot.run(straight, on="native", arena="empty", seconds=3.0, faults=[fault])
    truth = result.truth
    assert truth is not None and truth.left_speed is not None
    at = truth.time - result.clock_offset
    assert truth.left_speed[(at > 0.8) & (at < 1.0)].min() > 0.05
    from_s = 1.0 + STOPPED_S + 0.3
    window = (at > from_s) & (at < 1.9)
    assert np.abs(truth.left_speed[window]).max() < 1e-3
    if "killed" in fault:
        assert still_from(result, from_s) and result.run_time == pytest.approx(1.0, abs=0.051)
    else:
        assert truth.left_speed[at > 2.8].min() > 0.05, "it drives again"
        assert result.run_time == pytest.approx(3.0)
        assert result.sessions_lost == ("slow" not in fault)


def test_a_host_may_be_killed_while_it_makes_the_board_ready_again() -> None:
    """On boebot, whose parameters are then under way."""
    result = boebot.run(
        straight, "boebot", on="native", seconds=6.0, faults=["board.reset=external@0.351", "host.killed@0.401"]
    )
    assert result.error is None and result.run_time < 0.5
    assert min(result.faults.values()) > 0 and still_from(result, 1.0)


@pytest.mark.parametrize("volts", [2.5, 4.0])
def test_a_brown_out_that_lasts_fires_as_it_begins(volts: float, tmp_path: Path) -> None:
    program = compiled("int main(void) { for (;;) ; }", tmp_path / "waits.elf")
    result = boebot.run(program, seconds=0.3, faults=[f"board.brown_out={volts}@0.1"])
    assert list(result.faults.values()) == [1]


@pytest.mark.parametrize("cause", ["external", "watchdog"])
def test_a_reset_is_at_its_time_and_said_by_the_board(cause: str) -> None:
    result = boebot.run(straight, on="native", seconds=2.0, faults=[f"board.reset={cause}@0.5"])
    assert result.resets == result.sessions_lost == 1 and list(result.faults.values()) == [1]
    ticks = result.record.each_row("telemetry")
    times = [time_s for time_s, _ in ticks]
    gap = max(range(1, len(times)), key=lambda i: times[i] - times[i - 1])
    assert 0.45 - 1e-9 <= times[gap - 1] <= 0.5 and times[gap] < 1.5, "telemetry is back within 1 s"


def test_a_brown_out_resets_the_board() -> None:
    result = boebot.run(straight, on="native", seconds=2.0, faults=["board.brown_out=0@0.5..0.6"])
    assert result.resets == 1 and result.sessions_lost == 1


def test_a_damaged_memory_is_noticed_at_the_next_start() -> None:
    result = boebot.run(straight, on="native", seconds=1.0, faults=["eeprom.corrupted=3@0.5"])
    assert result.faults == {"eeprom.corrupted=3@0.5s": 3}


@pytest.mark.parametrize("board", ["native", "avr"])
def test_damage_on_the_line_is_never_delivered(board: str) -> None:
    """Frames are counted as bad or lost, and each telemetry that the run has is one that the board sent: its ticks go
    up by one, and where they do not, frames are counted as lost."""
    faults = ["serial.flipped=1e-3@0.2..0.8", "serial.dropped=0.01@0.8..1.4", "serial.doubled=0.01@1.4..2"]
    result = boebot.run(straight, on=board, seconds=2.5, faults=faults)
    assert all(result.faults.values()) and len(result.faults) == 3
    assert result.bad_frames and result.lost_frames and result.sessions_lost == 0
    ticks = result.series.raw["tick"].astype(int)
    assert (np.diff(ticks) > 0).all() and np.diff(ticks).max() <= 1 + result.lost_frames


def test_frames_that_come_twice_count_once() -> None:
    """Of telemetry the latest counts: a copy is no loss, no step and no row."""
    plain = boebot.run(straight, on="native", arena="empty", seconds=1.5)
    result = boebot.run(straight, on="native", arena="empty", seconds=1.5, faults=["serial.repeated=1@0.5..1"])
    assert result.link["host"]["duplicate"] >= 48 and result.lost_frames == result.bad_frames == result.late_steps == 0
    assert (result.steps, result.ticks, result.hash) == (plain.steps, plain.ticks, plain.hash)


@pytest.mark.parametrize(("share", "works"), [("1%", True), ("-1%", True), ("8%", False)])
def test_a_bit_rate_that_is_off(share: str, works: bool) -> None:
    """The data sheet asks for an error of 2 % at most at 8 data bits (ATmega328P, table 20-3)."""
    result = boebot.run(straight, on="avr", arena="empty", seconds=1.5, faults=[f"serial.rate={share}@0.5..1"])
    assert result.faults[f"serial.rate={float(share[:-1]) / 100:g}@0.5s..1s"] > 0
    assert (result.overview.dead_man_stops == 0) is works


# ---- that they fire, and repeat --------------------------------------------------------------------------------------


def test_a_run_repeats_with_its_faults(tmp_path: Path) -> None:
    faults = ["serial.flipped=1e-3@0.2..0.8", "host.stopped@1..1.3", "board.reset@1.5", "serial.delayed=30ms@1.6..1.8"]
    first = boebot.run("wander", on="native", seconds=2.0, faults=faults, out=tmp_path)
    read_back = read_run(tmp_path).robots[0]
    assert read_back.faults == first.faults and len(first.faults) == 4
    assert [time_s for time_s, _ in happenings(read_back.record)] == [0.2, 1.0, 1.5, 1.6]
    assert read_back.touched == 0, "no person did it"
    assert again(recorded(tmp_path)).is_equal
    said = ", ".join(f"{name} fired {count}" for name, count in first.faults.items())
    assert json.loads((tmp_path / "summary.json").read_text())["faults"] == said
    assert "fault board.reset=external@1.5s" in (tmp_path / "replay.html").read_text()


def test_what_comes_before_a_fault_is_as_without(tmp_path: Path) -> None:
    def rows(faults: list[str]) -> list[object]:
        record = boebot.run("wander", on="native", seconds=2.0, faults=faults).record
        return [row for name in ("telemetry", "command") for row in record.each_row(name) if row[0] < 1.44] + [
            row[1] for row in list(record.each_row("truth"))[:140]
        ]

    plain = rows([])
    assert len(plain) > 300
    assert plain == rows(["board.reset@1.5"]) == rows(["serial.dropped=1@1.5..2"]) == rows(["host.stopped@1.5..1.6"])


def test_one_that_does_not_fire_is_an_error_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(UnfiredError) as caught:
        boebot.run("wander", on="native", seconds=1.0, faults=["serial.flipped=1e-9@0.5..0.6"], out=tmp_path)
    assert str(caught.value) == (
        "fault serial.flipped=1e-09@0.5s..0.6s did not fire: nothing happened then that it could change"
    )
    assert caught.value.exit_code == 3
    assert again(recorded(tmp_path)).is_equal, "the record has it, too"


def test_of_several_robots_one_may_be_named() -> None:
    members = [boebot.Member(brain=straight), boebot.Member(brain=straight)]
    result = boebot.run_together(
        members, arena="empty", on="native", seconds=1.0, faults=["2:cable.out@0.3..0.5", "serial.repeated=1@0.6..0.7"]
    )
    one, two = result.robots
    assert list(one.faults) == ["serial.repeated=1@0.6s..0.7s"] and len(two.faults) == 2
    assert (one.overview.dead_man_stops, two.lost_frames > 10) == (0, True)  # type: ignore[operator]


@pytest.mark.wall_clock
@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_real_port_can_fail_as_well() -> None:
    with pty(Peer()) as served:
        result = boebot.run(
            straight, on=served.path, seconds=0.8, faults=["serial.flipped=0.01@0.2..0.4", "cable.out@0.5..0.6"]
        )
        assert all(result.faults.values()) and result.bad_frames and result.lost_frames
        with pytest.raises(BoardError, match="this program stood still for"):
            boebot.run(straight, on=served.path, seconds=1.5, faults=["host.stopped@0.2..1.1"])
        for fault in ("board.reset@0.1", "serial.rate@0.1"):
            with pytest.raises(CallError, match="is of a simulated robot"):
                boebot.run(straight, on=served.path, seconds=0.5, faults=[fault])
