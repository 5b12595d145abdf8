"""Saved states: what they hold, what they are refused for, and the hash that covers all of it."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any

import msgspec
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
    Wall,
    Waypoint,
    arena_names,
    load_arena,
)
from sim_bridge import saved
from sim_bridge._core import ffi
from sim_bridge.batch import WANDER, Batch
from sim_bridge.motor import DCMotor
from sim_bridge.reading_table import ReadingTable
from sim_bridge.saved import SavedStateError
from sim_bridge.tests.simulated import square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim, beam

MASK = 2**64 - 1


def mixed(word: int) -> int:
    """SplitMix64's finaliser (Steele, Lea, Flood 2014), by hand."""
    word = (word + 0x9E3779B97F4A7C15) & MASK
    word = ((word ^ (word >> 30)) * 0xBF58476D1CE4E5B9) & MASK
    word = ((word ^ (word >> 27)) * 0x94D049BB133111EB) & MASK
    return word ^ (word >> 31)


def numbers_of(state: bytes) -> bytes:
    return saved.decode(state)[1]


def words_of(state: bytes) -> list[int]:
    numbers = numbers_of(state)
    return list(struct.unpack(f"<{len(numbers) // 8}Q", numbers))


def model() -> VehicleModel:
    built = arsim(odometer_sigma=1e-3, ends_at_collision=False)
    built.sensor(
        "sharp_infrared", "sharp", beam=beam(x=0.2), reach=1.5, gain=1.0, period=0.0383, late=0.0076, sigma=0.01
    )
    built.sensor("accelerometer", "acceleration", mass=1e-3, stiffness=1.0, damping=0.01, range=50.0, sigma=0.01)
    built.sensor("sonar", "sonar", period=0.05, beam=beam(rays=3, opening=0.3), range_maximum=3.0, miss=0.1, sigma=0.01)
    built.battery("battery", empty=5.0, full=8.0, idle_per_s=0.01)
    return built


def driven(steps: int = 137, seed: int = 3) -> Vehicle:
    vehicle = Vehicle(model(), load_arena("arsim"), seed=seed)
    vehicle.run(lambda v: (0.6, 0.5 + 0.1 * v["compass"]), steps)
    return vehicle


# ---- what it holds ---------------------------------------------------------------------------------------------------


def test_a_state_is_words_of_the_same_order_on_every_machine() -> None:
    vehicle = driven()
    state = numbers_of(vehicle.save())
    body = vehicle.body
    names = (
        "x",
        "y",
        "speed",
        "turn_rate",
        "lateral",
        "rim_left",
        "rim_right",
        "wheel_left",
        "wheel_right",
        "distance",
    )
    numbers = struct.unpack_from("<10d", state)
    assert list(numbers) == [getattr(body, name) for name in names]
    readings = np.array(vehicle.readings)
    memory = 64
    assert state[len(state) - memory - 8 * len(readings) : len(state) - memory] == readings.astype("<f8").tobytes()


def test_the_hash_is_that_of_the_numbers() -> None:
    vehicle = driven()
    total = 0
    for word in words_of(vehicle.save()):
        total = mixed(total ^ word)
    assert vehicle.hash() == total


def test_every_number_of_the_body_is_in_the_hash_and_in_the_bytes() -> None:
    for name, _ in ffi.typeof("body_state").fields:
        vehicle = driven()
        before, state = vehicle.hash(), vehicle.save()
        value = getattr(vehicle.body, name)
        setattr(vehicle.body, name, 1 - value if isinstance(value, int) else value + 0.015625)
        assert vehicle.hash() != before and vehicle.save() != state, name
        vehicle.restore(state)
        assert vehicle.hash() == before and vehicle.save() == state, name


def test_a_brains_memory_is_in_the_hash() -> None:
    batch = Batch(model(), load_arena("arsim"), np.zeros((2, 3)), [7, 7])
    one, other = batch.hashes()
    assert one == other
    batch.state(1)[63] = 1
    assert batch.hashes()[0] == one != batch.hashes()[1]


def test_servo_driven_worlds_go_on_identically() -> None:
    body = {"mass": 0.6, "inertia": 1.2e-3, "radius": 0.07, "half_track": 0.0525, "wheel_radius": 0.0331, "slip": 1,
            "wheel_mass": 0.03, "wheel_inertia": 1.7e-5, "angular_damping": 0.004, "grip": 0.7}  # fmt: skip
    built = VehicleModel(body, dt=0.003)
    built.servos()
    whole, other = (Vehicle(built, load_arena("showcase"), seed=seed) for seed in (1, 2))
    whole.run(lambda _: (0.9, -0.2), 1111)
    other.restore(whole.save())
    for vehicle in (whole, other):
        vehicle.run(lambda _: (0.1, 0.8), 500)
    assert whole.hash() == other.hash() and whole.save() == other.save()


# ---- what it is refused for ------------------------------------------------------------------------------------------


def test_a_state_of_another_arena_is_refused() -> None:
    vehicles = {name: Vehicle(arsim(), load_arena(name)) for name in arena_names()}
    for here in vehicles:
        for there, vehicle in vehicles.items():
            before = vehicle.hash()
            if here == there:
                vehicle.restore(vehicles[here].save())
            else:
                with pytest.raises(SavedStateError, match=f"saved in another arena; expected .* this arena, {there}$"):
                    vehicle.restore(vehicles[here].save())
            assert vehicle.hash() == before


WAY = [Waypoint(0, 3, 3), Waypoint(5, 3, 2)]
FULL: dict[str, Any] = {
    "outline": [Polygon(square(0, 0, 10))],
    "obstacle": [Polygon(square(2, 2, 0.5))],
    "wall": [Wall([(1, -1), (2, -1), (2, -2)])],
    "disc": [Disc(-2, -2, 0.5)],
    "patch": [Patch(square(0, 0, 1), grip=0.5)],
    "light": [Light(1, 1, 1.0)],
    "charger": Charger(-1, 1, 0.2),
    "moving": [Moving(WAY, radius_m=0.2)],
}
CHANGES: list[dict[str, Any]] = [
    {"outline": []},
    {"obstacle": [Polygon(square(2, 2, 0.5), height_m=0.5)]},
    {"obstacle": [Polygon(square(2, 2, 0.5), infrared_reflectance=0.5)]},
    {"obstacle": [Polygon(square(2, 2, 0.5), sound_reflectance=0.5)]},
    {"obstacle": [Polygon(square(2, 2.001, 0.5))]},
    {"obstacle": [], "outline": [Polygon(square(0, 0, 10)), Polygon(square(2, 2, 0.5))]},
    {"wall": [Wall([(1, -1), (2, -1)]), Wall([(2, -1), (2, -2)])]},
    {"disc": [Disc(-2, -2, 0.501)]},
    {"disc": [Disc(-2, -2, 0.5, height_m=0.1)]},
    {"patch": [Patch(square(0, 0, 1), grip=0.6)]},
    {"patch": [Patch(square(0, 0, 1.1), grip=0.5)]},
    {"light": [Light(1, 1, 1.0, height_m=0.2)]},
    {"light": [Light(1, 1, 1.1)]},
    {"light": []},
    {"charger": None},
    {"charger": Charger(-1, 1, 0.21)},
    {"moving": [Moving(WAY, radius_m=0.21)]},
    {"moving": [Moving(WAY, corners_m=square(0, 0, 0.2))]},
    {"moving": [Moving(WAY, radius_m=0.2, height_m=0.2)]},
    {"moving": [Moving(WAY, radius_m=0.2, repeat="once")]},
    {"moving": [Moving([*WAY, Waypoint(6, 3, 2)], radius_m=0.2)]},
    {"moving": [Moving([WAY[0], Waypoint(5, 3, 2, 0.1)], radius_m=0.2)]},
    {"moving": []},
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_whatever_differs_in_an_arena_makes_it_another(change: dict[str, Any]) -> None:
    here, same, other = (Arena(ArenaDescription(name="a", **(FULL | more))) for more in ({}, {}, change))
    state = Vehicle(arsim(), here).save()
    Vehicle(arsim(), same).restore(state)
    with pytest.raises(SavedStateError, match="another arena"):
        Vehicle(arsim(), other).restore(state)


# Each device with all numbers of its C struct, and how a model gets it.
BEAM = beam(x=0.1, y=0.01, heading=0.2, opening=0.4, rays=3)
REGULATED = {"gain_n_s": 1.2, "torque_maximum_n_m": 0.268, "coast_n_s": 0.3, "coast_maximum_n_m": 0.05}
SERVO = {"mount": 1.0, "wheel_radius": 0.1, "centre_us": 1500.0, "dead_band_us": 9.0, "top_ccw_rad_s": 5.3,
         "scale_ccw_us": 78.5, "top_cw_rad_s": 5.3, "scale_cw_us": 78.5, "lag_s": 0.055,
         "motor": REGULATED}  # fmt: skip
DEVICES: dict[str, tuple[str, dict[str, Any]]] = {
    "infrared_proximity": ("infrared_proximity_parameters", {"beam": BEAM, "range": 1.0, "c1": 0.03, "c2": 0.1}),
    "sharp_infrared": ("sharp_infrared_parameters", {"beam": BEAM, "reach": 1.5, "gain": 1.0, "period": 0.05}),
    "sonar": ("sonar_parameters", {"beam": BEAM, "range_maximum": 3.0}),
    "laser": ("laser_parameters", {"first": -1.0, "step": 0.1, "rays": 9, "range": 4.0}),
    "compass": ("compass_parameters", {}),
    "accelerometer": ("accelerometer_parameters", {"mass": 1e-3, "stiffness": 10.0, "range": 20.0}),
    "phototransistor": ("phototransistor_parameters", {"near_distance": 0.05, "gain": 1.0}),
    "odometer": (
        "odometer_parameters",
        {"half_track": 0.2, "wheel_radius": 0.1, "factor_left": 1.0, "factor_right": 1.0},
    ),
}


def changed(kind: str, values: dict[str, Any]) -> list[dict[str, Any]]:
    """The values with one number of the struct changed, for each that it has."""
    found = []
    for name, field in ffi.typeof(kind).fields:
        if field.type.kind == "struct":
            found += [values | {name: inner} for inner in changed(field.type.cname, values.get(name, {}))]
        elif field.type.kind == "primitive":
            step = {"mount": -2, "efficiency": -0.001}.get(name, 1 if field.type.cname == "int" else 0.001)
            found.append(values | {name: values.get(name, 0) + step})
    return found


def driven_by(kind: str, values: dict[str, Any]) -> Callable[[VehicleModel], None]:
    def build(built: VehicleModel) -> None:
        if kind == "dc":
            built.dc_motors(None, values)
        else:
            getattr(built, f"{kind}s")(None, values)

    return build


def with_sensor(kind: str, values: dict[str, Any]) -> Callable[[VehicleModel], None]:
    def build(built: VehicleModel) -> None:
        built.dc_motors()
        built.sensor(kind, "device", **values)

    return build


def with_battery(values: dict[str, Any]) -> Callable[[VehicleModel], None]:
    def build(built: VehicleModel) -> None:
        built.dc_motors()
        built.battery("device", **values)

    return build


def built_from(build: Callable[[VehicleModel], None], body: dict[str, Any] | None = None) -> Vehicle:
    vehicle_model = VehicleModel(ARSIM_BODY if body is None else body)
    build(vehicle_model)
    return Vehicle(vehicle_model, load_arena("empty"))


def refused(one: Vehicle, others: list[Vehicle]) -> int:
    """How many others refuse the one's state as that of another model: all of them."""
    state = one.save()
    one.restore(state)
    for other in others:
        with pytest.raises(SavedStateError, match="saved by another model"):
            other.restore(state)
    return len(others)


def test_every_number_of_the_body_is_the_models() -> None:
    bodies = changed("body_parameters", dict(ARSIM_BODY))
    plain = VehicleModel.dc_motors
    assert refused(built_from(plain), [built_from(plain, body) for body in bodies]) >= 13


def test_every_number_of_the_drive_is_the_models() -> None:
    default = DCMotor().parameters
    motor = {name: getattr(default, name) for name, _ in ffi.typeof("motor_dc_parameters").fields}
    for kind, name, values in (("dc", "motor_dc_parameters", motor), ("servo", "servo_motor_parameters", SERVO)):
        others = [built_from(driven_by(kind, other)) for other in changed(name, values)]
        assert refused(built_from(driven_by(kind, values)), others) >= 10
    regulated = {"gain_n_s": 2.0, "torque_maximum_n_m": 0.5, "speed_maximum_m_s": 0.3}
    others = [built_from(driven_by("regulated_motor", regulated | {name: 0.4})) for name in regulated]
    assert refused(built_from(driven_by("regulated_motor", regulated)), others) == 3


@pytest.mark.parametrize("kind", DEVICES)
def test_every_number_of_a_sensor_is_the_models(kind: str) -> None:
    name, values = DEVICES[kind]
    others = [built_from(with_sensor(kind, other)) for other in changed(name, values)]
    assert refused(built_from(with_sensor(kind, values)), others) >= 4


def test_switches_battery_whisker_and_table_are_the_models() -> None:
    def table(sample: float) -> Callable[[VehicleModel], None]:
        read = ReadingTable([0.1, 1.1], [0.0], [[[5.0]], [[sample]]])
        return with_sensor("table", {"beam": BEAM, "table": read, "reach": 1.1, "none": 0.0})

    for build in (
        table,
        lambda x: with_sensor("touch", {"root_x": 0.2, "tip_x": 0.3, "tip_y": x}),
        lambda x: with_battery({"idle_per_s": 0.1 + x}),
        lambda x: with_battery({"full": 8.0 + x}),
        lambda x: with_sensor("compass", {"period": x}),
    ):
        assert refused(built_from(build(1.0)), [built_from(build(1.25))]) == 1
    models = [arsim(), arsim(noise=False), arsim(ends_at_collision=False), arsim(dt=0.02)]
    first, *others = (Vehicle(other, load_arena("empty")) for other in models)
    assert refused(first, others) == 3


def test_another_format_is_refused() -> None:
    heading, numbers = saved.decode(driven().save())
    other = saved.encode(msgspec.structs.replace(heading, format=saved.FORMAT - 1), numbers)
    with pytest.raises(SavedStateError, match=f"in format {saved.FORMAT - 1}; expected format {saved.FORMAT}"):
        driven().restore(other)


def test_another_size_of_memory_is_refused() -> None:
    large = Batch(model(), load_arena("arsim"), [[0, 0, 0]], [3], state_bytes=640)
    with pytest.raises(SavedStateError, match="expected the same state_bytes"):
        large.restore(0, driven().save())


# ---- damage ----------------------------------------------------------------------------------------------------------


def test_damage_anywhere_is_refused_and_changes_nothing() -> None:
    vehicle = driven()
    state, before = vehicle.save(), vehicle.hash()
    for at in range(len(state)):
        for bit in (0, 7):
            with pytest.raises(SavedStateError):
                vehicle.restore(state[:at] + bytes([state[at] ^ (1 << bit)]) + state[at + 1 :])
    for size in range(len(state)):
        with pytest.raises(SavedStateError):
            vehicle.restore(state[:size])
    for wrong in (None, "state", 5, [1, 2], math.nan):
        with pytest.raises(SavedStateError, match="is no saved state; expected the bytes"):
            vehicle.restore(wrong)  # type: ignore[arg-type]
    assert vehicle.hash() == before


SPECIAL = [math.nan, math.inf, -math.inf, 1e308, -1e308, 1e13, 1e11, 5e-324, -0.0, 1e6, 3.0]
spoilt_words = st.sampled_from([struct.unpack("<Q", struct.pack("<d", x))[0] for x in SPECIAL]) | st.integers(0, MASK)


@given(st.data())
def test_a_spoilt_state_with_the_right_checksum_is_refused_or_goes_on_in_numbers(data: st.DataObject) -> None:
    """Somebody who makes states by hand gets an error or a world, never a crash or what is no number."""
    vehicle = driven(20)
    before = vehicle.hash()
    heading, words = saved.decode(vehicle.save())[0], words_of(vehicle.save())
    for _ in range(data.draw(st.integers(1, 4))):
        words[data.draw(st.integers(0, len(words) - 1))] = data.draw(spoilt_words)
    state = saved.encode(heading, struct.pack(f"<{len(words)}Q", *words))
    try:
        vehicle.restore(state)
    except SavedStateError:
        assert vehicle.hash() == before
        return
    assert vehicle.save() == state
    for _ in range(20):
        vehicle.step(0.5, -0.3)
    assert vehicle.ended in ("", "collision", "battery empty", "brain failed")
    assert all(map(math.isfinite, (*vehicle.true_pose, vehicle.time, *vehicle.readings)))


def test_a_state_of_a_batch_is_one_of_a_vehicle() -> None:
    batch = Batch(model(), load_arena("arsim"), np.zeros((3, 3)), [1, 2, 3])
    batch.run(WANDER, 200)
    alone = Vehicle(model(), load_arena("arsim"), seed=9)
    alone.restore(batch.save(1))
    batch.step(np.full((3, 2), 0.4), 50)
    for _ in range(50):
        alone.step(0.4, 0.4)
    assert alone.hash() == batch.hashes()[1] and alone.save() == batch.save(1)
