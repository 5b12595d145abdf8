"""Whatever is given to worlds without boards: a world of numbers, or one sentence by a BoebotError; never a crash."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.arenas import (
    Arena,
    ArenaDescription,
    Charger,
    Disc,
    Light,
    Moving,
    Patch,
    Polygon,
    Start,
    Wall,
    Waypoint,
    load_arena,
)
from boebot.arenas.floor_plan import poses_of
from boebot.errors import ArenaError, BoebotError, BrainError, RobotError
from boebot_course.rays import ray_segment
from sim_bridge.batch import WANDER, Batch, CompiledBrain
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim

MODEL, ROOM, FIELD = arsim(ends_at_collision=False), load_arena("showcase"), load_arena("empty")

numbers = st.floats() | st.sampled_from([0.0, -0.0, 1e-320, 1e6, -1e6, 1e6 + 1, 1e15, 1e300, math.nan, math.inf])
small = st.floats(-1.5, 1.5)
things = (
    numbers | st.integers() | st.none() | st.text(max_size=5) | st.binary(max_size=5) | st.booleans()
    | st.just(10**400) | st.just([]) | st.just({}) | st.just(1j) | st.just(np.zeros((2, 2))) | st.just(object())
)  # fmt: skip
any_pose = st.tuples(numbers, numbers, numbers) | st.tuples(small, small, small) | st.lists(things, max_size=4) | things


def refused(action: Callable[[], Any]) -> bool:
    """Whether it was refused in one sentence."""
    try:
        action()
    except BoebotError as error:
        text = str(error)
        assert ("\n" not in text and "expected" in text) or "no free space" in text, text
        assert len(text) < 600, text
        return True
    return False


def is_sound(vehicle: Vehicle) -> bool:
    return all(map(math.isfinite, (*vehicle.true_pose, vehicle.time, vehicle.energy, *vehicle.readings)))


# ---- whatever there is -----------------------------------------------------------------------------------------------


@given(
    any_pose,
    things | st.integers(0, 9),
    things | st.integers(1, 9),
    st.sampled_from([0, 7, 64, -1, None, 2**24 + 1, 2**70]),
)
def test_any_vehicle_is_a_world_or_a_sentence(pose: Any, seed: Any, robot: Any, memory: Any) -> None:
    made: list[Vehicle] = []
    kwargs = {"pose": pose, "seed": seed, "robot": robot, "state_bytes": memory}
    for arena in (ROOM, FIELD):
        if not refused(lambda: made.append(Vehicle(MODEL, arena, **kwargs))):  # noqa: B023
            made[-1].step(1.0, 0.5)
            assert is_sound(made[-1])


@given(any_pose, things | small, things | small, things, things, things | st.integers(0, 30))
def test_any_start_signal_and_step_moves_it_or_is_refused(
    pose: Any, speed: Any, turn: Any, left: Any, right: Any, steps: Any
) -> None:
    vehicle = Vehicle(MODEL, ROOM)
    vehicle.step(0.4, 0.3)
    before = vehicle.hash()
    for action in (
        lambda: vehicle.place(pose, speed, turn),
        lambda: vehicle.step(left, right),
        lambda: vehicle.run(lambda _: (left, right), 3),
        lambda: vehicle.run(lambda _: left, 3),
        lambda: vehicle.run(lambda _: (0.1, 0.2), min(steps, 30) if isinstance(steps, int) else steps),
        lambda: vehicle.run(lambda _: left, 1, stage=lambda name, _: None),
    ):
        if refused(action):
            assert vehicle.hash() == before
        before = vehicle.hash()
        assert is_sound(vehicle)


@given(
    st.lists(any_pose, max_size=4) | things,
    st.lists(things | st.integers(0, 9), max_size=4) | things,
    things | st.integers(1, 3),
    st.sampled_from([ROOM, [ROOM], [ROOM, FIELD], [], None, "room", [None]]),
)
def test_any_batch_is_worlds_or_a_sentence(poses: Any, seeds: Any, threads: Any, arenas: Any) -> None:
    made: list[Batch] = []
    if isinstance(threads, int) and threads > 8:
        threads = 8
    if refused(lambda: made.append(Batch(MODEL, arenas, poses, seeds, threads=threads))):
        return
    with made[0] as batch:
        batch.step(np.full((batch.count, 2), 0.5), 3)
        assert np.isfinite(batch.readings).all() and np.isfinite(batch.true_poses).all()


@given(
    st.lists(st.tuples(numbers, numbers), max_size=3) | st.lists(st.lists(things, max_size=3), max_size=3) | things,
    things | st.integers(0, 30),
    st.lists(st.sampled_from(["infrared_left", "compass", "odometer", "nobody", ""]), max_size=3),
    things | st.integers(0, 100),
)
def test_any_signals_and_brains_move_the_batch_or_are_refused(signals: Any, steps: Any, names: Any, size: Any) -> None:
    batch = Batch(MODEL, ROOM, np.zeros((2, 3)), [1, 2])
    some = min(steps, 30) if isinstance(steps, int) else steps
    wander = ffi.addressof(lib, "vehicle_wander")
    before = batch.hashes().tolist()
    for action in (
        lambda: batch.step(signals, some),
        lambda: batch.run(WANDER, some),
        lambda: batch.run(signals, 3),
        lambda: batch.run(CompiledBrain(wander, readings=("infrared_left", *names), state_bytes=size), 3),
        lambda: batch.state(some, signals),
        lambda: batch.state(steps),
    ):
        if refused(action):
            assert batch.hashes().tolist() == before
        before = batch.hashes().tolist()
        assert np.isfinite(batch.readings).all() and np.isfinite(batch.true_poses).all()


@given(things | small, things | small, things, things | st.floats(0, 9))
def test_any_question_to_an_arena_is_answered_in_numbers_or_refused(x: Any, y: Any, angle: Any, reach: Any) -> None:
    answers: list[Any] = []
    for question in (
        lambda: ROOM.ray(x, y, angle, reach),
        lambda: ROOM.is_free(x, y, reach),
        lambda: FIELD.ray(x, y, 0.0, reach),
    ):
        refused(lambda: answers.append(question()))  # noqa: B023
    for answer in answers:
        assert isinstance(answer, (bool, type(None))) or math.isfinite(answer)


pairs = st.tuples(small, small) | st.lists(things | small, max_size=3)
corner_lists = st.lists(pairs, max_size=5) | st.just(square(0, 0, 1)) | st.just(np.array(square(2, 0, 1))) | things
surfaces = st.fixed_dictionaries(
    {},
    optional={
        "height_m": things,
        "infrared_reflectance": things | small,
        "sound_reflectance": things | small,
        "name": things | st.just("a"),
    },
)
waypoints = st.builds(Waypoint, things | small, things | small, things | small, things | small) | things
paths = st.lists(waypoints, max_size=3) | st.just([Waypoint(0, 0, 0)])
repeats = st.sampled_from(["loop", "once", "spin", "", 7, None])
descriptions = st.builds(
    ArenaDescription,
    name=things | st.just("any"),
    start=things | st.builds(Start, things, small, small),
    outline=st.just([]) | things,
    obstacle=st.lists(st.builds(lambda c, s: Polygon(c, **s), corner_lists, surfaces), max_size=2) | things,
    wall=st.lists(st.builds(lambda c, s: Wall(c, **s), corner_lists, surfaces), max_size=2),
    disc=st.lists(st.builds(lambda x, r, s: Disc(x, 0, r, **s), things | small, things | small, surfaces), max_size=2),
    patch=st.lists(st.builds(Patch, corner_lists, things | small), max_size=1),
    light=st.lists(st.builds(Light, things | small, small, things | small), max_size=1),
    charger=st.none() | st.builds(Charger, small, small, things | small),
    moving=st.lists(
        st.builds(lambda p, r, k, s: Moving(p, radius_m=r, repeat=k, **s), paths, things | small, repeats, surfaces),
        max_size=2,
    ),
)


@given(descriptions)
def test_any_description_is_an_arena_or_a_sentence(description: ArenaDescription) -> None:
    made: list[Arena] = []
    if refused(lambda: made.append(Arena(description))):
        return
    distance = made[0].ray(0, 0, 0.3, 9)
    assert distance is None or 0 <= distance < 9
    assert all(np.isfinite(outline).all() for outline in made[0].outlines)
    assert np.isfinite(poses_of(made[0].movers(7.3))).all()


# ---- what the sentences say ------------------------------------------------------------------------------------------

CORNERS = square(0, 0, 1)
WAY = [Waypoint(0, 0, 0), Waypoint(1, 1, 0)]


@pytest.mark.parametrize(
    ("description", "text"),
    [
        ({"obstacle": [Polygon(CORNERS, height_m=math.nan)]}, "obstacle[0].height_m: expected a finite number"),
        ({"obstacle": [Polygon(CORNERS, height_m=-1)]}, "obstacle[0].height_m: expected float > 0.0"),
        (
            {"disc": [Disc(0, 0, 1, infrared_reflectance=7)]},
            "disc[0].infrared_reflectance: expected float <= 1.0",
        ),
        (
            {"wall": [Wall([(0, 0), (1, 0, 0)])]},  # type: ignore[list-item]
            "wall[0].points_m[1]: expected array of length 2, got 3",
        ),
        (
            {"moving": [Moving(WAY, radius_m=1, repeat="spin")]},  # type: ignore[arg-type]
            "moving[0].repeat is 'spin'; expected one of loop, back_and_forth, once",
        ),
        (
            {"moving": [Moving(WAY, radius_m=1, name="cart"), Moving(WAY, radius_m=1, name="cart")]},
            "moving[1].name is 'cart', as that of moving[0]; expected another name, or none",
        ),
        (
            {"disc": [Disc(0, 0, 1, name="it")], "moving": [Moving(WAY, radius_m=1, name="it")]},
            "moving[0].name is 'it', as that of disc[0]; expected another name, or none",
        ),
        (
            {"moving": [Moving([Waypoint(0, 0, 0), Waypoint(1e-118, 1, 0)], radius_m=1)]},
            "moving[0].path[1].time_s is 1e-118; expected more than 0, by a microsecond or more",
        ),
        (
            {"moving": [Moving([Waypoint(0, 0, 0), Waypoint(0.001, 1, 0)], radius_m=1)]},
            "moving[0].path: some of it moves at 1000 m/s; expected at most 100 m/s",
        ),
        (
            {"moving": [Moving([Waypoint(0, 0, 0), Waypoint(1, 0, 0, 300)], corners_m=square(0, 0, 1))]},
            "moving[0].path: some of it moves at 212.1 m/s; expected at most 100 m/s",
        ),
        ({"patch": [Patch(CORNERS, grip=math.inf)]}, "patch[0].grip: expected a finite number"),
        ({"light": [Light(0, 0, -1.0)]}, "light[0].power_w: expected float >= 0.0"),
        ({"charger": Charger(0, 0, 0)}, "charger.radius_m: expected float > 0.0"),
        ({"start": Start(2000, 0, 0)}, "start.x_m: expected float <= 1000.0"),
        ({"start": (0, 0, 0)}, "start: expected object, got array"),
        ({"obstacle": [Polygon(np.zeros((3, 3)))]}, "obstacle[0].corners_m[0]: expected array of length 2, got 3"),  # type: ignore[arg-type]
        ({"obstacle": [Polygon(CORNERS, height_m=1j)]}, "obstacle[0].height_m: expected float | null, got str"),  # type: ignore[arg-type]
        ({"obstacle": Polygon(CORNERS)}, "obstacle: expected array, got object"),
    ],
)
def test_arenas_made_in_python_have_the_limits_of_files(description: dict[str, Any], text: str) -> None:
    with pytest.raises(ArenaError) as caught:
        Arena(ArenaDescription(name="wrong", **description))
    assert str(caught.value) == f"arena: {text}"


def test_numpys_numbers_are_numbers() -> None:
    box = Polygon(np.array(square(2, 0, 1)), height_m=np.float32(0.5))  # type: ignore[arg-type]
    arena = Arena(ArenaDescription(name="n", obstacle=[box], disc=[Disc(np.float64(-2), 0, np.int64(1))]))  # type: ignore[arg-type]
    assert arena.ray(0, 0, 0, 5) == 1.5 and arena.ray(np.float64(0), 0, math.pi, 5) == pytest.approx(1.0)


def test_one_description_cannot_be_changed_behind_an_arena() -> None:
    corners = square(2, 0, 1)
    arena = Arena(ArenaDescription(name="n", obstacle=[Polygon(corners)]))
    corners[0] = (math.nan, 0.0)
    assert arena.description.obstacle[0].corners_m[0] == (1.5, -0.5)


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda a: a.ray(math.nan, 0, 0, 1), "arena: the position is (nan, 0); expected 2 finite numbers, x, y (m), w"),
        (lambda a: a.ray(0, 0, math.nan, 1), "arena: angle is nan; expected a finite number"),
        (lambda a: a.ray(0, 0, 0, -1), "arena: reach is -1; expected a finite number from 0 to 1e+07"),
        (lambda a: a.is_free(0, 0, "r"), "arena: radius is 'r'; expected a finite number from 0"),
        (lambda a: type(a)(None), "arena: expected object, got null"),
        (lambda a: ray_segment(0, 0, 0, (1, 0), (1e7, 0)), "segment (1, 0) to (10000000.0, 0), ray from (0, 0) at 0"),
    ],
)
def test_questions_to_arenas(ask: Callable[[Arena], Any], text: str) -> None:
    with pytest.raises(ArenaError) as caught:
        ask(ROOM)
    assert str(caught.value).startswith(text)


def undriven() -> Vehicle:
    return Vehicle(VehicleModel(ARSIM_BODY), ROOM)


def too_slow() -> Vehicle:
    """Its step is refused where the drive is added; it may not be used all the same."""
    model = VehicleModel(ARSIM_BODY, dt=0.5)
    with pytest.raises(RobotError, match="Euler limit"):
        model.dc_motors()
    return Vehicle(model, ROOM)


any_vehicle: Any = Vehicle  # the types are what is wrong
any_batch: Any = Batch
START = "expected 3 finite numbers, x, y (m), heading (rad), within ±1,000,000, ±1,000,000, ±100,000"


@pytest.mark.parametrize(
    ("make", "error", "text"),
    [
        (lambda: any_vehicle(MODEL, ROOM, pose=(0, 0)), RobotError, f"vehicle: the pose is (0, 0); {START}"),
        (lambda: any_vehicle(MODEL, ROOM, pose="abc"), RobotError, f"vehicle: the pose is 'abc'; {START}"),
        (
            lambda: any_vehicle(MODEL, ROOM, pose=(1e7, 0, 0)),
            RobotError,
            "vehicle: the pose is (10000000.0, 0, 0); exp",
        ),
        (
            lambda: any_vehicle(MODEL, ROOM, seed=math.nan),
            RobotError,
            "vehicle: the seed is nan; expected a whole number",
        ),
        (
            lambda: any_vehicle(MODEL, ROOM, robot=0),
            RobotError,
            "vehicle: robot is 0; expected a whole number from 1 to 2",
        ),
        (lambda: any_vehicle(MODEL, None), RobotError, "vehicle: the arena is None; expected an Arena"),
        (lambda: any_vehicle("arsim", ROOM), RobotError, "vehicle: the model is 'arsim'; expected a VehicleModel"),
        (undriven, RobotError, "vehicle: the model has no drive; expected dc_motors, regulated_motors or servos"),
        (too_slow, RobotError, "vehicle: dt = 0.5 s; expected less than 0.3255 s, the Euler limit"),
        (
            lambda: any_vehicle(MODEL, ROOM).place((0, 0, 0), 200),
            RobotError,
            "vehicle: the speed is (200, 0.0); expected",
        ),
        (
            lambda: any_vehicle(MODEL, ROOM).step("a", 1),
            BrainError,
            "motor signals ('a', 1); expected two finite numbers",
        ),
        (
            lambda: any_vehicle(MODEL, ROOM).run(lambda _: None, 1),
            BrainError,
            "motor signals None; expected two finite",
        ),
        (
            lambda: any_vehicle(MODEL, ROOM).run(lambda _: (0, 0), -1),
            RobotError,
            "vehicle: steps is -1; expected a whole",
        ),
        (lambda: any_batch(MODEL, ROOM, [[0, 0]], [1]), RobotError, "batch: poses (1, 2), seeds (1,); expected shapes"),
        (
            lambda: any_batch(MODEL, ROOM, "x", [1]),
            RobotError,
            "batch: poses are 'x'; expected numbers of shape (N, 3)",
        ),
        (
            lambda: any_batch(MODEL, ROOM, [[0, 0, 0]] * 2, [1, math.nan]),
            RobotError,
            "batch, world 0: the seed is 1.0;",
        ),
        (
            lambda: any_batch(MODEL, ROOM, [[0, 0, math.nan]], [1]),
            RobotError,
            "batch, world 0: the pose is [0.0, 0.0, na",
        ),
        (
            lambda: any_batch(MODEL, ROOM, [[9, 9, 0]], [1]),
            ArenaError,
            "batch, world 0: in arena showcase the robot cann",
        ),
        (
            lambda: any_batch(MODEL, ROOM, [[0, 0, 0]], [1], threads=0),
            RobotError,
            "batch: threads is 0; expected a whole",
        ),
        (lambda: any_batch(MODEL, "room", [[0, 0, 0]], [1]), RobotError, "batch: the arena is 'r'; expected an Arena"),
    ],
)
def test_vehicles_and_batches(make: Callable[[], Any], error: type[BoebotError], text: str) -> None:
    with pytest.raises(error) as caught:
        make()
    assert str(caught.value).startswith(text)


@pytest.mark.parametrize(
    ("model", "memory", "text"),
    [
        (MODEL, 8, "batch: wander uses 24 bytes of memory, each world has 8; expected state_bytes=24 or more where"),
        (
            arsim(infrared_rad=()),
            64,
            "batch: wander reads infrared_left, infrared_right, the model has odometer, compass; expected the model's "
            "first sensors to be those that it reads, in that order",
        ),
    ],
)
def test_a_brain_on_a_model_that_it_was_not_made_for(model: VehicleModel, memory: int, text: str) -> None:
    batch = Batch(model, ROOM, np.zeros((2, 3)), [1, 2], state_bytes=memory)
    before = batch.hashes().tolist()
    with pytest.raises(BrainError) as caught:
        batch.run(WANDER, 3)
    assert str(caught.value).startswith(text) and batch.hashes().tolist() == before


def test_memory_is_lent_as_types_that_fit_it() -> None:
    batch = Batch(MODEL, ROOM, np.zeros((1, 3)), [1], state_bytes=16)
    batch.state(0, "double *")[0] = 2.0
    for kind, text in (
        ("vehicle_wander_state *", "16 bytes, vehicle_wander_state * points to 24; expected state_bytes=24"),
        ("no_type *", "'no_type *' is no C type here; expected a pointer"),
        ("double", "'double' is no C type here; expected a pointer"),
    ):
        with pytest.raises(RobotError) as caught:
            batch.state(0, kind)
        assert text in str(caught.value)


def test_what_was_lent_lives_as_long_as_it_is_held() -> None:
    body, readings = (lambda v: (v.body, v.readings))(Vehicle(MODEL, arena_of(), pose=(1.0, 2.0, 0.5)))
    columns, memory = (lambda b: (b.readings, b.state(0)))(Batch(MODEL, arena_of(), [[1.0, 2.0, 0.5]], [1]))
    for _ in range(50):  # whatever was free by now is something else
        Batch(MODEL, arena_of(), np.full((40, 3), 7.0), np.arange(40))
    assert (body.x, body.y) == (1.0, 2.0) and list(readings[2:5]) == [1.0, 2.0, 0.5]
    assert columns[0, 2:5].tolist() == [1.0, 2.0, 0.5] and memory[0] == b"\0"[0]
