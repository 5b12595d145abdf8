"""The whole circle: a brain, the link, the board, the world."""

from __future__ import annotations

import numpy as np
import pytest

import boebot
from boebot.boards import Truth
from boebot.navigation import Lattice, LineMap
from boebot.navigation.lattice import cells_of

pytestmark = pytest.mark.unsanitized

CELL_M, WINDOW_S = 0.2, 5.0


def cells_visited(truth: Truth) -> tuple[int, int]:
    """How many of the room's free cells, those whose centre is free, the robot's middle visited, and how many there
    are."""
    plan = LineMap.of("room")
    shape, centres = cells_of(plan, CELL_M)
    lattice = Lattice(~plan.is_solid(centres).reshape(shape), CELL_M, *plan.bounds[0].tolist())
    seen = {lattice.cell_at(x, y) for x, y in zip(truth.x.tolist(), truth.y.tolist(), strict=True)}
    return sum(bool(lattice.free[cell]) for cell in seen), int(lattice.free.sum())


def windows_moved(truth: Truth) -> np.ndarray:
    """The greatest distance between two places of the robot in each window of that length."""
    moved = []
    for start in np.arange(truth.time[0], truth.time[-1] - WINDOW_S, 1.0):
        inside = (truth.time >= start) & (truth.time <= start + WINDOW_S)
        x, y = truth.x[inside], truth.y[inside]
        moved.append(np.hypot(x - x[0], y - y[0]).max())
    return np.array(moved)


@pytest.mark.soak_on_avr
@pytest.mark.parametrize("seed", [1, 2])
def test_wander_keeps_moving_for_a_minute(board_url: str, seed: int) -> None:
    result = boebot.run("wander", on=board_url, seconds=60, seed=seed)
    assert result.truth is not None
    assert windows_moved(result.truth).min() >= 0.05
    assert result.lost_frames == 0 and result.overview.dead_man_stops == 0 and result.overview.overruns == 0


@pytest.mark.soak
def test_wander_visits_half_of_its_arena_in_five_minutes(board_url: str) -> None:
    """On average over three seeds: single runs spread by some 6 % of the cells (docs/decisions/0001)."""
    shares = []
    for seed in (1, 2, 3):
        result = boebot.run("wander", on=board_url, seconds=300, seed=seed)
        assert result.truth is not None
        visited, free = cells_visited(result.truth)
        shares.append(visited / free)
    assert np.mean(shares) >= 0.5, shares


@pytest.mark.soak_on_avr
def test_brain_that_does_nothing_fails_both_measures(board_url: str) -> None:
    result = boebot.run(lambda robot: None, on=board_url, seconds=20)
    assert result.truth is not None
    assert windows_moved(result.truth).max() < 0.05
    assert cells_visited(result.truth)[0] == 1


def test_same_seed_same_bytes(board_url: str) -> None:
    runs = [boebot.run("wander", on=board_url, seconds=10, seed=seed) for seed in (3, 3, 4)]
    assert runs[0].record.rows("to_host") == runs[1].record.rows("to_host")
    assert runs[0].record.rows("to_board") == runs[1].record.rows("to_board")
    assert runs[0].record.rows("to_host") != runs[2].record.rows("to_host")


def test_odometry_follows_the_truth(board_url: str) -> None:
    """Encoder counts through the whole circle: a straight metre is a metre within 3 %."""
    result = boebot.run(lambda robot: robot.drive(0.5, 0.5), on=board_url, arena="empty", seconds=8)
    assert result.truth is not None and result.odometry is not None
    true = np.hypot(result.truth.x[-1] - result.truth.x[0], result.truth.y[-1] - result.truth.y[0])
    estimate = np.hypot(result.odometry.x[-1], result.odometry.y[-1])
    assert true > 0.5
    assert abs(estimate - true) <= 0.03 * true
