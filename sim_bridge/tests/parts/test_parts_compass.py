"""The HMC5883L at the pins of the two-wire bus: line logic, registers, times (data sheet, form 900405)."""

from __future__ import annotations

import itertools
import math
import tempfile
from pathlib import Path
from typing import Any

import pytest

from boebot.devices.device import pin_name
from sim_bridge.boards import avr
from sim_bridge.boards.board import CLOCK_HZ
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.catalogue import Part
from sim_bridge.robots.wiring import add_part
from sim_bridge.sim import Sim
from sim_bridge.tests.boards.avr.avr_program import assemble
from sim_bridge.tests.boards.avr.test_avr_twi import MACROS, RESULTS
from sim_bridge.tests.simulated import MS, Scripted, arena_of, scripted, square

SDA, SCL = 18, 19
HALF = 20  # cycles: 400 kHz
HORIZONTAL, DOWN = 0.19, 0.45


def parameters(**field: float) -> Any:
    return ffi.new("hmc5883l_parameters *", {"field": field, "horizontal_gauss": HORIZONTAL, "down_gauss": DOWN})


class Master:
    """Speaks to the bus by edges of a scripted board; each call returns when its edges have been played."""

    def __init__(self, heading: float = 0.0, noise: bool = False, **field: float) -> None:
        self.robot: Scripted = scripted(pose=(0, 0, heading), noise=noise)
        assert add_part(self.robot.robot.handle, Part("compass_kind", 0, ["A4", "A5"], parameters(**field))) == 0
        self.at = 1 * MS

    def wait(self, seconds: float) -> None:
        self.at = max(self.at, self.robot.sim.cycle) + round(seconds * CLOCK_HZ)
        self.robot.sim.run(self.at - self.robot.sim.cycle)

    def line(self, pin: int, high: int) -> None:
        self.robot.edge(self.at, pin, 2 if high else 0)

    def step(self) -> None:
        self.at += HALF

    def start(self) -> None:
        self.at = max(self.at, self.robot.sim.cycle + 100)
        for pin, high in ((SDA, 1), (SCL, 1), (SDA, 0), (SCL, 0)):
            self.line(pin, high)
            self.step()

    def stop(self) -> None:
        for pin, high in ((SDA, 0), (SCL, 1), (SDA, 1)):
            self.line(pin, high)
            self.step()

    def bits(self, bits: str) -> list[int]:
        """Puts bits on SDA ("1" lets go) and returns what stood there while SCL was high, 1 where it was let go."""
        times = []
        for bit in bits:
            self.line(SDA, int(bit))
            self.step()
            self.line(SCL, 1)
            times.append((self.at + HALF // 2, int(bit)))
            self.step()
            self.line(SCL, 0)
            self.at += 6  # the next change of SDA comes after the clock has fallen
        self.robot.sim.run(self.at - self.robot.sim.cycle)
        log = self.robot.inputs(SDA)
        return [own & [level for cycle, level in log if cycle <= at][-1] for at, own in times]

    def send(self, byte: int) -> int:
        """Returns the acknowledgement, 0 for yes."""
        return self.bits(f"{byte:08b}1")[8]

    def take(self, acknowledge: bool) -> int:
        return int("".join(map(str, self.bits("11111111" + ("0" if acknowledge else "1"))[:8])), 2)

    def write(self, register: int, *values: int) -> None:
        self.start()
        assert [self.send(byte) for byte in (0x3C, register, *values)] == [0] * (2 + len(values))
        self.stop()

    def read(self, register: int, count: int) -> list[int]:
        self.start()
        assert self.send(0x3C) == 0 and self.send(register) == 0
        self.start()
        assert self.send(0x3D) == 0
        values = [self.take(acknowledge=i + 1 < count) for i in range(count)]
        self.stop()
        return values

    def field(self) -> tuple[int, int, int]:
        """X, Y, Z."""
        data = bytes(self.read(3, 6))
        x, z, y = (int.from_bytes(data[i : i + 2], "big", signed=True) for i in (0, 2, 4))
        return x, y, z


def test_identification_and_what_the_registers_hold_after_power_on() -> None:
    master = Master()
    assert bytes(master.read(10, 3)) == b"H43"
    assert master.read(0, 3) == [0x10, 0x20, 0x01]


@pytest.mark.parametrize("address", [0x00, 0x3A, 0x3E, 0xFF])
def test_other_addresses_are_not_acknowledged(address: int) -> None:
    master = Master()
    master.start()
    assert master.send(address) == 1
    assert master.send(0x12) == 1  # nor what follows
    master.stop()
    assert bytes(master.read(10, 3)) == b"H43"


def test_sda_moves_only_while_the_clock_is_low() -> None:
    master = Master()
    master.read(10, 3)
    falls = [edge["cycle"] for edge in master.robot.pins.pin_log() if edge["pin"] == SCL and edge["level"] == 0]
    for cycle, _ in master.robot.inputs(SDA)[1:]:
        assert min(abs(int(cycle) - int(fall) - 5) for fall in falls) == 0


@pytest.mark.parametrize("degrees", range(-180, 181, 15))
def test_single_measurement_tells_the_heading(degrees: int) -> None:
    """X forward, Y left: a robot that is turned left of north sees north on its right; 1090 counts per gauss."""
    heading = math.radians(degrees)
    master = Master(heading)
    master.write(2, 1)
    master.wait(0.0065)
    x, y, z = master.field()
    assert x == pytest.approx(1090 * HORIZONTAL * math.cos(heading), abs=0.51)
    assert y == pytest.approx(-1090 * HORIZONTAL * math.sin(heading), abs=0.51)
    assert z == pytest.approx(-1090 * DOWN, abs=0.51)
    assert math.cos(math.atan2(-y, x) - heading) > math.cos(0.006)


def test_a_single_measurement_takes_6_ms_and_then_it_rests() -> None:
    master = Master()
    master.write(2, 1)
    asked = master.at
    while not master.read(9, 1)[0] & 1:
        assert master.at - asked < 7 * MS
    assert 6 * MS <= master.at - asked < 6.3 * MS
    assert master.read(2, 1) == [0x03]
    x = master.field()
    master.robot.robot.place(0, 0, 2.0)
    master.wait(0.3)
    assert master.field() == x


@pytest.mark.unsanitized
@pytest.mark.parametrize(
    ("setting", "hertz"),
    [
        pytest.param(setting, hertz, marks=() if hertz in (15.0, 75.0) else pytest.mark.soak)
        for setting, hertz in enumerate([0.75, 1.5, 3.0, 7.5, 15.0, 30.0, 75.0])
    ],
)
def test_continuous_mode_has_the_rate_that_was_set(setting: int, hertz: float) -> None:
    """The robot is turned a little between two readings: what they read changes with each measurement only. One that
    ends while its predecessor is being read is lost (LOCK): at 75 Hz some are."""
    master = Master()
    master.write(0, setting << 2)
    master.write(2, 0)
    period = 1 / hertz
    times: list[float] = []
    last = None
    heading = 0.0
    while len(times) < (12 if hertz > 50 else 4):
        heading += 0.1
        master.robot.robot.place(0, 0, heading % 6.0)
        master.wait(max(period / 20, 0.001))
        field = master.field()
        if field != last and last is not None:
            times.append(master.at / CLOCK_HZ)
        last = field
    gaps = [later - earlier for earlier, later in itertools.pairwise(times[1:])]
    assert min(gaps) == pytest.approx(period, abs=max(period / 15, 0.0016))
    assert all(abs(gap / period - round(gap / period)) < 0.13 for gap in gaps)


@pytest.mark.parametrize(("setting", "per_gauss"), list(enumerate([1370, 1090, 820, 660, 440, 390, 330, 230])))
def test_gain(setting: int, per_gauss: int) -> None:
    master = Master()
    master.write(1, setting << 5)
    master.write(2, 1)
    master.wait(0.0065)
    x, _, z = master.field()
    assert x == pytest.approx(per_gauss * HORIZONTAL, abs=0.51)
    assert z == pytest.approx(-per_gauss * DOWN, abs=0.51)


def test_overflow_reads_minus_4096() -> None:
    master = Master(iron_x=8.0)  # 1.7 gauss at 1370 per gauss
    master.write(1, 0)
    master.write(2, 1)
    master.wait(0.0065)
    assert master.field()[0] == -4096


def test_half_read_data_are_locked() -> None:
    """New data are lost until all six registers have been read."""
    master = Master()
    master.write(0, 6 << 2)
    master.write(2, 0)
    master.wait(0.02)
    assert master.read(9, 1)[0] & 2 == 0
    first = master.read(3, 2)
    assert master.read(9, 1)[0] & 2
    master.robot.robot.place(0, 0, 1.5)
    master.wait(0.1)
    assert master.read(3, 6)[:2] == first
    assert master.read(9, 1)[0] & 2 == 0
    master.wait(0.1)
    assert master.read(3, 6)[:2] != first


def test_pointer_stays_within_the_data() -> None:
    master = Master()
    master.write(2, 1)
    master.wait(0.0065)
    data = master.read(3, 12)
    assert data[:6] == data[6:]


def test_iron_and_mounting() -> None:
    """Hard iron shifts the circle, a turned mounting turns it."""
    master = Master(iron_x=0.5, iron_y=-0.25)
    master.write(2, 1)
    master.wait(0.0065)
    x, y, _ = master.field()
    assert x == pytest.approx(1090 * HORIZONTAL * 1.5, abs=0.51)
    assert y == pytest.approx(-1090 * HORIZONTAL * 0.25, abs=0.51)
    turned = Master(bias=0.3)
    turned.write(2, 1)
    turned.wait(0.0065)
    x, y, _ = turned.field()
    assert math.atan2(-y, x) == pytest.approx(0.3, abs=0.005)


@pytest.mark.unsanitized
@pytest.mark.parametrize(("average", "samples"), [(0, 1), (3, 8)])
def test_averaging_lowers_the_noise(average: int, samples: int) -> None:
    master = Master(noise=True, sigma=0.05)
    master.write(0, average << 5 | 6 << 2)
    master.write(2, 0)
    values = []
    for _ in range(80):
        master.wait(1 / 75)
        values.append(master.field()[1])
    mean = sum(values) / len(values)
    spread = math.sqrt(sum((value - mean) ** 2 for value in values) / (len(values) - 1))
    assert spread == pytest.approx(1090 * HORIZONTAL * 0.05 / math.sqrt(samples), rel=0.25)


def test_self_test_adds_its_bias() -> None:
    master = Master(heading=math.pi / 2)
    master.write(1, 5 << 5)
    for test, sign in ((1, 1), (2, -1)):
        master.write(0, 0x10 | test)
        master.write(2, 1)
        master.wait(0.0065)
        x, _, z = master.field()
        assert x == pytest.approx(sign * 390 * 1.16, abs=0.51)
        assert z == pytest.approx(390 * (sign * 1.08 - DOWN), abs=0.51)


def test_one_address_is_for_one_chip() -> None:
    robot = scripted()
    handle = robot.robot.handle

    def add(sda: int, scl: int, **field: float) -> int:
        pins = [pin_name(sda) if sda > 13 else sda, pin_name(scl) if scl > 13 else scl]
        return add_part(handle, Part("compass_kind", 0, pins, parameters(**field)))

    assert add(SDA, SCL) == 0
    assert add(SDA, SCL) == lib.SIM_PIN_TAKEN
    assert (
        lib.robot_add_part(handle, ffi.addressof(lib.compass_kind), 0, [20, SCL], parameters()) == lib.SIM_BAD_ARGUMENT
    )


PROGRAM = """
main:
  setup 12, 0
  start
  send 0x3C
  send 2
  send 1
  stop
  ldi r26, 0
  ldi r30, lo8(30000)
  ldi r31, hi8(30000)
7: sbiw r30, 1        ; 7.5 ms
  brne 7b
  start
  send 0x3C
  send 3
  start
  send 0x3D
  take 1
  take 1
  take 1
  take 1
  take 1
  take 0
  stop
8: rjmp 8b
"""


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5])
def test_the_chip_of_the_emulated_board_reads_it(heading: float) -> None:
    """The whole circle: a program, the two-wire interface at 400 kHz, pins, chip, world."""
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder, "program.elf")
        image.write_bytes(assemble(MACROS + PROGRAM))
        board = avr.create(image)
    from boebot.description.robots import load_robot

    sim = Sim(arena_of(outline=square(0, 0, 2)), noise=False)
    robot = sim.add(board, load_robot("shieldbot"), pose=(0, 0, heading))
    assert add_part(sim.robot(0).handle, Part("compass_kind", 0, ["A4", "A5"], parameters())) == 0
    sim.run(round(0.02 * CLOCK_HZ))
    from sim_bridge.pins import BoardPins

    results = BoardPins(robot).read_memory(RESULTS, 5 + 12)
    assert list(results[:5:1]) == [0x08, 0x18, 0x28, 0x10, 0x40]
    assert list(results[5::2]) == [0x50] * 5 + [0x58]
    data = bytes(results[6::2])
    x, y = (int.from_bytes(data[i : i + 2], "big", signed=True) for i in (0, 4))
    assert x == pytest.approx(1090 * HORIZONTAL * math.cos(heading), abs=0.51)
    assert y == pytest.approx(-1090 * HORIZONTAL * math.sin(heading), abs=0.51)
    sim.close()
