"""LEDs: what is seen of them is the mean of their current, which pins, resistor and supply make."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.input import Button
from boebot.devices.led import Led
from sim_bridge.boards.avr import create
from sim_bridge.pins import BoardPins
from sim_bridge.sim import Sim
from sim_bridge.tests.boards.avr.avr_program import compiled
from sim_bridge.tests.simulated import MS, US, arena_of, scripted

SUPPLIED, GROUNDED = 7, 6
LOW, HIGH, RELEASED, PULLED_UP = range(4)


def lamps(**imperfections: float) -> RobotDescription:
    devices = {"a": Led(pin=GROUNDED), "b": Led(pin=SUPPLIED, to="supply", colour="blue")}
    return msgspec.structs.replace(
        load_robot("shieldbot"), firmware="none", device=devices, imperfections=imperfections
    )


def test_the_brightness_is_the_share_of_the_time_in_which_a_pin_drives_it() -> None:
    """A quarter of each millisecond high; since the last look, and between two edges too."""
    robot = scripted(robot=lamps())
    assert robot.robot.layout == {"a": slice(0, 1), "b": slice(1, 2)} and robot.robot.readings() == (0.0, 0.0)
    for i in range(100):
        for pin in (GROUNDED, SUPPLIED):
            robot.edge(i * MS + 100 * US, pin, HIGH)
        for pin in (GROUNDED, SUPPLIED):
            robot.edge(i * MS + 350 * US, pin, LOW)
    robot.edge(120 * MS, SUPPLIED, RELEASED)
    robot.edge(130 * MS, GROUNDED, PULLED_UP)
    robot.run(0.05)
    dark_s = 100e-6  # b's pin is an input up to the first edge
    assert robot.robot.readings() == pytest.approx((0.25, 0.75 - dark_s / 0.05), abs=1e-5)
    robot.run(0.05)
    assert robot.robot.readings() == pytest.approx((0.25, 0.75), abs=1e-5)
    robot.run(0.04)  # to 120 ms low, from 130 ms on by the pull-up of 35 kOhm
    assert robot.robot.readings() == pytest.approx((0.25 * 220 / 35_220, 0.5), abs=1e-5)
    assert robot.robot.readings() == pytest.approx((220 / 35_220, 0.0)), "now, as no time has passed"


# Its pins are inputs, but for 100 ms from 100 ms on, as pin 7 is high.
PROGRAM = """
#include <avr/io.h>
#include <util/delay.h>
int main(void) {
  _delay_ms(100);
  PORTD = DDRD = 1 << 7;
  _delay_ms(100);
  PORTD = DDRD = 0;
  for (;;) {}
}
"""


def test_a_net_has_one_level_whoever_drives_it(tmp_path: Path) -> None:
    """An LED beside a switch to 5 V, and one to 5 V beside a button to ground with 10 kOhm, which let no LED shine;
    what the board drives is the stronger one."""
    keys = {
        "up": Button(pin=GROUNDED, to="supply", resistor=True),
        "down": Button(pin=SUPPLIED, resistor=True),
    }
    robot = msgspec.structs.replace(lamps(), device=lamps().device | keys)
    sim = Sim(arena_of(), noise=False)
    added = sim.add(create(compiled(PROGRAM, tmp_path / "lets_go.elf")), robot)

    def shown(up: int, down: int) -> tuple[float, ...]:
        added.set_part("up", up)
        added.set_part("down", down)
        sim.run(MS)
        added.readings()
        sim.run(10 * MS)
        return tuple(round(one, 3) for one in added.readings()[:2])

    assert [shown(0, 0), shown(1, 0), shown(0, 1), shown(1, 1)] == [(0, 0), (1, 0), (0, 1), (1, 1)]
    sim.run_until(105 * MS)
    assert [shown(1, 1), shown(0, 1)] == [(1, 0), (0, 0)]
    sim.run_until(205 * MS)
    BoardPins(added).unplug("a")
    assert shown(1, 1) == (0, 1)
    BoardPins(added).plug("a")
    assert shown(1, 1) == (1, 1)


def test_resistor_supply_plug_and_spread_change_it() -> None:
    robot = scripted(robot=lamps(led_resistor_ohm=110.0))
    robot.edge(0, GROUNDED, HIGH)
    robot.pins.supply(4.0)
    robot.run(0.01)
    assert robot.robot.readings()[0] == pytest.approx(2 * (4.0 - 2.0) / (5.0 - 2.0), abs=1e-3)
    robot.pins.unplug("a")
    robot.robot.readings()
    robot.run(0.01)
    assert robot.robot.readings() == (0.0, 0.0)
    for level, brightness in ((LOW, 0.0), (HIGH, 4 / 3)):  # it shows what the pin has become meanwhile
        robot.edge(robot.sim.cycle + MS, GROUNDED, level)
        robot.run(0.01)
        robot.pins.plug("a")
        robot.run(0.01)
        assert robot.robot.readings()[0] == pytest.approx(brightness / 2, abs=1e-3)  # of half the time
        robot.pins.unplug("a")
    bright = set()
    for seed in range(3):
        robot = scripted(robot=lamps(), noise=True, seed=seed)
        robot.edge(0, GROUNDED, HIGH)
        robot.run(0.01)
        bright.add(robot.robot.readings()[0])
    assert len(bright) == 3 and all(0.3 < one < 2 for one in bright)
