"""Arenas: their files, what stands and moves in them, rays, floor plans; without robots, boards or worlds.

The simulator runs robots in these arenas, pictures draw them, and a map for planning can be made of them.
"""

from boebot.arenas.arena import Arena as Arena
from boebot.arenas.arena import arena_names as arena_names
from boebot.arenas.arena import load_arena as load_arena
from boebot.arenas.description import ArenaDescription as ArenaDescription
from boebot.arenas.description import Charger as Charger
from boebot.arenas.description import Disc as Disc
from boebot.arenas.description import Light as Light
from boebot.arenas.description import Moving as Moving
from boebot.arenas.description import Patch as Patch
from boebot.arenas.description import Polygon as Polygon
from boebot.arenas.description import Start as Start
from boebot.arenas.description import Wall as Wall
from boebot.arenas.description import Waypoint as Waypoint
from boebot.offered import offered

__all__ = offered(__name__)
