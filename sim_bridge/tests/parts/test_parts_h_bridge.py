"""H-bridges at pins: a rover's steady speed, stall, coasting and braking against the motor's equations by hand, and
what its pack gives."""

from __future__ import annotations

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from boebot.description.robots import load_robot
from boebot.devices.h_bridge import HBridge
from boebot.errors import RobotError
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.tests.simulated import MS, Scripted, arena_of, scripted, square
from sim_bridge.tests.world.test_h_bridge import BRAKE, COAST, FORWARD, integrated

ROVER = load_robot("rover")
BODY, SUPPLY = ROVER.body, ROVER.supply
LOW, HIGH, RELEASED, PULLED_UP = range(4)
ENA, IN1, IN2, IN3, IN4, ENB = 5, 7, 8, 9, 11, 6
RADIUS, MASS = BODY.wheel_radius_m, BODY.mass_kg
ROLLING = MASS + 2 * BODY.wheel_mass_kg + 2 * BODY.wheel_inertia_kg_m2 / RADIUS**2  # kg, that a force at the rims moves

OHM = 6.0 / 0.8  # the TT motor's sheet: 6 V, 0.8 A and 0.0785 N m stalled, 0.16 A and 250 rpm without a load
C = (6.0 - OHM * 0.16) / (48 * 250 * 2 * math.pi / 60)  # V s/rad, N m/A
ETA = 0.0785 / (48 * C * (0.8 - 0.16))
EMF = 48 * C / RADIUS  # V s/m, of the rim
FORCE = 48 * ETA * C / RADIUS  # N/A, of one wheel
HELD = 48 / ETA * C / RADIUS  # and of one that drives its motor
DAMPING = BODY.linear_damping_n_s_m * ROLLING / MASS  # (2.31) has alpha / M


def drive(robot: Scripted, at_s: float, left: str, right: str | None = None) -> None:
    """From then on: "forward", "back", "brake", "coast"."""
    inputs = {"forward": (1, 0), "back": (0, 1), "brake": (1, 1), "coast": (0, 0)}
    for way, enable, ahead, behind in ((left, ENA, IN1, IN2), (right or left, ENB, IN4, IN3)):
        levels = inputs[way]
        for pin, level in ((ahead, levels[0]), (behind, levels[1]), (enable, int(way != "coast"))):
            robot.edge(round(at_s * CLOCK_HZ), pin, level)


def speed(robot: Scripted) -> float:
    return float(robot.robot.body().speed)


def amperes(robot: Scripted) -> tuple[float, float]:
    left, right = (robot.robot.layout[name].start for name in ("motor_left", "motor_right"))
    values = robot.robot.readings()
    return values[left], values[right]


def test_the_motor_is_that_of_its_sheet() -> None:
    motor = ROVER.device["motor_left"]
    assert isinstance(motor, HBridge)
    assert (motor.resistance_ohm, motor.motor_constant, motor.efficiency) == pytest.approx((OHM, C, ETA))
    assert 0.6 < ETA < 0.75


def test_steady_speed_current_and_load_on_the_pack() -> None:
    """u = (R + R_d) i + e, and the force F i less friction is the damping's; the pack sags by what all of it draws."""
    robot = scripted(robot=ROVER)
    drive(robot, 0.0, "forward")
    robot.run(2.0)
    amperes(robot)
    robot.run(1.0)
    left, right = amperes(robot)
    v = speed(robot)
    pack = robot.robot.handle.battery.supply
    current = 0.16 + 0.5 * DAMPING * v / FORCE
    assert (left, right) == pytest.approx((current, current), rel=2e-3)
    drawn = 2 * (current + 0.018) + 0.08
    assert SUPPLY is not None
    assert pack.pack_v == pytest.approx(SUPPLY.empty_v + 2.4 * pack.charge - SUPPLY.resistance_ohm * drawn, abs=1e-3)
    assert v == pytest.approx((pack.pack_v - 1.4 - (OHM + 1.15) * current) / EMF, rel=1e-3)
    charge = pack.charge
    robot.run(1.0)
    assert (charge - robot.robot.handle.battery.supply.charge) * SUPPLY.capacity_as == pytest.approx(drawn, rel=2e-3)


def test_stalled_at_a_wall() -> None:
    """Each motor draws (pack - 1.4 V) / (R + 1.15 ohm); the tyres hold."""
    robot = scripted(arena_of(square(0.70, 0.0, 1.0)), ROVER, without=["slip"])
    drive(robot, 0.0, "forward")
    robot.run(1.0)
    amperes(robot)
    robot.run(0.5)
    assert abs(speed(robot)) < 1e-3
    stalled = (robot.robot.handle.battery.supply.pack_v - 1.4) / (OHM + 1.15)
    assert amperes(robot) == pytest.approx((stalled, stalled), rel=1e-2)


def stopped(way: str) -> tuple[float, float]:
    """Speed when it begins to stop that way, and how far it then goes (m/s, m), on tyres that hold."""
    robot = scripted(robot=ROVER, without=["slip"])
    drive(robot, 0.0, "forward")
    drive(robot, 1.5, way)
    robot.run(1.5)
    v, begin = speed(robot), float(robot.robot.body().distance)
    robot.run(3.0)
    assert abs(speed(robot)) < 1e-6
    return v, float(robot.robot.body().distance) - begin


def way_of_decay(v: float, to: float, constant: float, per_speed: float) -> float:
    """m, while m dv/dt = -constant - per_speed v takes the speed from v to `to`: closed form."""
    settled, rate = -constant / per_speed, per_speed / ROLLING
    time = math.log((v - settled) / (to - settled)) / rate
    return settled * time + (v - to) / rate


def test_coasting_and_braking_distances_are_those_of_the_closed_form() -> None:
    """Coasting, friction alone stops it. The brake adds a current (e - 1.4 V) / (R + 0.775 ohm) until e is 1.4 V."""
    v, far = stopped("coast")
    friction = 2 * HELD * 0.16
    coasting = way_of_decay(v, 0.0, friction, DAMPING)
    assert far == pytest.approx(coasting + 0.001 * v, rel=0.01)  # it begins a step late
    v, near = stopped("brake")
    ohm, weak = OHM + 1.15 / 2 + 0.2, 1.4 / EMF
    braked = way_of_decay(v, weak, friction - 2 * HELD * 1.4 / ohm, DAMPING + 2 * HELD * EMF / ohm)
    expected = braked + way_of_decay(weak, 0.0, friction, DAMPING) + 0.001 * v
    assert near == pytest.approx(expected, rel=0.02), "e is that of a step before"
    assert near < 0.6 * far


@pytest.mark.parametrize(("hertz", "on_enable"), [(976.5625, True), (490.196, True), (976.5625, False)])
def test_pwm_sets_the_speed(hertz: float, on_enable: bool) -> None:
    """Against the mean current of a pulse at that speed, integrated in steps of 1 us."""
    assert SUPPLY is not None
    stiff = msgspec.structs.replace(SUPPLY, resistance_ohm=0.0)  # its voltage is the same in and between pulses
    duty, robot = 0.5, scripted(robot=msgspec.structs.replace(ROVER, supply=stiff))
    drive(robot, 0.0, "forward")
    edges = []
    for pulse in range(round(4.5 * hertz)):
        begin = pulse / hertz
        for pin in (ENA, ENB) if on_enable else (IN1, IN4):
            edges += [(round(begin * CLOCK_HZ) + 1, pin, 1), (round((begin + duty / hertz) * CLOCK_HZ), pin, 0)]
    for edge in sorted(edges):
        robot.edge(*edge)
    robot.run(4.0)
    amperes(robot)
    robot.run(0.4)
    mean = np.mean(amperes(robot))
    v, pack = speed(robot), robot.robot.handle.battery.supply.pack_v
    pulse_s = round(1e6 / hertz) * 1e-6
    spans = [(FORWARD, duty * pulse_s), (COAST if on_enable else BRAKE, (1 - duty) * pulse_s)]
    start, _, _ = integrated(4 * spans, v / RADIUS, pack_v=pack)
    _, charge, _ = integrated(spans, v / RADIUS, start, pack)
    total = charge / pulse_s
    assert mean == pytest.approx(total, rel=0.005)
    assert mean == pytest.approx(0.16 + 0.5 * DAMPING * v / FORCE, rel=0.01)
    assert 0.2 < v < 0.8


def test_it_turns_and_what_is_left_alone_is_low() -> None:
    robot = scripted(robot=ROVER)
    drive(robot, 0.0, "back", "forward")
    robot.run(0.5)
    assert robot.robot.body().turn_rate > 2.0 and abs(speed(robot)) < 0.01
    robot.edge(robot.sim.cycle + MS, ENA, RELEASED)
    robot.edge(robot.sim.cycle + MS, ENB, PULLED_UP)
    robot.run(0.5)
    amperes(robot)
    robot.run(0.1)
    left, right = amperes(robot)
    assert left == 0.0 and right > 0.1
    robot.pins.unplug("motor_right")
    robot.run(0.01)
    amperes(robot)
    robot.run(0.1)
    assert amperes(robot) == (0.0, 0.0)


def test_a_jumper_is_enable() -> None:
    left = msgspec.structs.replace(ROVER.device["motor_left"], enable_pin=None)
    robot = scripted(robot=msgspec.structs.replace(ROVER, device=dict(ROVER.device) | {"motor_left": left}))
    robot.edge(0, IN1, HIGH)
    robot.run(0.2)
    assert amperes(robot)[0] > 0.1


def test_what_is_wrong_gets_a_sentence(tmp_path: Path) -> None:
    for text, sentence in (
        ("stall_a = 0.1", "stall_a is 0.1; expected more than no_load_a, 0.16 A"),
        (
            "stall_torque_n_m = 0.4",
            "stall_torque_n_m is 0.4; expected at most 0.117 N m, that of a gear without losses",
        ),
        ("enable_pin = 20", "there is no pin 20"),
    ):
        file = tmp_path / "mine.toml"
        file.write_text(f'extends = "rover"\n[device.motor_left]\n{text}\n')
        with pytest.raises(RobotError, match=sentence):
            load_robot(file)
    servo = 'type = "continuous_servo"\npin = "A0"\ncentre_us = 1500\ngain_us = 200\n'
    file.write_text(f'extends = "rover"\n[device.wheel]\n{servo}')
    with pytest.raises(RobotError, match=r"device\.wheel: motor_left and wheel both turn the left wheel; expected one"):
        load_robot(file)


def test_who_looks_changes_no_bit() -> None:
    ends = []
    for looks in (1, 7):
        robot = scripted(robot=ROVER, noise=True)
        drive(robot, 0.0, "forward", "back")
        for at in range(1, 600):
            robot.edge(at * 8192, ENA, at % 2)
        for _ in range(looks):
            robot.run(0.21 / looks)
            amperes(robot)
        body = robot.robot.body()
        ends.append((robot.sim.cycle, body.x, body.heading, robot.robot.handle.battery.supply.charge))
    assert ends[0] == ends[1]
