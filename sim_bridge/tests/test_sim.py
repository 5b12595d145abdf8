"""Whatever a caller gives to a simulation is done, or refused by one sentence; what is closed stays closed."""

from __future__ import annotations

import copy
import gc
import math
import resource
import signal
import threading
from collections.abc import Callable
from typing import Any

import pytest

from boebot.arenas import load_arena
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoebotError
from sim_bridge.boards.board import Damage, EmulatedBoard
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Sim
from sim_bridge.tests.boards.access import BoardAccess

ROBOT = load_robot("shieldbot")
ROOM = load_arena("room")


def board() -> EmulatedBoard:
    return native_board(native_library("shieldbot"))


def built() -> Sim:
    sim = Sim(ROOM)
    sim.add(board(), ROBOT)
    return sim


def refused(act: Callable[[], object], words: str) -> None:
    with pytest.raises(BoebotError, match=words) as caught:
        act()
    assert "\n" not in str(caught.value)


def test_a_closed_simulation_says_so() -> None:
    sim = built()
    robot = sim.robot(0)
    pins = BoardPins(robot)
    sim.close()
    sim.close()
    acts: list[Callable[[], object]] = [
        lambda: sim.run(16_000),
        sim.hash,
        lambda: sim.cycle,
        robot.body,
        robot.receive,
        lambda: robot.send(b"x"),
        lambda: pins.output(13),
        lambda: robot.place(0, 0, 0),
        lambda: sim.add(board(), ROBOT),
    ]
    for act in acts:
        refused(act, "closed")


def test_a_board_belongs_to_one_simulation() -> None:
    one = board()
    sim = Sim(ROOM)
    sim.add(one, ROBOT)
    refused(lambda: sim.add(one, ROBOT, pose=(0.9, -0.8, 0.0)), "in a simulation already")
    refused(lambda: Sim(ROOM).add(one, ROBOT), "in a simulation already")
    refused(one.close, r"is in a simulation; expected Sim.close\(\)")
    sim.close()
    one.close()
    refused(lambda: Sim(ROOM).add(one, ROBOT), "closed")


@pytest.mark.parametrize("how", [copy.copy, copy.deepcopy])
def test_a_simulation_is_not_copied(how: Callable[[Sim], Sim]) -> None:
    refused(lambda: how(built()), "cannot be copied; expected a new one")


@pytest.mark.unsanitized
def test_boards_that_are_dropped_are_freed() -> None:
    """Alone, in a simulation, and with one that is part of a cycle of references."""

    def drop(count: int) -> None:
        for number in range(count):
            board()
            cycle: list[Any] = [built()]
            if number % 5 == 0:
                cycle.append(cycle)
        gc.collect()

    drop(20)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    drop(150)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 20_000, "kB; a board has 270"


@pytest.mark.unsanitized
def test_a_long_run_hears_ctrl_c() -> None:
    sim = built()
    timer = threading.Timer(0.5, lambda: signal.raise_signal(signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        sim.run(16_000_000 * 3600 * 24)
    timer.join()
    cycle = sim.cycle
    sim.run(16_000)
    assert sim.cycle == cycle + 16_000


@pytest.mark.parametrize("pose", [(0, 0), "abc", 5, (0, 0, 1e20), (math.nan, 0, 0), (0, math.inf, 0), (1e7, 0, 0)])
def test_poses(pose: Any) -> None:
    words = r"expected 3 finite numbers, x \(m\), y \(m\) and heading \(rad\), within"
    refused(lambda: Sim(ROOM).add(board(), ROBOT, pose=pose), words)
    refused(lambda: Sim(ROOM).add(None, load_robot("arsim"), pose=pose), words)
    if isinstance(pose, tuple) and len(pose) == 3:
        refused(lambda: built().robot(0).place(*pose), words)


def test_what_is_no_number_name_or_byte() -> None:
    sim = built()
    robot, pins = sim.robot(0), BoardPins(sim.robot(0))
    anything: Any = "x"
    acts: list[tuple[Callable[[], object], str]] = [
        (lambda: Sim(anything), "expected an Arena"),
        (lambda: Sim(ROOM, seed=anything), "the seed is 'x'; expected a whole number"),
        (lambda: Sim(ROOM, seed=10**40), "the seed is .*; expected a whole number"),
        (lambda: Sim(ROOM, noise=anything), "expected True or False"),
        (lambda: Sim(ROOM, step_cycles=1), "step_cycles is 1; expected a whole number from 160"),
        (lambda: Sim(ROOM, step_cycles=anything), "step_cycles is 'x'"),
        (lambda: sim.add(anything, ROBOT), "expected a board or None, and a description"),
        (lambda: sim.add(board(), anything), "expected a board or None, and a description"),
        (lambda: sim.add(board(), ROBOT, number=anything), "robot number is 'x'"),
        (lambda: sim.add(board(), ROBOT, number=10**12), "robot number is 1000000000000; expected"),
        (lambda: sim.add(board(), ROBOT, without=anything), "without is 'x'; expected a list of names"),
        (lambda: sim.run(anything), "cycles is 'x'"),
        (lambda: sim.run(-1), "cycles is -1; expected a whole number from 0"),
        (lambda: robot.send(anything), "send: got 'x'; expected bytes"),
        (lambda: robot.listen(-1), "listen: the cycle is -1"),
        (lambda: robot.line_rate(0), "the rate is 0; expected a whole number from 1"),
        (lambda: robot.signals(0.1, 0.1), "is driven by its board"),
        (lambda: pins.supply(1e300), r"the voltage is 1e\+300; expected a finite number from 0 to 30"),
        (lambda: pins.brown_out(foo=1), "there is no 'foo'; expected one of reset_v"),
        (lambda: pins.reset("nope"), "there is no cause 'nope'; expected one of power"),
        (lambda: pins.drive(300, 1), "drive: the pin is 300; expected a whole number from 0 to 19"),
        (lambda: pins.drive(3, 3), "drive: the level is 3; expected a whole number from 0 to 2"),
        (lambda: pins.drive(3, 1, anything), "drive: at_cycle is 'x'; expected a whole number"),
        (lambda: pins.square_wave(20, 100, 1.0), "square_wave: the pin is 20; expected a whole number from 0 to 19"),
        (lambda: pins.square_wave(3, 1, 1.0), "square_wave: the period is 1; expected a whole number from 2"),
        (lambda: pins.square_wave(3, 100, math.nan), "square_wave: seconds is nan; expected a finite number from 0"),
        (lambda: pins.square_wave(3, 100, math.inf), "square_wave: seconds is inf; expected a finite number from 0"),
        (
            lambda: pins.square_wave(3, 2, 1e6),
            "square_wave: seconds is 1000000.0; expected a finite number from 0 to 0.625",
        ),
        (lambda: pins.pin_log(-1), "pin_log: newest is -1; expected a whole number from 0"),
        (lambda: pins.output(300), "output: the pin is 300; expected a whole number from 0 to 19"),
        (lambda: pins.eeprom_damage(Damage.GARBAGE, 256), "garbage is 256; expected a whole number from 0 to 255"),
        (lambda: robot.wait(-1, 0), "wait: cycles is -1; expected a whole number from 0"),
        (lambda: robot.wait(anything, 0), "wait: cycles is 'x'"),
        (lambda: robot.wait(10, -1), "wait: quiet is -1; expected a whole number from 0"),
        (lambda: sim.run_until(-1), "run_until: the cycle is -1; expected a whole number from 0"),
    ]
    for act, words in acts:
        refused(act, words)
    robot.send(bytearray(b"x"))
    vehicle = Sim(ROOM).add(None, load_robot("arsim"))
    refused(lambda: vehicle.signals(anything, 0), "expected two finite numbers")
    refused(lambda: vehicle.send(b"x"), "has no board, and so no bytes")
    assert issubclass(ArenaError, BoebotError)


def test_a_bodys_state_is_of_its_moment() -> None:
    robot = built().robot(0)
    before = robot.body()
    robot.place(0.5, -0.2, 0.0)
    assert before.x == ROOM.start[0] and robot.body().x == 0.5


def test_pins_of_a_robot_without_a_board_are_refused() -> None:
    description = load_robot("arsim")
    pins = BoardPins(Sim(ROOM).add(None, description))
    for act in (
        lambda: pins.drive(3, 1),
        lambda: pins.square_wave(3, 100, 1.0),
        lambda: pins.supply(3.0),
        lambda: pins.brown_out(reset_v=1.0),
    ):
        refused(act, "has no board")


def test_a_board_may_be_closed_before_its_access() -> None:
    board = native_board(native_library("boebot"))
    access = BoardAccess(board)
    board.close()
    access.close()
    refused(lambda: access.now, "closed")
