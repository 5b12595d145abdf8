"""How much of the room the wander brain visits in five minutes, by how often it turns and how it behaves in corners.

Prints the table of docs/decisions/0001-wander.md: `python -m tools.decisions.wander`, from the repository.
"""

from __future__ import annotations

from itertools import product

import numpy as np

import boebot
from boebot.brains import wander
from hil_tests.paths import cells_visited, windows_moved

SEEDS = range(1, 7)


def main() -> None:
    """Runs every combination with six seeds on the native board."""
    print("turn chance  keeps side (s)  visited share of free cells   least movement in 5 s (m)")
    for chance, keep in product((0.01, 0.004, 0.002), (0.0, 1.5)):
        wander.TURN_CHANCE, wander.KEEP_SIDE_TIME = chance, keep
        shares, moved = [], []
        for seed in SEEDS:
            truth = boebot.run(wander.Brain, arena="room", seconds=300, seed=seed).truth
            assert truth is not None
            visited, free = cells_visited(truth)
            shares.append(visited / free)
            moved.append(windows_moved(truth).min())
        print(
            f"{chance:11.3f}  {keep:14.1f}  {np.mean(shares):.2f} ({min(shares):.2f} to {max(shares):.2f})"
            f"           {min(moved):.2f}"
        )


if __name__ == "__main__":
    main()
