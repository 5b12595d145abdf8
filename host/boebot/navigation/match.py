"""Matching a scan with a map by random search, as in section 6.3 of the notes: where was the robot when it scanned?

    p := the odometric pose;  e := ε(p)
    N times: q := p + uniform in a box;  if ε(q) < e: p := q, e := ε(q)

The box goes with p. It is small: within about 0.15 m and 0.15 rad of the truth the search finds it, beyond it may not.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.navigation.frames import Pose
from boebot.navigation.scan_error import Scan

if TYPE_CHECKING:
    from boebot.navigation.line_map import LineMap


@dataclass(frozen=True)
class Match:
    """What a search came to.

    Attributes:
        pose: the best found: x (m), y (m), heading (rad).
        error: ε there.
        steps: the poses that were accepted one after another, each with its ε; the first is where it began.
    """

    pose: Pose
    error: float
    steps: list[tuple[Pose, float]]


def search_pose(
    scan: Scan,
    plan: LineMap,
    start: Pose,
    source: random.Random,
    *,
    box: Pose = (0.1, 0.1, 0.1),
    tries: int = 200,
    enough: float = 0.0,
) -> Match:
    """The notes' search.

    Args:
        start: where it begins (m, m, rad).
        source: of chance.
        box: full widths L_x (m), L_y (m), L_φ (rad).
        tries: N.
        enough: T: it does not begin where ε is below.
    """
    best, error = start, float(scan.errors(plan, [start])[0])
    steps = [(best, error)]
    if error < enough:
        return Match(best, error, steps)
    for _ in range(tries):
        tried = (
            best[0] + source.uniform(-box[0], box[0]) / 2,
            best[1] + source.uniform(-box[1], box[1]) / 2,
            best[2] + source.uniform(-box[2], box[2]) / 2,
        )
        found = float(scan.errors(plan, [tried])[0])
        if found < error:
            best, error = tried, found
            steps.append((best, error))
    return Match(best, error, steps)
