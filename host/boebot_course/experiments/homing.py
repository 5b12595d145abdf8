"""Cataglyphis, the desert ant that runs straight home from wherever it has strayed: section 4.4.4 of the notes, E33.

The brain wanders until it has found food, which here lies at the end of a way of given length; then it goes home by its
home vector and searches there (docs/reference/notes.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boebot import run
from boebot.behaviors import Homing, Wander
from boebot.brain import Brain, MotorBehavior, StateVariable, Utility
from boebot.cognition import Odometry, PathIntegration
from boebot.description.robots import RobotDescription
from boebot.devices.compass import TESLA_PER_COUNT
from boebot.robot import Robot
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, Variant, experiment
from boebot_course.trials import PER_SEED, Log, decisions, true_pose
from boebot_course.variants import varied

PERIOD = 0.02  # s
SIGNAL = 0.9  # motor signal out and home
SECONDS = 285.0  # 200 m out take some 225 s, the way home 30 s at most


@dataclass(frozen=True)
class Journey:
    """A way out, home, and the search."""

    x: Floats
    """m from the nest, at each step"""
    y: Floats
    vector: Floats
    """h (m), shape (steps, 2)"""
    left: int
    """step at which it found food"""
    arrived: int | None
    """step at which the search began"""

    @property
    def error(self) -> float:
        """How far from the nest the home vector points as the search begins (m); infinite if it never did."""
        if self.arrived is None:
            return math.inf
        east, north = self.vector[self.arrived]
        return math.hypot(self.x[self.arrived] + east, self.y[self.arrived] + north)

    @property
    def distance(self) -> float:
        """How far from the nest the search begins (m); infinite if it never did."""
        return math.inf if self.arrived is None else math.hypot(self.x[self.arrived], self.y[self.arrived])

    @property
    def nearest(self) -> float:
        """How near to the nest the search passes (m); infinite if there was none."""
        return (
            math.inf if self.arrived is None else float(np.hypot(self.x[self.arrived :], self.y[self.arrived :]).min())
        )


def journey(robot: RobotDescription, way: float, seconds: float, seed: int) -> Journey:
    """One journey with a way out of that length (m), on that robot."""
    path = PathIntegration()
    log = Log(read=lambda _, robot: (robot.time, *path.vector))
    homing = Homing(signal=SIGNAL, utility=Utility(b=-1.0, w={"food": 4.0}))
    wander = Wander(forward=SIGNAL, utility=Utility(b=0.5))
    food = StateVariable("food", lambda robot: float(path.travelled >= way))
    brain = Brain([wander, homing, Odometry(), path, log], [food], period=PERIOD)
    result = run(brain, robot=robot, arena="empty", seconds=seconds, seed=seed)
    rows = np.array(log.rows)
    pose = true_pose(result, rows[:, 0])
    began = [switch.time for switch in decisions(result).switches if switch.on == homing.name]
    left = int(np.searchsorted(rows[:, 0], began[0] - 1e-9)) if began else len(rows) - 1
    arrived = None if homing.arrived is None else int(np.searchsorted(rows[:, 0], homing.arrived - 1e-9))
    return Journey(pose.x - pose.x[0], pose.y - pose.y[0], rows[:, 1:], left, arrived)


def ant(compass: float, way: float) -> RobotDescription:
    """arsim with these errors: of the compass (rad), and of the way in each step of the brain (share of it)."""
    # Δs = (Δs_L + Δs_R) / 2 over n = 2 steps of the odometer: its noise is σ_step √(n / 2) = σ_step
    step = way * SIGNAL * 1.381 * PERIOD
    return varied("arsim", "ant", compass={"sigma_rad": compass}, odometer={"sigma_step_m": step})


@dataclass(kw_only=True)
class Spin(MotorBehavior):
    """Turns on the spot and keeps what the compass says: how its owner calibrates it.

    Attributes:
        fields: (x, y) in tesla.
    """

    NEEDS = ("compass",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.fields: list[tuple[float, float]] = []

    def step(self, robot: Robot) -> None:
        robot.drive(-SIGNAL, SIGNAL)
        field = getattr(robot.compass, "field", None)
        if robot.compass.valid and field is not None and field[:2] not in self.fields[-1:]:
            self.fields.append(field[:2])


def calibrated(seed: int) -> RobotDescription:
    """shieldbot with a compass, whose own iron has been measured by turning it on the spot: the circle's middle."""
    spin = Spin()
    raw = varied("shieldbot", "shieldbot-compass", compass={"on": True})
    run(Brain([spin], period=PERIOD), robot=raw, arena="empty", seconds=5.0, seed=seed)
    offset = middle(np.array(spin.fields) / TESLA_PER_COUNT)
    return varied("shieldbot", "shieldbot-compass", compass={"on": True, "offset_counts": offset})


def middle(points: Floats) -> tuple[float, float]:
    """Of the circle through points, shape (n, 2), by least squares: x² + y² = 2 x_0 x + 2 y_0 y + c."""
    matrix = np.column_stack((2 * points, np.ones(len(points))))
    (x, y, _), *_ = np.linalg.lstsq(matrix, (points**2).sum(axis=1), rcond=None)
    return float(x), float(y)


@experiment(
    "E33",
    on={
        "arsim": Variant("arsim (compass 0.05 rad, odometer 2 % of each step; and without noise)", None, slow=True),
        "shieldbot": Variant("shieldbot with its compass (native)", "native", slow=True),
    },
)
def cataglyphis(on: str | None, seed: int) -> Outcome:
    """Cataglyphis finds home by path integration

    In the notes: section 4.4.4, Cataglyphis

    Figure: A random way out, of 200 m or of shieldbot's 20 m, the way home by the home vector, and the search about the
    place where it ends.

    Expected: After 200 m the home vector is at most 0.4 m off in the mean, 0.05 m without noise; search: 0.1 m.

    Expected on shieldbot: The way is 20 m, a tenth of the notes' as its speed is. Iron, 0.3 of the earth's field,
    would lead astray by 0.3 / 2 of the way, 3 m; turning on the spot measures it, by 120 readings of 0.01 each, to
    0.0013: 0.0013 / 2 × 20 m = 0.013 m is left. Some 400 reversals of a wheel miscount an edge of 3.25 mm each, at
    headings by chance: √400 × 3.25 mm / 2 = 0.033 m. Compass noise of 0.01 rad each 6 mm: 0.004 m. Together 0.036
    m; three times that and the 0.1 m at which the search begins: 0.21 m.
    """
    if on is None:
        noise = [(0.05, 0.02, number) for number in range(4)] + [(0.0, 0.0, number) for number in range(2)]
        journeys = [
            journey(ant(compass, way), 200.0, SECONDS, seed + PER_SEED * number) for compass, way, number in noise
        ]
        found, exact = journeys[:4], journeys[4:]
        measured = [
            Measured("home vector's error, mean of 4", float(np.mean([one.error for one in found])), "m", most=0.4),
            Measured("the same without noise, the greater of 2", max(one.error for one in exact), "m", most=0.05),
        ]
    else:
        seeds = (seed, seed + PER_SEED)
        found = [journey(calibrated(trial_seed), 20.0, 210.0, trial_seed) for trial_seed in seeds]
        farther = max(one.distance for one in found)
        measured = [Measured("search begins from the nest, the farther of 2", farther, "m", most=0.21)]
    measured.append(Measured("the search passes the nest within", max(one.nearest for one in found), "m", most=0.1))
    one = found[0]
    shown = slice(None, None, 5)
    steps = np.arange(len(one.x))
    arrived = len(steps) if one.arrived is None else one.arrived
    phase = np.where(steps < one.left, "out", np.where(steps < arrived, "home", "search"))
    data = {
        "time_s": (steps * PERIOD)[shown],
        "phase": phase[shown],
        "true_x_m": one.x[shown],
        "true_y_m": one.y[shown],
        "home_x_m": one.vector[shown, 0],
        "home_y_m": one.vector[shown, 1],
    }

    def draw(figure: Figure) -> None:
        whole, near = figure.subplots(1, 2)
        for axes in (whole, near):
            _draw_phases(axes, one, arrived)
            axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
        whole.plot(one.x[one.left], one.y[one.left], "s", color="#cc79a7", label="food", zorder=5)
        whole.set_title("way out and home", fontsize=10)
        whole.set_adjustable("datalim")
        near.set_title("search", fontsize=10)
        after = slice(arrived, None)
        reach = 1.15 * max(0.3, *np.abs(one.x[after]), *np.abs(one.y[after])) if arrived < len(steps) else 1.0
        near.set(xlim=(-reach, reach), ylim=(-reach, reach))
        handles, labels = whole.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=9, frameon=False)

    return Outcome(measured, data, draw)


def _draw_phases(axes: Axes, one: Journey, arrived: int) -> None:
    for name, color, width, begin, end in (
        ("out", "#9aa3b5", 0.8, 0, one.left),
        ("home", "#0072b2", 1.6, one.left, arrived),
        ("search", "#d55e00", 1.0, arrived, len(one.x)),
    ):
        axes.plot(one.x[begin:end], one.y[begin:end], color=color, linewidth=width, label=name)
    axes.plot(0, 0, "*", color="#009e73", markersize=13, label="nest", zorder=6)
