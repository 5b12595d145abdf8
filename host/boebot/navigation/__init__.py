"""Navigation (chapter 6 of the notes): maps, search, paths, potential fields and localization, for brain processes and
as what they are made of."""

from boebot.navigation.cells import Cells
from boebot.navigation.estimators import Estimate, Estimator, RandomSearch
from boebot.navigation.follow_field import FollowField, LockDetector
from boebot.navigation.follow_path import FollowPath
from boebot.navigation.lattice import Lattice
from boebot.navigation.line_map import LineMap
from boebot.navigation.localization import Localization, laser_scan
from boebot.navigation.occupancy_map import OccupancyMap
from boebot.navigation.particle_filter import ParticleFilter
from boebot.navigation.potential_field import Potential, PotentialField
from boebot.navigation.scan_error import Scan
from boebot.navigation.search import Found, search
from boebot.navigation.tighten import tightened

__all__ = [
    "Cells",
    "Estimate",
    "Estimator",
    "FollowField",
    "FollowPath",
    "Found",
    "Lattice",
    "LineMap",
    "Localization",
    "LockDetector",
    "OccupancyMap",
    "ParticleFilter",
    "Potential",
    "PotentialField",
    "RandomSearch",
    "Scan",
    "laser_scan",
    "search",
    "tightened",
]
