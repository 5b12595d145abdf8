"""What the tests of body and contact share: parameter sets, one body or several, moved by torques in an arena."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import shapely

from boebot.arenas import Arena
from sim_bridge.compiled import ffi, lib
from sim_bridge.tests.simulated import arena_of

Points = Sequence[tuple[float, float]]

RADIUS = 0.07
# A Boe-Bot of 0.6 kg (docs/reference/notes.md).
BOE_BOT: dict[str, Any] = {
    "mass": 0.60,
    "inertia": 1.2e-3,
    "radius": RADIUS,
    "half_track": 0.0525,
    "wheel_radius": 0.0333,
    "wheel_mass": 0.03,
    "wheel_inertia": 1.7e-5,
    "linear_damping": 1.0,
    "angular_damping": 0.004,
    "grip": 0.7,
    "slip": 1,
}
# The default robot of the notes' simulator.
ARSIM: dict[str, Any] = {
    "mass": 3.0,
    "inertia": 0.2,
    "radius": 0.2,
    "half_track": 0.2,
    "wheel_radius": 0.1,
    "wheel_mass": 0.0,
    "wheel_inertia": 0.0,
    "linear_damping": 1.0,
    "angular_damping": 0.1,
    "grip": 0.7,
    "slip": 1,
}
# A chassis with its wheels beside it: ten corners, two of them inward on each side.
CHASSIS: list[tuple[float, float]] = [
    (-0.09, -0.04), (-0.035, -0.04), (-0.035, -0.06), (0.035, -0.06), (0.035, -0.04), (0.05, -0.04),
    (0.05, 0.04), (0.035, 0.04), (0.035, 0.06), (-0.035, 0.06), (-0.035, 0.04), (-0.09, 0.04),
]  # fmt: skip


def outline_of(corners: Points) -> Any:
    """A collision outline; its C struct."""
    outline = ffi.new("body_outline *")
    flat = [float(value) for corner in corners for value in corner]
    status = lib.body_outline_make(outline, flat, len(corners))
    assert status == lib.OUTLINE_OK, status
    return outline


class Body:
    """A body in an arena, moved by torques."""

    def __init__(
        self,
        arena: Arena | None = None,
        parameters: dict[str, Any] = BOE_BOT,
        corners: Points | None = None,
        robot: int = 1,
        **changes: Any,
    ) -> None:
        self.corners = corners
        self.outline = ffi.NULL if corners is None else outline_of(corners)
        self.parameters = ffi.new("body_parameters *", {**parameters, "outline": self.outline, **changes})
        self.arena = arena_of() if arena is None else arena
        self.scene = ffi.new("scene *", {"arena": self.arena.handle})
        self.body = ffi.new("body *")
        lib.body_init(self.body, self.parameters, 0.12)
        self.body.id = robot

    @property
    def state(self) -> Any:
        return self.body.state

    @property
    def pose(self) -> tuple[float, float, float]:
        s = self.state
        return s.x, s.y, s.heading

    @property
    def velocity(self) -> tuple[float, float]:
        """In the arena's frame, m/s."""
        s = self.state
        return s.speed * s.cosine - s.lateral * s.sine, s.speed * s.sine + s.lateral * s.cosine

    def place(self, x: float, y: float, heading: float, speed: float = 0.0, turn_rate: float = 0.0) -> None:
        lib.body_place(self.body, x, y, heading)
        self.state.speed, self.state.turn_rate = speed, turn_rate
        half = self.parameters.half_track
        self.state.rim_left, self.state.rim_right = speed - half * turn_rate, speed + half * turn_rate

    def advance(self, left: float, right: float, dt: float = 0.001, steps: int = 1) -> None:
        for _ in range(steps):
            lib.body_step([self.body], 1, self.scene, [[left, right]], dt)

    def regulate(
        self, reference: Callable[[float], tuple[float, float]], gain: float, seconds: float, dt: float
    ) -> None:
        """Wheel speeds by (3.15), as the wheels have them."""
        for step in range(round(seconds / dt)):
            left, right = reference(step * dt)
            self.advance(gain * (left - self.state.rim_left), gain * (right - self.state.rim_right), dt)

    @property
    def energy(self) -> float:
        """Kinetic, wheels included (J): a wheel that may slip turns with the rotor behind its gear (body.h)."""
        s, p = self.state, self.parameters
        v, w, half = s.speed, s.turn_rate, p.half_track
        rims = (s.rim_left, s.rim_right) if s.slipping else (v - half * w, v + half * w)
        spin = p.wheel_inertia / p.wheel_radius**2
        if p.slip:
            spin = p.spin_inertia / p.wheel_radius**2 if p.spin_inertia > 0 else max(spin, 0.1 * p.mass)
        mass, inertia = p.mass + 2 * p.wheel_mass, p.inertia + 2 * p.wheel_mass * half**2
        turning = inertia * w**2 + spin * (rims[0] ** 2 + rims[1] ** 2)
        return float(0.5 * (mass * (v**2 + s.lateral**2) + turning))

    def core(self) -> tuple[Any, float]:
        """What of it makes contact, by shapely: all within a distance (m) of a point or polygon."""
        x, y, heading = self.pose
        if self.corners is None:
            return shapely.Point(x, y), float(self.parameters.radius)
        c, s = math.cos(heading), math.sin(heading)
        polygon = shapely.Polygon(np.array(self.corners) @ np.array([[c, s], [-s, c]]) + (x, y))
        rounding = float(self.outline.rounding)  # of its outward corners
        return polygon.buffer(-rounding, join_style="mitre", mitre_limit=100), rounding

    def depth_in(self, other: Any, rounding: float = 0.0) -> float:
        """How deep it is in another thing: positive if the surfaces have passed each other (m)."""
        core, own = self.core()
        return own + rounding - float(shapely.distance(core, other))

    @property
    def depth(self) -> float:
        """How deep it is in something of its arena (m)."""
        rings = [shapely.LinearRing(corners) for corners in self.arena.outlines]
        return max((self.depth_in(ring) for ring in rings), default=0.0)

    def is_free(self) -> bool:
        """Whether its middle is where it may be, by the arena's polygons."""
        return bool(self.arena.is_free(self.state.x, self.state.y, 1e-9))


def constant(left: float, right: float) -> Callable[[float], tuple[float, float]]:
    """The same wheel speeds at any time."""
    return lambda t: (left, right)


class World:
    """Robots and moving obstacles in an arena, stepped together."""

    def __init__(self, robots: Sequence[Body], arena: Arena | None = None) -> None:
        self.robots = list(robots)
        self.arena = arena_of() if arena is None else arena
        self._movers = ffi.new("mover[8]")
        self.scene = ffi.new("scene *", {"arena": self.arena.handle, "movers": self._movers})
        self._outlines: list[Any] = []

    def mover(self, x: float, y: float, vx: float = 0.0, vy: float = 0.0, **more: Any) -> Any:
        """A moving obstacle; advance it yourself."""
        corners = more.pop("corners", None)
        mover = self._movers[self.scene.movers_count]
        self.scene.movers_count += 1
        mover.x, mover.y, mover.vx, mover.vy, mover.cosine, mover.id = x, y, vx, vy, 1.0, 100
        mover.height = math.inf
        if corners is not None:
            flat = ffi.new("double[]", [float(value) for corner in corners for value in corner])
            self._outlines.append(flat)
            mover.outline, mover.corners = flat, len(corners)
            mover.radius = max(math.hypot(*corner) for corner in corners)
        for name, value in more.items():
            setattr(mover, name, value)
        return mover

    def step(self, torques: Sequence[tuple[float, float]], dt: float, order: Sequence[int] | None = None) -> None:
        """One step; moving obstacles go on along their velocities unless they wait."""
        places = range(len(self.robots)) if order is None else order
        bodies = ffi.new("body *[]", [self.robots[i].body for i in places])
        lib.body_step(bodies, len(bodies), self.scene, [list(torques[i]) for i in places], dt)
        for i in range(self.scene.movers_count):
            mover = self._movers[i]
            gone = mover.stops  # it may have waited for the rest of the step
            mover.x += mover.vx * gone
            mover.y += mover.vy * gone
            c, s = math.cos(mover.turn_rate * gone), math.sin(mover.turn_rate * gone)
            mover.cosine, mover.sine = mover.cosine * c - mover.sine * s, mover.sine * c + mover.cosine * s

    @property
    def energy(self) -> float:
        return sum(robot.energy for robot in self.robots)

    def momentum(self) -> tuple[float, float, float]:
        """Linear (x, y) and angular about the origin, of bodies whose wheels spin freely."""
        px = py = spin = 0.0
        for robot in self.robots:
            p = robot.parameters
            mass = p.mass + 2 * p.wheel_mass
            vx, vy = robot.velocity
            px, py = px + mass * vx, py + mass * vy
            spin += mass * (robot.state.x * vy - robot.state.y * vx)
            spin += (p.inertia + 2 * p.wheel_mass * p.half_track**2) * robot.state.turn_rate
        return px, py, spin

    def bits(self) -> bytes:
        """The whole state of all robots, by id."""
        by_id = sorted(self.robots, key=lambda robot: int(robot.body.id))
        return b"".join(bytes(ffi.buffer(ffi.addressof(robot.body, "state"))) for robot in by_id)
