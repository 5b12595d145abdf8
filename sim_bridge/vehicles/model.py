"""What a vehicle without a board is made of: body, drive, sensors, battery (sim_bridge/vehicles/model.h).

A `VehicleModel` is built up once; any number of worlds then share it (vehicle.py, batch.py). Parameters are those of
the C structs of the same names in sim_bridge/world; model_file.py builds a model from a robot's file. Lengths in m,
angles in rad, SI units; motor signals in [-1, 1], left and right.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from boebot.arguments import shown, switch
from boebot.errors import RobotError
from sim_bridge._core import ffi, lib
from sim_bridge.motor import dc_parameters, regulated_parameters, servo_parameters
from sim_bridge.reading_table import ReadingTable
from sim_bridge.robots.outline import collision_outline
from sim_bridge.vehicles.checked_structs import FINITE, NOT_NEGATIVE, POSITIVE, keys_of, known, number, several, struct

SENSORS_MAXIMUM: Final = 24
SIDES: Final = ("left", "right")
UNTIMED: Final = ("sharp_infrared", "odometer")  # sensors that keep their own time, or read in each step
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
    return {key: value for key, value in body.items() if key != "outline_m"} | {"outline": outline}, outline


class VehicleModel:
    """What a vehicle is made of; any number of worlds share one.

    Parameters are those of the C structs of the same names in sim_bridge/world; a wrong one raises RobotError, which
    says which key, what it was and what was expected.

    Attributes:
        names: readings by name: where they stand among all readings.
        looks: sensors with a beam by name: the beam, and how far it reaches (m).
        a: A of (2.26), 1/m.
        b: B of (2.30).
    """

    def __init__(
        self, body: Mapping[str, Any], *, dt: float = 0.01, noise: bool = True, ends_at_collision: bool = True
    ) -> None:
        """A body (C struct body_parameters), which steps by `dt` seconds; drive and sensors are added to it.

        `outline_m` in it, corners (x, y) in m around the axle's middle, is its collision outline instead of a circle.
        """
        given, outline = _body_and_outline(body)
        parameters = struct("body_parameters", "vehicle: body", given)
        self.dt = number("vehicle", "dt", dt, POSITIVE)
        switches = (
            switch("vehicle: noise", noise, RobotError),
            switch("vehicle: ends_at_collision", ends_at_collision, RobotError),
        )
        self.names: dict[str, slice] = {}
        self.looks: dict[str, tuple[Mapping[str, float], float]] = {}
        self.body = dict(body)
        self.in_use = False
        self._keep: list[Any] = [given, outline]  # what the model in C points to
        handle = lib.vehicle_model_new(parameters, self.dt)
        if handle == ffi.NULL:
            raise RobotError("vehicle: there is no memory for a model")
        self.a: float = lib.body_a(parameters)
        self.b: float = lib.body_b(parameters)
        self.handle = ffi.gc(handle, lib.vehicle_model_destroy)
        lib.vehicle_model_switch(self.handle, *switches)

    @property
    def euler_limit(self) -> float:
        """The step, s, from which on Euler's method diverges."""
        return float(lib.vehicle_model_euler_limit(self.handle))

    @property
    def _open(self) -> Any:
        """The C model, while it may still grow: worlds have room for what it was when they were made."""
        if self.in_use:
            raise RobotError(
                "vehicle: worlds of this model exist; expected all of its devices before the first of them"
            )
        return self.handle

    def bad_step(self) -> RobotError:
        """Of a model that steps at its drive's Euler limit or beyond."""
        limit = lib.vehicle_model_euler_limit(self.handle)
        return RobotError(
            f"vehicle: dt = {self.dt:g} s; expected less than {limit:.4g} s, the Euler limit of its drive and body"
        )

    # ---- drives ------------------------------------------------------------------------------------------------------

    def dc_motors(
        self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None, *, full: bool = False
    ) -> None:
        """Two DC motors; what is not said is as in the notes' default motor (`DCMotor` has the keys).

        Quasi-static (1.8)-(1.10), or `full`: (1.6), (1.7) with the current as a state, see `Vehicle.currents`. The full
        motor is stable at every step at which the quasi-static one is, whatever its inductance (world/motor_dc.h).
        """
        motors = [dc_parameters(f"vehicle: {side} motor", changes) for side, changes in _sides(left, right)]
        self._driven(lib.vehicle_model_drive_dc(self._open, *motors, switch("vehicle: full", full, RobotError)))

    def regulated_motors(self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None) -> None:
        """Two velocity-regulated motors (3.15): torque K (v_ref - v), limited, with v_ref = s speed_maximum_m_s.

        What is not said is as in `RegulatedMotor`, which has the keys.
        """
        motors = [regulated_parameters(f"vehicle: {side} motor", changes) for side, changes in _sides(left, right)]
        self._driven(lib.vehicle_model_drive_regulated(self._open, *motors))

    def servos(self, left: Mapping[str, Any] | None = None, right: Mapping[str, Any] | None = None) -> None:
        """Two continuous-rotation servos driven by signal: 1500 us +- 200 us s, mirrored on the right.

        What is not said is as in the nominal Parallax servo (`ServoMotor` has the keys), the wheel as the body's.
        """
        radius = float(self.body["wheel_radius"])
        servos = [
            servo_parameters(f"vehicle: {side} servo", changes, MOUNTS[side], radius)
            for side, changes in _sides(left, right)
        ]
        self._driven(lib.vehicle_model_drive_servo(self._open, *servos))

    def _driven(self, status: int) -> None:
        if status == lib.VEHICLE_TOO_MANY:
            raise RobotError(
                "vehicle: it has a drive already; expected one of dc_motors, regulated_motors or servos, once"
            )
        if status == lib.VEHICLE_BAD_STEP:
            raise self.bad_step()
        if status:
            raise RobotError("vehicle: the drive's numbers are outside of what arithmetic holds; expected usual ones")

    # ---- battery and sensors -----------------------------------------------------------------------------------------

    def battery(
        self, name: str, *, empty: float = 5.0, full: float = 7.75, sigma: float = 0.0, **energy: float
    ) -> None:
        """The notes' battery, read as a voltage; `energy`: idle_per_s, signal_per_s, charger_per_s."""
        where = self._named(name)
        usual = ffi.new("energy_parameters *")
        lib.energy_default(usual)
        values = {key: getattr(usual, key) for key in keys_of("energy_parameters")}
        low, high = number(where, "empty", empty), number(where, "full", full)
        if not low < high:
            raise RobotError(f"{where}: full is {shown(full)}; expected more than empty, {low:g}")
        spread = number(where, "sigma", sigma, NOT_NEGATIVE)
        rates = struct("energy_parameters", where, energy, values)
        first = lib.vehicle_model_battery(self._open, rates, low, high, spread)
        if first == lib.VEHICLE_TOO_MANY:
            raise RobotError(f"{where}: it has a battery already; expected one")
        self._add(name, where, first)

    def _named(self, name: str) -> str:
        """Where messages about a new sensor of that name are from."""
        if not isinstance(name, str) or not name:
            raise RobotError(f"vehicle: a sensor's name is {shown(name)}; expected a text")
        if name in self.names:
            raise RobotError(f"vehicle: two sensors named {shown(name)}; expected different names")
        if len(self.names) >= SENSORS_MAXIMUM:
            raise RobotError(f"vehicle: no room for sensor {shown(name)}; expected at most {SENSORS_MAXIMUM}")
        return f"vehicle: sensor {shown(name)}"

    def _add(self, name: str, where: str, first: int, count: int = 1) -> None:
        if first < 0:
            raise RobotError(f"{where} has numbers that do not fit together; expected such as its header says")
        self.names[name] = slice(first, first + count)

    def _sensor(
        self,
        kind: str,
        name: str,
        given: Mapping[str, Any],
        usual: Mapping[str, Any] | None = None,
        period: float = 0.0,
        reach: str = "",
    ) -> None:
        """Adds a sensor of a C kind. `reach`: the key that says how far it looks."""
        where = self._named(name)
        parameters = struct(f"{kind}_parameters", where, given, usual)
        times = [] if kind in UNTIMED else [number(where, "period", period, NOT_NEGATIVE)]
        first = getattr(lib, f"vehicle_model_add_{kind}")(self._open, parameters, *times)
        if kind == "laser" and first == lib.VEHICLE_TOO_MANY:
            raise RobotError(f"{where}: it has a laser already; expected one")
        counts = {"laser": parameters.rays if kind == "laser" else 1, "odometer": 3}
        self._add(name, where, first, counts.get(kind, 1))
        if reach:
            self._looks(name, parameters.beam, getattr(parameters, reach))

    def _looks(self, name: str, look: Any, reach: float) -> None:
        self.looks[name] = ({key: getattr(look, key) for key in keys_of("beam_parameters")}, float(reach))

    def infrared_proximity(
        self, name: str, *, period: float = 0.0, table: ReadingTable | None = None, **parameters: Any
    ) -> None:
        """The notes' IR sensor: beam, range, c1, c2, sigma, reflectance. One reading in [0, 1].

        With a `table`: beam and range; what it reads is drawn from there instead, 0 beyond the range.
        """
        if table is None:
            self._sensor("infrared_proximity", name, parameters, None, period, "range")
        else:
            self._by_table(name, table, parameters, "range", 0.0, period)

    def sonar(self, name: str, *, period: float = 0.0, table: ReadingTable | None = None, **parameters: Any) -> None:
        """Sonar: beam, range_minimum, range_maximum, sigma, miss, ... One reading, m; D_max: nothing heard.

        With a `table`: beam and range_maximum; what it reads is drawn from there instead.
        """
        if table is None:
            self._sensor("sonar", name, parameters, None, period, "range_maximum")
        else:
            self._by_table(name, table, parameters, "range_maximum", None, period)

    def _by_table(
        self, name: str, table: ReadingTable, given: Any, reach: str, none: float | None, period: float
    ) -> None:
        """Adds a table of a sensor whose key for its range is `reach`, which it also reads where `none` is None."""
        where = self._named(name)
        known(where, given, ("beam", reach))
        far = number(where, reach, given.get(reach), POSITIVE)
        self.table(name, table, beam=given.get("beam"), reach=far, none=far if none is None else none, period=period)

    def table(self, name: str, table: ReadingTable, *, period: float = 0.0, **parameters: Any) -> None:
        """A sensor known by its table of readings (rule S3): beam, reach, none. One reading, drawn from the table.

        It is that for the distance and the angle of incidence of the nearest thing that the beam's rays meet within
        `reach` (m), and `none` (0 unless said) where there is nothing.
        """
        where = self._named(name)
        if not isinstance(table, ReadingTable):
            raise RobotError(f"{where}: table is {shown(table)}; expected a ReadingTable")
        given = {"beam": None, "reach": None, "none": 0.0} | known(where, parameters, ("beam", "reach", "none"))
        look = struct("beam_parameters", f"{where}: beam", given["beam"])
        far, free = number(where, "reach", given["reach"], POSITIVE), number(where, "none", given["none"], FINITE)
        time = number(where, "period", period, NOT_NEGATIVE)
        first = lib.vehicle_model_add_table(self._open, look, table.handle, far, free, time)
        self._keep.append(table)
        self._add(name, where, first)
        self._looks(name, look, far)

    def sharp_infrared(self, name: str, **parameters: Any) -> None:
        """Sharp GP2D12: beam, reach, sigma, gain, period, late. One reading, V."""
        self._sensor("sharp_infrared", name, parameters, {"gain": 1.0}, reach="reach")

    def laser(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Laser range finder: first, step, rays, range, sigma, height, ... A reading a ray, m; -1: beyond the range.

        Ray i looks along heading + first + i step, counter-clockwise as all angles (3.10): a fan about the heading has
        first = -step (rays - 1) / 2, and its readings go from right to left.
        """
        self._sensor("laser", name, parameters, None, period)

    def compass(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Compass: sigma, bias, iron_x, iron_y, current_x, current_y. One reading, rad."""
        self._sensor("compass", name, parameters, None, period)

    def accelerometer(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Accelerometer along the heading: mass, stiffness, damping, range, sigma, bias. One reading, m/s^2."""
        self._sensor("accelerometer", name, parameters, None, period)

    def light(self, name: str, *, period: float = 0.0, **parameters: Any) -> None:
        """Phototransistor: x, y, heading, height, near_distance, ambient, sigma, gain. One reading."""
        self._sensor("phototransistor", name, parameters, {"gain": 1.0}, period)

    def odometer(self, name: str, **parameters: Any) -> None:
        """Odometer: sigma_step, factor_left, ...; half_track and wheel_radius as the body's. Reads x, y, heading."""
        usual = {key: self.body[key] for key in ("half_track", "wheel_radius")}
        self._sensor("odometer", name, parameters, usual | {"factor_left": 1.0, "factor_right": 1.0})

    def whisker(self, name: str, root: tuple[float, float], tip: tuple[float, float]) -> None:
        """A whisker from `root` to `tip` on the body. One reading: 1 while it touches something."""
        where = self._named(name)
        ends = (*several(where, "root", root, ("x", "y")), *several(where, "tip", tip, ("x", "y")))
        if ends[:2] == ends[2:]:
            raise RobotError(f"{where}: tip is where root is; expected a whisker that has a length")
        self._add(name, where, lib.vehicle_model_add_whisker(self._open, *ends))
