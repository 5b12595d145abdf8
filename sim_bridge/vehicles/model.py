"""What a vehicle without a board is made of: body, drive, sensors, battery (sim_bridge/vehicles/model.h).

A `VehicleModel` is built up once; any number of worlds then share it (vehicle.py, batch.py). Parameters are those of
the C structs of the same names in sim_bridge/world; model_file.py builds a model from a robot's file. Lengths in m,
angles in rad, SI units; motor signals in [-1, 1], left and right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

from boebot.arguments import shown, switch
from boebot.description.robots import RobotDescription
from boebot.errors import RobotError
from boebot.running.driver import TICK_S
from sim_bridge.compiled import ffi, lib
from sim_bridge.devices.catalogue import SensorKind, sensor_kinds
from sim_bridge.reading_table import ReadingTable
from sim_bridge.robots.imperfections import AS_BUILT, collision_outline
from sim_bridge.vehicles.checked_structs import NOT_NEGATIVE, POSITIVE, Range, known, number, struct, values_of
from sim_bridge.vehicles.drives import ENERGY, dc_parameters, regulated_parameters, servo_parameters

SIDES: Final = ("left", "right")
STEP: Final = Range(0.0, 1e6, above=True)  # s
MOUNTS: Final = {"left": 1, "right": -1}  # of servos: which way drives forward


def _sides(left: Any, right: Any) -> Iterator[tuple[str, Any]]:
    """Each side's name and what differs there."""
    for side, changes in zip(SIDES, (left, right), strict=True):
        yield side, {} if changes is None else changes


def beam(
    x: float = 0.0, y: float = 0.0, heading: float = 0.0, opening: float = 0.0, rays: int = 1, height: float = 0.06
) -> dict[str, float]:
    """Where a sensor is on the body and what it sees (beam.h)."""
    return {"x": x, "y": y, "heading": heading, "opening": opening, "height": height, "rays": rays}


def _body_and_outline(body: Any) -> tuple[Any, Any]:
    """The body's struct as a mapping, with the outline in C that it says as `outline_m`."""
    if not isinstance(body, Mapping) or "outline_m" not in body:
        return body, None
    outline = collision_outline("vehicle: body: outline_m", body["outline_m"])
    rest = {key: value for key, value in body.items() if key != "outline_m"}
    return {"radius": outline.reach, **rest, "outline": outline}, outline


class VehicleModel:
    """What a vehicle is made of; any number of worlds share one.

    Parameters are those of the C structs of the same names in sim_bridge/world; a wrong one raises RobotError, which
    says which key, what it was and what was expected.

    Attributes:
        names: readings by name: where they stand among all readings.
        robot: whose model it is; None: it was built by hand.
        looks: sensors with a beam by name: the beam, and how far it reaches (m).
        a: A of (2.26), 1/m.
        b: B of (2.30).
        draw: magnitudes of the robot's imperfections, nominal.
        unit: of a robot with a board: both servos (C structs) of the one that a seed draws; None: without a board.
        motion_maps: and how its signals become pulses (C structs motion_map).
    """

    def __init__(
        self, body: Mapping[str, Any], *, dt: float = 0.01, noise: bool = True, ends_at_collision: bool = True
    ) -> None:
        """A body (C struct body_parameters), which steps by `dt` seconds; drive and sensors are added to it.

        `outline_m` in it, corners (x, y) in m around the axle's middle, is its collision outline instead of a circle.
        """
        given, outline = _body_and_outline(body)
        parameters = struct("body_parameters", "vehicle: body", given)
        self.dt = number("vehicle", "dt", dt, STEP)
        noise = switch("vehicle: noise", noise, RobotError)
        ends_at_collision = switch("vehicle: ends_at_collision", ends_at_collision, RobotError)
        self.names: dict[str, slice] = {}
        self.looks: dict[str, tuple[Mapping[str, float], float]] = {}
        self.body = dict(body)
        self.in_use = False
        self.robot: RobotDescription | None = None
        self.draw = AS_BUILT
        self.unit: Callable[[int], list[Any]] | None = None
        self.motion_maps: list[Any] = []
        self._keep: list[Any] = [given, outline]  # what the model in C points to
        handle = lib.vehicle_model_new(parameters, self.dt)
        if handle == ffi.NULL:
            raise RobotError("vehicle: there is no memory for a model")
        self.a: float = lib.body_a(parameters)
        self.b: float = lib.body_b(parameters)
        self.handle = ffi.gc(handle, lib.vehicle_model_destroy)
        self.handle.noise, self.handle.ends_at_collision = noise, ends_at_collision

    @property
    def euler_limit(self) -> float:
        """The step, s, from which on Euler's method diverges."""
        return float(lib.vehicle_model_euler_limit(self.handle))

    @property
    def readings(self) -> int:
        """How many readings it gives."""
        return int(self.handle.readings)

    @property
    def steps_a_tick(self) -> int:
        """Steps of the world in a tick of the robot's clock."""
        return 1 if self.unit is None else round(TICK_S / self.dt)

    @property
    def radius(self) -> float:
        """Of the disc about its axle's middle in which the body fits (m)."""
        corners = self.body.get("outline_m")
        return float(self.body["radius"]) if corners is None else max(math.hypot(*corner) for corner in corners)

    @property
    def _open(self) -> Any:
        """The C model, while it may still grow: worlds have room for what it was when they were made."""
        if self.in_use:
            raise RobotError(
                "vehicle: worlds of this model exist; expected all of its devices before the first of them"
            )
        return self.handle

    def check_drive(self, who: str = "vehicle") -> None:
        """Raises RobotError where it has no drive, or steps at the Euler limit of it or beyond."""
        if not self.handle.drive:
            raise RobotError(f"{who}: the model has no drive; expected dc_motors, regulated_motors or servos")
        if not self.dt < self.euler_limit:
            expected = f"expected less than {self.euler_limit:.4g} s, the Euler limit of its drive and body"
            raise RobotError(f"{who}: dt = {self.dt:g} s; {expected}")

    # ---- drives ------------------------------------------------------------------------------------------------------

    def dc_motors(
        self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None, *, full: bool = False
    ) -> None:
        """Two DC motors; what is not said is as in the notes' default motor (`DCMotor` has the keys).

        Quasi-static (1.8)-(1.10), or `full`: (1.6), (1.7) with the current as a state, see `Vehicle.currents`. The full
        motor is stable at every step at which the quasi-static one is, whatever its inductance (world/motor_dc.h).
        """
        motors = [dc_parameters(f"vehicle: {side} motor", changes) for side, changes in _sides(left, right)]
        is_full = switch("vehicle: full", full, RobotError)
        lib.vehicle_model_drive_dc(self._undriven, *motors, is_full)
        self.check_drive()

    def regulated_motors(self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None) -> None:
        """Two velocity-regulated motors (3.15): torque K (v_ref - v), limited, with v_ref = s speed_maximum_m_s.

        What is not said is as in `RegulatedMotor`, which has the keys.
        """
        motors = [regulated_parameters(f"vehicle: {side} motor", changes) for side, changes in _sides(left, right)]
        lib.vehicle_model_drive_regulated(self._undriven, *motors)
        self.check_drive()

    def servos(self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None) -> None:
        """Two continuous-rotation servos driven by signal: 1500 us +- 200 us s, mirrored on the right.

        What is not said is as in the nominal Parallax servo (`ServoMotor` has the keys), the wheel as the body's.
        """
        radius = float(self.body["wheel_radius"])
        servos = [
            servo_parameters(f"vehicle: {side} servo", changes, MOUNTS[side], radius)
            for side, changes in _sides(left, right)
        ]
        lib.vehicle_model_drive_servo(self._undriven, *servos)
        self.check_drive()

    def board_servos(self, nominal: list[Any], unit: Callable[[int], list[Any]], maps: list[Any]) -> None:
        """The two servos of a robot with a board, left and right: see `unit` and `motion_maps`."""
        lib.vehicle_model_drive_servo(self._undriven, *nominal)
        lib.vehicle_model_board(self.handle, *maps)
        self.unit, self.motion_maps = unit, maps
        self.check_drive()

    @property
    def _undriven(self) -> Any:
        """The C model, while it has no drive."""
        if self._open.drive:
            raise RobotError(
                "vehicle: it has a drive already; expected one of dc_motors, regulated_motors or servos, once"
            )
        return self.handle

    # ---- battery and sensors -----------------------------------------------------------------------------------------

    def battery(
        self, name: str, *, empty: float = 5.0, full: float = 7.75, sigma: float = 0.0, **energy: float
    ) -> None:
        """The notes' battery, read as a voltage; `energy`: idle_per_s, signal_per_s, charger_per_s."""
        where = self._named(name)
        rates = struct("energy_parameters", where, energy, ENERGY)
        if self._open.has_battery:
            raise RobotError(f"{where}: it has a battery already; expected one")
        lib.vehicle_model_battery(self.handle, rates)
        self.sensor("charge", name, empty=empty, full=full, sigma=sigma)

    def sensor(
        self, kind: str, name: str, /, *, period: float = 0.0, table: ReadingTable | None = None, **parameters: Any
    ) -> None:
        """Adds a sensor.

        Args:
            kind: as in sim_bridge/world/sensors: accelerometer, charge, compass, infrared_proximity, laser ...
            name: of its readings.
            period: s between readings; 0: in each step.
            table: it reads what is drawn from there for the distance and the angle of incidence of the nearest thing
                that its beam's rays meet (rule S3); then only its beam and its reach are given.
            parameters: the keys of the C struct KIND_parameters.

        Raises:
            RobotError: no such kind, a key that it has not, or a number outside its range.
        """
        kinds = sensor_kinds()
        where = self._named(name)
        if kind not in kinds:
            raise RobotError(f"{where}: its kind is {shown(kind)}; expected {', '.join(kinds)}")
        what = kinds[kind]
        if table is not None or kind == "table":
            parameters, what = self._by_table(where, what, table, parameters), kinds["table"]
        if period != 0.0 and not what.has_period:  # then it is a key of its struct, or of nothing
            parameters, period = {**parameters, "period": period}, 0.0
        usual = {**what.usual, **{key: self.body[key] for key in what.of_body}}
        given = struct(f"{what.name}_parameters", where, parameters, usual, what.ranges)
        if wrong := what.wrong(values_of(given)):
            raise RobotError(f"{where}: {wrong}")
        time = number(where, "period", period, NOT_NEGATIVE)
        first = lib.vehicle_model_add(self._open, ffi.addressof(getattr(lib, f"{what.name}_sensor")), given, time)
        if first == lib.VEHICLE_NO_MEMORY:
            raise RobotError(f"{where}: there is no memory for it")
        if first < 0:
            raise RobotError(f"{where} has numbers that do not fit together; expected such as its header says")
        self.names[name] = slice(first, self.readings)
        if what.reach:
            self.looks[name] = (values_of(given.beam), float(getattr(given, what.reach)))

    def _by_table(
        self, where: str, what: SensorKind, table: ReadingTable | None, given: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The parameters of a sensor of kind "table" that stands for one of kind `what`."""
        if not isinstance(table, ReadingTable):
            raise RobotError(f"{where}: table is {shown(table)}; expected a ReadingTable")
        self._keep.append(table)
        if what.name == "table":
            return {**known(where, given, ("beam", "reach", "none")), "table": table.handle}
        if not what.reach:
            raise RobotError(f"{where}: a sensor of kind {what.name} looks at nothing; expected one with a beam")
        beam = known(where, given, ("beam", what.reach)).get("beam")
        reach = number(where, what.reach, given.get(what.reach), POSITIVE)
        none = reach if what.nothing is None else what.nothing
        return {"reach": reach, "none": none, "table": table.handle} | ({} if beam is None else {"beam": beam})

    def _named(self, name: str) -> str:
        """Where messages about a new sensor of that name are from."""
        if not isinstance(name, str) or not name:
            raise RobotError(f"vehicle: a sensor's name is {shown(name)}; expected a text")
        if name in self.names:
            raise RobotError(f"vehicle: two sensors named {shown(name)}; expected different names")
        return f"vehicle: sensor {shown(name)}"
