"""What a built robot is like: its body and tyres, and one robot drawn from the spreads of its devices by seed.

What each device does not do ideally is in its file in sim_bridge/devices; all of it is one table,
docs/reference/imperfections.md, with the sources. Without noise every part is nominal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import msgspec

from boebot.arguments import shown
from boebot.description import robots
from boebot.description.outlines import polygon_fault
from boebot.description.robots import idle
from boebot.errors import BoardError, RobotError
from boebot.imperfections import checked, imperfections, switched_off
from sim_bridge.compiled import ffi, lib

_DRAW = 1000  # the draws that make a robot have other device numbers


class Draw:
    """Draws one robot's peculiarities: always the same ones for the same unit and device; of a robot that says no unit,
    for the same seed, robot and device. `draw["servo_lag_s"]` is a magnitude as this robot has it.

    Attributes:
        used: names of the magnitudes that were asked for.
    """

    def __init__(
        self,
        seed: int,
        noise: bool,
        robot: int = 0,
        unit: int | None = None,
        magnitudes: Mapping[str, float] | None = None,
    ) -> None:
        """`unit`: the robot's serial number, whose peculiarities no seed changes; 0: nominal throughout. `magnitudes`:
        those that are not as in the table."""
        self._magnitudes = magnitudes or {}
        self.used: set[str] = set()
        self._seed, self.noise, self._robot, self._unit = seed & (2**64 - 1), noise, robot, unit

    def __call__(self, device: int, what: int) -> float:
        """Standard normal; 0 without noise."""
        if not self.noise:
            return 0.0
        if self._unit is not None:
            kept: float = lib.unit_normal(self._unit, _DRAW + device, what)
            return kept
        value: float = lib.noise_normal(self._seed, self._robot, _DRAW + device, what)
        return value

    def __getitem__(self, name: str) -> float:
        """A magnitude of the table, or what this robot has in its place."""
        self.used.add(name)
        usual = imperfections()[name].value
        assert usual is not None, "a robot's file has it"
        return self._magnitudes.get(name, usual)


AS_BUILT = Draw(0, noise=False)
"""Nothing is drawn, and everything as in the table."""


def applied(
    robot: robots.RobotDescription, without: Sequence[str] = (), given: Any = None, *, noise: bool = True
) -> robots.RobotDescription:
    """The robot as a run wants it. Neutral values of what is switched off, and the magnitudes in `given`, replace the
    robot's values in its devices, body, supply and `imperfections`.

    Raises:
        BoardError: there is no such name; a magnitude is out of its range, is switched off as well, or changes nothing
            of this robot.
    """
    if isinstance(without, str) or not all(isinstance(name, str) for name in without):
        raise BoardError(f"without is {shown(without)}; expected a list of names")
    table = imperfections()
    off, asked = switched_off(without), checked({} if given is None else given)
    for name in asked.keys() & off.keys():
        by = table[name].switch if table[name].switch in without else name
        raise BoardError(
            f"imperfections: {name} is {asked[name]:g}, but without {by} makes it {off[name]:g}; expected one of them"
        )
    values = off | asked
    changed = msgspec.structs.replace(
        robot,
        body=_replaced("body", robot.body, values),
        supply=_replaced("supply", robot.supply, values),
        device={name: _replaced(str(one.__struct_config__.tag), one, values) for name, one in robot.device.items()},
        imperfections=robot.imperfections | {name: value for name, value in values.items() if not table[name].key},
    )
    for name in asked:
        if fault := idle(name, changed, noise=noise):
            near = [row.name for row in table.values() if row.switch and row.switch == table[name].switch]
            others = [other for other in near if not idle(other, changed, noise=noise)]
            hint = f"; expected {' or '.join(others)}" if others else ""
            raise BoardError(f"imperfections: {name} changes nothing: {fault}{hint}")
    return changed


def _replaced(owner: str, struct: Any, values: Mapping[str, float]) -> Any:
    """A table or device of a robot's description with those of the values that belong to it."""
    rows = [row for name in values if owner in (row := imperfections()[name]).of and row.key]
    return msgspec.structs.replace(struct, **{row.key: values[row.name] for row in rows}) if rows and struct else struct


def body_parameters(body: robots.Body, draw: Draw = AS_BUILT, outline: Any = ffi.NULL) -> Any:
    """The body in C. `outline`: its collision outline in C, which must outlive what is made of it; NULL: a circle."""
    tyres = {
        "spin_inertia": draw["spin_inertia_kg_m2"],
        "slip": 1 if body.tyre_slip is None else int(body.tyre_slip),
    }
    return ffi.new("body_parameters *", body_numbers(body) | {"outline": outline} | tyres)


def body_numbers(body: robots.Body) -> dict[str, float]:
    """Masses, lengths, damping and grip of the body, by their names in C (SI units)."""
    return {
        "mass": body.mass_kg,
        "inertia": body.inertia_kg_m2,
        "radius": body.radius_m,
        "half_track": body.track_width_m / 2,
        "wheel_radius": body.wheel_radius_m,
        "wheel_mass": body.wheel_mass_kg,
        "wheel_inertia": body.wheel_inertia_kg_m2,
        "linear_damping": body.linear_damping_n_s_m,
        "angular_damping": body.angular_damping_n_m_s,
        "grip": AS_BUILT["tyre_grip"] if body.tyre_grip is None else body.tyre_grip,
    }


# ---- its collision outline -------------------------------------------------------------------------------------------

CORNERS_MAXIMUM: Final[int] = lib.BODY_CORNERS_MAXIMUM


def collision_outline(where: str, corners: Sequence[Sequence[float]]) -> Any:
    """The outline in C of `corners`, (x, y) in m in the body's frame, around the axle's middle; it must outlive bodies.

    Raises:
        RobotError: it is no such polygon; `where` says whose.
    """
    try:
        points = [(float(x), float(y)) for x, y in corners]
    except (TypeError, ValueError, OverflowError):
        raise RobotError(f"{where}: expected a list of corners [x, y] in m") from None
    fault = polygon_fault(points, CORNERS_MAXIMUM)
    if fault:
        raise RobotError(f"{where}{fault}")
    outline = ffi.new("body_outline *")
    if lib.body_outline_make(outline, [value for point in points for value in point], len(points)) != lib.OUTLINE_OK:
        raise RobotError(f"{where}: a place of it is narrower than 0.4 mm; expected room for a core")
    return outline
