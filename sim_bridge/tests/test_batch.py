"""Batches of worlds: the same bits whatever the batch's size, order and threads, whatever compiler built the core."""

from __future__ import annotations

import copy
import math
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import boebot
from boebot.arenas import Arena, load_arena
from boebot.behaviors import Avoid, Wander
from boebot.brain import Brain
from boebot.errors import ArenaError, BoebotError, BrainError, RobotError
from boebot.robot import Robot
from sim_bridge.batch import WANDER, Batch, CompiledBrain
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim, beam, vehicle_model

HERE = Path(__file__).resolve().parent
STARTS = np.array([[0.1 * (k % 5) - 0.2, 0.1 * (k % 3), 0.7 * k] for k in range(12)])


def model() -> VehicleModel:
    built = arsim(odometer_sigma=1e-3, ends_at_collision=False)
    built.sensor("sonar", "sonar", period=0.05, beam=beam(rays=3, opening=0.3), range_maximum=3.0, miss=0.1, sigma=0.01)
    return built


def driven(worlds: list[int], threads: int = 1, chunk: int = 50) -> dict[int, int]:
    """Hash of each of those worlds after 300 steps under its own signals."""
    batch = Batch(model(), load_arena("arsim"), STARTS[worlds], np.array(worlds) + 5, threads=threads)
    signals = np.array([[0.5 + 0.03 * k, 0.7 - 0.05 * k] for k in worlds])
    for _ in range(300 // chunk):
        batch.step(signals, chunk)
    return dict(zip(worlds, batch.hashes().tolist(), strict=True))


def test_a_world_is_the_same_whatever_the_batch_order_and_threads() -> None:
    everyone = list(range(12))
    truth = driven(everyone)
    assert len(set(truth.values())) == 12
    assert driven(everyone[::-1]) == truth
    assert driven(everyone, threads=3) == truth and driven(everyone, threads=20) == truth
    assert driven(everyone, chunk=1) == truth
    for few in ([7], [3, 11], [0, 5, 9, 2]):
        assert driven(few) == {k: truth[k] for k in few}


def test_a_world_of_a_batch_is_a_single_vehicle() -> None:
    vehicle = Vehicle(model(), load_arena("arsim"), pose=STARTS[4], seed=9)
    for _ in range(300):
        vehicle.step(0.5 + 0.03 * 4, 0.7 - 0.05 * 4)
    assert vehicle.hash() == driven([4])[4]


def test_arrays_in_and_out() -> None:
    batch = Batch(arsim(noise=False), arena_of(outline=square(0, 0, 30)), STARTS, np.arange(12))
    before = batch.readings.copy()
    assert batch.readings.shape == (12, 6) and before[:, 2:5] == pytest.approx(batch.true_poses)
    readings = batch.step(np.full((12, 2), 0.5), 100)
    assert readings is batch.readings and not np.array_equal(readings, before)
    assert batch.true_poses.shape == (12, 3) and batch.flags.tolist() == [0] * 12 and batch.steps.tolist() == [100] * 12
    travel = np.hypot(*(batch.true_poses - STARTS)[:, :2].T)
    assert travel == pytest.approx(np.full(12, travel[0]), rel=1e-9) and batch.bytes_per_world < 4096
    with pytest.raises(ValueError, match="read-only"):
        readings[0, 0] = 1.0


def test_each_world_has_its_own_arena_and_its_own_end() -> None:
    near, far = (arena_of([(x, -5), (x + 1, -5), (x + 1, 5), (x, 5)]) for x in (1.0, 20.0))
    batch = Batch(arsim(noise=False), [near, far, near], np.zeros((3, 3)), [1, 2, 3])
    batch.step(np.ones((3, 2)), 400)
    assert batch.flags.tolist() == [lib.VEHICLE_COLLIDED, lib.VEHICLE_RUNS, lib.VEHICLE_COLLIDED]
    assert batch.true_poses[0, 0] == pytest.approx(0.8) and batch.true_poses[1, 0] > 4
    assert batch.steps[1] == 400 > batch.steps[0] == batch.steps[2]


def wandering(threads: int) -> Batch:
    batch = Batch(model(), load_arena("arsim"), STARTS, np.arange(12), threads=threads)
    for index in range(12):
        batch.state(index, "vehicle_wander_state *").seed = index
    batch.run(WANDER, 500)
    return batch


def test_a_compiled_brain_drives() -> None:
    assert wandering(2).hashes().tolist() == wandering(1).hashes().tolist()


@ffi.callback("vehicle_brain")  # type: ignore[untyped-decorator]
def counting_brain(state: object, readings: object, signals: object) -> None:
    count = ffi.cast("int64_t *", state)
    left_right = ffi.cast("double *", signals)
    count[0] += 1
    left_right[0], left_right[1] = 0.5, 0.4 + 1e-3 * count[0]
    if count[0] > 40:
        left_right[0] = math.nan


def test_a_brain_by_its_address_is_asked_in_every_step() -> None:
    """As numba's cfunc gives it; the same signals given from outside make the same run. Not a number ends it."""
    batch = Batch(model(), load_arena("arsim"), STARTS[:2], [5, 6])
    counting = CompiledBrain(int(ffi.cast("intptr_t", counting_brain)), readings=(), state_bytes=8)
    batch.run(counting, 40)
    other = Batch(model(), load_arena("arsim"), STARTS[:2], [5, 6])
    for step in range(40):
        other.step([[0.5, 0.4 + 1e-3 * (step + 1)]] * 2)
    assert batch.hashes().tolist() != other.hashes().tolist(), "the brain's memory is a part of the world"
    for k in range(2):
        assert batch.state(k, "int64_t *")[0] == 40
        other.state(k, "int64_t *")[0] = 40
    assert batch.hashes().tolist() == other.hashes().tolist()
    with pytest.raises(BrainError, match=r"finite number in 2 of 2 worlds, first in world 0"):
        batch.run(counting, 3)
    assert batch.steps.tolist() == [40, 40] and batch.flags.tolist() == [lib.VEHICLE_BRAIN_FAILED] * 2


def test_a_world_that_ends_leaves_its_neighbours_as_they_are_alone() -> None:
    """At collisions at different times, and where a brain fails; the worlds that go on do as they do alone."""
    fragile = arsim(odometer_sigma=1e-3, ends_at_collision=True)
    signals = np.array([[0.5 + 0.03 * k, 0.7 - 0.05 * k] for k in range(12)])
    batch = Batch(fragile, load_arena("arsim"), STARTS, np.arange(12))
    batch.step(signals, 400)
    assert 0 < np.count_nonzero(batch.flags) < 12 and len(set(batch.steps.tolist())) > 3
    for k in range(12):
        alone = Vehicle(fragile, load_arena("arsim"), pose=STARTS[k], seed=k)
        for _ in range(400):
            alone.step(*signals[k])
        assert alone.hash() == batch.hashes()[k]
    counting = CompiledBrain(int(ffi.cast("intptr_t", counting_brain)), readings=(), state_bytes=8)
    batch = Batch(model(), load_arena("arsim"), STARTS, np.arange(12))
    for k in range(12):
        batch.state(k, "int64_t *")[0] = 3 * k
    with pytest.raises(BrainError, match="finite number in 8 of 12 worlds, first in world 4"):
        batch.run(counting, 31)
    assert batch.steps.tolist() == [min(31, 40 - 3 * k) for k in range(12)]
    for k in range(12):
        one = Batch(model(), load_arena("arsim"), STARTS[k : k + 1], [k])
        one.state(0, "int64_t *")[0] = 3 * k
        one.run(counting, min(31, 40 - 3 * k))
        assert (
            one.readings[0].tolist() == batch.readings[k].tolist()
            and one.true_poses[0].tolist() == batch.true_poses[k].tolist()
        )


@pytest.mark.parametrize("threads", [1, 2])
def test_bad_input_is_refused_and_moves_nothing(threads: int) -> None:
    batch = Batch(model(), load_arena("arsim"), STARTS, np.arange(12), threads=threads)
    before = batch.hashes().tolist()
    signals = np.zeros((12, 2))
    signals[11, 1] = math.nan
    with pytest.raises(BrainError, match="finite"):
        batch.step(signals)
    with pytest.raises(RobotError, match=r"expected shape \(12, 2\)"):
        batch.step(np.zeros((11, 2)))
    assert batch.hashes().tolist() == before
    with pytest.raises(ArenaError, match="no free space"):
        Batch(model(), load_arena("arsim"), [[9, 9, 0]], [1])
    with pytest.raises(RobotError, match="expected shapes"):
        Batch(model(), load_arena("arsim"), [[0, 0, 0]], [1, 2])
    with pytest.raises(RobotError, match="arenas"):
        Batch(model(), [load_arena("arsim")] * 2, [[0, 0, 0]], [1])


def free_by_shapely(arena: Arena, radius: float) -> shapely.Geometry:
    """Where the middle of a disc may be: within the outlines, off what stands there, by the radius."""
    shapes, count = arena.outlines, len(arena.description.outline)
    solid = shapely.union_all(
        [shapely.Polygon(one) if len(one) > 2 else shapely.LineString(one) for one in shapes[count:]]
    )
    return (
        shapely.union_all([shapely.Polygon(one) for one in shapes[:count]])
        .buffer(-radius)
        .difference(solid.buffer(radius))
    )


def test_random_starts_are_free_even_and_those_of_the_seed() -> None:
    arena, seeds = load_arena("arsim"), np.arange(600)
    poses = Batch(arsim(), arena, "random", seeds).true_poses
    free = free_by_shapely(arena, arsim().radius - 1e-9)
    assert shapely.contains_xy(free, poses[:, :2]).all()
    assert np.array_equal(Batch(arsim(), arena, "random", seeds[::-7]).true_poses, poses[::-7]), "by its seed alone"
    assert len(np.unique(poses, axis=0)) == 600 and arena.free_start(arsim().radius, 5) == tuple(poses[5])
    # Four quarters of the arena, which looks the same turned by half a turn: binomial, within 4.4 sigma of equal shares
    for side in (poses[:, 0] > 0, poses[:, 1] > 0, poses[:, 2] > 0):
        assert abs(np.count_nonzero(side) - 300) < 4.4 * math.sqrt(600) / 2


def test_random_starts_of_an_outline_in_an_open_field() -> None:
    """A long body, of which all fits; up to 1 m beside the one obstacle, from 1 to 2 m."""
    long = VehicleModel({**ARSIM_BODY, "outline_m": [(0.5, -0.1), (0.5, 0.1), (-0.1, 0.1), (-0.1, -0.1)]})
    long.dc_motors()
    assert long.radius == pytest.approx(math.hypot(0.5, 0.1))
    field = arena_of(square(1.5, 1.5, 1.0))
    poses = Batch(long, field, "random", range(-50, 50)).true_poses
    assert shapely.distance(shapely.box(1, 1, 2, 2), shapely.points(poses[:, :2])).min() >= long.radius - 1e-9
    assert 0 <= poses[:, :2].min() < 0.5 and 2.5 < poses[:, :2].max() <= 3


def test_where_no_start_is_free_or_poses_are_none_is_one_sentence() -> None:
    arena = load_arena("arsim")
    with pytest.raises(ArenaError, match=r"arena arsim: of 10,000 places none is free for a robot of 5 m of radius"):
        arena.free_start(5.0, 1)
    with pytest.raises(ArenaError, match=r"seed is 1\.5; expected a whole number"):
        arena.free_start(0.1, 1.5)  # type: ignore[arg-type]
    with pytest.raises(ArenaError, match="no shape that stays"):
        arena_of().free_start(0.1, 1)
    with pytest.raises(RobotError, match=r"poses are 'free'; expected numbers of shape \(N, 3\), or \"random\""):
        Batch(arsim(), arena, "free", [1])


@pytest.mark.parametrize("robot", ["arsim", "shieldbot"])
def test_a_world_that_begins_anew_is_a_new_one_and_disturbs_no_other(robot: str) -> None:
    """With its brain and its servos, at its pose, or at that of the seed."""
    model, arena = vehicle_model(robot), load_arena("room")
    own = [arena.free_start(model.radius, seed) for seed in range(3)]
    for poses in ("random", own):
        batch, other = (Batch(model, arena, poses, [1, 2, 3]) for _ in range(2))
        fresh = Batch(model, arena, poses if poses == "random" else own[1:2], [9])
        for each in (batch, other):
            each.run("wander", 230)
        batch.restart(1, 9)
        for each in (batch, other, fresh):
            each.run("wander", 230)
        assert batch.hashes()[[0, 2]].tolist() == other.hashes()[[0, 2]].tolist()
        assert batch.hashes()[1] == fresh.hashes()[0] != other.hashes()[1]
        assert batch.steps.tolist() == [460, 230, 460] and batch.figures()["seed"].tolist() == [1, 9, 3]
    for index, seed, text in (
        (3, 1, "there is no world 3"),
        (0, 1.5, "the seed is 1.5"),
        (0, None, "the seed is None"),
    ):
        with pytest.raises(RobotError, match=text):
            batch.restart(index, seed)  # type: ignore[arg-type]
    batch.close()
    with pytest.raises(RobotError, match="it is closed"):
        batch.restart(0, 1)
    assert batch.figures()["seed"].tolist() == [1, 9, 3]


def test_a_world_that_begins_anew_has_pulses_until_it_shall_coast() -> None:
    batch = Batch(vehicle_model("shieldbot"), load_arena("room"), "random", [1, 2])
    for coasts, moves in (([True, True], False), ([True, False], False), ([False, True], True)):
        batch.restart(0, 1)
        start = batch.true_poses[0]
        batch.step(np.full((2, 2), 0.5), 100, coasts=coasts)
        assert (np.abs(batch.true_poses[0] - start).max() > 0.01) == moves


def test_an_empty_batch() -> None:
    batch = Batch(model(), load_arena("arsim"), np.zeros((0, 3)), np.zeros(0, dtype=int))
    assert batch.step(np.zeros((0, 2)), 5).shape == (0, 7) and batch.hashes().size == 0


# ---- the same bits from every compiler -------------------------------------------------------------------------------

# Of hash_runs.c, as one number. It changes with every change of the world's behaviour, and then is to be renewed.
RUNS_HASH = 0x7F1A004ED295B30B


def hashes_by(folder: Path, compiler: str, *more: str) -> list[str]:
    """Prints of hash_runs.c, built by that compiler."""
    program = folder / "".join((compiler, *more))
    core = HERE.parent
    geometry = core.parent / "host" / "boebot" / "arenas" / "geometry"
    rooms = (geometry, core / "vehicles", core / "world", core / "world" / "sensors")
    sources = [path for room in rooms for path in sorted(room.glob("*.c"))]
    command = [
        compiler,
        "-std=gnu11",
        "-ffp-contract=off",
        *more,
        f"-I{geometry.parent}",
        str(HERE / "hash_runs.c"),
        *map(str, sources),
    ]
    subprocess.run([*command, "-lm", "-o", str(program)], check=True)
    names = ("mass", "inertia", "radius", "half_track", "wheel_radius", "linear_damping", "angular_damping", "grip")
    body = [repr(ARSIM_BODY[name]) for name in names]
    return subprocess.run([str(program), *body], check=True, capture_output=True, text=True).stdout.split()


@pytest.mark.soak
def test_every_compiler_gives_the_same_bits(tmp_path: Path) -> None:
    builds: list[tuple[str, ...]] = [(c, o) for c in ("gcc", "clang") if shutil.which(c) for o in ("-O0", "-O2")]
    vectors = ("-fno-math-errno", "-fno-trapping-math", "-fvect-cost-model=dynamic")  # as it is installed
    builds += [("gcc", "-O2", *vectors), ("gcc", "-O3", "-mavx2")] if shutil.which("gcc") else []
    assert builds, "expected gcc or clang"
    with ThreadPoolExecutor() as pool:
        results = list(pool.map(lambda build: hashes_by(tmp_path, build[0], *build[1:]), builds))
    assert all(len(line) == 16 for line in results[0]) and len(set(results[0])) == 18
    assert all(result == results[0] for result in results)
    together = 0
    for line in results[0]:
        together = (together * 31 + int(line, 16)) % 2**64
    assert together == RUNS_HASH, hex(together)


@pytest.mark.parametrize("index", [-1, 12, 500_000])
def test_a_world_that_is_not_there_is_one_sentence(index: int) -> None:
    batch = Batch(model(), load_arena("arsim"), STARTS, np.arange(12))
    with pytest.raises(RobotError, match=f"no world {index}; expected 0 to 11"):
        batch.state(index)


def test_no_brain_is_one_sentence() -> None:
    batch = Batch(model(), load_arena("arsim"), STARTS[:2], [5, 6])
    with pytest.raises(BrainError, match="expected a CompiledBrain"):
        batch.run(ffi.addressof(lib, "vehicle_wander"), 5)
    with pytest.raises(BrainError, match="null pointer"):
        CompiledBrain(ffi.cast("vehicle_brain *", 0), readings=())
    others = ffi.new("int *"), ffi.addressof(lib, "body_a"), ffi.cast("void *", 5), ffi.cast("void *", 10**6)
    for other in others:
        with pytest.raises(BrainError, match=r"^brain: it is a C '.*'; expected a C function or its address, 'void"):
            CompiledBrain(other, readings=())
    for readings in (None, 5, "infrared", [5]):
        with pytest.raises(BrainError, match=r"^brain: readings are .*; expected a list of sensors' names$"):
            CompiledBrain(counting_brain, readings=readings)  # type: ignore[arg-type]
    for nothing in (0, 1, -1, 2**64, 1.5, None, "wander", ffi.cast("double", 3.0), lambda *_: None):
        with pytest.raises(BrainError, match="expected a C function or its address"):
            CompiledBrain(nothing, readings=())


def test_a_model_whose_worlds_exist_does_not_grow() -> None:
    built = model()
    vehicle = Vehicle(built, load_arena("arsim"))
    with pytest.raises(RobotError, match="expected all of its devices before"):
        built.sensor("compass", "second")
    vehicle.step(0.5, 0.5)


# ---- brains in Python ------------------------------------------------------------------------------------------------


def commanded(robot: Robot) -> None:
    """Speeds and signals, chance, readings, and a stop now and then."""
    turn = robot.random.uniform(-0.5, 0.5)
    if robot.observation.tick % 40 == 0:
        robot.stop()
    elif (robot.infrared_left.reading or 0.0) > 0.1:
        robot.drive(-0.3, 0.6)
    else:
        robot.drive_speed(0.3, turn + 0.1 * (robot.compass.heading or 0.0))


class Counting:
    """A brain with a memory."""

    def __init__(self) -> None:
        self.steps = 0

    def step(self, robot: Robot) -> None:
        self.steps += 1
        robot.drive(0.01 * self.steps, 0.3)


@pytest.mark.parametrize("brain", ["wander", commanded, Counting, Counting(), Brain([Avoid(), Wander()])])
def test_a_brain_in_python_comes_to_the_same_as_in_a_run(brain: Any) -> None:
    seeds = [3, 4, 7]
    batch = Batch(vehicle_model("arsim"), load_arena("arsim"), np.zeros((3, 3)), seeds)
    fresh = copy.deepcopy(brain)
    batch.run(brain, 220)
    batch.run(brain, 80)  # goes on
    for world, seed in enumerate(seeds):
        alone = boebot.run(
            copy.deepcopy(fresh), "arsim", arena="arsim", on="direct", seed=seed, seconds=3.0, pose=(0.0, 0.0, 0.0)
        )
        assert (alone.series.raw["values"][-1] == batch.readings[world]).all()


def test_each_world_has_its_own_brain_in_python() -> None:
    batch = Batch(vehicle_model("arsim"), load_arena("arsim"), np.zeros((2, 3)), [1, 1])
    batch.run(Counting(), 100, period=0.1)
    one, other = (loaded.step.__self__ for loaded in batch.brains)  # type: ignore[attr-defined]
    assert one is not other and one.steps == other.steps == 10
    assert batch.hashes()[0] == batch.hashes()[1]


class SecondFails:
    made = 0

    def __init__(self) -> None:
        SecondFails.made += 1
        self.number = SecondFails.made

    def step(self, robot: Robot) -> None:
        robot.drive(0.5 / (self.number - 2) if robot.time > 0.45 else 0.5, 0.0)


def test_a_brain_in_python_that_fails_names_world_and_line() -> None:
    batch = Batch(vehicle_model("arsim"), load_arena("arsim"), np.zeros((3, 3)), [5, 1, 2])
    with pytest.raises(BrainError, match=r"^batch, world 1: .*test_batch.py, line \d+: ZeroDivisionError"):
        batch.run(SecondFails, 100, period=0.1)
    assert batch.steps.tolist() == [50, 50, 50]


@pytest.mark.parametrize(
    ("brain", "more", "why"),
    [
        (5, {}, "5 is no brain; expected a name"),
        ("nobody", {}, "there is no brain 'nobody'"),
        ("wander", {"period": 0.015}, "a brain period of 15 ms does not fit; expected a multiple of 10 ms"),
        (WANDER, {"period": 0.05}, "a compiled brain is asked in each step; expected no period"),
    ],
)
def test_what_is_no_brain_for_a_batch_is_one_sentence(brain: Any, more: Any, why: str) -> None:
    batch = Batch(vehicle_model("arsim"), load_arena("arsim"), [[0, 0, 0]], [1])
    with pytest.raises(BoebotError, match=why):
        batch.run(brain, 10, **more)


def test_a_model_built_by_hand_has_no_robot_for_a_brain_in_python() -> None:
    model = VehicleModel(ARSIM_BODY)
    model.dc_motors()
    with pytest.raises(BrainError, match=r"need a robot's description; expected a model of vehicle_model\(\)"):
        Batch(model, load_arena("arsim"), [[0, 0, 0]], [1]).run("wander", 1)
