"""Whether a straight way is free, by one scan (for rules R3 and R12 of docs/reference/navigation.md)."""

from __future__ import annotations

import numpy as np

from boebot.navigation.scan_error import Scan


def is_clear(scan: Scan, bearing: float, length: float, half_width: float) -> bool:
    """No ray ends in the corridor.

    A ray of distance d at the angle κ from the bearing ends in it if 0 < d cos κ < length and |d sin κ| < half_width.

    Args:
        bearing: of the corridor, from the robot's heading (rad).
        length: of the corridor (m).
        half_width: from its middle to its side (m).
    """
    x, y = scan.place
    angles = np.linspace(*scan.bearings, len(scan.distances))[scan.known]
    distances = scan.distances[scan.known]
    ends_x, ends_y = x + distances * np.cos(angles), y + distances * np.sin(angles)
    along = ends_x * np.cos(bearing) + ends_y * np.sin(bearing)
    aside = ends_y * np.cos(bearing) - ends_x * np.sin(bearing)
    return not bool(np.any((along > 0) & (along < length) & (np.abs(aside) < half_width)))
