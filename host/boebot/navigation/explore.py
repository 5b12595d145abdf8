"""Exploration by sensory area coverage (section 6.1 of the notes): the robot drives about until its range finder has
seen every place.

A finite-state machine with 17 states, as many as the notes' (which do not list them). There is no map, only odometry.
Rules R1 to R15: docs/reference/navigation.md.
"""

from __future__ import annotations

import enum
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

from boebot.brain import checks
from boebot.cognition.odometry import Odometry, wrapped
from boebot.navigation.corridor import is_clear
from boebot.navigation.exploration_graph import STATUSES, ExplorationGraph, Node, Placement
from boebot.navigation.frames import inverse, placed
from boebot.navigation.obstacle import SONARS, is_blocked
from boebot.navigation.scan_error import Scan
from boebot.navigation.steering import SHARE_TO_TURN, SteeredBehavior, stand
from boebot.navigation.sweep import Sweep

if TYPE_CHECKING:
    from boebot.navigation.frames import Point, Pose
    from boebot.navigation.localization import Localization
    from boebot.robot import Robot

QUARTER = math.pi / 2
CLEARANCE = 0.05  # m that its body keeps to either side
FACING = 0.03  # rad off, and it faces a point
BACKWARD = 0.1  # m from what blocks the way, before it turns
BACKWARD_S = 4.0  # at most
PROGRESS, PROGRESS_S = 0.02, 3.0  # less (m) within this time (s) is none
ATTEMPTS = 5  # of coming back to its nodes
RETRIED_FROM = 4  # completed nodes from which an unreachable one is tried again
CLOSER = 0.5  # of the distances, where all else has failed
IN_SIGHT = 2.5  # of D: completed nodes that are nearer may be joined by a leg, where all else has failed


class State(enum.Enum):
    """What it is doing."""

    INIT = enum.auto()
    SCAN = enum.auto()
    PLACE = enum.auto()
    TURN_SCAN = enum.auto()
    SELECT = enum.auto()
    ROTATE = enum.auto()
    CHECK_DIRECT = enum.auto()
    DRIVE_DIRECT = enum.auto()
    DRIVE_LEG = enum.auto()
    NEXT_LEG = enum.auto()
    ARRIVED = enum.auto()
    UPDATE_PATHS = enum.auto()
    BLOCKED = enum.auto()
    BACKTRACK = enum.auto()
    RETRY_SELECT = enum.auto()
    DONE = enum.auto()
    FAILED = enum.auto()


@dataclass(kw_only=True)
class Explore(SteeredBehavior):
    """Drives from node to node until none is pending, and stops there.

    Attributes:
        graph: the nodes so far; None before the first step.
        state: what it is doing; at the end DONE, or FAILED if it came away from its nodes and finds no way back.
    """

    placement: Placement | None = None
    """where nodes are put; None: as fits the robot's size"""
    reach: float = 0.05
    """a: m from a node at which it is reached"""
    shortcut: float = 3.0
    """L: m up to which it tries to drive straight to its target (R12)"""
    near: float = 0.05
    """m before a sonar at which something blocks the way (R11)"""
    sonars: Sequence[str] = SONARS
    """names of those that look where it drives; whiskers are heeded as well"""
    second_pass: bool = True
    """R14: what is blocked is passed around, and unreachable nodes are tried again when all others are done"""
    settle: float = 0.5
    """s from stopping to the scan; a sweep must be newer than the last movement"""
    localization: Localization | None = None
    """whose map nodes lie in; None: they lie in the frame of the odometry, and drift with it"""
    scan: Callable[[Robot], Scan | None] = field(default_factory=Sweep)
    """what takes a sweep: the laser, or a sonar on a turret"""

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.positive(self, "reach", "shortcut", "near", "settle")

    def forget(self) -> None:
        super().forget()
        self.graph: ExplorationGraph | None = None
        self.state = State.INIT

    @property
    def ended(self) -> bool:
        """It explores no more."""
        return self.state in (State.DONE, State.FAILED)

    @property
    def complete(self) -> bool:
        """R13: no node is left; some may be unreachable."""
        return self.state is State.DONE

    @property
    def pose(self) -> Pose:
        """Where the robot is, in the frame of the nodes (m, m, rad)."""
        return self.other(Odometry).pose if self.localization is None else self.localization.pose

    def enter(self, robot: Robot) -> None:
        self._stood_s = self._seen_s = robot.time

    def step(self, robot: Robot) -> None:
        """Goes from state to state until one takes time; stands where it is lost. Shows which state that is."""
        if self.localization is not None and self.localization.lost:
            stand(robot, self._stood_s)
            robot.show(f"{self.name}_state", "lost")
            return
        while True:
            before, self.state = self.state, self._states[self.state](self, robot)
            if self.state is before:
                break
            self._stood_s = self._seen_s = robot.time
        robot.show(f"{self.name}_state", self.state.name.lower())

    # ---- nodes -------------------------------------------------------------------------------------------------------

    def _init(self, robot: Robot) -> State:
        x, y = self.pose[:2]
        self._placement = self.placement or Placement.of(robot.dimensions.radius)
        self.graph = ExplorationGraph((x, y), self._placement.least_distance, 1.1 * self._placement.distance)
        self._sweeps: dict[int, list[tuple[Pose, Scan]]] = {}  # by the node at which they were taken
        self._tried: set[tuple[int, int]] = set()  # node, completed node from which it was tried to come straight to it
        self._looked_about: set[int] = set()  # R15: nodes at which it has looked in four directions
        self._retried = -1
        self._looked_closely: set[int] = set()  # R14e: completed nodes
        self._close: set[int] = set()  # nodes that were placed then; one try is enough for them
        self._share = 1.0  # of the distances at which nodes are placed
        self._blocked_at: Point | None = None
        self._seen_at, self._seen_s = (x, y), robot.time  # where it was last when it made progress
        self._look_around()
        return State.SCAN

    def _look_around(self) -> None:
        """R15: a range finder that sees half a turn only has to look in four directions."""
        heading = self.pose[2]
        self._headings = [heading + k * QUARTER for k in (1, 2, 3)]
        self._looked_about.add(self._graph.active)

    def _scan(self, robot: Robot) -> State:
        self._sweep = self._swept(robot)
        return State.SCAN if self._sweep is None else State.PLACE

    def _swept(self, robot: Robot) -> Scan | None:
        """A sweep of the robot at rest; None: not yet."""
        stand(robot, self._stood_s)
        return self.scan(robot) if robot.time - self._stood_s > self.settle - 1e-9 else None

    def _place(self, robot: Robot) -> State:
        assert self._sweep is not None
        x, y, heading = self.pose
        self._sweeps.setdefault(self._graph.active, []).append((self.pose, self._sweep))
        placement = self._placement.closer(self._share)
        way = placement.distance
        for bearing in placement.bearings(self._sweep, half_width(robot)):
            angle = heading + bearing
            node = self._graph.place((x + way * math.cos(angle), y + way * math.sin(angle)), self._share)
            if node is not None and self._share < 1.0:
                self._close.add(node.number)
        self._draw(robot)
        if self._headings:
            return State.TURN_SCAN
        self._share = 1.0
        return State.SELECT

    def _turn_scan(self, robot: Robot) -> State:
        if not self._turn(robot, self._headings[0]):
            return State.TURN_SCAN
        del self._headings[0]
        return State.SCAN

    def _select(self, robot: Robot) -> State:
        target = self._graph.target()
        if target is None and self._graph.active not in self._looked_about:
            self._look_around()
            return State.TURN_SCAN
        if target is None:
            return State.RETRY_SELECT if self.second_pass else State.DONE
        self._target = target
        away = math.dist(self.pose[:2], target.place)
        pair = target.number, self._graph.active
        if len(target.path) > 2 and away <= self.shortcut and pair not in self._tried:
            self._tried.add(pair)
            self._faces = False
            return State.CHECK_DIRECT
        return State.NEXT_LEG

    def _retry_select(self, robot: Robot) -> State:
        """R14d, R14e: what could not be reached is tried from other nodes, where the way is shortest first, then looked
        for in smaller steps. R14f: then legs that were blocked are tried once more, and others beside them: a door may
        be one of them, and its node too near to a post to come back by it."""
        graph = self._graph
        unreachable = [n for n in graph.nodes if n.status == "unreachable" and n.number not in self._close]
        ways = [
            (way, node, last)
            for node in unreachable
            for last in graph.nearest_completed(node.place)[:RETRIED_FROM]
            if (node.number, last.number) not in self._tried and not self._is_obstructed(last, node.place, robot)
            if (way := graph.way(last.number))
        ]
        if ways:
            _, node, last = min(ways, key=lambda one: graph.length([*one[0], one[1].number]))
            self._tried.add((node.number, last.number))
            graph.retry(node, last.number)
            self._retried = node.number
            return State.SELECT
        for node in unreachable:
            nearest = graph.nearest_completed(node.place)[0]
            is_new = nearest.number not in self._looked_closely
            if is_new and not self._is_obstructed(nearest, node.place, robot):
                self._looked_closely.add(nearest.number)
                if graph.set_out(nearest):
                    self._target, self._share = nearest, CLOSER
                    return State.NEXT_LEG
        if unreachable and graph.try_legs_again():
            self._join_what_sees_each_other(robot)
            return State.RETRY_SELECT
        return State.DONE

    def _join_what_sees_each_other(self, robot: Robot) -> None:
        """R14f: a leg between each two completed nodes that are near, and between which no sweep shows anything."""
        nodes = [node for node in self._graph.nodes if node.status == "completed" and node.number in self._sweeps]
        for one, other in itertools.combinations(nodes, 2):
            is_near = math.dist(one.place, other.place) <= IN_SIGHT * self._placement.distance
            ways = (one, other), (other, one)
            if is_near and not any(self._is_obstructed(begin, end.place, robot) for begin, end in ways):
                self._graph.legs.add(frozenset((one.number, other.number)))

    def _is_obstructed(self, last: Node, place: Point, robot: Robot) -> bool:
        """A sweep at a completed node showed something in the corridor from there to a place."""
        for (x, y, heading), sweep in self._sweeps.get(last.number, []):
            bearing, length = math.atan2(place[1] - y, place[0] - x) - heading, math.dist((x, y), place)
            if not is_clear(sweep, bearing, length + half_width(robot), half_width(robot)):
                return True
        return False

    # ---- ways --------------------------------------------------------------------------------------------------------

    def _check_direct(self, robot: Robot) -> State:
        """R12: turn to the target; if nothing is in the way, drive there."""
        if not self._faces:
            self._faces = self._face(robot, self._target.place)
            self._stood_s = robot.time
            return State.CHECK_DIRECT
        if (sweep := self._swept(robot)) is None:
            return State.CHECK_DIRECT
        x, y, heading = self.pose
        to_x, to_y = self._target.place[0] - x, self._target.place[1] - y
        bearing, length = wrapped(math.atan2(to_y, to_x) - heading), math.hypot(to_x, to_y) + robot.dimensions.radius
        return State.DRIVE_DIRECT if is_clear(sweep, bearing, length, half_width(robot)) else State.NEXT_LEG

    def _drive_direct(self, robot: Robot) -> State:
        if self._drive(robot, self._target.place):
            return State.ARRIVED
        if not self._blocked(robot):
            return State.DRIVE_DIRECT
        self._bases = [self._graph.active]
        return State.BACKTRACK

    def _next_leg(self, robot: Robot) -> State:
        if len(self._target.path) < 2:
            return State.ARRIVED
        self._next = self._graph.nodes[self._target.path[1]]
        return State.ROTATE

    def _rotate(self, robot: Robot) -> State:
        return State.DRIVE_LEG if self._face(robot, self._next.place) else State.ROTATE

    def _drive_leg(self, robot: Robot) -> State:
        if not self._drive(robot, self._next.place):
            return State.BLOCKED if self._blocked(robot) else State.DRIVE_LEG
        if self._next is self._target:
            return State.ARRIVED
        self._graph.reached(self._next.number)  # it becomes active; the target's path begins there now
        return State.NEXT_LEG

    def _arrived(self, robot: Robot) -> State:
        self._graph.reached(self._target.number)
        return State.UPDATE_PATHS

    def _update_paths(self, robot: Robot) -> State:
        """R9; R14d, R14e: where it could not come before, it looks in all directions."""
        if self._target.number == self._retried or self._share < 1.0:
            self._look_around()
        else:
            self._headings = [self.pose[2] + math.pi]  # R15: a range finder of half a turn also looks back
        self._draw(robot)
        return State.SCAN

    def _block(self, robot: Robot) -> State:
        """R11 for a target; R14c for a node on the way there."""
        self._bases = [self._graph.active]
        if self._next is self._target and self._target.status == "pending":
            self._tried.add((self._target.number, self._graph.active))
            self._graph.blocked(self._target.number)
        elif self.second_pass:
            self._graph.bad_leg(self._graph.active, self._next.number)
        self._draw(robot)
        return State.BACKTRACK

    def _backtrack(self, robot: Robot) -> State:
        """Backward, until it can turn; then to the node where it was last, or, R14b, to another that is near."""
        if self._blocked_at is not None:
            robot.drive_speed(-self.turn_speed, -self.turn_speed)
            if math.dist(self.pose[:2], self._blocked_at) >= BACKWARD or robot.time - self._stood_s > BACKWARD_S:
                self._blocked_at, self._seen_s = None, robot.time
            return State.BACKTRACK
        place = self._graph.nodes[self._bases[-1]].place
        if math.dist(self.pose[:2], place) <= 2 * BACKWARD or self._drive(robot, place):
            self._graph.came_back(self._bases[-1])
            return State.SELECT
        if self._blocked(robot):  # R14b
            self._stood_s = robot.time
            self._bases.append(self._next_base())
        return State.BACKTRACK if len(self._bases) <= ATTEMPTS else State.FAILED

    def _next_base(self) -> int:
        """Of the nodes that it went back to least often, the nearest."""
        if not self.second_pass:
            return self._bases[-1]
        near = self._graph.nearest_completed(self.pose[:2])
        return min(near, key=lambda node: self._bases.count(node.number)).number

    def _end(self, robot: Robot) -> State:
        stand(robot, self._stood_s)
        return self.state

    # ---- movements ---------------------------------------------------------------------------------------------------

    def _turn(self, robot: Robot, heading: float) -> bool:
        """On the spot, to a heading (rad); True: it is there."""
        error = wrapped(heading - self.pose[2])
        if abs(error) < FACING:
            robot.drive_speed(0.0, 0.0)
            return True
        turn = math.copysign(
            min(self.turn_speed, SHARE_TO_TURN * robot.dimensions.speed, 0.01 + 0.2 * abs(error)), error
        )
        robot.drive_speed(-turn, turn)
        return False

    def _face(self, robot: Robot, place: Point) -> bool:
        x, y = self.pose[:2]
        return self._turn(robot, math.atan2(place[1] - y, place[0] - x))

    def _drive(self, robot: Robot, place: Point) -> bool:
        """To a place (m); True: it is there."""
        x, y, heading = self.pose
        to_x, to_y = place[0] - x, place[1] - y
        away = math.hypot(to_x, to_y)
        if away < self.reach:
            return True
        self.steer(robot, math.atan2(to_y, to_x) - heading, min(1.0, max(0.3, away / (4 * self.reach))))
        return False

    def _blocked(self, robot: Robot) -> bool:
        """Something is right before it, by its sonars or whiskers, or it comes no further."""
        x, y = self.pose[:2]
        if self.turning or math.dist((x, y), self._seen_at) > PROGRESS:
            self._seen_at, self._seen_s = (x, y), robot.time
        is_blocked_now = robot.time - self._seen_s > PROGRESS_S or (
            not self.turning and is_blocked(robot, self.near, self.sonars)
        )
        if is_blocked_now:
            self._blocked_at = x, y
        return is_blocked_now

    @property
    def _graph(self) -> ExplorationGraph:
        assert self.graph is not None
        return self.graph

    def _draw(self, robot: Robot) -> None:
        """The graph as it grows."""
        nodes, places = self._graph.nodes, [node.place for node in self._graph.nodes]
        if self.localization is None:
            frame, places = "start", placed(inverse(self.other(Odometry).origin), places)
        else:
            frame = "arena"
        for status in STATUSES:
            robot.sketch(status, points=[places[node.number] for node in nodes if node.status == status], frame=frame)
        robot.sketch(
            "legs", lines=[[places[number] for number in sorted(leg)] for leg in self._graph.legs], frame=frame
        )

    _states: ClassVar[dict[State, Callable[[Explore, Robot], State]]] = {
        State.INIT: _init,
        State.SCAN: _scan,
        State.PLACE: _place,
        State.TURN_SCAN: _turn_scan,
        State.SELECT: _select,
        State.ROTATE: _rotate,
        State.CHECK_DIRECT: _check_direct,
        State.DRIVE_DIRECT: _drive_direct,
        State.DRIVE_LEG: _drive_leg,
        State.NEXT_LEG: _next_leg,
        State.ARRIVED: _arrived,
        State.UPDATE_PATHS: _update_paths,
        State.BLOCKED: _block,
        State.BACKTRACK: _backtrack,
        State.RETRY_SELECT: _retry_select,
        State.DONE: _end,
        State.FAILED: _end,
    }


def half_width(robot: Robot) -> float:
    """Of the corridor that must be free (m)."""
    return robot.dimensions.radius + CLEARANCE
