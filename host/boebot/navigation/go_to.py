"""Going to a place on a map: the way there is searched for, followed, and searched for anew when a scan has corrected
where the robot believes to be (sections 6.2 and 6.3 of the notes)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from boebot.brain import checks
from boebot.cognition.odometry import Odometry
from boebot.errors import BrainError
from boebot.navigation.follow_path import FollowPath
from boebot.navigation.lattice import Lattice
from boebot.navigation.line_map import LineMap
from boebot.navigation.localization import Localization
from boebot.navigation.obstacle import is_blocked
from boebot.navigation.search import search
from boebot.navigation.tighten import is_clear, tightened

if TYPE_CHECKING:
    from boebot.navigation.frames import Point
    from boebot.robot import Robot

BACKWARD = 0.1  # m from what is in the way


@dataclass(kw_only=True)
class GoTo(FollowPath):
    """Drives to its goal, and stands there. It has arrived when a scan has said so. Where it finds no way, or is lost,
    it stands still until it gets another goal or a scan fits again.

    Attributes:
        goal: where it goes to, in the map (m); None: it stands.
        way: waypoints from where the last plan was made, in the map (m).
        no_path: no way leads to the goal from where it believes to be.
    """

    localization: Localization
    """where the robot is, and in which map"""
    margin: float = 0.1
    """m that the robot's body keeps from all lines"""
    cell: float = 0.05
    """m: side of the cells of the grid on which a way is searched for"""
    slack: float = 0.3
    """m within which a free cell stands for where the robot believes to be, or for a goal nearer to a line than the
    margin; where the body would touch a line there is no path"""
    near: float = 0.03
    """m before a sonar at which something is in the way: it goes back and asks for a scan, for it is not where it
    believes to be"""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.localization, Localization):
            raise checks.refused(self, "localization", "a Localization")
        checks.positive(self, "cell", "slack", "near")
        checks.not_negative(self, "margin")
        self._grids: dict[float, Lattice] = {}

    def forget(self) -> None:
        super().forget()
        self.go(None)

    def enter(self, robot: Robot) -> None:
        self.other(Localization)  # it has to be in the brain as well
        self._planned_after = -1
        self._blocked_at: Point | None = None
        if self.arrived and self.goal is not None and not self._is_there(self.goal):
            self.arrived = False

    def go(self, goal: Point | None) -> None:
        """From now on to there (m, in the map); None: it stands.

        Raises:
            BrainError: it is no place.
        """
        if goal is not None and np.shape(goal) != (2,):
            raise BrainError(f"{self.name}: a goal of {goal!r}; expected x and y in m, or None")
        self.goal = goal
        self.way: list[Point] = []
        self.no_path = False
        self._planned_after = -1  # so many scans
        self._ended_after: int | None = None  # so many scans: it is at the end of its way, by odometry
        self.follow([])

    @property
    def lost(self) -> bool:
        """It does not know where it is."""
        return self.localization.lost

    def step(self, robot: Robot) -> None:
        if self.goal is None or self.lost or self.arrived:
            self.stand(robot)
        elif self._blocked_at is not None:
            self._go_back(robot, self._blocked_at)
        elif not self.turning and is_blocked(robot, self.near):
            self._blocked_at = self.other(Odometry).position
        else:
            self._go_on(robot, self.goal)
        robot.show(f"{self.name}_state", self.state)

    @property
    def state(self) -> str:
        """ "lost", "no goal", "arrived", "no path", "goes back" or "on the way"; shown as `go_to_state`."""
        if self.lost:
            return "lost"
        if self.goal is None:
            return "no goal"
        if self.arrived:
            return "arrived"
        if self.no_path:
            return "no path"
        return "on the way" if self._blocked_at is None else "goes back"

    def _go_back(self, robot: Robot, begin: Point) -> None:
        robot.drive_speed(-self.turn_speed, -self.turn_speed)
        if math.dist(self.other(Odometry).position, begin) >= BACKWARD:
            self._blocked_at = None
            self._planned_after = -1
            self.localization.ask()

    def _go_on(self, robot: Robot, goal: Point) -> None:
        estimates = self.localization.estimates
        if self._planned_after != len(estimates):
            is_confirmed = self._ended_after is not None and len(estimates) > self._ended_after
            if is_confirmed and estimates[-1][1].found and self._is_there(goal):
                self.arrived = True
                return
            self._plan(robot, goal)
        super().step(robot)
        if self.arrived:  # by odometry: a scan is to say so, too
            self.arrived, self._ended_after = False, len(estimates)
            self.localization.ask()

    def _is_there(self, goal: Point) -> bool:
        return math.dist(self.localization.pose[:2], goal) < 2 * self.arrival

    def _plan(self, robot: Robot, goal: Point) -> None:
        self._planned_after, self._ended_after = len(self.localization.estimates), None
        plan, radius = self.localization.plan, robot.dimensions.radius
        grid = self._grid(plan, radius)
        here = self.localization.pose[:2]
        start, target = (grid.nearest_free(*place, within=self.slack) for place in (here, goal))
        if target is not None and not is_clear(plan, grid.centre(target), goal, radius):
            target = None  # its body would touch something on the way from there, or at the goal itself
        cells = [] if start is None or target is None else search(grid, start, target).path
        self.no_path = not cells
        between = [grid.centre(cell) for cell in cells[1:-1]]
        self.way = tightened([here, *between, goal], plan, radius + self.margin) if cells else []
        self.follow(self.localization.to_odometry(self.way[1:]))
        robot.sketch(self.name, lines=[self.way], frame="arena")

    def _grid(self, plan: LineMap, radius: float) -> Lattice:
        if radius not in self._grids:
            self._grids[radius] = Lattice.of(plan, radius, self.margin, self.cell)
        return self._grids[radius]
