"""The scene of the world's figures, for this kit and for its peers: the one place that says what is measured.

A square room with square pillars a metre apart, the middle left free. The robot is the notes' default (two DC motors,
odometer, compass) with three IR sensors of three rays, or with a laser range finder of 683 beams. Steps of 10 ms,
motors and noise on.
"""

from __future__ import annotations

import functools
import math

from boebot.arenas import Arena, ArenaDescription, Polygon
from sim_bridge.vehicle import ARSIM_BODY, Vehicle, VehicleModel, arsim

RADIUS = ARSIM_BODY["radius"]
PITCH = 1.0  # m from pillar to pillar
PILLAR = 0.06  # m, half of a pillar's side
ANGLES = (0.7854, -0.7854, 0.0)  # rad, of the IR sensors: left, right, middle
OPENING = 0.5  # rad, of an IR sensor's three rays
INFRARED_RANGE = 1.0  # m
BEAMS = 683
BEAM_STEP = 2 * math.pi / 1024  # rad
LASER_RANGE = 4.0  # m
Corners = list[tuple[float, float]]


def square(x: float, y: float, half: float) -> Corners:
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def shapes(edges: int) -> tuple[Corners, list[Corners]]:
    """Outline and pillars; `edges` in all, a multiple of 4."""
    pillars = edges // 4 - 1
    side = math.ceil(math.sqrt(pillars + 1))
    middle = 0.0 if side % 2 else 0.5 * PITCH
    first = middle - 0.5 * PITCH * (side - 1)
    centres = [(first + PITCH * (i // side), first + PITCH * (i % side)) for i in range(side * side)]
    free = [(x, y) for x, y in centres if abs(x) >= 0.5 or abs(y) >= 0.5]
    return square(middle, middle, 0.5 * PITCH * side), [square(x, y, PILLAR) for x, y in free[:pillars]]


@functools.cache
def room(edges: int) -> Arena:
    outline, pillars = shapes(edges)
    obstacles = [Polygon(corners) for corners in pillars]
    return Arena(ArenaDescription(name=f"bench-{edges}", outline=[Polygon(outline)], obstacle=obstacles))


def robot() -> VehicleModel:
    """It slides on where it bumps into something: a sixth of the work is contacts."""
    return arsim(infrared_rad=ANGLES, odometer_sigma=1e-4, ends_at_collision=False)


def laser_robot(noise: bool) -> VehicleModel:
    model = VehicleModel(ARSIM_BODY, noise=noise, ends_at_collision=False)
    model.dc_motors()
    model.sensor(
        "laser", "laser", rays=BEAMS, first=-(BEAMS // 2) * BEAM_STEP, step=BEAM_STEP, range=LASER_RANGE, sigma=0.01
    )
    return model


def wander(vehicle: Vehicle) -> tuple[float, float]:
    """As much of a brain as a line holds."""
    readings = vehicle.readings
    return (0.7, -0.7) if readings[0] + readings[1] + readings[2] > 0.5 else (0.5, 0.5)
