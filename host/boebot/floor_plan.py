"""A floor plan: what stands in an arena and what moves in it, as the simulator tells it for pictures after a run.

Lengths in m, angles in rad, x to the right, y up; arrays of points have the shape (points, 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

LOOKED_OVER_M = 0.10  # the highest sensor, a laser, sits so high: what is lower is not seen by all of them


@dataclass(frozen=True, kw_only=True)
class Solid:
    """What keeps robots out, or, as an outline, in.

    Attributes:
        kind: "outline", "obstacle", "wall" or "disc"; a moving shape is an obstacle or a disc in its own frame.
        points: corners of a polygon, in which the last joins the first; ends and bends of a wall; a disc's centre.
        radius: of a disc.
        height: of its top above the floor.
        infrared_reflectance, sound_reflectance: shares that come back, 0 to 1.
    """

    kind: Literal["outline", "obstacle", "wall", "disc"]
    points: Floats
    radius: float = 0.0
    name: str = ""
    height: float = math.inf
    infrared_reflectance: float = 1.0
    sound_reflectance: float = 1.0

    @property
    def is_low(self) -> bool:
        """Some sensors look over it."""
        return self.height < LOOKED_OVER_M

    @property
    def is_dull(self) -> bool:
        """It throws back less than a white, hard wall."""
        return self.infrared_reflectance < 1.0 or self.sound_reflectance < 1.0

    @property
    def remarks(self) -> list[str]:
        """What of it cannot be seen from above, in words: a low height, reflectances."""
        said = [f"{self.height * 100:g} cm high"] if self.is_low else []
        if self.infrared_reflectance < 1.0:
            said.append(f"IR {self.infrared_reflectance:.0%}")
        if self.sound_reflectance < 1.0:
            said.append(f"sound {self.sound_reflectance:.0%}")
        return said

    def placed(self, x: float, y: float, heading: float) -> Solid:
        """The solid with its frame at a pose."""
        cosine, sine = math.cos(heading), math.sin(heading)
        turned = self.points @ np.array([[cosine, sine], [-sine, cosine]])
        return replace(self, points=turned + np.array((x, y)))

    @property
    def box(self) -> tuple[Floats, Floats]:
        """Lower left and upper right corner."""
        return self.points.min(axis=0) - self.radius, self.points.max(axis=0) + self.radius


@dataclass(frozen=True, kw_only=True)
class Moving:
    """A solid on its way: its frame's pose at each time, straight and even between them."""

    solid: Solid
    time: Floats  # s, on the clock of the truth
    x: Floats
    y: Floats
    heading: Floats  # not wrapped

    def pose(self, time: float) -> tuple[float, float, float]:
        """x, y, heading at a time; before the first and after the last one it stands."""
        x, y, heading = (float(np.interp(time, self.time, row)) for row in (self.x, self.y, self.heading))
        return x, y, heading

    def at(self, time: float) -> Solid:
        """The solid where it is then."""
        return self.solid.placed(*self.pose(time))


@dataclass(frozen=True, kw_only=True)
class Patch:
    """A part of the floor with another friction coefficient."""

    corners: Floats
    grip: float
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Lamp:
    """A lamp and its power (W)."""

    x: float
    y: float
    height: float
    power: float
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Charger:
    """A charging station: a disc on the floor."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, kw_only=True)
class FloorPlan:
    """An arena from above; `grip`: of tyres on the floor outside of all patches."""

    name: str = "arena"
    title: str = ""
    solids: Sequence[Solid] = field(default=(), repr=False)
    patches: Sequence[Patch] = field(default=(), repr=False)
    lamps: Sequence[Lamp] = field(default=(), repr=False)
    charger: Charger | None = None
    moving: Sequence[Moving] = field(default=(), repr=False)
    grip: float = 0.7

    @property
    def outlines(self) -> list[Solid]:
        """Within these the robots are; none in an open field."""
        return [solid for solid in self.solids if solid.kind == "outline"]

    @property
    def obstacles(self) -> list[Solid]:
        """What stands within."""
        return [solid for solid in self.solids if solid.kind != "outline"]
