"""A caller's keywords, checked, as C structs of sim_bridge/world; an error is one sentence.

Which keys a struct has is read from its C declaration; what a key may be is in `RANGES`, beside what several keys
must be. Every message says where, which key, what it was and what was expected.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from boebot.arguments import real, shown
from boebot.errors import RobotError
from sim_bridge.compiled import ffi

LIMIT: Final = 1e12  # of any number: products of some of them stay finite


@dataclass(frozen=True)
class Range:
    """What a number may be: from `low` to `high`, `low` itself not if `above`; or one of `choices`."""

    low: float = -LIMIT
    high: float = LIMIT
    above: bool = False
    choices: tuple[float, ...] = ()

    def __contains__(self, value: float) -> bool:
        if self.choices:
            return value in self.choices
        return (value > self.low if self.above else value >= self.low) and value <= self.high

    def text(self, whole: bool = False) -> str:
        """As it is shown in a message."""
        if self.choices:
            return " or ".join(f"{choice:g}" for choice in self.choices)
        kind = "a whole number" if whole else "a number"
        if self.low > -LIMIT and self.high < LIMIT:
            return f"{kind} {'more than' if self.above else 'from'} {self.low:g} {'up ' * self.above}to {self.high:g}"
        if self.low > -LIMIT:
            return f"{kind} {'more than' if self.above else 'of at least'} {self.low:g}"
        return "a whole number" if whole else "a finite number"


FINITE: Final = Range()
POSITIVE: Final = Range(0.0, above=True)
NOT_NEGATIVE: Final = Range(0.0)
SHARE: Final = Range(0.0, 1.0)
SWITCH: Final = Range(choices=(0, 1))
SIDE: Final = Range(choices=(1, -1))
PULSE_US: Final = Range(500.0, 2500.0)
TURN: Final = Range(-2 * math.pi, 2 * math.pi)
HEADING: Final = Range(-1e4, 1e4)

RANGES: Final[Mapping[str, Mapping[str, Range]]] = {
    "body_parameters": dict.fromkeys(("mass", "inertia", "radius", "half_track", "wheel_radius"), POSITIVE)
    | dict.fromkeys(("axis_half_track", "wheel_mass", "wheel_inertia", "spin_inertia"), NOT_NEGATIVE)
    | dict.fromkeys(("linear_damping", "angular_damping", "grip"), NOT_NEGATIVE)
    | {"slip": SWITCH},
    "motor_dc_parameters": dict.fromkeys(
        ("torque_constant", "emf_constant", "inductance_h", "coulomb_n_m", "viscous_n_m_s"), NOT_NEGATIVE
    )
    | dict.fromkeys(("torque_maximum_n_m", "voltage_maximum"), NOT_NEGATIVE)
    | {"resistance_ohm": POSITIVE, "gear": POSITIVE, "efficiency": Range(0.0, 1.0, above=True)},
    "motor_regulated_parameters": {"gain_n_s": POSITIVE}
    | dict.fromkeys(("torque_maximum_n_m", "coast_n_s", "coast_maximum_n_m", "speed_maximum_m_s"), NOT_NEGATIVE),
    "servo_motor_parameters": {"mount": SIDE, "wheel_radius": POSITIVE, "centre_us": PULSE_US}
    | dict.fromkeys(("scale_ccw_us", "scale_cw_us"), POSITIVE)
    | dict.fromkeys(("dead_band_us", "top_ccw_rad_s", "top_cw_rad_s", "lag_s"), NOT_NEGATIVE),
    "motor_position_parameters": {"mount": SIDE, "centre_us": PULSE_US}
    | dict.fromkeys(("us_per_rad", "gain_per_s", "range_rad"), POSITIVE)
    | dict.fromkeys(("top_speed_rad_s", "dead_band_us"), NOT_NEGATIVE),
    "energy_parameters": dict.fromkeys(("idle_per_s", "signal_per_s", "charger_per_s"), NOT_NEGATIVE),
    "beam_parameters": {"heading": HEADING, "opening": Range(0.0, math.pi), "rays": Range(1, 32)},
}


def number(where: str, key: str, value: Any, allowed: Range = FINITE, whole: bool = False) -> float:
    """`value` as a float within `allowed`; raises RobotError if it is none."""
    found = real(value)
    if not math.isfinite(found) or found not in allowed or (whole and not found.is_integer()):
        raise RobotError(f"{where}: {key} is {shown(value)}; expected {allowed.text(whole)}")
    return found


def several(where: str, key: str, value: Any, names: Sequence[str], allowed: Range = FINITE) -> tuple[float, ...]:
    """As many numbers as there are `names`; raises RobotError if they are not."""
    try:
        found = None if isinstance(value, str | bytes | Mapping) else tuple(value)
    except TypeError:
        found = None
    if found is None or len(found) != len(names):
        raise RobotError(f"{where}: {key} is {shown(value)}; expected {len(names)} numbers, {', '.join(names)}")
    return tuple(number(where, f"{key}: {name}", part, allowed) for name, part in zip(names, found, strict=True))


def known(where: str, given: Any, keys: Iterable[str]) -> dict[str, Any]:
    """`given`, if it is a mapping of these keys; raises RobotError if it is not."""
    names = list(keys)
    if not isinstance(given, Mapping):
        raise RobotError(f"{where} is {shown(given)}; expected a mapping with keys of {', '.join(names)}")
    for key in given:
        if key not in names:
            raise RobotError(f"{where}: there is no key {shown(key)}; expected {', '.join(names)}")
    return dict(given)


def struct(
    kind: str,
    where: str,
    given: Any,
    usual: Mapping[str, Any] | None = None,
    ranges: Mapping[str, Range] | None = None,
) -> Any:
    """A pointer to a new C struct `kind`: what is not `given` is as `usual`, or else 0.

    `ranges`: what its keys may be, of a struct that is not in `RANGES`.

    Raises:
        RobotError: a key that the struct has not, that is missing or outside its range.
    """
    values = _values(kind, where, "", given, usual or {}, RANGES[kind] if ranges is None else ranges)
    try:
        return ffi.new(f"{kind} *", values)
    except TypeError:  # the numbers fit by now: it is a pointer that does not
        wrong = [key for key, field in ffi.typeof(kind).fields if field.type.kind == "pointer" and key in values]
        what = f"{wrong[0]} is {shown(values[wrong[0]])}; expected a pointer to its C struct"
        raise RobotError(f"{where}: {what}") from None


def keys_of(kind: str) -> list[str]:
    """The keys of a C struct."""
    return [name for name, _ in ffi.typeof(kind).fields]


def values_of(struct: Any) -> dict[str, Any]:
    """What a C struct holds, by key; pointers are left out."""
    kind = ffi.typeof(struct)
    fields = (kind.item if kind.kind == "pointer" else kind).fields
    found = {key: getattr(struct, key) for key, field in fields if field.type.kind != "pointer"}
    return {key: values_of(value) if isinstance(value, ffi.CData) else value for key, value in found.items()}


def _values(
    kind: str, where: str, inside: str, given: Any, usual: Mapping[str, Any], ranges: Mapping[str, Range]
) -> dict[str, Any]:
    """What to initialise the struct with. `inside`: "beam." for the keys of a struct within one."""
    known(f"{where}: {inside[:-1]}" if inside else where, given, keys_of(kind))
    values: dict[str, Any] = {}
    for key, field in ffi.typeof(kind).fields:
        allowed = ranges.get(key, FINITE)
        if key not in given and key not in usual:
            if field.type.kind == "struct" or (field.type.kind == "primitive" and 0 not in allowed):
                raise RobotError(f"{where}: the key '{inside}{key}' is missing; expected {_wanted(field, allowed)}")
            continue
        value = given[key] if key in given else usual[key]
        if field.type.kind == "struct":
            below = usual.get(key, {}) if key in given else {}
            values[key] = _values(field.type.cname, where, f"{inside}{key}.", value, below, RANGES[field.type.cname])
        elif field.type.kind == "pointer":
            values[key] = ffi.NULL if value is None else value
        else:
            found = number(where, inside + key, value, allowed, whole=_is_whole(field))
            values[key] = int(found) if _is_whole(field) else found
    return values


def _wanted(field: Any, allowed: Range) -> str:
    if field.type.kind == "struct":
        return f"a mapping, {', '.join(keys_of(field.type.cname))}"
    return allowed.text(_is_whole(field))


def _is_whole(field: Any) -> bool:
    return field.type.cname not in ("double", "float")
