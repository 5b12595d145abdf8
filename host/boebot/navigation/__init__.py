"""Navigation (chapter 6 of the notes): maps, search, paths, potential fields and localization, for brain processes and
as what they are made of."""

from boebot.navigation.estimators import Estimate, Estimator, RandomSearch
from boebot.navigation.exploration_graph import ExplorationGraph, Placement
from boebot.navigation.explore import Explore
from boebot.navigation.follow_field import FollowField, LockDetector
from boebot.navigation.follow_path import FollowPath
from boebot.navigation.go_to import GoTo
from boebot.navigation.lattice import Lattice
from boebot.navigation.line_map import LineMap
from boebot.navigation.localization import Localization
from boebot.navigation.occupancy_map import OccupancyMap
from boebot.navigation.particle_filter import ParticleFilter
from boebot.navigation.potential_field import Potential, PotentialField
from boebot.navigation.scan_error import Scan
from boebot.navigation.search import Found, search
from boebot.navigation.sweep import Sweep, TurretScan, laser_scan
from boebot.navigation.tighten import tightened

__all__ = [
    "Estimate",
    "Estimator",
    "ExplorationGraph",
    "Explore",
    "FollowField",
    "FollowPath",
    "Found",
    "GoTo",
    "Lattice",
    "LineMap",
    "Localization",
    "LockDetector",
    "OccupancyMap",
    "ParticleFilter",
    "Placement",
    "Potential",
    "PotentialField",
    "RandomSearch",
    "Scan",
    "Sweep",
    "TurretScan",
    "laser_scan",
    "search",
    "tightened",
]
