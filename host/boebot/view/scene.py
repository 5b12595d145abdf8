"""What the pictures of a run show: the arena, the paths, and where something was touched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from boebot.arenas.floor_plan import FloorPlan
from boebot.record.truth import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from boebot.description.robots import RobotDescription
    from boebot.devices.drawing import Shape, Sweeps
    from boebot.record.columns import Columns
    from boebot.record.run import Run
    from boebot.record.shown import Layer
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
    """A run seen from above; lengths in metres."""

    known: bool
    """The truth is known, and `path` is it; otherwise `path` is the odometric estimate; without that it is zeros."""
    path: Pose
    estimate: Pose | None
    """Laid on the true start; None without the truth, which it is compared with, or without encoders or odometer."""
    plan: FloorPlan
    true_contacts: Floats
    """Where the body came to touch something, shape (n, 2)."""
    touches: Floats
    """Where the robot was when a whisker was pressed, shape (n, 2)."""
    turret: Floats
    """Its angle (rad) at each tick; 0 without one, or while it is free."""
    path_is_seen: bool
    """Somebody knows where the robot went: the simulator, or its odometry."""
    layers: list[Layer]
    """What the brain sketched."""
    swept: list[Swept]
    """What sensors with fans of rays measured."""

    def origin(self, sketch: Sketch) -> tuple[float, float, float]:
        """Of the frame of a sketch, as it lies in the picture at the run's end: m, m, rad."""
        if sketch.frame == "robot":
            return self.pose(-1)
        return self.pose(0) if sketch.frame == "start" and self.known else (0.0, 0.0, 0.0)

    def pose(self, index: int) -> tuple[float, float, float]:
        """Of the path at a tick."""
        return float(self.path.x[index]), float(self.path.y[index]), float(self.path.heading[index])


def view(result: Run) -> View:
    """The run as the pictures show it."""
    few = result.overview
    series = few.columns
    seen = series.odometry if series.true_pose is None else series.true_pose
    return View(
        known=series.true_pose is not None,
        path=Pose(*np.zeros((3, len(series)))) if seen is None else seen,
        estimate=few.placed_odometry,
        plan=result.plan if result.has_truth else FloorPlan(),
        true_contacts=few.contact_places,
        touches=few.touch_places,
        turret=np.nan_to_num(series.number("turret", "angle"), nan=0.0),
        path_is_seen=seen is not None,
        layers=few.layers,
        swept=[] if seen is None else swept(series, seen),
    )


def swept(series: Columns, path: Pose) -> list[Swept]:
    """The sweeps of each such sensor of a robot on that path, which has a pose for each tick."""
    found = []
    for sweeps in series.sweeps():
        sampled = series.time - sweeps.ages
        ticks = np.flatnonzero(np.diff(sampled, prepend=-np.inf) > SAME_S)
        time = sampled[ticks]
        x, y, heading = (np.interp(time, series.time, row) for row in (path.x, path.y, np.unwrap(path.heading)))
        (forward, left), (cosine, sine) = sweeps.position, (np.cos(heading), np.sin(heading))
        pose = Pose(x + cosine * forward - sine * left, y + sine * forward + cosine * left, heading + sweeps.heading)
        found.append(Swept(time, pose, sweeps, ticks))
    return found


def shapes(robot: RobotDescription) -> list[tuple[str, Shape]]:
    """What the robot's devices look like, each with the device's name: those that are on."""
    return [(name, shape) for name, device in robot.device.items() if device.on for shape in device.drawing()]


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
        corners += [point for patch in plan.patches for point in patch.corners]
        corners += [point for line in plan.lines for point in line.points]
        corners += [np.array((lamp.x_m, lamp.y_m)) for lamp in plan.lamps]
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
