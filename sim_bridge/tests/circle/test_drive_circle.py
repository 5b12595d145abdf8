"""Wheels, battery and supply around the whole circle: pulses, servos, body, floor, encoders, pack, telemetry, host.

Expected values are closed forms of the servo's measured curve (docs/reference/imperfections.md), of Coulomb friction
and of the pack.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from boebot.arenas import Patch
from boebot.description.robots import RobotDescription, Supply, load_robot
from boebot.devices.battery import BatteryDivider
from boebot.link import messages
from boebot_hil.rig import CYCLES_PER_S, TICK_S
from reading import read
from sim_bridge.robots.imperfections import AS_BUILT
from sim_bridge.tests.circle.circle import CircleRig, arena_of, circle, robot_of
from sim_bridge.tests.simulated import pack_voltage

pytestmark = pytest.mark.unsanitized

LEFT, RIGHT = 13, 12
G = 9.81
EDGES = 64  # in a turn
# Two edges are none if the second comes before the interrupt of the first has read the port. That takes 45 cycles, and
# some 100 on average, as it waits for others, above all those of servos' edges: 1.5 % of each of a flicker's two gaps,
# which last up to 0.4 ms. The native board takes no time.
FLICKERS_SEEN = {"native": 1.0, "avr": 0.97}


def wheel_speed(robot: RobotDescription, share: float, force: float) -> float:
    """Steady speed of the rim at full signal, m/s: curve A, times the voltage's share, less what the regulated motor
    (3.15) gives up to hold `force` (N, at each rim)."""
    radius = robot.body.wheel_radius_m
    free = 51.25 * 2 * math.pi / 60 * math.tanh(200 / 78.5) * radius * share
    return free - force * radius / AS_BUILT["servo_gain_n_s"]


def drag_of(robot: RobotDescription) -> float:
    """Of a rolling robot, N s/m: alpha of (2.31) with A of (2.26) is this force at its axle."""
    body = robot.body
    rolling = body.mass_kg + 2 * (body.wheel_mass_kg + body.wheel_inertia_kg_m2 / body.wheel_radius_m**2)
    return body.linear_damping_n_s_m * rolling / body.mass_kg


def drawn_by_servos(speed: float, force: float, radius: float) -> float:
    """Amperes of both: idle, by speed, and by torque."""
    torque = force * radius
    return 2 * (0.015 + AS_BUILT["servo_run_a_s_m"] * speed + AS_BUILT["servo_a_per_n_m"] * torque)


def supply_of(robot: RobotDescription) -> Supply:
    assert robot.supply is not None
    return robot.supply


# ---- battery and supply ----------------------------------------------------------------------------------------------


def lowest_pack(rig: CircleRig, left: float, right: float, seconds: float) -> float:
    """The lowest voltage of the pack while driven so for that long."""
    lowest = math.inf
    for _ in range(round(seconds / TICK_S)):
        rig.drive(left, right)
        rig.listen(TICK_S)
        lowest = min(lowest, pack_voltage(rig.robot))
    return lowest


def test_battery_sags_while_the_boebot_drives_and_its_wheels_slow_down(board_url: str) -> None:
    """Servos on the pack: V = V_full - R I and v = v(V / 5 V), solved together; 5.3 V idle and 4.6 V running."""
    robot = load_robot("boebot")
    pack, drag = supply_of(robot), drag_of(robot)
    with circle(board_url, arena_of()) as rig:
        battery = BatteryDivider(pin="A0")
        idle = pack.full_v - pack.resistance_ohm * AS_BUILT["board_a"]
        assert idle == pytest.approx(5.3)
        reported = read(battery, "battery", rig.devices(after_s=0.3))
        assert reported.valid and reported.voltage == pytest.approx(
            idle, abs=0.035
        )  # bandgap and converter resolve that
        volts = idle
        for _ in range(20):
            speed = wheel_speed(robot, volts / 5.0, 0.0)
            speed = wheel_speed(robot, volts / 5.0, drag * speed / 2)
            amperes = AS_BUILT["board_a"] + drawn_by_servos(speed, drag * speed / 2, robot.body.wheel_radius_m)
            volts = pack.full_v - pack.resistance_ohm * amperes
        assert volts == pytest.approx(4.6, abs=0.05), "what was measured on a robot"
        rig.drive_for(1.0, 1.0, 2.0)
        reported = read(battery, "battery", rig.devices())
        assert reported.voltage == pytest.approx(volts, abs=0.035)
        assert rig.robot.body().speed == pytest.approx(speed, rel=0.005)
        assert abs(rig.latest().supply - 1000 * volts) <= 25, "the board's rail is the pack"
        assert lowest_pack(rig, -1.0, -1.0, 0.6) < 4.25, "both servos reverse"
        assert rig.latest().latch == 0, "a dip of the classic robot does not stop it"


def test_the_shieldbots_regulator_holds_the_speed(board_url: str) -> None:
    robot = load_robot("shieldbot")
    with circle(board_url, arena_of(), robot) as rig:
        rig.drive_for(1.0, 1.0, 1.5)
        speed = wheel_speed(robot, 1.0, drag_of(robot) * wheel_speed(robot, 1.0, 0.0) / 2)
        assert rig.robot.body().speed == pytest.approx(speed, rel=0.005)
        sag = supply_of(robot).full_v - pack_voltage(rig.robot)
        assert sag > 0.2 and rig.robot.supply_voltage == 5.0


def test_an_empty_pack_switches_the_motors_off(board_url: str) -> None:
    """Alone the board has 4.9 V; with the servos' current the pack falls below the parameter's minimum: latched."""
    robot = robot_of(supply={"full_v": 4.0 + 0.2, "empty_v": 3.0})
    with circle(board_url, arena_of(), robot) as rig:
        assert rig.robot.supply_voltage == pytest.approx(4.2 - 2.5 * AS_BUILT["board_a"], abs=0.01)
        rig.drive_for(1.0, 1.0, 0.6)
        now = rig.latest()
        assert now.latch == messages.Latch.SUPPLY_LOW
        assert (now.pulse_left, now.pulse_right) == (0, 0)


def test_brown_out_switches_the_motors_off_and_the_link_comes_back(board_url: str) -> None:
    with circle(board_url, arena_of()) as rig:
        rig.drive_for(0.8, 0.8, 0.5)
        assert rig.robot.body().speed > 0.1
        rig.answers.clear()
        rig.board.supply(2.5)
        rig.listen(0.02)
        held_at = rig.board.cycle
        silent = len(rig.uno.serial.heard)
        rig.listen(0.5)
        assert len(rig.uno.serial.heard) == silent, "a board in reset is silent"
        assert all(rig.board.output(pin) == 2 for pin in (LEFT, RIGHT))
        assert rig.robot.body().speed < 0.01, "wheels without pulses roll out"
        x = rig.robot.body().x
        rig.board.supply(None)
        hello = rig.wait_for(
            lambda: next((a for a in rig.answers if isinstance(a, messages.Hello) and a.session == 0), None),
            2.0,
            "hello",
        )
        assert hello.reset_cause == messages.ResetCause.BROWN_OUT
        assert rig.board.counters()["resets"] == 1
        rig.start()
        rig.listen(0.5)
        for pin in (LEFT, RIGHT):
            assert np.all(rig.pulses(pin)[:, 0] <= held_at), "a pulse without a set-point"
        assert rig.robot.body().x == pytest.approx(x, abs=0.002)
        rig.drive_for(0.8, 0.8, 0.5)
        assert rig.robot.body().speed > 0.1


# ---- encoders --------------------------------------------------------------------------------------------------------


def edges_shown_and_true(
    url: str, missed: float, extra: float, *, seconds: float = 20.0, every_edge: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Of both wheels, at full speed. `every_edge`: also such as follow each other faster than a wheel's."""
    chances = {"encoder_missed": missed, "encoder_extra": extra}
    with circle(url, arena_of(), load_robot("shieldbot"), noise=True, seed=5, imperfections=chances) as rig:
        if every_edge:
            rig.set("encoder_gap", 0)
        before = rig.latest()
        rig.drive_for(1.0, 1.0, seconds)
        rig.listen(1.0)
        after, body = rig.latest(), rig.robot.body()
        shown = after.encoder_left - before.encoder_left, after.encoder_right - before.encoder_right
        return np.array(shown), np.array([body.wheel_left, body.wheel_right]) * EDGES / (2 * math.pi)


def test_encoders_count_each_edge(board_url: str) -> None:
    shown, true = edges_shown_and_true(board_url, 0.0, 0.0)
    assert np.all(np.abs(shown - true) <= 1.0)


def test_encoders_with_missed_edges_count_less(board_url: str) -> None:
    """A pulse is lost with probability p for each edge that would begin it: a share 2 p / (1 + p) of the edges."""
    shown, true = edges_shown_and_true(board_url, 0.1, 0.0, seconds=60.0)
    assert shown.sum() / true.sum() == pytest.approx(1 - 2 * 0.1 / 1.1, abs=0.03)


def test_extra_edges_of_encoders_count_if_every_edge_does(board_url: str) -> None:
    """Each flicker adds two edges. Of 6,400 edges: 0.0075 is the standard deviation of their share."""
    shown, true = edges_shown_and_true(board_url, 0.0, 0.1, seconds=60.0, every_edge=True)
    assert shown.sum() / true.sum() == pytest.approx(1 + 2 * 0.1 * FLICKERS_SEEN[board_url], abs=0.03)
    shown, true = edges_shown_and_true(board_url, 0.0, 0.1)
    assert np.all(np.abs(shown - true) <= 1.0)


# ---- slip ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("grip", [0.01, 0.7])
def test_encoders_run_ahead_of_the_ground_where_it_is_slippery(board_url: str, grip: float) -> None:
    """On ice the floor gives the body mu m g at most: m v' = mu m g - d v, while the wheels turn as the servos will."""
    robot = load_robot("shieldbot")
    body = robot.body
    mass, drag = body.mass_kg + 2 * body.wheel_mass_kg, drag_of(robot)
    ice = Patch([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], grip=grip)
    with circle(board_url, arena_of(patch=[ice]), robot) as rig:
        rig.drive_for(1.0, 1.0, 0.5)
        first, start = rig.latest(), rig.robot.body()
        speed, x, cycle = start.speed, start.x, rig.board.cycle
        rig.drive_for(1.0, 1.0, 1.0)
        last, end = rig.latest(), rig.robot.body()
        seconds = (rig.board.cycle - cycle) / CYCLES_PER_S
        ticked = (last.tick - first.tick) * TICK_S
        counted = last.encoder_left - first.encoder_left
        rolled = counted / EDGES * 2 * math.pi * body.wheel_radius_m
        edge = 2 * math.pi * body.wheel_radius_m / EDGES
        slips = grip < 0.1
        force = grip * mass * G / 2 if slips else drag * speed / 2
        assert rolled == pytest.approx(wheel_speed(robot, 1.0, force) * ticked, abs=1.5 * edge)
        if not slips:
            assert end.x - x == pytest.approx(rolled, abs=2.5 * edge)
            return
        final = grip * mass * G / drag
        decay = math.exp(-drag * seconds / mass)
        assert end.speed == pytest.approx(final + (speed - final) * decay, rel=1e-3)
        ground = final * seconds + (speed - final) * mass / drag * (1 - decay)
        assert end.x - x == pytest.approx(ground, rel=1e-2)
        assert rolled > 3 * ground
