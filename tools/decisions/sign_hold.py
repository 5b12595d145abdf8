"""How long a single-channel encoder keeps the old direction after the command has reversed.

Prints the table of docs/decisions/0002-sign-hold.md: `python -m tools.decisions.sign_hold`, from the repository.
"""

from __future__ import annotations

import numpy as np

import boebot
from boebot import odometry

SEEDS = range(1, 9)


def main() -> None:
    """Two minutes of wander with eight seeds for each time, on the native board."""
    print("hold (ms)   heading error at the end (rad rms)   position error at the end (m rms)")
    for hold_ms in (0, 20, 40, 60, 80, 100, 150):
        odometry.HOLD_S = hold_ms / 1000
        heading: list[float] = []
        position: list[float] = []
        for seed in SEEDS:
            result = boebot.run("wander", arena="room", seconds=120, seed=seed)
            truth, estimate, off_by = result.true_pose, result.odometry, result.odometry_error
            assert truth is not None and off_by is not None
            error = estimate.heading[-1] - truth.heading[-1]
            heading.append(float(np.arctan2(np.sin(error), np.cos(error))))
            position.append(off_by)
        print(f"{hold_ms:9d}   {rms(heading):34.2f}   {rms(position):33.2f}")


def rms(values: list[float]) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


if __name__ == "__main__":
    main()
