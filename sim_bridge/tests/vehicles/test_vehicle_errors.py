"""Whatever is given to a vehicle, its model and its motors: one sentence (BoebotError), or finite numbers only."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from boebot.arenas import load_arena
from boebot.description.robots import load_robot
from boebot.errors import ArenaError, BoardError, BoebotError, RobotError
from boebot_course.motor import DCMotor, PositionServo, RegulatedMotor, ServoMotor
from sim_bridge.reading_table import ReadingTable
from sim_bridge.sim import Sim
from sim_bridge.tests.simulated import arena_of, square
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim, beam
from sim_bridge.vehicles.checked_structs import keys_of

ROOM = arena_of(outline=square(0, 0, 4))

# ---- random dictionaries ---------------------------------------------------------------------------------------------

numbers = (
    st.floats(-3, 3)
    | st.floats()
    | st.integers(-3, 40)
    | st.sampled_from([0.0, 1.0, 1e-3, 0.02, 1e-300, 5e-324, 1e11, 1e300, 10**400, np.float32(0.5), np.int64(3)])
)
junk = st.none() | st.booleans() | st.text(max_size=5) | st.binary(max_size=3) | st.lists(st.floats(), max_size=3)
anything = st.one_of(numbers, numbers, numbers, junk, st.dictionaries(st.text(max_size=3), st.floats(), max_size=2))


def dictionaries(*kinds: str, **more: Any) -> Any:
    """Of keys that those C structs have, and now and then of one that they have not."""
    known = sorted({key for kind in kinds for key in keys_of(kind)} - {"beam", "motor", "outline"})
    keys = st.sampled_from(known) | st.sampled_from(known) | st.sampled_from(known) | st.text(min_size=1, max_size=4)
    return st.builds(
        lambda a, b: a | b, st.dictionaries(keys, anything, max_size=6), st.fixed_dictionaries({}, optional=more)
    )


beams = (
    anything | dictionaries("beam_parameters") | st.builds(lambda more: beam() | more, dictionaries("beam_parameters"))
)
TABLE = ReadingTable([0.1, 1.0], [0.0, 1.0], [[[1.0], [2.0]], [[3.0, 3.5], [4.0]]])
GOOD: dict[str, dict[str, Any]] = {
    "infrared_proximity": {"beam": beam(), "range": 1.0},
    "sharp_infrared": {"beam": beam(), "reach": 1.0},
    "sonar": {"beam": beam(), "range_maximum": 3.0},
    "laser": {"step": 0.01, "rays": 9, "range": 4.0},
    "compass": {},
    "accelerometer": {"mass": 1e-3, "stiffness": 1.0, "range": 20.0},
    "phototransistor": {"near_distance": 0.05},
    "odometer": {},
}
sensors = st.sampled_from(sorted(GOOD)).flatmap(
    lambda name: st.tuples(
        st.just(name),
        dictionaries(f"{name}_parameters", beam=beams, period=anything, table=st.just(TABLE) | anything),
    )
)


def is_sentence_or_finite(numbers_of: Callable[[], tuple[float, ...]]) -> bool:
    """It is refused in one sentence, or has finite numbers only."""
    try:
        found = numbers_of()
    except BoebotError as error:
        text = str(error)
        return 10 < len(text) < 700 and "\n" not in text and ("expected" in text or isinstance(error, ArenaError))
    return all(map(math.isfinite, found))


def settles(build: Callable[[], VehicleModel]) -> None:
    """It is refused in one sentence, or its world has finite numbers only."""

    def driven() -> tuple[float, ...]:
        vehicle = Vehicle(build(), ROOM)
        for _ in range(20):
            vehicle.step(0.7, -0.3)
        return (*vehicle.true_pose, *vehicle.readings, *vehicle.currents, vehicle.body.speed)

    assert is_sentence_or_finite(driven)


@given(sensors)
@example(("accelerometer", {"period": None}))
@example(("phototransistor", {"near_distance": 1e-300, "gain": 1e11}))
@example(("sonar", {"beam": beam(rays=3.0), "range_maximum": True}))  # type: ignore[arg-type]
def test_sensors_take_any_dictionary(chosen: tuple[str, dict[str, Any]]) -> None:
    name, changes = chosen

    def build() -> VehicleModel:
        model = VehicleModel(ARSIM_BODY)
        model.dc_motors()
        model.sensor(name, "one", **GOOD[name] | changes)
        return model

    settles(build)


@given(
    st.sampled_from(["dc_motors", "regulated_motors", "servos"]),
    anything
    | dictionaries("motor_dc_parameters", "motor_regulated_parameters", "servo_motor_parameters", motor=anything),
    st.none() | dictionaries("motor_dc_parameters"),
    st.booleans(),
)
@example("dc_motors", {"gear": 1e-200, "coulomb_n_m": 1.0}, {"inductance_h": 5e-324}, True)
@example("dc_motors", {"resistance_ohm": 5e-324}, None, False)
@example("servos", {"wheel_radius": 1e-300, "scale_ccw_us": 5e-324}, None, False)
def test_drives_take_any_dictionary(drive: str, left: Any, right: Any, full: bool) -> None:
    def build() -> VehicleModel:
        model = VehicleModel(ARSIM_BODY)
        model.sensor("compass", "compass", current_x=0.1)
        more = {"full": full} if drive == "dc_motors" else {}
        getattr(model, drive)(left, right, **more)
        return model

    settles(build)


@given(anything | dictionaries("body_parameters", outline=anything), anything)
@example({"mass": 5e-324}, 0.01)
@example({"wheel_radius": 1e-300, "half_track": 1e11}, 0.01)
@example({"slip": 1, "grip": 1e11, "inertia": 1e-9}, 1e-6)
def test_bodies_take_any_dictionary(changes: Any, dt: Any) -> None:
    def build() -> VehicleModel:
        body = ARSIM_BODY | changes if isinstance(changes, dict) else changes
        model = VehicleModel(body, dt=dt)
        model.sensor("odometer", "odometer")
        model.dc_motors()
        return model

    settles(build)


@given(st.fixed_dictionaries({}, optional=dict.fromkeys(("empty", "full", "sigma", "idle_per_s", "x"), anything)))
def test_batteries_take_any_dictionary(given_keys: dict[str, Any]) -> None:
    def build() -> VehicleModel:
        model = VehicleModel(ARSIM_BODY)
        model.dc_motors()
        model.battery("battery", **given_keys)
        return model

    settles(build)


@given(
    anything,
    anything,
    st.fixed_dictionaries({}, optional={"beam": beams, "reach": anything, "none": anything, "x": junk}),
)
def test_tables_and_whiskers_take_anything(a: Any, b: Any, given_keys: dict[str, Any]) -> None:
    def table() -> VehicleModel:
        model = VehicleModel(ARSIM_BODY)
        model.dc_motors()
        keys: dict[str, Any] = {"beam": beam(), "reach": 1.0} | given_keys
        model.sensor("table", "one", table=TABLE, **keys)
        return model

    def whisker() -> VehicleModel:
        model = VehicleModel(ARSIM_BODY)
        model.dc_motors()
        model.sensor("touch", "one", root_x=a, tip_y=b)
        return model

    settles(table)
    settles(whisker)


@given(
    st.fixed_dictionaries(
        {},
        optional={"pose": anything | st.tuples(numbers, numbers, numbers), "seed": anything, "robot": anything,
                  "state_bytes": anything},
    ),
    anything, anything,
)  # fmt: skip
def test_vehicles_take_anything(given_keys: dict[str, Any], speed: Any, signal: Any) -> None:
    def all_of_it() -> tuple[float, ...]:
        vehicle = Vehicle(arsim(), ROOM, **given_keys)
        vehicle.step(0.3, 0.3)
        vehicle.place((0.0, 0.0, 0.0), speed, speed)
        vehicle.step(signal, 0.5)
        vehicle.run(lambda _: signal, 2)
        return (*vehicle.true_pose, *vehicle.readings)

    assert is_sentence_or_finite(all_of_it)


@given(st.sampled_from([DCMotor, RegulatedMotor, ServoMotor, PositionServo]), st.data())
def test_motors_take_any_dictionary(kind: Any, data: Any) -> None:
    names = {
        DCMotor: "motor_dc",
        RegulatedMotor: "motor_regulated",
        ServoMotor: "servo_motor",
        PositionServo: "motor_position",
    }
    given_keys = data.draw(dictionaries(f"{names[kind]}_parameters"))
    one, two = data.draw(st.tuples(anything, anything))

    def all_of_it() -> tuple[float, ...]:
        motor = kind(**given_keys)
        if kind is DCMotor:
            return motor.voltage(one), motor.torque(one, two), motor.current(one, two), *motor.step(1.0, 2.0, one, two)
        if kind is RegulatedMotor:
            return motor.reference(one), motor.torque(one, two)
        if kind is ServoMotor:
            return motor.pulse(one), motor.speed(two)
        motor.pulse(one)
        return (motor.step(two),)

    assert is_sentence_or_finite(all_of_it)


# ---- single sentences ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("add", "what"),
    [
        (
            lambda m: m.sensor("sonar", "a", beam=beam(), range=3.0),
            "'a': there is no key 'range'; expected beam, range_minimum",
        ),
        (
            lambda m: m.sensor("sonar", "a", beam=beam()),
            "'a': the key 'range_maximum' is missing; expected a number more than 0",
        ),
        (
            lambda m: m.sensor("sonar", "a", range_maximum=3.0),
            "'a': the key 'beam' is missing; expected a mapping, x, y, heading",
        ),
        (
            lambda m: m.sensor("sonar", "a", beam=beam() | {"ray": 3}, range_maximum=3.0),
            "'a': beam: there is no key 'ray'",
        ),
        (
            lambda m: m.sensor("sonar", "a", beam=beam(rays=33), range_maximum=3.0),
            "'a': beam.rays is 33; expected a whole number from",
        ),
        (
            lambda m: m.sensor("sonar", "a", beam=beam(), range_maximum=3.0, miss=2),
            "'a': miss is 2; expected a number from 0 to 1",
        ),
        (
            lambda m: m.sensor("laser", "a", step=1.0, rays=9, range=4.0),
            "'a': step is 1; expected a fan of 9 rays of less than a turn",
        ),
        (
            lambda m: m.sensor("laser", "a", rays=9, range=4.0),
            "'a': step is 0; expected a number more than 0, with 9 rays",
        ),
        (
            lambda m: m.sensor("sharp_infrared", "a", beam=beam(), reach=1.0, period=0.03, late=0.04),
            "'a': late is 0.04; expected at most",
        ),
        (lambda m: m.sensor("compass", "a", sigma="big"), "'a': sigma is 'big'; expected a number of at least 0"),
        (lambda m: m.sensor("compass", 7), "a sensor's name is 7; expected a text"),
        (lambda m: m.sensor("odometer", "a", rule=3), "'a': rule is 3; expected 0 or 1 or 2"),
        (lambda m: m.sensor("touch", "a", root_x=(1,)), "'a': root_x is (1,); expected a finite number"),
        (
            lambda m: m.battery("a", idle=1),
            "'a': there is no key 'idle'; expected idle_per_s, signal_per_s, charger_per_s",
        ),
        (lambda m: m.battery("a", empty=7, full=5), "'a': full is 5; expected more than empty, 7"),
        (lambda m: m.battery("a", idle_per_s=-1), "'a': idle_per_s is -1; expected a number of at least 0"),
        (lambda m: m.battery("a", signal_per_s=-1), "'a': signal_per_s is -1; expected a number of at least 0"),
        (lambda m: m.battery("a", charger_per_s=-1), "'a': charger_per_s is -1; expected a number of at least 0"),
        (
            lambda m: m.sensor("touch", "a", root_x=0.1, root_y=0, tip_x=0.1, tip_y=0.0),
            "'a': tip is where root is; expected a whisker that has a length",
        ),
        (lambda m: m.dc_motors(full="no"), "vehicle: full is 'no'; expected True or False"),
        (lambda m: m.servos(7), "left servo is 7; expected a mapping with keys of mount"),
        (lambda m: m.servos(None, {"lag": 1}), "right servo: there is no key 'lag'; expected mount"),
        (lambda m: m.dc_motors(right={"gears": 2}), "right motor: there is no key 'gears'; expected torque_constant"),
        (lambda m: m.regulated_motors({"coast_n_s": 1}), "left motor: there is no key 'coast_n_s'; expected gain_n_s"),
    ],
)
def test_wrong_keys_get_a_sentence_and_add_nothing(add: Any, what: str) -> None:
    model = VehicleModel(ARSIM_BODY)
    with pytest.raises(RobotError) as caught:
        add(model)
    assert str(caught.value).startswith("vehicle: ") and what in str(caught.value)
    assert not model.names and not model.looks
    model.dc_motors()
    assert len(Vehicle(model, ROOM).readings) == 0


@pytest.mark.parametrize("key", ["noise", "ends_at_collision"])
def test_a_switch_is_true_or_false(key: str) -> None:
    wrong: Any
    right: dict[str, Any] = {key: np.bool_(False)}
    for wrong in ("off", None, 2):
        with pytest.raises(RobotError, match=f"^vehicle: {key} is .*; expected True or False$"):
            VehicleModel(ARSIM_BODY, **{key: wrong})
    VehicleModel(ARSIM_BODY, **right)


def test_what_is_no_path_is_one_sentence() -> None:
    with pytest.raises(ArenaError, match=r"^arena is 5; expected a name or a \.toml file$"):
        load_arena(5)  # type: ignore[arg-type]
    with pytest.raises(RobotError, match=r"^robot is None; expected a name or a \.toml file$"):
        load_robot(None)  # type: ignore[arg-type]
    with pytest.raises(RobotError, match=r"^table is 5; expected the path of a CSV file$"):
        ReadingTable.load(5)  # type: ignore[arg-type]
    with pytest.raises(BoardError, match=r"^simulation: noise is 'off'; expected True or False$"):
        Sim(ROOM, noise="off")  # type: ignore[arg-type]


def test_one_of_each() -> None:
    model = VehicleModel(ARSIM_BODY)
    model.servos()
    for drive in (model.dc_motors, model.regulated_motors, model.servos):
        with pytest.raises(RobotError, match="it has a drive already; expected one of dc_motors, regulated_motors or"):
            drive()
    model.battery("pack")
    with pytest.raises(RobotError, match="'more': it has a battery already; expected one"):
        model.battery("more")


def test_a_model_that_steps_too_far_makes_no_worlds() -> None:
    model = VehicleModel(ARSIM_BODY, dt=0.5)
    for ask in (model.dc_motors, lambda: Vehicle(model, ROOM)):
        with pytest.raises(RobotError, match=r"dt = 0\.5 s; expected less than 0\.3255 s, the Euler limit"):
            ask()
