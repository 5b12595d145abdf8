"""What a built robot is like: its body and tyres, and one robot drawn from the spreads of its devices by seed.

What each device does not do ideally is in its file in sim_bridge/devices. Sources are named beside the values:
"data" is a manufacturer's or published measurement, "chosen" is ours and to be measured. Without noise every part is
nominal; what else can be switched off, and by which name, is in switches.py.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

from boebot.description import robots
from sim_bridge._core import ffi, lib
from sim_bridge.devices import catalogue
from sim_bridge.robots import switches

SPIN_INERTIA_KG_M2 = 4e-4  # of a slipping wheel: the servo's rotor behind its gear of about 1:250 (chosen)
TYRE_SLIP = 1  # beyond that coefficient they slip; 0: wheels always roll
TYRE_GRIP = 0.7  # friction coefficient of a rubber tyre, along and across (chosen)


@cache
def parameters() -> dict[str, Any]:
    """All parameters of body and devices, by name."""
    own = {"SPIN_INERTIA_KG_M2": SPIN_INERTIA_KG_M2, "TYRE_SLIP": TYRE_SLIP, "TYRE_GRIP": TYRE_GRIP}
    return own | catalogue.parameters()


_DRAW = 1000  # the draws that make a robot have other device numbers


class Draw:
    """Draws one robot's peculiarities: always the same ones for the same unit and device; of a robot that says no unit,
    for the same seed, robot and device. `draw["SERVO_LAG_S"]` is a parameter as this robot has it."""

    def __init__(
        self, seed: int, noise: bool, robot: int = 0, unit: int | None = None, without: Iterable[str] = ()
    ) -> None:
        """`unit`: the robot's serial number, whose peculiarities no seed changes; 0: nominal throughout. `without`:
        names of switches.py.

        Raises:
            BoardError: there is no such name.
        """
        self._neutral = switches.neutral(without)
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

    def own(self, name: str, given: float | None) -> float:
        """The same, `given` by a robot itself unless that is None."""
        return self[name] if given is None or name in self._neutral else given

    def __getitem__(self, name: str) -> float:
        """A parameter of the body or of a device, or its neutral value if what it belongs to is switched off."""
        value: float = self._neutral.get(name, parameters()[name])
        return value


AS_BUILT = Draw(0, noise=False)
"""Nothing is drawn, and nothing switched off."""


def body_parameters(body: robots.Body, draw: Draw = AS_BUILT, outline: Any = ffi.NULL) -> Any:
    """The body in C. `outline`: its collision outline in C, which must outlive what is made of it; NULL: a circle."""
    tyres = {
        "grip": draw.own("TYRE_GRIP", body.tyre_grip),
        "spin_inertia": SPIN_INERTIA_KG_M2,
        "slip": int(draw.own("TYRE_SLIP", body.tyre_slip)),
    }
    return ffi.new("body_parameters *", body_numbers(body) | {"outline": outline} | tyres)


def body_numbers(body: robots.Body) -> dict[str, float]:
    """Masses, lengths and damping of the body, by their names in C (SI units)."""
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
    }
