"""What pictures of a run show: the arena, the paths, where something was touched; and what arena and robots look like,
as display lists (boebot.devices.drawing)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan, Solid
from boebot.devices.drawing import BODY, PARTS, Item, circle
from boebot.devices.turret import PositionServo, turret_name
from boebot.record.truth import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from boebot.description.robots import RobotDescription
    from boebot.devices.drawing import Sweeps
    from boebot.record.brain_record import BrainRecord, Layer, Shown
    from boebot.record.columns import Columns
    from boebot.record.run import Run
    from boebot.record.truth import Floats
    from boebot.showing import Sketch

MARGIN = 0.03  # of the greater side
OPEN_M = 0.3  # to see around a path in an open field, at least
OPEN_ARENA_M = 1.0  # around the robots in an open field
OPEN_SHARE = 0.15  # of the path's extent, to see around it
SAME_S = 1e-6  # sweeps nearer in time than this are one
SLIMMEST = 0.4  # shorter side by longer side of what is shown of an open field


@dataclass(frozen=True)
class Swept:
    """What one sensor with a fan of rays measured, where and when it did: an entry per sweep."""

    time: Floats
    """s, the run's"""
    pose: Pose
    """Of the sensor."""
    sweeps: Sweeps
    ticks: NDArray[np.intp]
    """At which of those of the run it was read."""

    def distances(self, which: NDArray[np.intp], rays: NDArray[np.intp]) -> Floats:
        """Of these rays (m): the reach where nothing is within it."""
        read = self.sweeps.distances[np.ix_(self.ticks[which], rays)]
        return np.where(read < 0, self.sweeps.reach, read)

    def area(self, index: int) -> Floats:
        """Corners of what that sweep covers (m), shape (1 + rays, 2): from the sensor through the ends of its rays."""
        x, y, heading = self.pose.at(index)
        angles = heading + self.sweeps.angles
        (far,) = self.distances(np.array([index]), np.arange(len(angles)))
        return np.vstack(((x, y), np.column_stack((x + far * np.cos(angles), y + far * np.sin(angles)))))


@dataclass(frozen=True)
class View:
    """What is seen of a robot's run from above, or of a stretch of it; lengths in metres."""

    columns: Columns
    """Its ticks."""
    start: tuple[float, float, float]
    """Pose in which the run began, as the path has it: m, m, rad; zeros without the truth."""
    shown: Shown
    """Values that the brain showed."""
    layers: Sequence[Layer] = ()
    """What it sketched."""
    brain: BrainRecord | None = None
    """Steps and switches of a brain of processes; None: a brain of another kind, or no step yet."""
    plan: FloorPlan = field(default_factory=FloorPlan)

    @property
    def known(self) -> bool:
        """The truth is known, and `path` is it; otherwise `path` is the odometric estimate, or else zeros."""
        return self.columns.true_pose is not None

    @property
    def path_is_seen(self) -> bool:
        """Somebody knows where the robot went: the simulator, or its odometry."""
        return self.known or self.columns.odometry is not None

    @property
    def path(self) -> Pose:
        """See `known`."""
        return self.columns.true_pose or self.columns.odometry or Pose(*np.zeros((3, len(self.columns))))

    @cached_property
    def estimate(self) -> Pose | None:
        """By odometry, from the true start on; None without the truth or without odometry."""
        odometry = self.columns.odometry
        return odometry.placed(*self.start) if self.known and odometry is not None else None

    @property
    def turret(self) -> Floats:
        """Its angle (rad) at each tick; 0 without one, or while it is free."""
        name = turret_name(self.columns.robot.device)
        return np.nan_to_num(self.columns.number(name, "angle"), nan=0.0)

    @cached_property
    def swept(self) -> list[Swept]:
        """The sweeps of each sensor with a fan of rays."""
        path, found = self.path, []
        for sweeps in self.columns.sweeps():
            sampled = self.columns.time - sweeps.ages
            ticks = np.flatnonzero(np.diff(sampled, prepend=-np.inf) > SAME_S)
            time = sampled[ticks]
            track = (path.x, path.y, np.unwrap(path.heading))
            x, y, heading = (np.interp(time, self.columns.time, row) for row in track)
            (forward, left), (cosine, sine) = sweeps.position, (np.cos(heading), np.sin(heading))
            pose = Pose(
                x + cosine * forward - sine * left, y + sine * forward + cosine * left, heading + sweeps.heading
            )
            found.append(Swept(time, pose, sweeps, ticks))
        return found

    def origin(self, sketch: Sketch) -> tuple[float, float, float]:
        """Of the frame of a sketch, as it lies in the picture at the run's end: m, m, rad."""
        if sketch.frame == "robot":
            return self.path.at(-1)
        return self.start if sketch.frame == "start" else (0.0, 0.0, 0.0)


def view(result: Run) -> View:
    """The run as the pictures show it."""
    few = result.overview
    true, brain = few.columns.true_pose, few.brain
    return View(
        columns=few.columns,
        start=(0.0, 0.0, 0.0) if true is None else true.at(0),
        shown=few.shown,
        layers=few.layers,
        brain=brain if brain is not None and len(brain) else None,
        plan=result.plan if result.has_truth else FloorPlan(),
    )


def bounds(*views: View) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what there is to see, with a margin (m): the arena within its outlines; in
    an open field what the robots went through."""
    places = [place for shown in views for place in (shown.path, shown.estimate) if place is not None]
    points = np.vstack([np.column_stack((place.x, place.y)) for place in places])
    if any(shown.plan.outlines for shown in views):
        low, high = plan_bounds(views[0].plan, [])
        points = np.vstack([np.column_stack((shown.path.x, shown.path.y)) for shown in views])
        return np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    low, high = points.min(axis=0), points.max(axis=0)
    edge = max(OPEN_M, OPEN_SHARE * float((high - low).max()))
    return _stout(low - edge, high + edge)


def plan_bounds(plan: FloorPlan, places: Sequence[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Of an arena by itself and of some places in it: its outlines; in an open field all that stands there."""
    solids = plan.outlines or [*plan.solids, *(moving.at(float(moving.time[0])) for moving in plan.moving)]
    corners = [corner for solid in solids for corner in solid.box]
    if not plan.outlines:
        corners += [np.array(place) for place in places]
        corners += [np.array(point) for patch in plan.described.patch for point in patch.corners_m]
        corners += [np.array(point) for line in plan.described.line for point in line.points_m]
        corners += [np.array((lamp.x_m, lamp.y_m)) for lamp in plan.described.light]
        corners += [point for moving in plan.moving for point in np.column_stack((moving.x, moving.y))]
    points = np.array(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    if not plan.outlines:
        return _stout(low - OPEN_ARENA_M, high + OPEN_ARENA_M)
    edge = MARGIN * float((high - low).max())
    return low - edge, high + edge


def _stout(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """The box, made wider where it is too slim to look at."""
    size = high - low
    more = np.maximum(0.0, SLIMMEST * float(size.max()) - size) / 2
    return low - more, high + more


# ---- display lists ---------------------------------------------------------------------------------------------------

WHEEL_M = 0.012  # width of a wheel
BODY_HEIGHT_M = 0.08  # as drawn: descriptions do not say it
HIGH_M = 0.2  # what has no height is drawn this high
LAMP_M = 0.05  # of a lamp's star
STARS = ("lamp",)  # `Item.says` of things that a legend shows as a star
ROOMY_SHARE = 0.09  # of the arena's width: what is as large has its label inside
TOP_SHARE = 0.07  # what reaches higher within the outline has its label below
WORDS = 5.5  # layer of labels: above the arena, below robots
MOVES = 4.0  # layer of what moves


def robot_items(robot: RobotDescription) -> list[Item]:
    """The robot, from the lowest layer on: what its sensors see, body, wheels, front, devices that are on."""
    body = robot.body
    edge = body.outline_m or circle((0.0, 0.0), body.radius_m)
    nose = [(share * body.front_m, side * body.front_m) for share, side in ((0.9, 0.0), (0.35, 0.32), (0.35, -0.32))]
    whole = Item(edge, ink="robot", fill="body", closed=True, width=1.8, layer=BODY, height=BODY_HEIGHT_M)
    front = Item(nose, fill="robot", closed=True, layer=PARTS + 1, height=BODY_HEIGHT_M)
    touching = [
        whole._replace(fill="", ink="contact", when="contact"),
        front._replace(fill="contact", when="contact"),
    ]
    items = [whole, front, *touching]
    wheel, half = body.wheel_radius_m, WHEEL_M / 2
    for y in (-body.track_width_m / 2, body.track_width_m / 2):
        corners = [(-wheel, y - half), (wheel, y - half), (wheel, y + half), (-wheel, y + half)]
        items.append(Item(corners, fill="ink", closed=True, layer=PARTS, height=2 * wheel))
    items += [item for one in device_items(robot).values() for item in one]
    return sorted(items, key=_layer)


def device_items(robot: RobotDescription) -> dict[str, list[Item]]:
    """What the robot's devices look like, by their names: those that are on and can be seen."""
    found = {name: device.drawing(name) for name, device in robot.device.items() if device.on}
    if isinstance(turret := robot.device.get(turret_name(robot.device)), PositionServo):
        for name in turret.carried(robot.device):
            found[name] = [item._replace(turns=True) for item in found[name]]
    return {name: items for name, items in found.items() if items}


def pivot(robot: RobotDescription) -> tuple[float, float] | None:
    """About where that turns which sits on the robot's turret."""
    return getattr(robot.device.get(turret_name(robot.device)), "position_m", None)


def ghost_items(robot: RobotDescription) -> list[Item]:
    """The robot where it believes to be."""
    body = robot.body
    edge = body.outline_m or circle((0.0, 0.0), body.radius_m)
    look: dict[str, Any] = {"ink": "estimate", "width": 1.1, "dashes": (3.0, 2.0), "layer": 8.0}
    return [Item(edge, closed=True, **look), Item([(0.0, 0.0), (body.front_m, 0.0)], **look)]


def arena_items(plan: FloorPlan) -> list[Item]:
    """All that stands still in an arena, from the lowest layer on, and labels: what cannot be seen from above (grip, a
    low height, reflectances) is written beside it."""
    items = []
    for outline in plan.outlines:
        items.append(Item(outline.points.tolist(), fill="floor", closed=True, layer=0.2))
        edge = Item(outline.points.tolist(), ink="edge", closed=True, width=2.8, layer=2.0, height=_height(outline))
        items.append(edge._replace(dashes=(4.0, 1.5)) if outline.is_low else edge)
    for patch in plan.described.patch:
        corners = list(patch.corners_m)
        colour = "rough" if patch.grip > plan.grip else "smooth"
        items.append(Item(corners, ink="faint", fill=colour, closed=True, width=0.5, dashes=(1.0, 1.65), layer=0.6))
        middle = ((np.min(corners, axis=0) + np.max(corners, axis=0)) / 2).tolist()
        items.append(Item([middle], text=f"grip {patch.grip:g}", layer=WORDS))
    for line in plan.described.line:
        colour = "paint-dark" if line.floor_reflectance < plan.described.floor_reflectance else "paint-bright"
        items.append(Item(list(line.points_m), ink=colour, wide_m=line.width_m, layer=0.65))
    if (charger := plan.described.charger) is not None:
        there = (charger.x_m, charger.y_m)
        disc = circle(there, charger.radius_m)
        items.append(Item(disc, ink="charger", fill="charger", closed=True, width=1.2, alpha=0.35, layer=0.7))
        items.append(Item([(there[0], there[1] - charger.radius_m)], text="charger", side=-1, layer=WORDS))
    for solid in plan.obstacles:
        items.append(solid_item(solid))
        items += remarks(solid, plan)
    for lamp in plan.described.light:
        star = _star((lamp.x_m, lamp.y_m))
        items.append(
            Item(star, ink="edge", fill="lamp", closed=True, width=0.8, layer=4.5, height=lamp.height_m, says="lamp")
        )
    return sorted(items, key=_layer)


def solid_item(solid: Solid) -> Item:
    """What keeps robots out."""
    if solid.kind == "wall":
        look: dict[str, Any] = {"width": 1.4, "dashes": (3.0, 1.2)} if solid.is_low else {"width": 2.2}
        ink = "dull" if solid.is_dull else "edge"
        return Item(solid.points.tolist(), ink=ink, layer=3.0, height=_height(solid), **look)
    points = circle(solid.points[0].tolist(), solid.radius) if solid.kind == "disc" else solid.points.tolist()
    look = {"fill": "dull", "says": "throws back less"} if solid.is_dull else {"fill": "solid"}
    if solid.is_low:
        look = {"fill": "low", "hatch": True, "width": 0.9, "says": "low: some sensors look over it"}
    return Item(points, ink="edge", closed=True, layer=3.0, height=_height(solid), **({"width": 1.3} | look))


def moving_item(solid: Solid) -> Item:
    """A shape that moves, in the frame that it is given in."""
    return solid_item(solid)._replace(fill="moving", layer=MOVES, says="moves, shown at the start")


def _layer(item: Item) -> float:
    return item.layer


def _height(solid: Solid) -> float:
    return solid.height if math.isfinite(solid.height) else HIGH_M


def _star(centre: tuple[float, float]) -> list[tuple[float, float]]:
    points = []
    for corner in range(10):
        radius, angle = (0.4 * LAMP_M if corner % 2 else LAMP_M), math.pi / 2 + corner * math.pi / 5
        points.append((centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)))
    return points


def remarks(solid: Solid, plan: FloorPlan) -> list[Item]:
    """Its label: inside it where there is room, else above it, and near the arena's upper edge below it."""
    if not (said := solid.remarks):
        return []
    walls = [outline.box for outline in plan.outlines]
    width = max((float(high[0] - low[0]) for low, high in walls), default=4.0)
    top = max((high[1] - TOP_SHARE * (high[1] - low[1]) for low, high in walls), default=np.inf)
    low, high = solid.box
    x, y = ((low + high) / 2).tolist()
    if not solid.is_low and (high - low).min() > ROOMY_SHARE * width:
        return [Item([(x, y)], text="\n".join(said), layer=WORDS)]
    side = -1 if high[1] > top else 1
    return [Item([(x, float(low[1] if side < 0 else high[1]))], text=", ".join(said), side=side, layer=WORDS)]
