"""What both pictures of a run show: the arena, the paths, and where something was touched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot import robots, vehicle_devices
from boebot.series import touch_indices

if TYPE_CHECKING:
    from boebot.result import RunResult
    from boebot.series import Bools, Floats, Pose

SEEING = (robots.InfraredPair, vehicle_devices.InfraredProximity)
RANGING = (*SEEING, robots.Ping, vehicle_devices.Sonar)  # devices that the pictures show as cones
MARGIN = 0.02  # of the greater side


@dataclass(frozen=True)
class View:
    """A run seen from above; lengths in metres."""

    known: bool
    """The truth is known, and `path` is it; otherwise `path` is the odometric estimate."""
    path: Pose
    estimate: Pose | None
    outlines: list[Floats]
    """The arena's polygons, largest first: the outer wall, then obstacles."""
    contacts: Floats
    """Where the body came to touch something, shape (n, 2)."""
    touches: Floats
    """Where the robot was when a whisker was pressed, shape (n, 2)."""


def reach(
    device: robots.InfraredPair | vehicle_devices.InfraredProximity | robots.Ping | vehicle_devices.Sonar,
) -> float:
    """How far it sees (m)."""
    if isinstance(device, robots.InfraredPair | vehicle_devices.InfraredProximity):
        return device.range_m
    return device.range_max_m


def view(result: RunResult) -> View:
    """The run as the pictures show it."""
    known = result.true_pose is not None
    path = result.true_pose if result.true_pose is not None else result.odometry
    truth = result.truth
    outlines = [np.asarray(outline, dtype=np.float64) for outline in truth.outlines] if truth is not None else []
    outlines.sort(key=_extent, reverse=True)
    contacts = np.empty((0, 2))
    if truth is not None and known:
        inside = truth.time >= result.clock_offset
        begins = touch_indices(truth.time, truth.contact & inside)
        contacts = np.column_stack((truth.x[begins], truth.y[begins]))
    begins = _onset_indices(result.series.left_whisker | result.series.right_whisker)
    touches = np.column_stack((path.x[begins], path.y[begins]))
    return View(known, path, result.odometry if known else None, outlines, contacts, touches)


def bounds(scene: View) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what there is to see, with a margin (m)."""
    points = np.vstack([np.column_stack((scene.path.x, scene.path.y)), *scene.outlines])
    low, high = points.min(axis=0), points.max(axis=0)
    if not scene.outlines:  # no walls: leave room for the robot and its sensors
        low, high = low - 0.3, high + 0.3
    edge = MARGIN * float((high - low).max())
    return low - edge, high + edge


COLOURS = ("#3f6fb5", "#d0682f", "#3d9363", "#8e5fb0", "#b8912a", "#bf3f6f", "#2b96a8", "#6b7280")
"""Of the robots of a run of several, by number, over and over."""


def colour(number: int) -> str:
    """Of the robot of that number, from 1."""
    return COLOURS[(number - 1) % len(COLOURS)]


def margin(low: Floats, high: Floats) -> float:
    """How far the corners that `bounds` gave stand off from what there is to see (m)."""
    return float((high - low).max()) * MARGIN / (1 + 2 * MARGIN)


def _extent(outline: Floats) -> float:
    return float(np.ptp(outline, axis=0).prod()) if len(outline) else 0.0


def _onset_indices(flags: Bools) -> np.ndarray:
    return np.flatnonzero(flags & ~np.concatenate(([False], flags[:-1])))
