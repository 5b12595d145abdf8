"""Navigation (chapter 6 of the notes): maps, search, paths, potential fields and localization, for brain processes and
as what they are made of."""

from boebot.navigation.estimators import Estimate as Estimate
from boebot.navigation.estimators import Estimator as Estimator
from boebot.navigation.estimators import RandomSearch as RandomSearch
from boebot.navigation.exploration_graph import ExplorationGraph as ExplorationGraph
from boebot.navigation.exploration_graph import Placement as Placement
from boebot.navigation.explore import Explore as Explore
from boebot.navigation.follow_field import FollowField as FollowField
from boebot.navigation.follow_field import LockDetector as LockDetector
from boebot.navigation.follow_path import FollowPath as FollowPath
from boebot.navigation.go_to import GoTo as GoTo
from boebot.navigation.lattice import Lattice as Lattice
from boebot.navigation.line_map import LineMap as LineMap
from boebot.navigation.localization import Localization as Localization
from boebot.navigation.occupancy_map import OccupancyMap as OccupancyMap
from boebot.navigation.particle_filter import ParticleFilter as ParticleFilter
from boebot.navigation.potential_field import Potential as Potential
from boebot.navigation.potential_field import PotentialField as PotentialField
from boebot.navigation.scan_error import Scan as Scan
from boebot.navigation.search import Found as Found
from boebot.navigation.search import search as search
from boebot.navigation.sweep import Sweep as Sweep
from boebot.navigation.sweep import TurretScan as TurretScan
from boebot.navigation.sweep import laser_scan as laser_scan
from boebot.navigation.tighten import tightened as tightened
from boebot.offered import offered

__all__ = offered(__name__)
