"""Arenas: their files, what stands and moves in them, rays, floor plans; without robots, boards or worlds.

The simulator runs robots in these arenas, pictures draw them, and a map for planning can be made of them.
"""

from boebot.arenas.arena import Arena, arena_names, load_arena
from boebot.arenas.description import (
    ArenaDescription,
    Charger,
    Disc,
    Light,
    Moving,
    Patch,
    Polygon,
    Start,
    Wall,
    Waypoint,
)

__all__ = [
    "Arena",
    "ArenaDescription",
    "Charger",
    "Disc",
    "Light",
    "Moving",
    "Patch",
    "Polygon",
    "Start",
    "Wall",
    "Waypoint",
    "arena_names",
    "load_arena",
]
