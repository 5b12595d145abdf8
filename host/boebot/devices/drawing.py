"""What devices look like from above, as data: any painter can draw it (boebot.view). Lengths in m, angles in rad, in
the robot's frame: x forward, y left, origin at the middle of the axle."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]


class Cone(NamedTuple):
    """What a sensor sees at once."""

    position: Point
    """m"""
    heading: float
    """rad, of its middle"""
    opening: float
    """rad, full"""
    reach: float
    """m"""
    shade: float
    """Opacity, 0 to 1."""
    turns: bool = False
    """It sits on the robot's turret."""


class Ray(NamedTuple):
    """A line of sight."""

    position: Point
    """m"""
    heading: float
    """rad"""
    reach: float
    """m"""


class Spot(NamedTuple):
    """A small sensor."""

    position: Point
    """m"""
    heading: float | None
    """rad, the way that it looks; None: downwards."""


class Stroke(NamedTuple):
    """A wire from here to there."""

    begin: Point
    """m"""
    end: Point
    """m"""


class Axis(NamedTuple):
    """The axis of the turret: what turns, turns about it."""

    position: Point
    """m"""


Shape = Cone | Ray | Spot | Stroke | Axis


class Sweeps(NamedTuple):
    """What a sensor with a fan of rays measured over time: each sweep covers the area from it through their ends."""

    position: Point
    """m"""
    heading: float
    """rad"""
    angles: NDArray[np.float64]
    """rad from the heading, counter-clockwise, in rising order"""
    distances: NDArray[np.float64]
    """m, shape (ticks, rays); below 0: nothing within reach"""
    reach: float
    """m"""
    ages: NDArray[np.float64]
    """s, of each tick's distances"""
