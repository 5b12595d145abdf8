"""Cognitive processes: what a robot works out from its readings, and the state variables that come of it."""

from boebot.cognition.battery import BatteryLevel
from boebot.cognition.contact import Contact, contact
from boebot.cognition.drift import Drift
from boebot.cognition.light import LightSense
from boebot.cognition.odometry import Odometry, wrapped
from boebot.cognition.path_integration import PathIntegration
from boebot.cognition.proximity import Proximity, left_nearness, near, nearness_ahead, right_nearness
from boebot.cognition.stuck import StuckDetector
from boebot.cognition.sun_compass import SunCompass, sun_azimuth

__all__ = [
    "BatteryLevel",
    "Contact",
    "Drift",
    "LightSense",
    "Odometry",
    "PathIntegration",
    "Proximity",
    "StuckDetector",
    "SunCompass",
    "contact",
    "left_nearness",
    "near",
    "nearness_ahead",
    "right_nearness",
    "sun_azimuth",
    "wrapped",
]
