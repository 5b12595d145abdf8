"""The loop: when it returns, what it carries, and that a run is the same however it is cut."""

from __future__ import annotations

import itertools
import os
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError
from sim_bridge.boards.board import CLOCK_HZ, EmulatedBoard
from sim_bridge.compiled import ffi, lib
from sim_bridge.sessions.session import SimTransport
from sim_bridge.sessions.world import NATIVE, open_on
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import MS, US, Scripted, add_scripted, arena_of, scripted, scripts, square

BYTE = 320  # cycles at 500,000 baud


def message(robot: Scripted, end: int, count: int = 10) -> None:
    """Bytes back to back, the last one's stop bit at `end`."""
    for i in range(count):
        assert scripts.script_board_byte(robot.script, end - (count - 1 - i) * BYTE, i) == 0


# ---- when it returns -------------------------------------------------------------------------------------


def test_read_waits_for_the_whole_message() -> None:
    robot = scripted()
    transport = SimTransport(robot.robot, "script")
    message(robot, 20 * MS + 123, count=60)
    data = transport.read(0.1)
    assert data == bytes(range(60))
    idle = robot.sim.cycle - (20 * MS + 123)
    assert 2 * BYTE <= idle <= 2 * BYTE + 4000


def test_read_lets_quiet_time_pass() -> None:
    robot = scripted()
    transport = SimTransport(robot.robot, "script")
    message(robot, 10 * MS)
    message(robot, 20 * MS)
    message(robot, 50 * MS)
    assert len(transport.read(0.1, quiet_s=0.040)) == 20
    assert transport.now() == pytest.approx(0.040)
    assert len(transport.read(0.1)) == 10
    assert 0.050 < transport.now() < 0.0505


def test_read_ends_after_its_wait() -> None:
    robot = scripted()
    transport = SimTransport(robot.robot, "script")
    assert transport.read(0.0123) == b""
    assert transport.now() == pytest.approx(0.0123)
    message(robot, robot.sim.cycle + 2 * MS, count=60)
    assert len(transport.read(0.001)) < 60  # in the middle of it
    assert transport.read(0.0) == b""
    assert transport.read(0.01, quiet_s=1.0) != b""
    assert transport.now() == pytest.approx(0.0233)


def test_bytes_reach_the_board() -> None:
    robot = scripted()
    SimTransport(robot.robot, "script").write(b"hello")
    buffer = ffi.new("uint8_t[]", 10)
    assert scripts.script_board_sent(robot.script, buffer, 10) == 5
    assert ffi.buffer(buffer, 5)[:] == b"hello"


def test_long_silence_of_the_reader_loses_nothing() -> None:
    robot = scripted()
    for i in range(200_000):
        scripts.script_board_byte(robot.script, i * BYTE, i & 0xFF)
    robot.run(4.1)
    assert robot.robot.receive() == bytes(i & 0xFF for i in range(200_000))


def test_transport_of_a_closed_world_says_so() -> None:
    robot = scripted().robot
    transport = SimTransport(robot, "script")
    robot.sim.close()
    for call in (lambda: transport.read(0.1), lambda: transport.write(b"x"), transport.now):
        with pytest.raises(BoardError, match="closed"):
            call()


def test_paced_transport_keeps_to_the_wall_clock() -> None:
    import time

    start = time.perf_counter()
    session = open_on(NATIVE, BoardRequest(robot=load_robot("shieldbot"), arena="empty", realtime=True))
    while session.transport.now() < 0.1:
        session.transport.read(0.01)
    assert time.perf_counter() - start > session.transport.now() - 0.001
    session.close()


# ---- the same however it is cut --------------------------------------------------------------------------


def lively(seed: int = 1, noise: bool = True) -> Scripted:
    """A robot that drives, turns, hits things, blinks and pings for two seconds."""
    arena = arena_of(square(0.33, 0.1, 0.3), outline=square(0, 0, 1.2))
    robot = scripted(arena, noise=noise, seed=seed)
    edges: list[tuple[int, int, int]] = []
    for frame in range(100):
        rise = frame * 20 * MS + 777
        left, right = (1700, 1320) if frame < 60 else (1350, 1400)
        edges += [
            (rise, 13, 1),
            (rise + left * US, 13, 0),
            (rise + 40_000, 12, 1),
            (rise + 40_000 + right * US, 12, 0),
        ]
        for i in range(20):
            edges += [(rise + 100_000 + 421 * i, 9, 1), (rise + 100_200 + 421 * i, 9, 0)]
        edges += [(rise + 200_000, 8, 1), (rise + 200_080, 8, 2)]
    for edge in sorted(edges):
        robot.edge(*edge)
    return robot


def outcome(robot: Scripted) -> tuple[Any, ...]:
    return (robot.sim.hash(), [robot.inputs(pin) for pin in range(20)], robot.robot.truth()["x"].tobytes())


def test_lively_robot_is_lively() -> None:
    robot = lively()
    robot.run(2.0)
    assert robot.robot.true_contacts >= 1
    assert all(len(robot.inputs(pin)) > 2 for pin in (16, 17, 5, 7, 10, 8))


@given(st.lists(st.integers(1, 40 * MS), min_size=1, max_size=60))
def test_run_does_not_depend_on_how_it_is_cut(cuts: list[int]) -> None:
    whole, pieces = lively(), lively()
    whole.sim.run(2 * CLOCK_HZ)
    for cut in cuts:
        left = 2 * CLOCK_HZ - pieces.sim.cycle
        pieces.sim.run(min(cut, left))
    left = 2 * CLOCK_HZ - pieces.sim.cycle
    pieces.sim.run(left)
    assert outcome(pieces) == outcome(whole)


def test_same_seed_same_run_other_seed_other_run() -> None:
    runs = [lively(seed) for seed in (1, 1, 2)]
    for robot in runs:
        robot.run(2.0)
    assert outcome(runs[0]) == outcome(runs[1])
    assert outcome(runs[0])[0] != outcome(runs[2])[0]


def test_libraries_under_test_are_the_sanitized_ones_when_that_is_meant() -> None:
    import sim_bridge._core

    sanitized = b"__asan_init" in Path(str(sim_bridge._core.__file__)).read_bytes()
    assert sanitized == ("BOEBOT_SANITIZED" in os.environ)


def test_state_is_the_same_however_it_was_compiled() -> None:
    """The state's bits after two lively seconds. tools/test_sanitized.sh runs this first with the usual build, which
    leaves its bits in the file that BOEBOT_STATE_FILE names, then with the sanitizers' unoptimised build."""
    robot = lively(seed=42)
    robot.run(2.0)
    bits = f"{robot.sim.hash():016x}"
    file = Path(os.environ.get("BOEBOT_STATE_FILE", os.devnull))
    earlier = file.read_text() if file.is_file() else ""
    assert bits == (earlier or bits)
    if not earlier:
        file.write_text(bits)


@pytest.mark.parametrize("step_us", [100, 500, 2000, 5000, 10000])
def test_step_of_the_world_may_be_chosen(step_us: int) -> None:
    def end(step_cycles: int) -> Any:
        robot = scripted(step_cycles=step_cycles)
        robot.pulses(1.0, {13: 1600, 12: 1420})
        robot.run(1.0)
        return robot.robot.body()

    coarse, usual = end(step_us * US), end(1 * MS)
    assert coarse.x == pytest.approx(usual.x, abs=0.003)
    assert coarse.heading == pytest.approx(usual.heading, abs=0.03)


@pytest.mark.parametrize("step_cycles", [0, -16_000, 15_999, 48_000, 320_000])
def test_step_that_does_not_divide_the_tick_is_refused(step_cycles: int) -> None:
    with pytest.raises(BoardError, match=r"does not divide|step_cycles is .*; expected a whole number from 160 to"):
        scripted(step_cycles=step_cycles)


# ---- truth and logs --------------------------------------------------------------------------------------


def test_truth_has_a_row_every_ten_milliseconds() -> None:
    robot = lively()
    robot.run(2.0)
    truth = robot.robot.truth()
    assert truth["time"] == pytest.approx(np.arange(200) * 0.01)
    speed = np.hypot(np.diff(truth["x"]), np.diff(truth["y"])) / 0.01
    assert speed.max() < 0.25
    assert truth["contact"].max() == 1 and truth["contact"].min() == 0
    assert truth["left"] == pytest.approx(truth["speed"] - 0.0525 * truth["turn_rate"])


def test_nothing_is_recorded_unless_asked_for() -> None:
    sim = Sim(arena_of(), record=False)
    robot = add_scripted(sim)
    robot.run(1.0)
    assert len(robot.robot.truth()["time"]) == 0
    sim.close()


def test_pin_log_has_every_edge_in_order() -> None:
    robot = lively()
    robot.run(2.0)
    log = robot.pins.pin_log()
    assert len(log) == 100 * (4 + 40 + 2)
    assert (np.diff(log["cycle"].astype(np.int64)) >= 0).all()
    servo = log[log["pin"] == 13]
    assert (np.diff(servo["cycle"].astype(np.int64))[:100:2] == 1700 * US).all()


def test_pin_log_keeps_the_newest_million() -> None:
    robot = scripted()
    for i in range(1_200_000):
        scripts.script_board_edge(robot.script, 10 * i, 4, i & 1)
    robot.run(1.0)
    log = robot.pins.pin_log()
    assert len(log) == 1 << 20
    assert log["cycle"][-1] == 10 * 1_199_999
    assert (np.diff(log["cycle"].astype(np.int64)) == 10).all()


def test_contacts_are_counted_once_each() -> None:
    robot = scripted(arena_of(square(0.6, 0, 0.3)))  # face at 0.45
    robot.pulses(4.0, {13: 1700, 12: 1300})
    robot.pulses(2.0, {13: 1300, 12: 1700}, start=4.0)
    robot.pulses(4.0, {13: 1700, 12: 1300}, start=6.0)
    robot.run(10.0)
    assert robot.robot.true_contacts == 2


# ---- hands of a test -------------------------------------------------------------------------------------


def test_driven_pin_belongs_to_the_test() -> None:
    robot = scripted(arena_of(square(1, 0, 1)), pose=(0.41, 0, 0))  # whiskers press
    robot.run(0.01)
    robot.pins.drive(5, 1, 20 * MS)
    robot.pins.drive(5, 0, 30 * MS)
    robot.pins.drive(5, 2, 40 * MS)  # an open switch: the resistor pulls up
    robot.run(0.1)
    assert robot.inputs(5)[-3:] == [(20 * MS, 1), (30 * MS, 0), (40 * MS, 1)]


def test_new_square_wave_replaces_the_one_on_its_pin() -> None:
    robot = scripted()
    robot.pins.square_wave(16, 16_000, 0.02)
    robot.pins.square_wave(17, 160_000, 1.0)
    robot.run(0.1)  # the first wave is over
    before = len(robot.inputs(17))
    robot.pins.square_wave(17, 320_000, 0.5)
    robot.run(0.6)
    assert len(robot.inputs(17)) - before in (50, 51)  # one of the old wave may have been queued already


def test_shortest_wait_lets_time_pass() -> None:
    robot = scripted()
    transport = SimTransport(robot.robot, "script")
    before = robot.sim.cycle
    transport.read(1e-9, 1e-9)
    assert robot.sim.cycle > before


def test_square_wave_has_its_edges() -> None:
    robot = scripted()
    robot.run(0.005)
    robot.pins.square_wave(16, 64_000, 0.2)
    robot.run(0.3)
    wave = robot.inputs(16)[1:]
    assert len(wave) == 100
    assert {b[0] - a[0] for a, b in itertools.pairwise(wave)} == {32_000}
    robot.pins.square_wave(16, 160, 0.5)
    robot.run(0.6)
    assert len(robot.inputs(16)) == 1 + 100 + 100_000


def test_robot_is_put_only_where_it_fits() -> None:
    robot = scripted(arena_of(square(1, 0, 1)))
    robot.robot.place(0.3, 0.2, 1.0)
    assert (robot.robot.body().x, robot.robot.body().y, robot.robot.body().heading) == (0.3, 0.2, 1.0)
    for x in (0.45, 1.0):
        with pytest.raises(ArenaError, match="a robot cannot stand at"):
            robot.robot.place(x, 0, 0)
    with pytest.raises(ArenaError, match="cannot start"):
        scripted(arena_of(square(1, 0, 1)), pose=(1.0, 0, 0))


@pytest.mark.parametrize(("pin", "level"), [(20, 0), (5, 3)])
def test_unknown_pins_and_levels_are_refused(pin: int, level: int) -> None:
    with pytest.raises(BoardError):
        scripted().pins.drive(pin, level)


# ---- boards ----------------------------------------------------------------------------------------------


def test_crash_of_a_board_is_told() -> None:
    robot = scripted()
    robot.run(0.5)
    scripts.script_board_crash(robot.script)
    with pytest.raises(BoardError, match=r"the script crashed at 0\.500 s: the script says so"):
        robot.run(0.1)


def test_board_of_another_version_is_refused() -> None:
    destroy = ffi.callback("void(board *)", lambda _: None)
    operations = ffi.new("board_operations *", {"version": 99, "destroy": destroy})
    old = EmulatedBoard((ffi, lib), ffi.new("board *", {"op": operations}), "old board")
    with pytest.raises(BoardError, match="old board cannot be joined to the simulation: it was built for another"):
        Sim(arena_of()).add(old, load_robot("shieldbot"))
    old.close()


# ---- edges that end a run, and reactions -------------------------------------------------------------------


def test_a_run_ends_at_an_edge() -> None:
    whole, cut = lively(), lively()
    cut.robot.board.stop_at([13])
    whole.run(0.5)
    stops = 0
    while cut.sim.cycle < whole.sim.cycle:
        stops += cut.robot.run_to_edge(whole.sim.cycle, [13])
        if cut.sim.cycle < whole.sim.cycle:
            assert int(cut.pins.pin_log(1)["cycle"][0]) == cut.sim.cycle
    assert stops == 50
    assert cut.sim.hash() == whole.sim.hash()
    assert np.array_equal(cut.pins.pin_log(), whole.pins.pin_log())
    assert not cut.robot.run_to_edge(cut.sim.cycle, [13])


def test_a_run_of_two_boards_cannot_end_at_an_edge() -> None:
    robot = scripted()
    add_scripted(robot.sim, pose=(1.0, 0.0, 0.0))
    with pytest.raises(BoardError, match=r"cannot end at an edge of one of 2 boards; expected the only one"):
        robot.robot.run_to_edge(1000, [13])
    with pytest.raises(BoardError, match="pin"):
        scripted().robot.run_to_edge(1000, [20])


@pytest.mark.parametrize("boards", [1, 2])
def test_what_a_reaction_raises_ends_the_run_which_can_go_on(boards: int) -> None:
    robot, other = scripted(), scripted()
    for one in (robot, other):
        if boards == 2:
            add_scripted(one.sim, pose=(1.0, 0.0, 0.0))
        one.pulses(0.1, {13: 1500, 12: 1400})
    calls = []

    def react(cycle: int, level: int) -> None:
        calls.append(cycle)
        if len(calls) == 2:
            raise ZeroDivisionError

    robot.robot.board.on_edge(13, react)
    with pytest.raises(ZeroDivisionError):
        SimTransport(robot.robot, "script").read(0.2)
    assert robot.sim.cycle <= calls[1] <= robot.sim.cycle + 16_000
    robot.sim.run(CLOCK_HZ // 10 - robot.sim.cycle)
    other.run(0.1)
    assert len(calls) == 10 and robot.sim.hash() == other.sim.hash()


def test_a_reaction_cannot_let_time_pass() -> None:
    robot = scripted()
    robot.pulses(0.1, {13: 1500})
    robot.robot.board.on_edge(13, lambda cycle, level: robot.run(0.1))
    with pytest.raises(BoardError, match="a reaction to an edge cannot let time pass"):
        robot.run(0.1)


def test_a_robot_without_devices() -> None:
    bare = msgspec.structs.replace(load_robot("shieldbot"), device={}, supply=None)
    robot = scripted(robot=bare)
    robot.run(0.1)
    assert robot.robot.layout == {} and robot.robot.readings() == () and robot.robot.texts() == {}
    assert robot.robot.supply_voltage == 5.0
