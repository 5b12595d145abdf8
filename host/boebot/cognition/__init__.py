"""Cognitive processes: what a robot works out from its readings, and the state variables that come of it."""

from boebot.cognition.battery import BatteryLevel as BatteryLevel
from boebot.cognition.contact import Contact as Contact
from boebot.cognition.contact import contact as contact
from boebot.cognition.drift import Drift as Drift
from boebot.cognition.light import LightSense as LightSense
from boebot.cognition.odometry import Odometry as Odometry
from boebot.cognition.odometry import wrapped as wrapped
from boebot.cognition.path_integration import PathIntegration as PathIntegration
from boebot.cognition.proximity import Proximity as Proximity
from boebot.cognition.proximity import left_nearness as left_nearness
from boebot.cognition.proximity import near as near
from boebot.cognition.proximity import nearness_ahead as nearness_ahead
from boebot.cognition.proximity import right_nearness as right_nearness
from boebot.cognition.stuck import StuckDetector as StuckDetector
from boebot.cognition.sun_compass import SunCompass as SunCompass
from boebot.cognition.sun_compass import sun_azimuth as sun_azimuth
from boebot.offered import offered

__all__ = offered(__name__)
