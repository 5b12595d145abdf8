"""Office tasks: a robot at a random place of the office is told once to go to another, and finds its way there on the
map while odometry drifts and scans correct it (sections 6.2 and 6.3 of the notes).

It has arrived if it says so and stands within 0.15 m of its goal; if it says so and stands farther away, it believes
to be where it is not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from boebot import Robot, run
from boebot.brain import Brain, CognitiveProcess, Utility
from boebot.cognition import Odometry
from boebot.navigation import Estimator, GoTo, LineMap, Localization, RandomSearch
from boebot_course.experiments.exploring import starts
from boebot_course.trials import trial_seeds

Point = tuple[float, float]
Pose = tuple[float, float, float]

ARENA = "office"
THERE_M = 0.15  # from the goal
TASKS = 100
SEED = 1


@dataclass(frozen=True)
class Rules:
    """What a robot is given for a task.

    Attributes:
        speed, turn_speed: of its wheels on the way and in turns (m/s).
        box: of the random search (m, m, rad).
        every: s from scan to scan.
        seconds: for the task.
    """

    speed: float
    turn_speed: float
    every: float
    seconds: float
    box: Pose = RandomSearch.box


RULES = {
    "roller": Rules(speed=0.25, turn_speed=0.1, every=8.0, seconds=60.0),
    "shieldbot-turret": Rules(speed=0.12, turn_speed=0.06, every=20.0, seconds=180.0, box=(0.15, 0.15, 0.3)),
}


class Errand(CognitiveProcess):
    """Says once where to go."""

    goal: Point = (0.0, 0.0)

    def step(self, robot: Robot) -> None:
        if self.other(GoTo).goal is None:
            self.other(GoTo).go(self.goal)


def errand(plan: LineMap, start: Pose, goal: Point, rules: Rules = RULES["roller"]) -> tuple[Brain, GoTo]:
    """A brain that goes to a place."""
    estimator: Estimator = RandomSearch(box=rules.box)
    due = Utility(b=-1.0, w={"due": 3.0}, tau=0.05)
    localization = Localization(plan=plan, start=start, every=rules.every, estimator=estimator, utility=due)
    go = GoTo(localization=localization, speed=rules.speed, turn_speed=rules.turn_speed, utility=Utility(b=0.5))
    order = Errand()
    order.goal = goal
    return Brain([Odometry(), localization, order, go], [localization.due_variable]), go


@dataclass(frozen=True)
class Task:
    """One of them."""

    robot: str
    on: str | None
    start: Pose
    goal: Point
    seed: int


@dataclass(frozen=True)
class Ended:
    """How a task ended.

    Attributes:
        said: the robot says that it has arrived.
        away: from where it really stands to the goal (m).
        lost, no_path: it says so.
    """

    task: Task
    said: bool
    away: float
    lost: bool
    no_path: bool

    @property
    def has_arrived(self) -> bool:
        return self.said and self.away < THERE_M

    @property
    def is_mistaken(self) -> bool:
        """It believes to be where it is not."""
        return self.said and self.away >= THERE_M


def tasks(robot: str, count: int, on: str | None = None) -> list[Task]:
    """The first so many of a hundred that stay the same."""
    places = starts(ARENA, SEED, 2 * TASKS)
    pairs = zip(places[::2], places[1::2], trial_seeds(SEED, count), strict=False)
    return [Task(robot, on, start, goal[:2], seed) for start, goal, seed in pairs]


def tried(task: Task) -> Ended:
    """Runs it."""
    rules = RULES[task.robot]
    brain, go = errand(LineMap.of(ARENA), task.start, task.goal, rules)
    result = run(
        brain,
        robot=task.robot,
        arena=ARENA,
        pose=task.start,
        on=task.on,
        seconds=rules.seconds,
        seed=task.seed,
    )
    assert result.true_pose is not None
    end = float(result.true_pose.x[-1]), float(result.true_pose.y[-1])
    return Ended(task, go.arrived, math.dist(end, task.goal), go.lost, go.no_path)
