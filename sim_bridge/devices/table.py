"""Sensors known by their table of readings (reading_table.py)."""

from __future__ import annotations

from sim_bridge.devices.sensor import SensorKind
from sim_bridge.vehicles.checked_structs import POSITIVE

TABLE = SensorKind("table", {"reach": POSITIVE}, reach="reach")
