"""What a weak supply does to the boards, and the charging station."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from boebot.description.robots import load_robot
from boebot.errors import BoardError, RobotError
from sim_bridge.boards.avr import create
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.boards.emulated import native_board, native_library
from sim_bridge.compiled import lib
from sim_bridge.devices import battery as battery_model
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Sim, SimRobot
from sim_bridge.tests.boards.avr.avr_program import assemble
from sim_bridge.tests.simulated import MS, SUPPLY, Scripted, arena_of, pack_voltage, scripted

TOGGLE = """
main:
  sbi DDRB, 5
  in r18, MCUSR
  out MCUSR, r1
1: sbi PINB, 5
  rjmp 1b
"""


def avr() -> SimRobot:
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder, "program.elf")
        image.write_bytes(assemble(TOGGLE))
        return Sim(arena_of(), noise=False).add(create(image), load_robot("shieldbot"))


def native() -> SimRobot:
    return Sim(arena_of(), noise=False).add(native_board(native_library("shieldbot")), load_robot("shieldbot"))


@pytest.fixture(params=[avr, native])
def robot(request: pytest.FixtureRequest) -> Iterator[SimRobot]:
    make: Callable[[], SimRobot] = request.param
    made = make()
    yield made
    made.sim.close()


def run(robot: SimRobot, seconds: float) -> None:
    cycles = round(seconds * CLOCK_HZ)
    robot.sim.run(cycles)


def test_below_the_fuse_the_board_is_held_in_reset(robot: SimRobot) -> None:
    pins = BoardPins(robot)
    run(robot, 0.5)
    assert pins.counters()["edges_out"] > 0
    pins.supply(2.6)
    run(robot, 0.01)
    quiet = pins.counters()["edges_out"]
    assert all(pins.output(pin) == 2 for pin in range(2, 20))  # let go
    run(robot, 0.5)
    assert pins.counters()["edges_out"] == quiet
    assert robot.sim.cycle == pytest.approx(1.01 * CLOCK_HZ)  # time goes on
    pins.supply(2.72)  # within the hysteresis
    run(robot, 0.1)
    assert pins.counters()["edges_out"] == quiet
    pins.supply(5.0)
    run(robot, 0.5)
    assert pins.counters()["edges_out"] > quiet
    assert pins.counters()["resets"] == 1


def test_the_program_learns_the_cause() -> None:
    robot = avr()
    pins = BoardPins(robot)
    run(robot, 0.01)
    pins.supply(2.0)
    run(robot, 0.01)
    pins.supply(None)
    run(robot, 0.01)
    assert pins.read_memory(18, 1)[0] & 0x04  # BORF
    robot.sim.close()


def test_the_detector_can_be_switched_off(robot: SimRobot) -> None:
    pins = BoardPins(robot)
    pins.brown_out(reset_v=0.0)
    pins.supply(1.0)
    run(robot, 0.5)
    assert pins.counters()["edges_out"] > 0
    assert pins.counters()["resets"] == 0


def upsets(volts: float, rate: float = 20.0, noise: bool = True, seconds: float = 20.0) -> int:
    robot = scripted(noise=noise, step_cycles=10 * MS)
    robot.pins.brown_out(upsets_per_s=rate)
    robot.pins.supply(volts)
    robot.run(seconds)
    return int(robot.robot.handle.brown_out.upsets)


@pytest.mark.parametrize(("volts", "share"), [(2.71, 0.99), (3.24, 0.5), (3.51, 0.25)])
def test_between_fuse_and_limit_it_is_erratic(volts: float, share: float) -> None:
    """20 per second at the worst, falling in a straight line: 400 * share are expected in 20 s."""
    expected = 400 * share
    assert upsets(volts) == pytest.approx(expected, abs=4.5 * expected**0.5)


def test_upsets_need_a_weak_supply_and_noise() -> None:
    assert upsets(3.79) == upsets(3.0, rate=0.0) == upsets(3.0, noise=False) == 0


def test_an_upset_resets_the_board() -> None:
    robot = scripted(noise=True)
    robot.pins.brown_out(upsets_per_s=20.0)
    robot.pins.supply(3.0)
    robot.run(1.0)
    assert robot.pins.counters()["resets"] == robot.robot.handle.brown_out.upsets > 0


def test_bad_borders_are_refused() -> None:
    robot = scripted()
    for changes in ({"reset_v": 4.0}, {"upsets_per_s": -1.0}, {"hysteresis_v": float("nan")}):
        with pytest.raises(BoardError, match=r"brown.out"):
            robot.pins.brown_out(**changes)


def charged(x: float) -> Scripted:
    arena = arena_of()
    lib.arena_set_charger(arena.handle, 1.0, 0.0, 0.2)
    lib.arena_build(arena.handle)
    robot = scripted(arena, pose=(x, 0, 0))
    parameters = battery_model.battery_parameters(SUPPLY)
    parameters.supply.capacity_as = 10.0
    parameters.supply.charger_a = 0.5
    assert lib.robot_add_battery(robot.robot.handle, 255, parameters) == 0
    return robot


def test_a_robot_at_the_charger_takes_charge() -> None:
    """The board's 0.08 A empty a pack of 10 A s by 1.6 A s in 20 s; 0.5 A from the charger fill it again."""
    away, at = charged(0.0), charged(1.1)
    for robot in (away, at):
        robot.robot.place(0.0, 0.0, 0.0)
        robot.run(20.0)
    assert pack_voltage(away.robot) == pytest.approx(pack_voltage(at.robot))
    at.robot.place(1.1, 0.0, 0.0)
    away.robot.place(0.7, 0.0, 0.0)
    for robot in (away, at):
        robot.run(2.0)
    assert pack_voltage(at.robot) > pack_voltage(away.robot) + 0.1
    open_circuit = 7.75 - (7.75 - 5.0) * (22 * 0.08) / 10.0
    assert pack_voltage(away.robot) == pytest.approx(open_circuit - 0.6 * 0.08, abs=0.01)


def described(text: str, folder: Path, x: float) -> SimRobot:
    """A shieldbot of that file's table `supply`, at x in an arena with a charger about 1 m, 0."""
    (folder / "mine.toml").write_text(f"extends = 'shieldbot'\nname = 'mine'\n[supply]\n{text}\n")
    description = load_robot(folder / "mine.toml")
    arena = arena_of()
    lib.arena_set_charger(arena.handle, 1.0, 0.0, 0.2)
    lib.arena_build(arena.handle)
    robot = Sim(arena, noise=False).add(native_board(native_library("shieldbot")), description)
    robot.place(x, 0.0, 0.0)
    return robot


def test_a_robots_file_says_how_full_it_begins_and_what_its_charger_gives(tmp_path: Path) -> None:
    """The board's 0.08 A against 2.08 A from the charger, on 20 A s: a tenth more, or 0.004 less, in a second."""
    text = "charge = 0.5\ncharger_a = 2.08\ncapacity_as = 20.0"
    for x, change, current in ((0.0, -0.004, 0.08), (1.0, 0.1, -2.0)):
        robot = described(text, tmp_path, x)
        robot.sim.run(CLOCK_HZ)
        open_circuit = 5.0 + 2.75 * (0.5 + change)
        assert pack_voltage(robot) == pytest.approx(open_circuit - 0.6 * current, abs=0.01)


def test_without_contacts_nothing_is_charged(tmp_path: Path) -> None:
    robot = described("capacity_as = 20.0\ncharger_a = 0", tmp_path, 1.0)
    robot.sim.run(CLOCK_HZ)
    assert pack_voltage(robot) == pytest.approx(5.0 + 2.75 * (1 - 0.004) - 0.6 * 0.08, abs=0.01)


@pytest.mark.parametrize("charge", [-0.1, 1.1])
def test_charge_that_cannot_be_is_refused(charge: float, tmp_path: Path) -> None:
    with pytest.raises(RobotError, match="charge"):
        described(f"charge = {charge}", tmp_path, 0.0)
