"""Wheel encoders: edges of a slotted disc, counted and timed by the firmware.

    distance = 2 pi r n / N,   speed = 2 pi r / (N t_edge)
A single-channel encoder knows no direction: its count only grows, its speed is never negative.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from boebot.link.messages import Status, Telemetry

EDGE_PERIOD_SCALE = 16e-6  # seconds per count of the edge periods on the wire


class Encoder(NamedTuple):
    """One wheel's encoder."""

    count: int  # type: ignore[assignment]  # hides a method of tuple that nobody wants here
    """Edges since the board started."""
    distance: float
    """Metres that the wheel has rolled since the board started; all of it counted forward if not `directed`."""
    speed: float
    """Metres per second along the ground, from the time between the last two edges; 0 if none within 0.5 s."""
    directed: bool
    """The encoder knows forward from backward."""
    age: float
    """Seconds since the count was taken."""
    valid: bool
    """False while the line fires so fast that the firmware masks it."""


class EncoderReader:
    """Reads one encoder."""

    def __init__(self, left: bool, edges_per_turn: int, wheel_radius_m: float, directed: bool) -> None:
        self.metres_per_edge = 2 * math.pi * wheel_radius_m / edges_per_turn
        self._left = left
        self._directed = directed
        self._masked = int(Status.ENCODER_LEFT_MASKED if left else Status.ENCODER_RIGHT_MASKED)

    def __call__(self, telemetry: Telemetry) -> Encoder:
        """The encoder at that tick."""
        if self._left:
            count, edge_period = telemetry.encoder_left, telemetry.edge_period_left
        else:
            count, edge_period = telemetry.encoder_right, telemetry.edge_period_right
        speed = self.metres_per_edge / (edge_period * EDGE_PERIOD_SCALE) if edge_period else 0.0
        valid = not telemetry.status & self._masked
        return Encoder(count, count * self.metres_per_edge, speed, self._directed, 0.0, valid)
