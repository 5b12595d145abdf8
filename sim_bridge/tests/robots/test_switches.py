"""What is switched off is ideal: closed forms at the parts, on the native board and without one; all of it with noise.

Where chance would hide an imperfection it is made large first, so that only its switch can take it away.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

import boebot
from boebot import Member
from boebot.arenas import Arena, ArenaDescription, Patch
from boebot.boards import BoardRequest, open_board
from boebot.description import robots
from boebot.description.robots import load_robot
from boebot.devices.accelerometer import Accelerometer
from boebot.devices.analog_infrared import SharpSensor
from boebot.devices.battery import Energy
from boebot.devices.device import pin_number
from boebot.devices.encoder import SingleEncoder
from boebot.devices.infrared import InfraredPair, InfraredProximity
from boebot.devices.laser import Laser
from boebot.devices.light import LightSensor, Phototransistor
from boebot.devices.motor import DcMotor
from boebot.devices.ping import PingSensor, Sonar
from boebot.devices.servo import ContinuousServo
from boebot.devices.turret import PositionServo
from boebot.errors import BoardError, BoebotError
from boebot.imperfections import imperfections, switched_off, switches
from boebot.result import RunResult
from boebot.robot import Robot
from sim_bridge.compiled import lib
from sim_bridge.devices import analog_infrared as analog_infrared_model
from sim_bridge.devices import battery as battery_model
from sim_bridge.devices import compass as compass_model
from sim_bridge.devices import light as light_model
from sim_bridge.devices import servo as servo_model
from sim_bridge.devices import turret as turret_model
from sim_bridge.robots import imperfections as parts
from sim_bridge.robots.imperfections import Draw
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import MS, US, add_scripted, arena_of, pack_voltage, scripted, square
from sim_bridge.vehicle import Vehicle
from sim_bridge.vehicles.model_file import vehicle_model

pytestmark = pytest.mark.unsanitized  # whole runs: their C is that of the tests of world, parts and loop

LEFT, RIGHT = 13, 12
WHEEL = 0.0331
TOP = 51.25 * 2 * math.pi / 60  # rad/s
LED, RECEIVER, PING = 9, 10, 8
SHIELDBOT, BOEBOT, ARSIM = load_robot("shieldbot"), load_robot("boebot"), load_robot("arsim")
SEEDS = range(1, 21)


def drawn(seed: int, *without: str) -> Draw:
    return Draw(seed, True, magnitudes=parts.applied(SHIELDBOT, without).imperfections)


def servo(seed: int, *without: str) -> Any:
    device = SHIELDBOT.device["servo_left"]
    assert isinstance(device, ContinuousServo)
    return servo_model.servo_parameters(device, SHIELDBOT.body, 0, drawn(seed, *without))


# ---- what is drawn of a unit: (switch, figures of the part, ideal values) -------------------------------------------


def sharp(draw: Draw) -> Any:
    device = BOEBOT.device["analog_infrared"]
    assert isinstance(device, SharpSensor)
    return analog_infrared_model.analog_infrared_parameters(device, draw)


def light(draw: Draw) -> Any:
    device = SHIELDBOT.device["light_left"]
    assert isinstance(device, LightSensor)
    return light_model.light_parameters(device, 0, draw).light


def turret(draw: Draw) -> Any:
    device = SHIELDBOT.device["turret"]
    assert isinstance(device, PositionServo)
    return turret_model.turret_parameters(device, draw).motor.centre_us


def field(draw: Draw) -> Any:
    return compass_model.compass_parameters(draw).field


def body(*without: str) -> Any:
    return parts.body_parameters(parts.applied(SHIELDBOT, without).body)


UNITS: list[tuple[str, Callable[[Draw], tuple[float, ...]], tuple[float, ...]]] = [
    ("sharp_noise", lambda draw: (sharp(draw).gain, sharp(draw).sigma), (1.0, 0.0)),
    ("sharp_delay", lambda draw: (sharp(draw).late,), (0.0,)),
    ("light_noise", lambda draw: (light(draw).gain, light(draw).sigma), (1.0, 0.0)),
    ("ambient_light", lambda draw: (light(draw).ambient,), (0.0,)),
    ("turret_centre", lambda draw: (turret(draw),), (1500.0,)),
    ("compass_noise", lambda draw: (field(draw).sigma,), (0.0,)),
    (
        "compass_bias",
        lambda draw: tuple(getattr(field(draw), key) for key in ("bias", "iron_x", "iron_y", "current_x", "current_y")),
        (0.0,) * 5,
    ),
]


@pytest.mark.parametrize(("switch", "figures", "ideal"), UNITS, ids=[unit[0] for unit in UNITS])
def test_a_unit_is_ideal(switch: str, figures: Callable[[Draw], tuple[float, ...]], ideal: tuple[float, ...]) -> None:
    for seed in SEEDS:
        assert figures(drawn(seed, switch)) == ideal
        assert all(one != other for one, other in zip(figures(drawn(seed)), ideal, strict=True))


@pytest.mark.parametrize("seed", SEEDS)
def test_servos_follow_the_tanh_of_the_data_sheet(seed: int) -> None:
    """51.25 rpm tanh(offset / 78.5 us), from the smallest pulse offset on; each switch takes its own part away."""
    both = servo(seed, "servo_spread")
    assert (both.top_ccw_rad_s + both.top_cw_rad_s) / 2 == pytest.approx(TOP, rel=1e-12)
    even = servo(seed, "servo_asymmetry")
    assert even.top_ccw_rad_s == even.top_cw_rad_s != TOP
    assert servo(seed, "servo_centre").centre_us == 1500.0 != servo(seed).centre_us
    ideal = servo(seed, "servo_spread", "servo_asymmetry", "servo_centre", "dead_band")
    for offset in (-200.0, -30.0, -1.0, 0.0, 1.0, 30.0, 200.0):
        curve = lib.servo_motor_curve(ideal, 1500 + offset)
        assert curve == pytest.approx(TOP * math.tanh(offset / 78.5) * WHEEL, rel=1e-9, abs=1e-12)


# ---- drive -----------------------------------------------------------------------------------------------------------


def test_without_lag_only_the_regulators_loop_is_left() -> None:
    """M v' + alpha v = 2 A K (v_ref - v), (2.26) and (3.15), by Euler steps of 1 ms: what is missing at steady speed
    dies out by that rate."""
    robot = scripted(without=("lag",))
    robot.pulses(0.2, {LEFT: 1700, RIGHT: 1300})
    robot.run(0.2)
    mass, alpha = SHIELDBOT.body.mass_kg, SHIELDBOT.body.linear_damping_n_s_m
    gain = 2 * lib.body_a(body()) * 1.2
    truth = robot.robot.truth()
    steady = TOP * math.tanh(200 / 78.5) * WHEEL * gain / (gain + alpha)
    missing = steady - truth["speed"][(truth["time"] > 0.045) & (truth["time"] < 0.085)]
    assert missing[1:] / missing[:-1] == pytest.approx((1 - (gain + alpha) / mass * 0.001) ** 10, rel=0.01)
    assert truth["speed"][-1] == pytest.approx(steady, rel=1e-4)


def test_without_drag_it_rolls_out_by_the_bodys_damping() -> None:
    """v = v0 exp(-alpha t / M), (2.26)."""
    robot = scripted(without=("coast_drag",))
    robot.pulses(1.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(1.1)  # it has let go
    before = robot.robot.body().speed
    robot.run(0.3)
    rate = SHIELDBOT.body.linear_damping_n_s_m / SHIELDBOT.body.mass_kg
    assert robot.robot.body().speed == pytest.approx(before * math.exp(-rate * 0.3), rel=2e-3)


def ice(grip: float) -> Arena:
    return Arena(ArenaDescription(name="ice", patch=[Patch(corners_m=square(0, 0, 8), grip=grip)]))


def test_without_slip_ice_is_like_any_floor() -> None:
    """Rolling: the rims go as the ground does."""

    def way(grip: float, *without: str) -> tuple[float, float]:
        robot = scripted(ice(grip), without=without, pose=(0, 0, 0))
        robot.pulses(0.6, {LEFT: 1700, RIGHT: 1300})
        robot.run(0.6)
        state = robot.robot.body()
        return float(state.x), float(state.wheel_left) * WHEEL

    assert way(0.005, "slip") == way(5.0, "slip")
    x, rolled = way(0.005, "slip")
    assert rolled == pytest.approx(x, rel=1e-9)
    x, rolled = way(0.005)
    assert rolled > 2 * x


def test_encoders_see_each_edge_once() -> None:
    poor = msgspec.structs.replace(SHIELDBOT, imperfections={"encoder_missed": 0.2, "encoder_extra": 0.2})
    device = SHIELDBOT.device["encoder_left"]
    assert isinstance(device, SingleEncoder)
    pin = pin_number(device.pin)

    def off(*without: str) -> float:
        robot = scripted(robot=poor, noise=True, without=without)
        robot.pulses(3.0, {LEFT: 1600, RIGHT: 1400})
        robot.run(3.0)
        turned = robot.robot.body().wheel_left / (2 * math.pi) * device.edges_per_turn
        return abs(len(robot.inputs(pin)) - 1 - abs(float(turned)))

    assert off("encoder_errors") <= 1.0 < off()


# ---- sensors on a board ----------------------------------------------------------------------------------------------


def test_whiskers_close_once() -> None:
    for seed in SEEDS:
        robot = scripted(arena_of(square(1, 0, 1)), pose=(0.41, 0, 0), noise=True, seed=seed, without=("bounce",))
        robot.run(0.05)
        assert all([level for _, level in robot.inputs(pin)] == [1, 0] for pin in (5, 7))


def infrared_sees(distance: float, seed: int, *without: str) -> bool:
    """A burst of the left LED with a wall across its beam at that distance."""
    pair = SHIELDBOT.device["infrared_left"]
    assert isinstance(pair, InfraredPair)
    (x, y), heading = pair.position_m, math.pi / 2 - pair.heading_rad
    px, py = x * math.cos(heading) - y * math.sin(heading), x * math.sin(heading) + y * math.cos(heading)
    wall = y + distance
    arena = arena_of([(-2, wall), (2, wall), (2, wall + 0.1), (-2, wall + 0.1)])
    poor = msgspec.structs.replace(SHIELDBOT, imperfections={"infrared_spread": 0.3, "infrared_false_hit": 0.3})
    robot = scripted(arena, poor, pose=(-px, y - py, heading), noise=True, seed=seed, without=without)
    robot.burst(1 * MS, LED)
    robot.run(0.005)
    return len(robot.inputs(RECEIVER)) > 1


@pytest.mark.unsanitized
def test_infrared_range_is_sharp() -> None:
    near = {infrared_sees(0.195, seed, "infrared_noise") for seed in SEEDS}
    far = {infrared_sees(0.205, seed, "infrared_noise") for seed in SEEDS}
    assert (near, far) == ({True}, {False})
    assert {infrared_sees(0.205, seed) for seed in SEEDS} == {True, False}


def test_only_the_robot_that_switches_it_off_is_spared_cross_talk() -> None:
    pair = SHIELDBOT.device["infrared_left"]
    assert isinstance(pair, InfraredPair)
    turn, (px, py) = -pair.heading_rad, pair.position_m
    back = math.pi + turn
    dx, dy = px * math.cos(turn) - py * math.sin(turn), px * math.sin(turn) + py * math.cos(turn)

    def lit(*without: str) -> bool:
        """A silent robot's left pair looks at another's that sends."""
        sim = Sim(arena_of(outline=square(0, 0, 12)), noise=False)
        hearer = add_scripted(sim, pose=(-dx, -dy, turn), without=without)
        sender = add_scripted(sim, pose=(1 + dx, dy, back))
        sender.burst(5 * MS, LED)
        sim.run(40 * MS)
        return len(hearer.inputs(RECEIVER)) > 1

    assert lit() and not lit("cross_talk")


def echo_us(arena: Arena, seed: int, *without: str) -> float:
    deaf = msgspec.structs.replace(SHIELDBOT, imperfections={"ping_miss": 0.5})
    robot = scripted(arena, deaf, pose=(0, 0, 0), noise=True, seed=seed, without=without)
    robot.edge(1 * MS, PING, 1)
    robot.edge(1 * MS + 5 * US, PING, 2)
    robot.run(0.03)
    (rise, _), (fall, _) = robot.inputs(PING)[:2]
    return (fall - rise) / US


@pytest.mark.unsanitized
def test_echoes_are_exact_and_heard() -> None:
    """t = 2 d / c with c = 343.5 m/s at 20 degrees Celsius; 18.5 ms where none is heard."""
    wall = arena_of([(1.06, -3), (1.2, -3), (1.2, 3), (1.06, 3)])
    exact = pytest.approx(2 / 343.5 * 1e6, abs=0.1)
    assert all(echo_us(wall, seed, "ping_noise", "ping_misses") == exact for seed in SEEDS)
    quiet = [echo_us(wall, seed, "ping_noise") for seed in SEEDS]
    assert any(echo > 18_000 for echo in quiet) and all(echo == exact for echo in quiet if echo < 18_000)
    heard = [echo_us(wall, seed, "ping_misses") for seed in SEEDS]
    assert all(echo < 18_000 for echo in heard) and not all(echo == exact for echo in heard)


def test_flat_surfaces_answer() -> None:
    """The echo comes by the ray that is nearest to the wall's normal, of a wall 0.5 m from the body's centre."""
    device = SHIELDBOT.device["ping"]
    assert isinstance(device, PingSensor)
    turn = math.radians(70)
    c, s = math.cos(turn), math.sin(turn)
    wall = arena_of([(c * x - s * y, s * x + c * y) for x, y in [(0.5, -5), (0.6, -5), (0.6, 5), (0.5, 5)]])
    distance = (0.5 - device.position_m[0] * c) / math.cos(turn - device.beam_rad / 2)
    echo = echo_us(wall, 1, "specular", "ping_noise", "ping_misses")
    assert echo == pytest.approx(2 * distance / 343.5 * 1e6, abs=0.1)
    assert echo_us(wall, 1, "ping_noise", "ping_misses") == 18_500


# ---- supply ----------------------------------------------------------------------------------------------------------


def weak() -> robots.RobotDescription:
    """Of a pack whose voltage the regulator lets through."""
    assert SHIELDBOT.supply is not None
    return msgspec.structs.replace(SHIELDBOT, supply=msgspec.structs.replace(SHIELDBOT.supply, full_v=4.8, empty_v=4.4))


def volts(*without: str) -> tuple[float, float]:
    """Of pack and rail after two seconds at full speed."""
    robot = scripted(robot=weak(), without=without, step_cycles=10 * MS)
    robot.pulses(2.0, {LEFT: 1700, RIGHT: 1300})
    robot.run(2.0)
    return pack_voltage(robot.robot), robot.robot.supply_voltage


def test_supply_is_ideal() -> None:
    pack, rail = volts("battery_load")
    assert pack == 4.8 and rail == pytest.approx(4.3, abs=1e-12), "only the drop-out is left"
    pack, rail = volts("battery_sag")
    assert pack == rail and 4.8 - 0.4 * 2 * 1.0 / 7200 < pack < 4.8, "it empties, by less than 1 A; nothing sags"
    assert volts("battery_sag", "battery_load") == (4.8, 4.8)
    pack, rail = volts()
    assert rail == pytest.approx(pack - 0.5, abs=1e-12) and pack < 4.7


def test_battery_is_measured_exactly() -> None:
    def noise_v(*without: str) -> float:
        assert BOEBOT.supply is not None
        magnitudes = parts.applied(BOEBOT, without).imperfections
        return float(battery_model.battery_parameters(BOEBOT.supply, 2.0, Draw(1, True, magnitudes=magnitudes)).noise_v)

    assert noise_v("battery_noise") == 0.0 < noise_v()


# ---- without a board -------------------------------------------------------------------------------------------------


def readings(seed: int, *without: str) -> dict[str, tuple[float, ...]]:
    """Of a vehicle at the centre of a 4 m square, looking along +x."""
    devices: dict[str, Any] = {
        "infrared_left": InfraredProximity(position_m=(1.7, 0.0), heading_rad=0.0, beam_rad=0.0, rays=1, sigma=0.2),
        "sonar": Sonar(position_m=(0.0, 0.0), heading_rad=0.0, beam_rad=0.0, rays=1, sigma=0.2, miss=0.5),
        "laser": Laser(position_m=(0.0, 0.0), rays=3, step_rad=math.pi / 2, sigma=0.2),
        "light": Phototransistor(position_m=(0.0, 0.0), heading_rad=0.0, ambient=2.0, sigma=0.2),
        "accelerometer": Accelerometer(bias_m_s2=0.5),
        "energy": Energy(sigma_v=0.5),
        "compass": msgspec.structs.replace(ARSIM.device["compass"], bias_rad=0.3),
    }
    robot = msgspec.structs.replace(ARSIM, device=ARSIM.device | devices)
    vehicle = Vehicle(vehicle_model(robot, without=without), arena_of(outline=square(0, 0, 4)), seed=seed)
    return {name: tuple(vehicle.readings[where]) for name, where in vehicle.model.names.items()}


IDEAL: list[tuple[tuple[str, ...], str, tuple[float, ...]]] = [
    (("infrared_noise",), "infrared_left", (0.03 / 0.3**2 + 0.1,)),  # (3.12)
    (("ping_noise", "ping_misses"), "sonar", (2.0,)),
    (("laser_noise",), "laser", (2.0, 2.0, 2.0)),
    (("compass_noise", "compass_bias"), "compass", (0.0,)),
    (("accelerometer_errors",), "accelerometer", (0.0,)),
    (("battery_noise",), "energy", (12.0,)),
    (("light_noise",), "light", (2.0,)),
    (("ambient_light",), "light", (0.0,)),  # without a lamp
]


@pytest.mark.parametrize(("without", "name", "ideal"), IDEAL, ids=[row[1] for row in IDEAL])
def test_vehicle_reads_ideal_values(without: tuple[str, ...], name: str, ideal: tuple[float, ...]) -> None:
    for seed in SEEDS:
        assert readings(seed, *without)[name] == pytest.approx(ideal, abs=1e-12)
    assert any(readings(seed)[name] != pytest.approx(ideal, abs=1e-12) for seed in SEEDS)


def test_odometer_and_sampling_of_a_vehicle() -> None:
    """The odometer's pose is the true one; the compass reads at every step."""
    devices = {
        "odometer": msgspec.structs.replace(ARSIM.device["odometer"], sigma_step_m=0.001),
        "compass": msgspec.structs.replace(ARSIM.device["compass"], period_s=0.5),
    }
    robot = msgspec.structs.replace(ARSIM, device=ARSIM.device | devices)

    def errors(*without: str) -> tuple[float, float]:
        """Of the odometer after a straight way, of the compass in a turn."""
        vehicle = Vehicle(vehicle_model(robot, without=("compass_noise", *without)), arena_of())
        for _ in range(100):
            vehicle.step(0.5, 0.5)
        off = math.hypot(vehicle["odometer"][0] - vehicle.true_pose[0], vehicle["odometer"][1] - vehicle.true_pose[1])
        for _ in range(30):
            vehicle.step(0.4, 0.6)
        return off, abs(vehicle["compass"] - vehicle.true_pose[2])

    off, late = errors()
    assert off > 1e-3 and late > 1e-2
    off, late = errors("encoder_errors", "sampling")
    assert off < 1e-9 and late < 1e-12


def test_motors_without_friction_drive_by_ohms_law() -> None:
    """(1.8)-(1.10): both wheels' 2 G c_t (V - c_e G v / r) / (R r) = alpha v at a steady speed."""
    motor, radius, alpha = ARSIM.device["motor_left"], ARSIM.body.wheel_radius_m, ARSIM.body.linear_damping_n_s_m
    assert isinstance(motor, DcMotor)
    drive = 2 * motor.gear * motor.torque_constant_n_m_a / (motor.resistance_ohm * radius)
    brake = drive * motor.emf_constant_v_s * motor.gear / radius
    result = boebot.run(Both(0.3), robot="arsim", arena="empty", seconds=25, without=("motor_friction",))
    assert result.truth is not None and result.truth.left_speed is not None
    expected = drive * 0.3 * motor.voltage_maximum_v / (brake + alpha)
    assert result.truth.left_speed[-1] == pytest.approx(expected, rel=1e-6)


class Both:
    """A brain: both motors alike."""

    def __init__(self, signal: float) -> None:
        self.signal = signal

    def step(self, robot: Robot) -> None:
        robot.drive(self.signal, self.signal)


# ---- whole runs ------------------------------------------------------------------------------------------------------


def test_every_switch_sets_its_rows() -> None:
    table = imperfections()
    assert {row.switch for row in table.values() if row.switch} == set(switches())
    for name in switches():
        neutral = switched_off([name])
        assert neutral.keys() == {row.name for row in table.values() if row.switch == name}
        assert all(table[key].fault(value) == "" for key, value in neutral.items())


def bend(result: RunResult) -> float:
    """Turned in the last second, rad: both servos have long got their pulses, which come one after the other."""
    assert result.truth is not None
    return abs(float(result.truth.heading[-1] - result.truth.heading[-101]))


def test_a_straight_run_is_straight_on_the_native_board() -> None:
    """Without the units' spreads both wheels go alike; the record says what was off."""
    without = ("servo_spread", "servo_asymmetry", "servo_centre")
    ideal = boebot.run(Both(0.8), arena="empty", seconds=3, seed=5, without=without)
    built = boebot.run(Both(0.8), arena="empty", seconds=3, seed=5)
    assert bend(ideal) < 1e-9 < 1e-3 < bend(built)
    assert ideal.table()["without"] == "servo_spread, servo_asymmetry, servo_centre"
    assert (ideal.without, built.table()["without"]) == (without, None)


def test_one_robot_of_several() -> None:
    without = ("servo_spread", "servo_asymmetry", "servo_centre")
    members = [Member(brain=Both(0.8), pose=(0, y, 0), without=off) for y, off in ((0, without), (2, ()))]
    one, other = boebot.run_together(members, arena="empty", seconds=2, seed=5).robots
    assert bend(one) < 1e-9 < 1e-3 < bend(other)
    assert (one.without, other.without) == (without, ())


@pytest.mark.parametrize("robot", ["shieldbot", "arsim"])
def test_unknown_names_get_a_sentence(robot: str) -> None:
    with pytest.raises(
        BoardError, match=r"no imperfection 'slipp' to switch off; .*list switches.*; did you mean 'slip'\?$"
    ):
        boebot.run("wander", robot=robot, seconds=1, without=("slip", "slipp"))
    for wrong in ("slip", 3, [3]):
        with pytest.raises(BoebotError, match=r"without is .*; expected a list of names"):
            boebot.run("wander", robot=robot, seconds=1, without=wrong)  # type: ignore[arg-type]


def test_a_real_robot_keeps_its_own() -> None:
    with pytest.raises(BoardError, match="is as it is built: imperfections are for simulated runs"):
        open_board("/dev/nowhere", BoardRequest(robot=SHIELDBOT, without=("slip",)))
