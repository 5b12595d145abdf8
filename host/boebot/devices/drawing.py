"""What things look like from above, as data: a display list. Devices, robots and arenas make the items
(`Device.drawing`, boebot.view.scene); every picture, page and scene paints the same ones and knows nothing of what they
stand for.

Lengths in m, angles in rad, in the frame of what the items belong to: of a robot x forward, y left, origin at the
middle of the axle. A colour is a name of the palette in boebot.view.style, "robot" for that of the robot, or "#rrggbb".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]

CORNERS: Final = 64  # of a circle
SHOWN_M: Final = 0.35  # what reaches farther is drawn this far
SPOT_M, LOOK_M = 0.004, 0.04  # of a small sensor: radius, and length of the line to where it looks
SIGHTS, BODY, PARTS, TOP = 1.5, 10.0, 11.0, 13.0
"""Layers of a robot: what its sensors see, below all that is solid; its body; what sits on it."""


class Item(NamedTuple):
    """One line, area or text."""

    points: Sequence[Point]
    """m; of a text its place"""
    ink: str = ""
    """Colour of its line; empty: none."""
    fill: str = ""
    """Colour of the area within; empty: none."""
    closed: bool = False
    """The last point joins the first."""
    width: float = 1.0
    """Of the line, in points."""
    wide_m: float = 0.0
    """Of a line that is that wide in m, as paint on the floor is; 0: `width` counts."""
    dashes: tuple[float, ...] = ()
    """Dash and gap, in widths of the line."""
    alpha: float = 1.0
    """Opacity of the area."""
    hatch: bool = False
    """Lines over the area."""
    layer: float = 0.0
    """Higher ones lie above."""
    height: float = 0.0
    """m, of its top above the floor."""
    when: str = ""
    """Shown only while that sign is on: the name of a device whose SIGN is, or "contact"; empty: always."""
    reach_by: str = ""
    """Stretched from its first point by that measured distance (m), "ping"; not shown without one."""
    turns: bool = False
    """It sits on the robot's turret."""
    says: str = ""
    """What it is, in words for a legend."""
    text: str = ""
    """A text instead of a line."""
    side: int = 0
    """Of the text: 1 above its place, -1 below it, 0 in the middle of it."""


def circle(centre: Sequence[float], radius: float) -> list[Point]:
    """Its corners, as a polygon."""
    angles = np.linspace(0, 2 * math.pi, CORNERS, endpoint=False)
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles.tolist()]


def square(centre: Sequence[float], side: float) -> list[Point]:
    """Its corners."""
    (x, y), half = centre, side / 2
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def arc(position: Point, heading: float, opening: float, reach: float) -> list[Point]:
    """Points so far from there, about a heading."""
    count = 2 * math.ceil(CORNERS * opening / (4 * math.pi)) + 1
    angles = np.linspace(heading - opening / 2, heading + opening / 2, count).tolist()
    return [(position[0] + reach * math.cos(angle), position[1] + reach * math.sin(angle)) for angle in angles]


def cone(position: Point, heading: float, opening: float, reach: float, alpha: float) -> Item:
    """What a sensor sees at once."""
    points = [position, *arc(position, heading, opening, min(reach, SHOWN_M))]
    return Item(points, fill="robot", closed=True, alpha=alpha, layer=SIGHTS, says=f"up to {reach:g} m")


def ray(position: Point, heading: float, reach: float) -> Item:
    """A line of sight."""
    points = [position, *arc(position, heading, 0.0, min(reach, SHOWN_M))]
    return Item(points, ink="robot", dashes=(1.0, 1.65), layer=SIGHTS, says=f"up to {reach:g} m")


def spot(position: Point, heading: float | None = None) -> list[Item]:
    """A small sensor, and which way it looks; None: downwards."""
    dot = Item(circle(position, SPOT_M), fill="robot", closed=True, layer=TOP)
    if heading is None:
        return [dot]
    return [dot, Item([position, *arc(position, heading, 0.0, LOOK_M)], ink="robot", width=1.6, layer=TOP)]


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
