"""Robots with boards in worlds without boards, against the native board and the firmware's own C: 100 runs.

The quanta are the protocol's: 1/16 us of a pulse, 1 us of an echo, 16 us between two edges.
"""

from __future__ import annotations

import math
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pytest
from cffi import FFI
from numpy.typing import NDArray

import boebot
from boebot.arenas import Arena, load_arena
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain
from boebot.description.robots import RobotDescription, load_robot
from boebot.devices.encoder import EDGE_PERIOD_SCALE, WheelEncoder
from boebot.devices.ping import METRES_PER_US
from boebot.errors import BoebotError, BrainError, CallError, RobotError
from boebot.robot import Robot
from sim_bridge.batch import Batch
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.boards.native.native_program import FIRMWARE
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim, vehicle_model

RUNS = 100
SECONDS = 1.5  # thirty time constants of a servo
PULSE_US = 1 / 16
QUIET = ("infrared_noise", "ping_noise", "ping_misses", "encoder_errors")


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An arena whose walls are far away."""
    path = tmp_path_factory.mktemp("arena") / "field.toml"
    corners = [[-9, -9], [9, -9], [9, 9], [-9, 9]]
    start = "[start]\nx_m = 0.0\ny_m = 0.0\nheading_rad = 0.0\n"
    path.write_text(f'name = "field"\n{start}[[outline]]\nname = "walls"\ncorners_m = {corners}\n')
    return path


class Keeps:
    """A brain that drives by one command, and keeps its newest readings."""

    def __init__(self, command: Callable[[Robot], object]) -> None:
        self.command = command
        self.seen: dict[str, Any] = {}

    def step(self, robot: Robot) -> None:
        self.command(robot)
        names = ("encoder_left", "encoder_right", "infrared_left", "infrared_right", "whisker_left", "whisker_right")
        self.seen = {name: getattr(robot, name) for name in (*names, "ping", "servo_left", "servo_right")}


def seen(batch: Batch) -> list[dict[str, Any]]:
    """By each world's brain, a `Keeps`."""
    return [loaded.step.__self__.seen for loaded in batch.brains]  # type: ignore[attr-defined]


def drives(signals: NDArray[np.float64]) -> Keeps:
    return Keeps(lambda robot: robot.drive(*signals.tolist()))


def edges_per_turn(robot: str) -> int:
    encoder = load_robot(robot).device["encoder_left"]
    assert isinstance(encoder, WheelEncoder)
    return encoder.edges_per_turn


def rims(batch: Batch) -> NDArray[np.float64]:
    """Speeds of the wheels along the ground, shape (N, 2)."""
    bodies = [batch.handle.worlds[index].body.state for index in range(batch.count)]
    half = batch.model.body["half_track"]
    return np.array([(b.speed - half * b.turn_rate, b.speed + half * b.turn_rate) for b in bodies])


# ---- pulses ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """firmware/src/motion.c as it is, in a library."""
    library = tmp_path_factory.mktemp("motion") / "motion.so"
    source, stubs = FIRMWARE / "motion.c", library.with_name("stubs.c")
    stubs.write_text(
        "#include <stdint.h>\nvoid servo_set(uint16_t a, uint16_t b) { (void)a, (void)b; }\n"
        "uint16_t parameters_u16(int a) { return (uint16_t)a; }\nint16_t parameters_i16(int a) { return (int16_t)a; }\n"
    )
    folders = [f"-I{FIRMWARE}", f"-I{FIRMWARE / 'hal/native'}"]
    command = ["cc", "-std=gnu11", "-shared", "-fPIC", "-DPIN_MAP_SHIELDBOT", *folders, "-o", str(library)]
    subprocess.run([*command, str(source), str(stubs)], check=True)
    own = FFI()
    own.cdef("uint16_t motion_pulse(uint16_t centre, int16_t gain, int16_t part, int16_t full);")
    return own.dlopen(str(library))


@pytest.mark.parametrize(
    ("centre", "gain"), [(24000, 3200), (24000, -3200), (23517, 3111), (25600, -1), (22400, 3200), (24016, 0)]
)
def test_every_signal_gives_the_firmwares_pulse(firmware: Any, centre: int, gain: int) -> None:
    wheel = ffi.new("motion_map *", [centre, gain])
    signals = range(-10_000, 10_001)
    mine = [lib.motion_pulse_of(wheel, signal / 10_000) for signal in signals]
    assert mine == [firmware.motion_pulse(centre, gain, signal, 10_000) for signal in signals]


def test_every_speed_gives_the_firmwares_pulse_or_the_one_beside_it(firmware: Any) -> None:
    full = round(load_robot("shieldbot").body.wheel_speed_maximum_m_s * 10_000)
    wheel = ffi.new("motion_map *", [24000, -3200])
    for part in range(-full, full + 1):
        assert abs(lib.motion_pulse_of(wheel, part / full) - firmware.motion_pulse(24000, -3200, part, full)) <= 1


# ---- 100 runs against the native board -------------------------------------------------------------------------------


class Native(NamedTuple):
    seen: dict[str, Any]
    speeds: tuple[float, float]
    """of the wheels at the end, m/s"""


def native(brain: Keeps, arena: str | Path, seed: int, pose: Any, seconds: float) -> Native:
    result = boebot.run(
        brain, "shieldbot", arena=arena, on="native", seed=seed, pose=tuple(pose), seconds=seconds, without=QUIET
    )
    truth = result.truth
    assert result.error is None and truth is not None
    assert truth.left_speed is not None and truth.right_speed is not None
    return Native(brain.seen, (float(truth.left_speed[-1]), float(truth.right_speed[-1])))


def test_wheels_turn_as_fast_as_at_the_native_board(field: Path) -> None:
    """The same seed is the same unit, the same signal the same pulse: speeds agree within a count of the pulse, and the
    times between two edges within one of theirs."""
    signals = np.round(np.random.default_rng(5).uniform(-1, 1, (RUNS, 2)), 4)
    model = vehicle_model("shieldbot", without=QUIET)
    batch = Batch(model, load_arena(field), np.zeros((RUNS, 3)), np.arange(RUNS))
    batch.run([drives(signal) for signal in signals], round(SECONDS / model.dt))
    assert model.unit is not None
    for world, (mine, speeds) in enumerate(zip(seen(batch), rims(batch), strict=True)):
        board = native(drives(signals[world]), field, world, (0, 0, 0), SECONDS)
        for side, name in enumerate(("left", "right")):
            servo, encoder = f"servo_{name}", f"encoder_{name}"
            assert mine[servo] == board.seen[servo]
            unit = model.unit(world)[side]
            steepest = max(unit.top_ccw_rad_s / unit.scale_ccw_us, unit.top_cw_rad_s / unit.scale_cw_us)
            assert abs(speeds[side] - board.speeds[side]) <= steepest * unit.wheel_radius * PULSE_US
            if abs(speeds[side]) > 0.03:  # an edge in every tenth of a second
                edge_m = 2 * math.pi * unit.wheel_radius / edges_per_turn("shieldbot")
                periods = [edge_m / there[encoder].speed / EDGE_PERIOD_SCALE for there in (mine, board.seen)]
                assert abs(periods[0] - periods[1]) < 1.5
    assert len(np.unique(np.abs(batch.true_poses[:, 2]))) == RUNS


def test_sensors_read_at_a_pose_what_the_native_board_reads() -> None:
    """Without noise: infrared and whiskers alike, the echo within 1 us. Half of the places are close to a wall."""
    poses = np.array([load_arena("room").free_start(0.075, seed) for seed in range(RUNS)])
    poses[::2, 0] = 1.5 - np.linspace(0.075, 0.16, RUNS // 2)
    poses[::2, 1] = np.linspace(-1.3, 0.3, RUNS // 2)
    poses[::2, 2] = np.random.default_rng(2).uniform(-1.2, 1.2, RUNS // 2)
    batch = Batch(vehicle_model("shieldbot", without=QUIET), load_arena("room"), poses, np.arange(RUNS))
    batch.run(Keeps(Robot.stop), 60)
    hits = {"infrared_left": 0, "infrared_right": 0, "whisker_left": 0, "whisker_right": 0}
    for world, mine in enumerate(seen(batch)):
        board = native(Keeps(Robot.stop), "room", world, poses[world], 0.3).seen
        assert mine["ping"].status == board["ping"].status and mine["ping"].valid == board["ping"].valid
        echoes = [(there["ping"].distance or 0.0) / METRES_PER_US for there in (mine, board)]
        assert abs(echoes[0] - echoes[1]) < 1.5, poses[world]
        for name in hits:
            now = mine[name].pressed if name.startswith("whisker") else mine[name].detected
            assert now == (board[name].pressed if name.startswith("whisker") else board[name].detected), poses[world]
            hits[name] += now
        assert mine["servo_left"] == board["servo_left"] and mine["servo_left"].pulse_us is None
        assert mine["encoder_left"] == board["encoder_left"]
    assert all(5 <= count <= RUNS - 5 for count in hits.values()), hits


def test_ways_of_a_step_of_5_ms_are_those_of_1_ms_within_an_edge(field: Path) -> None:
    signals = np.random.default_rng(3).uniform(-1, 1, (20, RUNS, 2))
    angles = []
    for dt in (0.001, 0.005):
        model = vehicle_model("shieldbot", dt=dt)
        batch = Batch(model, load_arena(field), np.zeros((RUNS, 3)), np.arange(RUNS))
        for one in signals:
            batch.step(one, round(0.1 / dt))
        bodies = [batch.handle.worlds[index].body.state for index in range(RUNS)]
        angles.append([(body.wheel_left, body.wheel_right) for body in bodies])
    assert np.abs(np.diff(angles, axis=0)).max() < 2 * math.pi / 64


# ---- its devices -----------------------------------------------------------------------------------------------------


def robot_with(**devices: dict[str, Any]) -> RobotDescription:
    """The shieldbot with other keys of its devices."""
    robot = load_robot("shieldbot")
    changed = {name: msgspec.structs.replace(robot.device[name], **keys) for name, keys in devices.items()}
    return msgspec.structs.replace(robot, device=robot.device | changed)


def test_edges_are_those_of_the_wheels_way(field: Path) -> None:
    """One line counts both ways upwards, two count backward edges down."""
    for name, backward in (("shieldbot", 1), ("shieldbot-quad", -1)):
        batch = Batch(vehicle_model(name, without=QUIET), load_arena(field), np.zeros((20, 3)), np.arange(20))
        batch.step(np.full((20, 2), (0.6, -0.4)), 400)
        per_rad = edges_per_turn(name) / (2 * math.pi)
        for world in range(20):
            body = batch.handle.worlds[world].body.state
            assert body.wheel_left > 0.5 and body.wheel_right < -0.5
            edges = body.wheel_left * per_rad, -backward * body.wheel_right * per_rad
            assert np.abs(batch.readings[world, [0, 2]] - edges).max() <= 1.0


def test_a_standing_wheel_has_no_period(field: Path) -> None:
    batch = Batch(vehicle_model("shieldbot", without=QUIET), load_arena(field), np.zeros((5, 3)), np.arange(5))
    assert (batch.readings[:, [1, 3]] == 0).all()
    batch.step(np.full((5, 2), 0.5), 200)
    assert (batch.readings[:, [1, 3]] > 0).all()
    batch.step(np.zeros((5, 2)), 200, coasts=True)
    assert (batch.readings[:, [1, 3]] == 0).all()


def test_missed_edges_take_their_neighbours_with_them(field: Path) -> None:
    """Of n edges with chance p to be missed pn / (1 + p) are, and as many again change nothing."""
    chance = 0.2
    counts = []
    for without, given in ((QUIET, None), (QUIET[:3], {"encoder_missed": chance})):
        model = vehicle_model("shieldbot", without=without, imperfections=given)
        batch = Batch(model, load_arena(field), np.zeros((RUNS, 3)), np.arange(RUNS))
        batch.step(np.full((RUNS, 2), 0.5), 1000)
        counts.append(batch.readings[:, [0, 2]].sum())
    lost = 2 * chance / (1 + chance)
    assert counts[1] / counts[0] == pytest.approx(1 - lost, abs=4 * math.sqrt(2 * lost / counts[0]))


def test_without_pulses_the_wheels_turn_freely(field: Path) -> None:
    """`robot.stop()` lets go, `robot.drive(0, 0)` holds still: it rolls farther without pulses."""
    ways = []
    for last in (Robot.stop, lambda robot: robot.drive(0, 0)):
        batch = Batch(vehicle_model("shieldbot", noise=False), load_arena(field), np.zeros((3, 3)), [1, 2, 3])
        batch.run(Keeps(lambda robot: robot.drive(1, 1)), 200)
        batch.run(Keeps(last), 200)
        assert (np.abs(rims(batch)) < 1e-3).all()
        assert [one["servo_left"].pulse_us is None for one in seen(batch)] == [last is Robot.stop] * 3
        ways.append(batch.true_poses[:, 0])
    assert (ways[0] > ways[1] + 1e-3).all()


def test_who_coasts_may_be_changed_in_place(field: Path) -> None:
    batch = Batch(vehicle_model("shieldbot", noise=False), load_arena(field), np.zeros((2, 3)), [1, 2])
    coasts = np.array([False, True])
    batch.step(np.full((2, 2), 0.5), 100, coasts=coasts)
    assert rims(batch)[0, 0] > 0.05 and abs(rims(batch)[1, 0]) < 1e-9
    coasts[:] = True, False
    batch.step(np.full((2, 2), 0.5), 100, coasts=coasts)
    assert abs(rims(batch)[0, 0]) < 1e-2 and rims(batch)[1, 0] > 0.05


def test_a_wheel_without_limits_does_not_hold_up_the_world() -> None:
    """A wheel of a millionth of a millimetre turns millions of times in a step, which no encoder sees."""
    model = VehicleModel(ARSIM_BODY | {"wheel_radius": 1e-9, "wheel_mass": 0.0, "wheel_inertia": 0.0})
    model.regulated_motors({"gain_n_s": 1e-9}, {"gain_n_s": 1e-9})
    model.sensor("wheel_encoder", "encoder", edges_per_turn=64, missed=0.0, right=0, directed=0)
    vehicle = Vehicle(model, load_arena("arsim"))
    vehicle.place((0, 0, 0), speed=10.0)
    vehicle.run(lambda _: (1.0, 1.0), 10)
    assert vehicle.body.wheel_left > 1e8 and list(vehicle["encoder"]) == [0.0, 0.0]
    with pytest.raises(RobotError, match="expected a number from 2 to 4096"):
        VehicleModel(ARSIM_BODY).sensor("wheel_encoder", "e", edges_per_turn=1e12, missed=0, right=0, directed=0)


def test_latched_motors_get_no_pulses(field: Path) -> None:
    seen_latched = []

    def step(robot: Robot) -> None:
        robot.drive(1, 1)
        if robot.time >= 0.5:
            robot.emergency_stop()
            seen_latched.append(bool(robot.observation.status & boebot.link.messages.Status.LATCHED))

    batch = Batch(vehicle_model("shieldbot"), load_arena(field), np.zeros((1, 3)), [1])
    batch.run(step, 400)
    assert (np.abs(rims(batch)) < 1e-3).all() and seen_latched[0] is False and seen_latched[-1] is True


def test_units_differ_from_world_to_world_unless_the_robot_says_its_own(field: Path) -> None:
    for robot, kinds in ((load_robot("shieldbot"), 20), (msgspec.structs.replace(load_robot("shieldbot"), unit=7), 1)):
        batch = Batch(vehicle_model(robot), load_arena(field), np.zeros((20, 3)), np.arange(20))
        batch.step(np.full((20, 2), 0.5), 300)
        assert len({tuple(np.round(one, 12)) for one in rims(batch)}) == kinds


def test_worlds_are_the_same_whatever_the_batch_order_and_threads() -> None:
    def hashes(seeds: list[int], threads: int) -> dict[int, int]:
        batch = Batch(vehicle_model("shieldbot"), load_arena("room"), "random", seeds, threads=threads)
        batch.run("wander", 300)
        return dict(zip(seeds, batch.hashes().tolist(), strict=True))

    everyone = hashes(list(range(8)), 1)
    assert len(set(everyone.values())) == 8 and hashes([7, 3, 0, 1, 2, 4, 5, 6], 2) == everyone
    assert hashes([5], 1) == {5: everyone[5]}


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (
            lambda: vehicle_model("shieldbot-line"),
            RobotError,
            r"device.line_left of robot 'shieldbot-line' \(line_sensor\)",
        ),
        (lambda: vehicle_model("shieldbot-charging"), RobotError, "modelled at its board only; expected boebot.run"),
        (lambda: vehicle_model("boebot"), RobotError, "robot 'boebot': its servos run on the pack"),
        (lambda: vehicle_model("rover"), CallError, "robot 'rover' has no firmware of the kit"),
        (lambda: vehicle_model("shieldbot", dt=0.004), RobotError, "expected a whole part of its control tick, 0.01 s"),
        (
            lambda: vehicle_model(robot_with(servo_left={"on": False})),
            RobotError,
            "1 servos that are on; expected servo_l",
        ),
        (
            lambda: vehicle_model(robot_with(infrared={"sweep": True})),
            RobotError,
            r"device.infrared_left .*\(infrared_p",
        ),
        (lambda: vehicle_model(robot_with(ping={"plugged": False})), RobotError, "device.ping of robot 'shieldbot'"),
        (
            lambda: vehicle_model("shieldbot", imperfections={"supply_drop_out_v": 1.0}),
            BoebotError,
            "imperfections: supply_drop_out_v changes nothing",
        ),
        (
            lambda: vehicle_model("shieldbot", imperfections={"whisker_bounce_s": 0.01}),
            BoebotError,
            "imperfections: whisker_bounce_s changes nothing of robot 'shieldbot' without its board",
        ),
    ],
)
def test_what_there_is_no_model_of_is_one_sentence(
    make: Callable[[], VehicleModel], error: type[BoebotError], text: str
) -> None:
    with pytest.raises(error, match=text):
        make()


# ---- brains and figures of each world --------------------------------------------------------------------------------


def test_figures_are_those_of_the_run() -> None:
    """A robot without a board comes to the same bits in a batch and in `boebot.run`: so do its figures, but that a run
    adds up its way from tick to tick, and a batch the way along the wall as well."""
    arena: Arena = load_arena("room")
    batch = Batch(vehicle_model("arsim"), arena, [arena.start] * 4, [1, 2, 3, 4])
    batch.run("wander", 2000)
    figures = batch.figures()
    for world, seed in enumerate((1, 2, 3, 4)):
        table = boebot.run("wander", "arsim", arena="room", seed=seed, seconds=20).table()
        for name, values in figures.items():
            assert values[world] == (pytest.approx(table[name], rel=1e-3) if name == "true_distance_m" else table[name])
    assert figures["true_contacts"].sum() > 0


def test_each_world_has_its_own_brain_and_parameters(field: Path) -> None:
    brains = [Keeps(lambda robot: robot.drive(0.5, 0.5)), Keeps(lambda robot: robot.drive(-0.5, -0.5))]
    batch = Batch(vehicle_model("shieldbot"), load_arena(field), np.zeros((2, 3)), [1, 2])
    batch.run(brains, 200)
    assert batch.true_poses[0, 0] > 0.05 > -0.05 > batch.true_poses[1, 0]
    wandering = Brain([Wander(), Avoid()])
    name = next(iter(boebot.running.brain_parameters.sliders(batch_of(wandering).brains[0])))
    batch = batch_of(wandering, [{name: 0.25}, {name: 0.5}])
    values = [boebot.running.brain_parameters.parameters(loaded)[name] for loaded in batch.brains]
    assert values == [0.25, 0.5]
    with pytest.raises(BrainError, match=r"batch, world 1: brain .* has no parameter 'nothing.at'"):
        batch_of(wandering, [{}, {"nothing.at": 1}])
    with pytest.raises(BrainError, match="batch: 3 parameters for 2 worlds; expected one for all, or as many"):
        batch_of(wandering, [{}] * 3)
    with pytest.raises(BrainError, match="batch: 1 brains for 2 worlds"):
        batch_of([wandering])
    with pytest.raises(BrainError, match="batch, world 0: parameters is 3; expected values by name"):
        batch_of(wandering, 3)


def batch_of(brain: object, parameters: Any = None) -> Batch:
    """After a step in two worlds."""
    batch = Batch(vehicle_model("shieldbot"), load_arena("room"), "random", [1, 2])
    batch.run(brain, 10, parameters=parameters)
    return batch


@pytest.mark.parametrize(
    ("coasts", "text"), [([True] * 3, "coasts are"), (1, "coasts are 1"), ([[True]], "coasts are")]
)
def test_who_coasts_is_true_or_false(coasts: Any, text: str) -> None:
    batch = batch_of("wander")
    with pytest.raises(RobotError, match=text):
        batch.step(np.zeros((2, 2)), coasts=coasts)
    with pytest.raises(RobotError, match="only servos at a board get no pulses"):
        Batch(arsim(), load_arena("arsim"), [[0, 0, 0]], [1]).step([[0, 0]], coasts=True)
