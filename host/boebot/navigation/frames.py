"""Poses in frames: where one frame lies in another (m, m, rad)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from boebot.cognition.odometry import wrapped

Pose = tuple[float, float, float]
Point = tuple[float, float]


def composed(outer: Pose, inner: Pose) -> Pose:
    """A pose that is `inner` in a frame that lies at `outer`."""
    cosine, sine = math.cos(outer[2]), math.sin(outer[2])
    x, y, heading = inner
    return outer[0] + cosine * x - sine * y, outer[1] + sine * x + cosine * y, wrapped(outer[2] + heading)


def inverse(pose: Pose) -> Pose:
    """Where the outer frame lies, seen from the inner one."""
    x, y, heading = pose
    cosine, sine = math.cos(heading), math.sin(heading)
    return -cosine * x - sine * y, sine * x - cosine * y, wrapped(-heading)


def placed(frame: Pose, points: Sequence[Point]) -> list[Point]:
    """Points of a frame (m), as they lie in the one that it lies in."""
    return [composed(frame, (x, y, 0.0))[:2] for x, y in points]
