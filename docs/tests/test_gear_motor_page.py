"""docs/explanation/gear-motor.md has the motor, the drops and the distances that the simulator has."""

from __future__ import annotations

from pathlib import Path

from boebot.description.robots import load_robot
from boebot.devices.h_bridge import HBridge
from boebot.imperfections import imperfections
from sim_bridge.tests.parts.test_parts_h_bridge import amperes, drive, speed
from sim_bridge.tests.simulated import scripted

PAGE = (Path(__file__).resolve().parents[1] / "explanation" / "gear-motor.md").read_text(encoding="utf-8")
ROVER = load_robot("rover")


def test_the_motor_and_the_drops() -> None:
    motor = ROVER.device["motor_left"]
    assert isinstance(motor, HBridge)
    assert f"{motor.stall_a:g} A = {motor.resistance_ohm:g} Ω" in PAGE
    assert f"rad/s) = {1e3 * motor.motor_constant:.2f} mV s" in PAGE
    assert f"| {1e3 * motor.motor_constant * motor.no_load_a:.2f} mN m at the motor's axis |" in PAGE
    assert f"N m = {motor.efficiency:.2f} |" in PAGE
    volts, ohm, diode_v, diode_ohm = (
        imperfections()[f"bridge_{name}"].value or 0.0 for name in ("drop_v", "drop_ohm", "diode_v", "diode_ohm")
    )
    assert f"pack − {volts:g} V − {ohm:g} Ω i" in PAGE
    assert f"−({volts / 2:g} V + {diode_v:g} V) − {ohm / 2 + diode_ohm:g} Ω i" in PAGE
    assert f"−(pack + {2 * diode_v:g} V) − {2 * diode_ohm:g} Ω i" in PAGE


def test_full_speed_and_the_ways_to_a_stop() -> None:
    robot = scripted(robot=ROVER)
    drive(robot, 0.0, "forward")
    robot.run(3.0)
    amperes(robot)  # from here on
    robot.run(0.5)
    pack = robot.robot.handle.battery.supply.pack_v
    assert f"{pack:.1f} V − 1.4 V − 8.65 Ω · {amperes(robot)[0]:.2f} A" in PAGE and f": {speed(robot):.2f} m/s" in PAGE
    far = {}
    for way in ("coast", "brake"):
        robot = scripted(robot=ROVER)
        drive(robot, 0.0, "forward")
        drive(robot, 2.0, way)
        robot.run(2.0)
        begin = robot.robot.body().distance
        robot.run(1.0)
        far[way] = 100 * (robot.robot.body().distance - begin)
    assert f"stops a rover in {far['brake']:.0f} cm, `analogWrite(ENA, 0)` in {far['coast']:.0f} cm" in PAGE
