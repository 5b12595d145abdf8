"""Runs of a brain: timing of steps, set-points, every kind of end, and what the record keeps."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

import boebot
from boebot.boards import board_kinds
from boebot.description.robots import load_robot
from boebot.errors import BoardError, BoebotError, BrainError, ProtocolError
from boebot.link import messages
from boebot.result import RunResult, read_run
from boebot.robot import Robot
from boebot.running import loop
from boebot.running.tasks import Request
from peer import InProcess, Peer


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> InProcess:
    """What `--on native` opens in these tests."""
    session = InProcess(Peer())
    monkeypatch.setattr(loop, "open_world", lambda url, requests: session)
    return session


def straight(robot: Robot) -> None:
    robot.drive(0.5, 0.5)


def run_on(peer: Peer, brain: object, monkeypatch: pytest.MonkeyPatch, **options: object) -> RunResult:
    monkeypatch.setattr(loop, "open_world", lambda url, requests: InProcess(peer))
    return boebot.run(brain, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("ticks", [1, 2, 5, 7])
def test_brain_steps_at_every_multiple_of_its_period(session: InProcess, ticks: int) -> None:
    seen: list[tuple[int, float]] = []
    result = boebot.run(lambda robot: seen.append((robot.tick, robot.time)), seconds=1, period=ticks / 100)
    assert len(seen) == math.ceil(100 / ticks) == result.steps
    assert all(tick % ticks == 0 for tick, _ in seen)
    assert [time for _, time in seen] == pytest.approx([ticks / 100 * n for n in range(len(seen))])
    assert np.array_equal(np.diff(result.series.raw["tick"]), np.ones(result.record.ticks - 1))
    assert result.run_time == pytest.approx(1.0)
    assert result.late_steps == 0


def test_set_point_answers_the_observation_at_once(session: InProcess) -> None:
    boebot.run(straight, seconds=0.5)
    sent = [
        (message, tick)
        for message, tick in zip(session.peer.setpoints, session.peer.setpoint_ticks, strict=True)
        if isinstance(message, messages.SetpointSignal)
    ]
    assert len(sent) == 10
    for message, tick in sent:
        assert (message.left, message.right, message.time_to_live) == (5000, 5000, 250)
        assert message.answers_tick == tick - 1, "the set-point is out before the next tick begins"


@pytest.mark.parametrize(("period_ms", "time_to_live_ms"), [(10, 250), (100, 250), (200, 500), (800, 2000)])
def test_time_to_live_outlasts_the_period(session: InProcess, period_ms: int, time_to_live_ms: int) -> None:
    boebot.run(straight, seconds=2, period=period_ms / 1000)
    first = session.peer.setpoints[0]
    assert isinstance(first, messages.SetpointSignal) and first.time_to_live == time_to_live_ms


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"period": 0.81}, "period of 810 ms is too long; expected at most 800 ms"),
        ({"period": 0.015}, "period of 15 ms does not fit; expected a multiple of 10 ms"),
        ({"period": 0}, "period of 0 ms is none"),
        ({"period": math.nan}, "expected more than 0"),
        ({"seconds": 0}, "cannot last 0 s"),
        ({"seconds": math.nan}, "cannot last nan s"),
        ({"realtime": "no"}, "realtime is 'no'; expected True or False"),
        ({"gdb": "4711"}, "gdb is '4711'; expected a TCP port or None"),
        ({"gdb": 65536}, "gdb is 65536; expected a TCP port, 1 to 65535, or 0: any that is free"),
        ({"progress": 5}, "progress is 5; expected a function of the seconds that have passed, or None"),
        ({"seconds": "5"}, "seconds is '5'; expected a number"),
        ({"seconds": None}, "seconds is None; expected a number"),
        ({"seed": "x"}, "seed is 'x'; expected a whole number"),
        ({"seed": 1.5}, "seed is 1.5; expected a whole number"),
        ({"period": "50"}, "period is '50'; expected seconds or None"),
        ({"robot": 5}, "robot is 5; expected a name, a .toml file, a description or None"),
        ({"on": 3}, "on is 3; expected the name of a board or a port"),
        ({"arena": 3}, "arena is 3; expected a name, a .toml file or None"),
        ({"out": 3}, "out is 3; expected a folder or None"),
        ({"robot": "r2d2"}, "there is no robot 'r2d2'"),
        ({"brain": "wonder"}, "there is no brain 'wonder'"),
    ],
)
def test_bad_input_moves_nothing(session: InProcess, options: dict[str, object], sentence: str) -> None:
    with pytest.raises(BoebotError, match=sentence):
        boebot.run(**({"brain": straight} | options))  # type: ignore[arg-type]
    assert session.peer.setpoints == []


def test_brain_that_needs_what_the_robot_lacks_is_refused(session: InProcess) -> None:
    def step(robot: Robot) -> None: ...

    step.NEEDS = ["whiskers", "ping"]  # type: ignore[attr-defined]
    whole = load_robot("shieldbot")
    fewer = {name: device for name, device in whole.device.items() if name != "ping"}
    blind = msgspec.structs.replace(whole, device=fewer)
    with pytest.raises(BrainError, match="brain 'step' needs ping, which robot 'shieldbot' does not have"):
        boebot.run(step, robot=blind)
    assert session.peer.starts == 1 and session.peer.setpoints == []


def test_brains_own_period_yields_to_the_callers(session: InProcess) -> None:
    class Slow:
        PERIOD = 0.2

        def step(self, robot: Robot) -> None:
            robot.drive(0, 0)

    assert boebot.run(Slow, seconds=1).steps == 5
    session.closed = False
    assert boebot.run(Slow, seconds=1, period=0.1).steps == 10


def test_same_seed_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [run_on(Peer(), "wander", monkeypatch, seconds=10, seed=seed) for seed in (3, 3, 4)]
    assert runs[0].record.rows("to_host") == runs[1].record.rows("to_host")
    assert runs[0].record.rows("to_board") == runs[1].record.rows("to_board")
    assert runs[0].record.rows("to_board") != runs[2].record.rows("to_board")


def fails_after(seconds: float, error: BaseException) -> Callable[[Robot], None]:
    def step(robot: Robot) -> None:
        robot.drive(0.5, 0.5)
        if robot.time >= seconds:
            raise error

    return step


def test_error_of_the_brain_is_not_hidden_by_that_of_its_files(
    session: InProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("boebot.view.tables.write_summary", full)
    with pytest.raises(BrainError, match="division") as caught:
        boebot.run(fails_after(0.5, ZeroDivisionError("division")), seconds=10, out=tmp_path)
    assert "No space left on device" in caught.value.__notes__[0]
    session.closed = False
    with pytest.raises(BoebotError, match="No space left on device"):
        boebot.run(straight, seconds=1, out=tmp_path)


@pytest.mark.parametrize(
    ("error", "caught", "sentence"),
    [
        (ZeroDivisionError("division by zero"), BrainError, r"test_loop\.py, line \d+: ZeroDivisionError: division"),
        (SystemExit(1), BrainError, r"test_loop\.py, line \d+: SystemExit"),
        (KeyboardInterrupt(), KeyboardInterrupt, "^$"),
    ],
)
def test_run_that_ends_early_stops_the_motors_and_keeps_its_record(
    session: InProcess, tmp_path: Path, error: BaseException, caught: type[BaseException], sentence: str
) -> None:
    with pytest.raises(caught, match=sentence):
        boebot.run(fails_after(0.5, error), seconds=10, out=tmp_path)
    assert session.peer.stops >= 1 and session.peer.latch == messages.Latch.STOP_COMMAND
    assert not session.peer.moving and session.closed
    result = read_run(tmp_path)
    assert isinstance(result, RunResult) and result.record.times_of(result.record.tick_stream)[-1] == pytest.approx(0.5)
    assert (tmp_path / "replay.html").exists()
    assert '"ended"' in (tmp_path / "summary.json").read_text()


def test_brain_that_names_a_missing_device_is_refused_with_its_place(session: InProcess, tmp_path: Path) -> None:
    path = tmp_path / "blind.py"
    path.write_text("def step(robot):\n    robot.drive(1.5, 0)\n")
    with pytest.raises(BrainError, match=r"blind\.py, line 2: drive\(1\.5, 0\): motor signals go from -1 to 1"):
        boebot.run(path)


def test_board_that_vanishes_ends_the_run_with_a_whole_record(session: InProcess) -> None:
    def unplug(tick: int) -> None:
        if tick == 100:
            session.closed = True
            raise BoardError("peer has gone")

    session.before_tick = unplug
    result = loop.execute(Request.single(straight, seconds=10))
    assert isinstance(result.error, BoardError)
    assert result.series.raw["tick"][-1] == 99
    assert result.table()["ended"] == "peer has gone"


def test_board_that_falls_silent_ends_the_run(session: InProcess) -> None:
    def fall_silent(tick: int) -> None:
        if tick >= 100:
            session.peer.answers = False

    session.before_tick = fall_silent
    result = loop.execute(Request.single(straight, seconds=10))
    assert str(result.error) == "the board at peer fell silent: no telemetry for 1 s"
    assert session.now() < 2.6


@pytest.mark.parametrize(("silent_s", "error"), [(1.9, None), (3.2, "no telemetry for 3 s")])
def test_board_behind_a_port_may_wait_in_its_boot_loader(
    session: InProcess, monkeypatch: pytest.MonkeyPatch, silent_s: float, error: str | None
) -> None:
    monkeypatch.setattr(session, "realtime", True)

    def reset(tick: int) -> None:
        if tick == 100:
            session.peer.reset()
            session.peer.answers = False
            session.at(session.now() + silent_s, start)
            session.before_tick = lambda _: None

    def start() -> None:
        session.peer.answers = True

    session.before_tick = reset
    result = loop.execute(Request.single(straight, seconds=6))
    if error is None:
        assert result.error is None and result.resets == 1
        assert result.run_time == pytest.approx(6.0, abs=0.02)
    else:
        assert error in str(result.error)


def test_board_with_another_pin_map_is_refused(session: InProcess) -> None:
    with pytest.raises(ProtocolError, match="runs firmware for pin map 'shieldbot', but robot 'shieldbot-quad' needs"):
        boebot.run(straight, robot="shieldbot-quad")
    assert session.peer.setpoints == []


def test_reset_in_mid_run_is_counted_and_the_run_goes_on(session: InProcess) -> None:
    peer = session.peer
    counts: list[int] = []

    def reset(tick: int) -> None:
        if tick == 57 and peer.starts == 1:
            peer.parameters.clear()
            peer.reset()
        counts.append(len(peer.parameters))

    session.before_tick = reset
    times: list[float] = []

    def step(robot: Robot) -> None:
        times.append(robot.time)
        robot.drive(0.5, 0.5)

    result = boebot.run(step, seconds=2)
    assert result.resets == 1
    assert result.lost_frames == 0
    assert len(peer.parameters) == counts[0], "the parameters were set again"
    assert (np.diff(times) > 0).all() and times[-1] < 2.0, "the run's clock goes on"
    assert session.now() == pytest.approx(2.0 + result.clock_offset, abs=0.05)
    assert result.odometry is not None
    assert abs(result.odometry.x[-1] - result.odometry.x[0]) < 0.4, "counts that begin afresh are no motion"


def test_lost_and_damaged_frames_are_counted(session: InProcess) -> None:
    whole = session.channel.carry
    fates = {50: [], 91: [True], 130: []}  # by tick: lost, damaged, lost

    def lossy(way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        is_telemetry = way == "host" and frame[2] == messages.Telemetry.ID
        fate = fates.pop(session.peer.ticks, None) if is_telemetry else None
        if fate is None:
            return whole(way, frame, at_s)
        return whole(way, frame[:5] + b"\xff" + frame[6:], at_s) if fate else []

    session.channel.carry = lossy  # type: ignore[method-assign]
    result = boebot.run(straight, seconds=2)
    assert (result.lost_frames, result.bad_frames) == (3, 1)
    assert result.steps == 40, "the brain stepped on"


def test_dead_man_stops_are_counted(session: InProcess) -> None:
    whole = session.peer.receive
    session.peer.receive = lambda data: None if 20 < session.peer.ticks < 80 else whole(data)  # type: ignore[method-assign]
    result = boebot.run(straight, seconds=1.5)
    assert result.overview.dead_man_stops == 1


def test_takeovers_by_the_boards_own_brain_are_counted(session: InProcess) -> None:
    def taken_over_twice(robot: Robot) -> None:
        robot.drive(0.5, 0.5)
        session.peer.status &= ~messages.Status.FALLBACK
        if 0.2 < robot.time < 0.4 or 0.6 < robot.time < 0.7:
            session.peer.status |= messages.Status.FALLBACK

    assert boebot.run(taken_over_twice, seconds=1).overview.fallback_takeovers == 2


def test_nothing_commanded_means_motors_off(session: InProcess) -> None:
    result = boebot.run(lambda robot: None, seconds=1)
    assert all(isinstance(message, messages.SetpointCoast) for message in session.peer.setpoints)
    assert result.true_distance == 0.0


def test_stop_of_a_brain_latches_nothing(session: InProcess) -> None:
    def stop_and_go(robot: Robot) -> None:
        if 0.3 < robot.time < 0.6:
            robot.stop()
        else:
            robot.drive(0.5, 0.5)

    result = boebot.run(stop_and_go, seconds=1)
    pulses = result.series.number("servo_left", "pulse")
    assert (pulses[35:60] == 0).all() and pulses[-1] == 1600
    assert not result.series.raw["latch"].any()


def test_emergency_stop_latches_until_the_brain_arms_again(session: InProcess) -> None:
    def panic(robot: Robot) -> None:
        robot.drive(0.5, 0.5)
        if 0.3 < robot.time < 0.6:
            robot.emergency_stop()
        elif robot.time >= 0.8:
            robot.arm()

    result = boebot.run(panic, seconds=1.2)
    latch, pulses = result.series.raw["latch"], result.series.number("servo_left", "pulse")
    assert (latch[37:80] == messages.Latch.STOP_COMMAND).all() and (pulses[37:80] == 0).all()
    assert not latch[-20:].any() and pulses[-1] == 1600


def test_low_supply_ends_the_run_and_names_the_voltage(session: InProcess) -> None:
    def drop(tick: int) -> None:
        if tick == 60:
            session.peer.supply_mv = 3900

    session.before_tick = drop
    result = loop.execute(Request.single(straight, seconds=5))
    assert str(result.error) == (
        "the board at peer has stopped its motors: its supply is low, 3.90 V; charge or change the batteries"
    )
    assert result.run_time < 1.0 and not session.peer.moving


def test_run_does_not_begin_with_a_low_supply(session: InProcess) -> None:
    session.peer.supply_mv = 3900
    result = loop.execute(Request.single(straight, seconds=5))
    assert str(result.error) == "the board at peer does not arm its motors: its supply is low (3.90 V)"
    assert session.peer.accepted == []


def test_stop_from_elsewhere_ends_the_run(session: InProcess) -> None:
    def stop(tick: int) -> None:
        if tick == 60:
            session.peer._latch(messages.Latch.STOP_COMMAND)

    session.before_tick = stop
    result = loop.execute(Request.single(straight, seconds=5))
    assert str(result.error) == "the board at peer has stopped its motors: a stop command came from elsewhere"
    assert result.run_time < 1.0


def test_session_that_the_board_ends_is_opened_and_armed_again(session: InProcess) -> None:
    def forget(tick: int) -> None:
        if tick == 60:
            session.peer._end_session()

    session.before_tick = forget
    result = boebot.run(straight, seconds=2)
    assert (result.sessions_lost, result.resets) == (1, 0)
    assert result.run_time == pytest.approx(2.0)
    assert result.series.number("servo_left", "pulse")[-1] == 1600
    assert np.flatnonzero(result.series.number("servo_left", "pulse") == 0)[-1] < 70, (
        "driving again within a tenth of a second"
    )


def test_dead_man_stop_that_came_with_the_end_of_the_session_is_counted(session: InProcess) -> None:
    """The line to the board is cut until its session has ended, and the other one before the board could report it."""
    session.peer.parameters[messages.PARAMETERS["session_time_out"].id] = 400
    carry = session.channel.carry
    ends_s = {"board": 1.6, "host": 1.5}

    def cut(way: str, frame: bytes, at_s: float) -> list[tuple[float, bytes]]:
        return [] if {"board": 1.0, "host": 1.2}[way] < at_s < ends_s[way] else carry(way, frame, at_s)

    session.channel.carry = cut  # type: ignore[method-assign]
    result = boebot.run(straight, seconds=4)
    assert (result.error, result.sessions_lost, result.overview.dead_man_stops) == (None, 1, 1)
    assert result.notices == []
    stop = next(event for event in result.record.events if event.kind == messages.EventKind.DEAD_MAN)
    assert stop.earlier and stop.time == pytest.approx(1.25, abs=0.05)


def test_stop_before_the_run_is_a_notice_and_not_the_runs(session: InProcess) -> None:
    session.peer._happened(messages.EventKind.DEAD_MAN, 7)
    session.read(0.5, 0.5)
    result = boebot.run(straight, seconds=1)
    assert result.overview.dead_man_stops == 0
    assert result.notices == [
        "before this run, by the clock of the board at peer: 0.000 s: motors stopped by the dead-man"
    ]


@pytest.mark.parametrize(("telemetry_ticks", "period", "stepping"), [(2, 0.05, 0.06), (5, 0.05, 0.05), (10, 0.01, 0.1)])
def test_period_fits_the_telemetry(session: InProcess, telemetry_ticks: int, period: float, stepping: float) -> None:
    session.peer.telemetry_period = telemetry_ticks
    times: list[float] = []
    result = boebot.run(lambda robot: times.append(robot.time), seconds=2, period=period)
    assert np.diff(times) == pytest.approx(stepping)
    assert result.period == pytest.approx(stepping)
    said = [notice for notice in result.notices if notice.startswith("the brain steps every")]
    assert len(said) == (period != stepping)
    if said:
        assert f"the brain steps every {stepping * 1000:g} ms, not every {period * 1000:g} ms" in said[0]
    assert result.late_steps == result.lost_frames == result.overview.dead_man_stops == 0


def test_set_points_outlive_three_periods_of_slow_telemetry(session: InProcess) -> None:
    session.peer.telemetry_period = 20
    boebot.run(straight, seconds=2)
    assert {message.time_to_live for message in session.peer.accepted} == {606}  # 3 * 200 ms and 300 bytes


def test_parameters_saved_on_the_board_win(session: InProcess) -> None:
    peer = session.peer
    saved = peer.defaults()
    for name, counts in {"wheel_radius": 4000, "track_width": 12000, "encoder_counts": 32}.items():
        saved[messages.PARAMETERS[name].id] = counts
    peer.saved = saved
    peer.reset()
    result = boebot.run(straight, seconds=0.5)
    assert not any(isinstance(message, messages.SetParameter) for _, message in peer.carried_out)
    assert (result.robot.body.wheel_radius_m, result.robot.body.track_width_m) == (0.04, 0.12)
    assert {result.robot.device[f"encoder_{side}"].edges_per_turn for side in ("left", "right")} == {32}  # type: ignore[attr-defined]


def test_observation_carries_board_and_host_time(session: InProcess) -> None:
    errors: list[tuple[float, float]] = []
    session.peer.drift = 1e-3

    def look(robot: Robot) -> None:
        seen = robot.observation
        true_s = robot.tick * runner_tick_s(session)
        assert seen.board_time == pytest.approx(true_s * (1 + session.peer.drift), abs=2e-6)
        errors.append((abs(seen.host_time - true_s), seen.host_time_error))

    boebot.run(look, seconds=8)
    assert all(error <= bound for error, bound in errors)
    assert max(error for error, _ in errors[100:]) < 100e-6
    assert max(bound for _, bound in errors[100:]) < 500e-6


def runner_tick_s(session: InProcess) -> float:
    """Between two ticks, by the transport's clock."""
    return 0.01 / (1 + session.peer.drift)


def test_speeds_are_sent_as_speeds(session: InProcess) -> None:
    boebot.run(lambda robot: robot.drive_speed(0.1, -0.05), seconds=0.2)
    first = session.peer.setpoints[0]
    assert isinstance(first, messages.SetpointSpeed) and (first.left, first.right) == (1000, -500)


def test_odometry_follows_the_truth(session: InProcess) -> None:
    result = boebot.run(lambda robot: robot.drive(0.4, 0.5), seconds=6)
    assert result.true_pose is not None and result.odometry is not None and result.odometry_error is not None
    assert result.true_distance is not None and result.true_distance > 0.3
    assert result.odometry_distance == pytest.approx(result.true_distance, rel=0.02)
    assert result.odometry_error < 0.02
    assert abs(result.odometry.heading[-1] - (result.true_pose.heading[-1] - result.true_pose.heading[0])) < 0.1


def test_progress_is_reported(session: InProcess) -> None:
    reported: list[float] = []
    boebot.run(straight, seconds=1, progress=reported.append)
    assert reported and all(0 <= passed <= 1 for passed in reported)


def test_an_error_of_progress_ends_the_run_and_is_its_error(session: InProcess) -> None:
    class LongEnoughError(BoebotError):
        pass

    def progress(passed: float) -> None:
        raise LongEnoughError(f"after {passed:g} s")

    result = loop.execute(Request.single(straight, seconds=5), progress)
    assert isinstance(result.error, LongEnoughError) and result.run_time < 5
    assert result.table()["ended"] == "after 0 s"


@pytest.mark.skipif("native" not in board_kinds(), reason="the simulator is not installed")
def test_an_error_of_progress_is_no_robots_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop, "PROGRESS_S", 0.0)

    def progress(passed: float) -> None:
        if passed > 1:
            raise BoebotError("long enough")

    members = [boebot.Member(brain=straight, robot="arsim", pose=(x, 0.0, 0.0)) for x in (0.0, 1.0)]
    together = loop.execute(Request(members=members, arena="room", seconds=5), progress)
    assert str(together.error) == "long enough"
    assert all(str(one.error) == "the run has ended: long enough" for one in together.robots)


def test_encoder_counts_roll_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 2^31 - 1, and for a wheel that is assumed to turn backwards, too."""
    plain, near = Peer(), Peer()
    near.first_edges = (2**31 - 20, 2**31 - 30)

    def turn(robot: Robot) -> None:
        robot.drive(0.3, -0.3) if robot.time > 1 else robot.drive(0.3, 0.3)

    expected = run_on(plain, turn, monkeypatch, seconds=3).series.travel
    result = run_on(near, turn, monkeypatch, seconds=3)
    left, right = result.series.raw["encoder_left"], result.series.raw["encoder_right"]
    assert left[0] > 0 > left[-1] and right[0] > 0 > right[-1], "they did"
    for travel, same in zip(result.series.travel or (), expected or (), strict=True):
        assert travel == pytest.approx(same), "as without the roll-over"


def test_overruns_are_counted_over_their_roll_over_and_over_resets(session: InProcess) -> None:
    def overrun(tick: int) -> None:
        if session.peer.starts == starts and 50 <= tick < 60:
            session.peer.overruns += 1
        elif session.peer.starts == starts and tick == 100:
            session.peer.reset()
            session.peer.overruns = 3

    starts = session.peer.starts
    session.peer.overruns = 250
    session.before_tick = overrun
    result = loop.execute(Request.single(straight, seconds=3))
    assert (result.error, result.resets) == (None, 1)
    assert result.overview.overruns == 10 + 3


def test_realtime_run_takes_its_time(session: InProcess) -> None:
    result = boebot.run(straight, seconds=0.4, realtime=True)
    assert 0.35 < (result.wall_time or 0.0) < 0.8


def test_numbers_of_numpy_are_recorded_as_python_s(tmp_path: Path) -> None:
    """The same run, and files that say the same."""
    pose = (0.5, 0.25, 0.0)
    plain = boebot.run(straight, robot="arsim", seconds=1, seed=3, period=0.05, pose=pose, out=tmp_path / "plain")
    numbers = boebot.run(
        straight,
        robot="arsim",
        seconds=np.float32(1),  # type: ignore[arg-type]
        seed=np.uint8(3),  # type: ignore[arg-type]
        period=np.float64(0.05),
        pose=tuple(np.array(pose)),
        out=tmp_path / "numpy",
    )
    assert numbers.hash == plain.hash
    first, second = (
        msgspec.json.decode((tmp_path / name / "summary.json").read_bytes()) for name in ("plain", "numpy")
    )
    assert first["seed"] == second["seed"] == 3 and first["steps"] == second["steps"] == 20
