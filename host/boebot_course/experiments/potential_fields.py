"""Navigation by potential fields: section 6.2 of the notes, Figs. 6.11 to 6.13, (6.1) to (6.7); E47 to E51.

The robot is the notes' own size, round and with odometry that does not drift; on a Boe-Bot all lengths are half as
long, and its encoders count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from boebot.brain import Brain, CognitiveProcess
from boebot.cognition import Odometry
from boebot.description.robots import RobotDescription, load_robot
from boebot.navigation import FollowField, Lattice, LineMap, LockDetector, Potential, PotentialField
from boebot.navigation.potential_field import waypoints
from boebot.robot import Robot
from boebot.view import style
from boebot_course.experiment import Axes, Figure, Floats, Measured, Outcome, Variant, about, exactly, experiment
from boebot_course.paths import floor
from boebot_course.trials import Trial, trial_seeds, try_once
from boebot_course.variants import exact_roller, scaled_arena

Point = tuple[float, float]
Pose = tuple[float, float, float]

# ---- E47: the gradient -----------------------------------------------------------------------------------------------

POINTS = 1000
POTENTIALS = 9
STEP = 1e-6  # m, of the differences
FIG_6_11_GOAL = Potential(2.0, 0.0, -1.0, 1.5, 1.5)
FIG_6_11_HILL = Potential(0.6, 0.2, 0.6, 0.35, 0.35)


def difference(field: PotentialField, points: Floats, step: float) -> float:
    """The greatest difference of the gradient from central differences over ± `step` (m), in 1/m."""
    sides = ((step, 0.0), (0.0, step))
    slopes = [(field.value(points + side) - field.value(points - side)) / (2 * step) for side in map(np.array, sides)]
    return float(np.abs(field.gradient(points) - np.stack(slopes, axis=-1)).max())


@experiment("E47")
def gradient(seed: int) -> Outcome:
    """The gradient of a potential field

    In the notes: section 6.2, Fig. 6.11, equations (6.1) to (6.3)

    Figure: Left: the field of one obstacle and a goal. Right: greatest difference of the gradient of nine random
    potentials from central differences, over the differences' step; dashed: in proportion to its square.

    Expected: Nine potentials of any place, height, widths and direction, 1000 points. Central differences over ± 1
    µm are good to 1e-6 / m, by rounding of the field's values.
    """
    chance = np.random.default_rng(seed)
    low, high = (-2, -2, -1, 0.3, 0.3, -math.pi), (2, 2, 1, 2, 2, math.pi)
    field = PotentialField.of(Potential(*row) for row in chance.uniform(low, high, (POTENTIALS, 6)))
    points = chance.uniform(-3, 3, (POINTS, 2))
    steps = 10.0 ** np.arange(-7, -0.9, 0.5)
    differences = [difference(field, points, step) for step in steps]
    steepest = float(np.hypot(*field.gradient(points).T).max())
    measured = [
        Measured("greatest difference from central differences", difference(field, points, STEP), "1/m", most=1e-6),
        Measured("steepest slope at the points", steepest, "1/m", least=0.1),
    ]

    def draw(figure: Figure) -> None:
        figure.set_figheight(4.0)
        left = figure.add_subplot(1, 2, 1, projection="3d")
        _draw_landscape(left, PotentialField.of([FIG_6_11_GOAL, FIG_6_11_HILL]), (-1, -1.5, 3, 1.5))
        right = figure.add_subplot(1, 2, 2)
        right.loglog(steps, differences, "o-", ms=4)
        right.loglog(steps[6:], 5 * differences[-1] * (steps[6:] / steps[-1]) ** 2, "--", color="0.5", label="slope 2")
        right.legend()
        right.set(xlabel="step of the differences (m)", ylabel="greatest difference (1/m)")

    return Outcome(measured, {"step_m": steps, "difference_per_m": differences}, draw)


def _draw_landscape(axes: Axes, field: PotentialField, box: tuple[float, float, float, float]) -> None:
    """As a landscape; `box`: x and y from, x and y to (m)."""
    x, y = np.meshgrid(np.linspace(box[0], box[2], 61), np.linspace(box[1], box[3], 61))
    axes.plot_surface(x, y, field.value(np.dstack((x, y))), cmap="viridis", linewidth=0, rcount=61, ccount=61)  # type: ignore[attr-defined]
    axes.set(xlabel="x (m)", ylabel="y (m)", title="Φ(x, y)", facecolor="none")
    axes.tick_params(labelsize=8)
    axes.locator_params(nbins=5)
    axes.set_box_aspect((1.0, (box[3] - box[1]) / (box[2] - box[0]), 0.45))  # type: ignore[arg-type]


# ---- robots in fields ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class World:
    """A robot, and the size of all that is about it.

    Attributes:
        scale: of the notes' lengths.
        drift: how far odometry may be off after a run (m).
        without: imperfections that it does not have.
    """

    robot: RobotDescription
    on: str | None
    scale: float
    speed: float
    turn_speed: float
    drift: float
    without: tuple[str, ...] = ()

    @property
    def radius(self) -> float:
        """Of the robot (m)."""
        return self.robot.body.radius_m

    def size(self, potential: Potential) -> Potential:
        """One of the notes' potentials in this size."""
        return replace(potential, **{key: getattr(potential, key) * self.scale for key in ("x", "y", "beta", "gamma")})

    def follower(self, goal: Potential, hills: Sequence[Potential] = ()) -> FollowField:
        """V_nav and V_rot of this robot; arrives within 0.1 m, passes within 0.25 m, in this size."""
        return FollowField(
            goal=self.size(goal),
            hills=[self.size(hill) for hill in hills],
            speed=self.speed,
            turn_speed=self.turn_speed,
            arrival=ARRIVAL * self.scale,
            passing=PASSING * self.scale,
        )

    def drive(
        self,
        behavior: FollowField,
        arena: str | Path,
        start: Pose,
        seconds: float,
        seed: int,
        *others: CognitiveProcess,
    ) -> Trial:
        """From a pose of the notes' size (m, m, rad)."""
        x, y, heading = start
        pose = x * self.scale, y * self.scale, heading
        brain = Brain([behavior, Odometry(start=pose), *others], period=PERIOD)
        return try_once(brain, self.robot, arena, seconds, pose=pose, seed=seed, on=self.on, without=self.without)


ARRIVAL, PASSING = 0.1, 0.25  # m
PERIOD = 0.05  # s


def roller() -> World:
    """The notes' size; V_nav = 0.2 m/s, V_rot = 0.1 m/s; odometry without noise."""
    return World(exact_roller(), None, 1.0, 0.2, 0.1, 1e-6)


def shieldbot() -> World:
    """Half that size; V_nav = 0.12 m/s; its encoders tell directions and miss nothing, its servos are centred.

    With encoders of one channel, which leave the direction open, odometry is 0.2 m off after such a way.
    """
    exact = ("encoder_errors", "servo_centre")
    return World(load_robot("shieldbot-quad"), "avr", 0.5, 0.12, 0.06, 0.03, without=exact)


BOE_BOT = "shieldbot-quad (avr), its encoders without errors, its servos centred"


def _draw_field(axes: Axes, field: PotentialField, trial: Trial, low: float, high: float) -> None:
    """An arena with contours of a field between two heights."""
    floor(axes, trial.plan)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 150), np.linspace(bottom, top, 150))
    height = np.clip(field.value(np.dstack((x, y))), low, high)
    levels = np.linspace(low, high, 15)
    axes.contourf(x, y, height, levels=levels, cmap="viridis", alpha=0.3, zorder=0.9)
    axes.contour(x, y, height, levels=levels[1:-1], colors="#5b6577", linewidths=0.5, zorder=1.0)


def _draw_goal(axes: Axes, behavior: FollowField) -> None:
    from matplotlib.patches import Circle

    place = behavior.goal.x, behavior.goal.y
    axes.add_patch(Circle(place, behavior.arrival, facecolor="#f0e442", edgecolor="#39415a", lw=1.0, zorder=5))


def _draw_way(axes: Axes, trial: Trial, number: int, line: str = "-", width: float = 1.6) -> None:
    from boebot.view.painter import draw_robot

    axes.plot(*trial.path.T, line, color=style.colour(number), lw=width, zorder=6)
    draw_robot(axes, trial.result.robot, trial.start, style.colour(number))


def _columns(trials: Sequence[Trial]) -> dict[str, list[float]]:
    """True paths, ten points for each second."""
    shown = [(number, index) for number, one in enumerate(trials, 1) for index in _tenths(one)]
    return {
        "run": [number for number, _ in shown],
        "time_s": [float(trials[number - 1].time[index]) for number, index in shown],
        "true_x_m": [float(trials[number - 1].path[index, 0]) for number, index in shown],
        "true_y_m": [float(trials[number - 1].path[index, 1]) for number, index in shown],
    }


def _tenths(trial: Trial) -> list[int]:
    times = np.arange(0.0, float(trial.time[-1]), 0.1)
    return np.searchsorted(trial.time, times).tolist()  # type: ignore[no-any-return]


# ---- E48: four pillars -----------------------------------------------------------------------------------------------

CORNER = Potential(-1.3, 1.3, -1.0, 3.0, 3.0)
ROOM = [
    *(Potential(0, y, 0.4, 2.2, 0.2) for y in (-1.8, 1.8)),
    *(Potential(x, 0, 0.4, 0.2, 2.2) for x in (-1.8, 1.8)),
    *(Potential(x, y, 0.5, 0.3, 0.3) for x in (-0.7, 0.7) for y in (-0.7, 0.7)),
]
STARTS: list[Pose] = [(1.3, -1.0, 0.0), (1.3, 1.3, 0.0), (-1.3, -1.3, 0.0), (0.0, -1.2, 0.0)]


@experiment(
    "E48",
    on={
        "roller": Variant("roller, its odometer without noise", roller, 26.0),
        "avr": Variant(BOE_BOT, shieldbot, 32.0, slow=True),
    },
)
def among_pillars(make: Callable[[], World], seconds: float, seed: int) -> Outcome:
    """Down a potential field past four pillars

    In the notes: section 6.2, Fig. 6.12

    Figure: Left: a field of nine potentials, one of the goal, four of the walls and four of the pillars. Right: its
    contours, and the robot's paths from four starts to the goal (yellow).

    Expected: It arrives within 0.1 m, and its middle stays farther than its radius and 0.05 m from all lines. The
    goal's minimum is within half of 0.1 m.

    Expected on avr: All lengths are half of the notes' ones; the robot has its own radius, and arrives within 0.05 m by
    its odometry. Odometry by encoders may be 0.03 m off at the end: edges are 1.6 mm apart, so that the heading is
    known to 0.016 rad, on a way of less than 2 m. Its middle stays farther than its radius and 0.05 m from all lines.
    """
    world = make()
    followers, trials = [], []
    starts = list(zip(STARTS, trial_seeds(seed, len(STARTS)), strict=True))
    with scaled_arena("pillars", world.scale) as arena:
        plan = LineMap.of(arena)
        for start, trial_seed in starts:
            followers.append(world.follower(CORNER, ROOM))
            trials.append(world.drive(followers[-1], arena, start, seconds, trial_seed))
    goal, arrival = followers[0].goal, followers[0].arrival
    field = PotentialField.of([goal, *followers[0].hills])
    lowest = field.minimum_near(goal.x, goal.y) or (math.nan, math.nan)
    ends = [math.dist(trial.end[:2], (goal.x, goal.y)) for trial in trials]
    clear = [float(plan.distance(trial.path).min()) for trial in trials]
    measured = [
        exactly("starts from which it arrives", sum(one.arrived for one in followers), len(STARTS)),
        Measured("farthest end from the goal", max(ends), "m", most=arrival + world.drift),
        Measured("least distance of its middle from wall or pillar", min(clear), "m", least=world.radius + 0.05),
        Measured("true contacts", float(sum(trial.result.true_contacts or 0 for trial in trials)), most=0.0),
        Measured("minimum of the field, off the goal", math.dist(lowest, (goal.x, goal.y)), "m", most=arrival / 2),
    ]

    def draw(figure: Figure) -> None:
        figure.set_figheight(4.2)
        left = figure.add_subplot(1, 2, 1, projection="3d")
        reach = 1.8 * world.scale
        _draw_landscape(left, field, (-reach, -reach, reach, reach))
        right = figure.add_subplot(1, 2, 2)
        _draw_field(right, field, trials[0], -1.0, 0.2)
        _draw_goal(right, followers[0])
        for number, trial in enumerate(trials, 1):
            _draw_way(right, trial, number)

    return Outcome(measured, _columns(trials), draw)


# ---- E49: locked -----------------------------------------------------------------------------------------------------

BEHIND = Potential(2.0, 0.0, -1.0, 2.0, 2.0)
WEDGE = [Potential(1.0, 0.0, 0.45, 0.25, 0.25), *(Potential(0.8, y, 0.45, 0.3, 0.2) for y in (-0.35, 0.35))]
BESIDE = Potential(0.8, 0.35, 0.45, 0.3, 0.2)  # one of them alone
AHEAD: list[Pose] = [(-1.0, 0.0, 0.0), (-1.0, 0.05, 0.0)]


@experiment("E49", robot="roller, its odometer without noise")
def locked(seed: int) -> Outcome:
    """Locked in a wedge

    In the notes: section 6.2, Fig. 6.13

    Figure: Left: contours of the field of a goal at (2, 0) and of the three hills of a wedge, and paths from two
    starts (line, dashes). Right: distance from the goal, also without the wedge, and with one of its hills only.

    Expected: Where the slopes of goal and hills cancel on the axis, at x = 0.57 m, the field has a minimum of
    -0.553. Without hills, and with one of them, the robot arrives.
    """
    world = roller()
    field = PotentialField.of([BEHIND, *WEDGE])
    lowest = field.minimum_near(0.5, 0.05) or (math.nan, math.nan)
    runs = [(WEDGE, AHEAD[0], "wedge", 40.0), (WEDGE, AHEAD[1], "wedge", 40.0)]
    runs += [([], AHEAD[0], "empty", 20.0), ([BESIDE], AHEAD[0], "empty", 20.0)]
    followers, trials = [], []
    for hills, start, arena, seconds in runs:
        followers.append(world.follower(BEHIND, hills))
        trials.append(world.drive(followers[-1], arena, start, seconds, seed))
    held, free = trials[:2], trials[2:]
    before = [one.path[np.searchsorted(one.time, one.time[-1] - 10.0)] for one in held]
    drifts = [math.dist(one.end[:2], place) for one, place in zip(held, before, strict=True)]
    measured = [
        about("minimum of the field at x", lowest[0], 0.57, 0.01, "m"),
        about("its height", float(field.value(lowest)), -0.553, 0.001),
        *(about(f"start {n}: x at the end", one.end[0], 0.57, 0.03, "m") for n, one in enumerate(held, 1)),
        Measured(
            "distance from the axis at the end, the farther", max(abs(one.end[1]) for one in held), "m", most=0.02
        ),
        Measured("where it was 10 s before, off where it ends", max(drifts), "m", most=0.01),
        exactly("arrives without hills, and with one", sum(one.arrived for one in followers[2:]), 2),
    ]

    def draw(figure: Figure) -> None:

        figure.set_figheight(3.5)
        left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
        _draw_field(left, field, held[0], -1.0, 0.0)
        _draw_goal(left, followers[0])
        looks = (("wedge", "-", 3.0), ("0.05 m beside", "--", 1.4), ("no hill", "-", 8.0), ("one hill", "-", 5.0))
        for number, (trial, (label, line, width)) in enumerate(zip(trials, looks, strict=True), 1):
            if number <= len(held):
                _draw_way(left, trial, number, line, width)
            away = np.hypot(*(trial.path - (BEHIND.x, BEHIND.y)).T)
            right.plot(trial.time, away, line, color=style.colour(number), lw=width, label=label, zorder=9 - width)
        right.set(xlabel="time (s)", ylabel="distance from the goal (m)", ylim=(0, 3.2))
        right.legend(loc="upper right")

    return Outcome(measured, _columns(held + free), draw)


# ---- E50: waypoints --------------------------------------------------------------------------------------------------

AROUND = [(0.3, 0.8), (1.0, 0.95)]  # the notes' figure has none: see the criterion


@dataclass(kw_only=True)
class PutWaypoints(CognitiveProcess):
    """Puts valleys on the way when the run begins."""

    field: FollowField
    valleys: Sequence[Potential]

    def enter(self, robot: Robot) -> None:
        self.field.way = list(self.valleys)

    def step(self, robot: Robot) -> None:
        """They are put once."""


@experiment(
    "E50",
    on={
        "roller": Variant("roller, its odometer without noise", roller),
        "avr": Variant(BOE_BOT, shieldbot, slow=True),
    },
)
def past_the_wedge(make: Callable[[], World], seed: int) -> Outcome:
    """Waypoints lead around a wedge

    In the notes: section 6.2

    Figure: Paths past the wedge to the goal (yellow), with contours of the field. Left: two waypoints (diamonds) from
    the start; right: valleys at the corners of a path around, put where the robot comes no further.

    Expected: The notes do not say where waypoints are put: (0.3, 0.8) and (1.0, 0.95), valleys of -1.2 and 0.6 m, which
    go when the robot is within 0.25 m. It arrives within 25 s; with the lock detector, which waits 5 s, within 50 s.

    Expected on avr: The same in half the size, with the drift of E48.
    """
    world, seconds = make(), 25.0
    ends = [(0.0, 0.0), *AROUND, (0.0, 0.0)]
    valleys = [world.size(valley) for valley in waypoints(ends)]
    with scaled_arena("wedge", world.scale) as arena:
        plan = LineMap.of(arena)
        keep = world.radius + 0.2 * world.scale
        lattice = Lattice.of(plan, world.radius, 0.2 * world.scale, 0.1 * world.scale)
        given, alone = world.follower(BEHIND, WEDGE), world.follower(BEHIND, WEDGE)
        put = PutWaypoints(field=given, valleys=valleys)
        detector = LockDetector(field=alone, plan=plan, lattice=lattice, clearance=keep, distance=0.05 * world.scale)
        first = world.drive(given, arena, AHEAD[0], seconds, seed, put)
        second = world.drive(alone, arena, AHEAD[0], 2 * seconds, seed, detector)
    measured = []
    for name, behavior, trial in (("given waypoints", given, first), ("lock detector", alone, second)):
        away = np.hypot(*(trial.path - (behavior.goal.x, behavior.goal.y)).T)
        measured += [
            exactly(f"{name}: arrives (1: yes)", behavior.arrived, 1),
            Measured(f"{name}: end from the goal", float(away[-1]), "m", most=behavior.arrival + world.drift),
            exactly(f"{name}: waypoints that are left", len(behavior.way), 0),
            Measured(f"{name}: true contacts", float(trial.result.true_contacts or 0), most=0.0),
        ]
    measured.append(Measured("times at which the detector noticed", len(detector.locked), least=1))
    field = PotentialField.of([given.goal, *given.hills, *valleys])

    def draw(figure: Figure) -> None:
        figure.set_figheight(4.0)
        left, right = figure.subplots(1, 2, sharey=True)
        for axes, behavior, trial, title in (
            (left, given, first, "waypoints from the start"),
            (right, alone, second, "lock detector"),
        ):
            shown = field if trial is first else PotentialField.of([alone.goal, *alone.hills])
            _draw_field(axes, shown, trial, -1.6, 0.0)
            _draw_goal(axes, behavior)
            _draw_way(axes, trial, 1)
            axes.set_title(title, fontsize=10)
        left.plot(*np.array([(valley.x, valley.y) for valley in valleys]).T, "D", color="#cc79a7", ms=6, zorder=7)

    return Outcome(measured, _columns([first, second]), draw)


# ---- E51: turning on the spot ----------------------------------------------------------------------------------------

ABOVE, BELOW = math.pi / 3, math.pi / 12  # rad; it turns on the spot beyond the first, until it is within the second
HEADINGS = [0.8, -0.8, 1.3, -1.3, 2.2, -2.2, 3.0]  # rad; the first two are below π/3


@dataclass(frozen=True)
class Turn:
    """A start under a heading, and what came of it.

    Attributes:
        error: φ_ref - φ at each sample of the path (rad).
        commands: sample, v_L and v_R (m/s) of each step.
    """

    heading: float
    trial: Trial
    error: Floats
    commands: list[tuple[int, float, float]]

    @property
    def spot(self) -> list[tuple[int, float, float]]:
        """Commands that turn it on the spot."""
        return [one for one in self.commands if one[1] * one[2] < 0]

    @property
    def goes_on(self) -> int:
        """Sample of the first command after those."""
        last = max((index for index, *_ in self.spot), default=-1)
        return min((index for index, *_ in self.commands if index > last), default=len(self.error) - 1)

    @property
    def shift(self) -> float:
        """How far its middle moved until then (m)."""
        return float(np.hypot(*(self.trial.path[: self.goes_on + 1] - self.trial.path[0]).T).max())


def turned(world: World, heading: float, seed: int) -> Turn:
    """From the origin, with the goal in +x; the field has nothing else."""
    behavior = world.follower(BEHIND)
    trial = world.drive(behavior, "empty", (0.0, 0.0, heading), 5.0, seed)
    truth = trial.result.true_pose
    assert truth is not None
    x, y = trial.path.T
    error = np.remainder(np.arctan2(-y, behavior.goal.x - x) - truth.heading + math.pi, 2 * math.pi) - math.pi
    return Turn(heading, trial, error, [(index, left, right) for index, _, left, right in trial.result.record.steps])


def _begins_on_spot(one: Turn) -> bool:
    """Its first command turns it on the spot, and so do all until it goes on."""
    return bool(one.spot) and one.spot == one.commands[: len(one.spot)]


@experiment(
    "E51",
    on={
        "roller": Variant("roller, its odometer without noise", roller, 0.22, BELOW, 1e-3),
        "avr": Variant(BOE_BOT, shieldbot, 0.02, BELOW + 0.016, 0.0065, slow=True),
    },
)
def facing_away(make: Callable[[], World], least: float, most: float, shift: float, seed: int) -> Outcome:
    """Facing away from the goal it turns on the spot first

    In the notes: section 6.2, equations (6.5) to (6.7)

    Figure: Left: heading error from seven starts; dots: where the robot stops turning on the spot and goes on. Right:
    set-points of the wheels from the start with the largest error.

    Expected: It turns on the spot where the error is beyond π/3, by the shorter way, until it is within π/12. It turns
    by 0.042 rad in a step of 0.05 s: it goes on at π/12 less that, 0.22 rad, or more.

    Expected on avr: The heading is known to 0.016 rad, as edges are 1.6 mm apart. By the servos' curve 0.06 m/s are
    0.125 m/s, 2.4 rad/s: in a step of 0.05 s, with a reading 0.05 s old, it turns by 0.24 rad, and goes on at 0.02 rad
    or more. Servos differ by 2.9 % each (1 σ), the speeds of two by 4.1 %: a quarter of that of the track width is the
    distance of its middle from the centre of the turn, with three of them 3.2 mm, and half a turn about it takes the
    middle 6.5 mm away.
    """
    # `least`, `most`: heading error at which it goes on (rad); `shift`: of its middle while it turns (m)
    world = make()
    turns = [turned(world, heading, seed) for heading in HEADINGS]
    far = [one for one in turns if abs(one.heading) > ABOVE]
    near = [one for one in turns if abs(one.heading) <= ABOVE]
    errors = [abs(float(one.error[one.goes_on])) for one in far]
    commands = [(one.heading, left, right) for one in far for _, left, right in one.spot]
    sums = [abs(left + right) for _, left, right in commands]
    measured = [
        exactly("starts beyond π/3 that turn on the spot first", sum(_begins_on_spot(one) for one in far), len(far)),
        exactly("starts within π/3 that turn on the spot", sum(bool(one.spot) for one in near), 0),
        Measured("largest |v_L + v_R| while they turn", max(sums, default=math.nan), "m/s", most=1e-9),
        exactly(
            "commands that turn the longer way",
            sum(heading * (right - left) > 0 for heading, left, right in commands),
            0,
        ),
        Measured("largest heading error at which they go on", max(errors), "rad", most=most),
        Measured("smallest", min(errors), "rad", least=least),
        Measured("farthest that a middle moves while it turns", max(one.shift for one in far), "m", most=shift),
    ]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2)
        for number, one in enumerate(turns):
            left.plot(one.trial.time, one.error, color=f"C{number}", lw=1.4)
            left.plot(one.trial.time[one.goes_on], one.error[one.goes_on], "o", color=f"C{number}", ms=4)
        for bound, dashes, name in ((ABOVE, "--", "π/3"), (BELOW, ":", "π/12")):
            left.axhline(bound, color="0.4", lw=1.0, ls=dashes, label=name)
            left.axhline(-bound, color="0.4", lw=1.0, ls=dashes)
        left.set(xlabel="time (s)", ylabel="heading error (rad)", xlim=(0, 5))
        left.legend(loc="upper right")
        last = turns[-1]
        times = [float(last.trial.time[index]) for index, *_ in last.commands]
        for column, name in ((1, "v_L"), (2, "v_R")):
            right.step(times, [one[column] for one in last.commands], where="post", lw=1.4, label=name)
        right.set(xlabel="time (s)", ylabel="set-points of the wheels (m/s)", xlim=(0, 5))
        right.legend(loc="lower right")

    rows = [(one, index) for one in turns for index in range(0, len(one.error), 10)]
    data = {
        "heading_at_start_rad": [one.heading for one, _ in rows],
        "time_s": [float(one.trial.time[index]) for one, index in rows],
        "heading_error_rad": [float(one.error[index]) for one, index in rows],
    }
    return Outcome(measured, data, draw)
