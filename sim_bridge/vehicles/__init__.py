"""Robots without boards: what one is made of, and many worlds with one each (the C of this room)."""

from typing import Final

from sim_bridge.compiled import lib

STEP_S: Final = 0.01  # notes, section 3.2.6
ENDS: Final[dict[int, str]] = {
    lib.VEHICLE_RUNS: "",
    lib.VEHICLE_COLLIDED: "collision",
    lib.VEHICLE_EXHAUSTED: "battery empty",
    lib.VEHICLE_BRAIN_FAILED: "brain failed",
}
"""Why a vehicle can go no further."""
