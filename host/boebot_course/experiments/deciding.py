"""Other ways to decide than by utility functions: section 8.1.1 of the notes, on the demonstration brain's task.

Its four motor behaviors, with the same readings, state variables and utilities. A behavior *calls* while its utility
is at least that of Wander, which always calls. Only who drives then differs:

    utilities    the one of the highest utility; this is the demonstration brain itself
    priorities   the first that calls, in a fixed order, as layers of a subsumption architecture (Brooks 1986)
    tree         a behavior tree of the package py-trees: a selector of the same order, but once it has begun
                 to charge, it goes on until the battery is full or a behavior before it calls
    voting       as DAMN (Rosenblatt 1997): all that call vote on each of a set of commands, the more the nearer it
                 is to their own; votes are summed up by fixed weights, and the command of the highest sum drives

What is measured was chosen before the first run: the way driven, which is what the task is paid for; contacts; time
on the charger; and in how many runs the battery ran down. As the body never touched anything, touches of the whiskers
were then counted, too. Starts and seeds are the same for all ways.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from boebot import missing, rates
from boebot.arenas import load_arena
from boebot.behaviors import ChargeBattery
from boebot.brain import Brain, MotorBehavior, Utility
from boebot.robot import Command, Robot
from boebot_course.experiment import Figure, Floats, Measured, Outcome, experiment
from boebot_course.experiments import economics
from boebot_course.trials import decisions, trial_seeds

SECONDS, PAIRS = 120.0, 24
ORDER = ("withdraw", "avoid", "charge", "wander")  # the most urgent first
WEIGHTS = {name: 2.0**-place for place, name in enumerate(ORDER)}  # of votes
SIGNALS = np.round(np.arange(-0.7, 0.71, 0.05), 2)  # of each wheel, that are voted on
WIDTH = 0.25  # σ of a vote over motor signals: commands nearer than two of them have one best between them
FARTHEST_WITHOUT = 1.1 * 48.5 * 0.152  # m, of a robot that never charges (robot-economics)
FIGURES = {
    "way_m": ("way driven", "m", FARTHEST_WITHOUT),
    "touches": ("touches of whiskers", "", -math.inf),
    "charging_s": ("time on the charger", "s", -math.inf),
}
"""Those of a run that are compared: in words, unit, and the least mean that is expected."""
Rule = Callable[["Arbiter", Sequence[str]], Sequence[str]]
"""Who drives, of those that call, in ORDER."""


@dataclass(kw_only=True)
class Arbiter(MotorBehavior):
    """Has the motors all the time, and lets others drive by `rule`: one alone, or several by their votes.

    Its own utility, tanh 20 = 1, is above all others: by the brain's own rule it is always active.
    """

    rule: Rule
    utility: Utility = field(default_factory=lambda: Utility(b=20.0))

    def govern(self, demo: Brain) -> Brain:
        """That brain, with this above it."""
        self.brain = Brain([self, *demo.given], demo.variables)
        self.behaviors = {each.name: each for each in demo.given}
        return self.brain

    def useful(self, name: str) -> float:
        """The present utility of a behavior."""
        return self.brain.utility(self.behaviors[name])

    def enter(self, robot: Robot) -> None:
        self.said: dict[str, Command] = {}  # by those that drive, last

    def step(self, robot: Robot) -> None:
        least = self.useful("wander")
        driving = self.rule(self, [name for name in ORDER if self.useful(name) >= least])
        for name in [name for name in self.said if name not in driving]:
            self.behaviors[name].exit(robot)
            del self.said[name]
        for name in driving:
            if name in self.said:
                robot.command = self.said[name]  # what it does not say anew holds on
            else:
                robot.stop()
                self.behaviors[name].enter(robot)
            self.behaviors[name].step(robot)
            self.said[name] = robot.command
        if len(driving) > 1:
            left, right = voted(self.said)
            if left or right:
                robot.drive(left, right)
            else:
                robot.stop()


def voted(said: Mapping[str, Command]) -> tuple[float, float]:
    """Motor signals of the highest sum of votes."""
    votes = np.zeros((len(SIGNALS), len(SIGNALS)))
    for name, command in said.items():
        left, right = (np.exp(-(((SIGNALS - own) / WIDTH) ** 2) / 2) for own in command[1:])
        votes += WEIGHTS[name] * np.outer(left, right)
    left, right = SIGNALS[list(np.unravel_index(votes.argmax(), votes.shape))]
    return float(left), float(right)


def tree() -> Rule:
    """A rule: the leaf that a tick of a behavior tree comes to.

    Raises:
        BoebotError: py-trees is not installed.
    """
    trees = missing.imported("py_trees", "a behavior tree", "py-trees", "learn")
    status, leaf = trees.common.Status, trees.meta.create_behaviour_from_function
    calls: Sequence[str] = ()
    is_full = False
    asked = leaf(lambda node: status.SUCCESS if node.name in calls else status.FAILURE)
    drives = leaf(lambda node: status.SUCCESS if node.name == "charge" and is_full else status.RUNNING)
    branches = [
        trees.composites.Sequence(f"{name} if called", memory=name == "charge", children=[asked(name), drives(name)])
        for name in ORDER
    ]
    root = trees.composites.Selector("robot", memory=False, children=branches)

    def rule(arbiter: Arbiter, called: Sequence[str]) -> Sequence[str]:
        nonlocal calls, is_full
        calls, is_full = called, arbiter.other(ChargeBattery).charging and "charge" not in called
        root.tick_once()
        return [str(root.tip().name)]

    return rule


WAYS: dict[str, Callable[[Brain], Brain]] = {
    "utilities": lambda demo: demo,
    "priorities": lambda demo: Arbiter(rule=lambda arbiter, calls: calls[:1]).govern(demo),
    "tree": lambda demo: Arbiter(rule=tree()).govern(demo),
    "voting": lambda demo: Arbiter(rule=lambda arbiter, calls: calls).govern(demo),
}


def figures_of(brain: Brain, seed: int) -> dict[str, float]:
    """Of one run from a free place by chance."""
    described = economics.robot()
    pose = load_arena("station").free_start(described.body.reach_m, seed)
    trial, low_after = economics.until_low(brain, described, seed, SECONDS, pose)
    record = decisions(trial.result)
    charging = record.values[:, record.names.variables.index("charging")] > 0
    utilities = np.column_stack([record.utility_of(name) for name in ORDER])
    called = (utilities >= utilities[:, -1:]).argmax(axis=1)
    return {
        "way_m": trial.way,
        "touches": trial.result.whisker_touches or 0,
        "contacts": trial.result.true_contacts or 0,
        "charging_s": charging.sum() * brain.PERIOD,
        "battery_low": low_after < math.inf,
        "otherwise": (called != utilities.argmax(axis=1)).mean(),
    }


@experiment("deciding", robot="shieldbot-charging (native)", slow=True)
def deciding(seed: int) -> Outcome:
    """Utilities, priorities, a behavior tree and voting decide for the same four behaviors

    In the notes: section 8.1.1

    Figure: Way driven, touches of the whiskers and time on the charger of each of 24 runs of 120 s (grey) and their
    mean with its 95 % interval, for four ways to decide; below: less those of the demonstration brain from the same
    start with the same seed.

    Expected: With each of them robots charge: in the mean they drive farther than the 8.1 m that one which never
    charges can (robot-economics). No difference is expected in advance; where the interval of the paired
    differences holds 0, the row says that the two cannot be told apart. Each interval holds 95 % by itself: without
    any difference at least one of nine misses 0 in about a third of such sets of runs.
    """
    seeds = trial_seeds(seed, PAIRS)
    runs = {way: [figures_of(made(economics.sweeper()), one) for one in seeds] for way, made in WAYS.items()}
    found = {way: {name: np.array([run[name] for run in own], float) for name in own[0]} for way, own in runs.items()}
    by_utility = found["utilities"]
    otherwise = 100 * by_utility["otherwise"].mean()
    measured = [
        Measured("utilities: share of steps at which priorities would choose otherwise", otherwise, "%"),
        Measured("contacts of the body, in all runs", sum(own["contacts"].sum() for own in found.values())),
    ]
    for way, own in found.items():
        low = int(own["battery_low"].sum())
        measured.append(Measured(f"{way}: runs whose battery ran down ({rates.in_words(low, PAIRS)})", low))
        for name, (what, unit, least) in FIGURES.items():
            measured.append(_said(f"{way}: {what}", own[name], unit, least))
            if way != "utilities":
                less = own[name] - by_utility[name]
                measured.append(_said(f"{way} less utilities: {what}", less, unit, compared=True))
    data = {"way_to_decide": np.repeat(list(WAYS), PAIRS), "seed": np.tile(seeds, len(WAYS))}
    data |= {name: np.concatenate([own[name] for own in found.values()]) for name in by_utility}
    return Outcome(measured, data, lambda figure: _draw(figure, found))


def _said(what: str, values: Floats, unit: str, least: float = -math.inf, *, compared: bool = False) -> Measured:
    mean = rates.mean_of(values)
    words = f"{mean.least:.3g} to {mean.most:.3g}"
    if compared:
        words += ": more" if mean.least > 0 else ": less" if mean.most < 0 else ": cannot be told apart"
    return Measured(f"{what} ({words})", mean.mean, unit, least)


def _draw(figure: Figure, found: Mapping[str, Mapping[str, Floats]]) -> None:
    panels = figure.subplots(2, len(FIGURES), sharex=True)
    for (upper, lower), (name, (what, unit, _)) in zip(panels.T, FIGURES.items(), strict=True):
        for place, own in enumerate(found.values()):
            for axes, values in (upper, own[name]), (lower, own[name] - found["utilities"][name]):
                mean = rates.mean_of(values)
                axes.plot(place + np.linspace(-0.3, -0.1, PAIRS), values, ".", color="0.75", markersize=4)
                ends = [[mean.mean - mean.least], [mean.most - mean.mean]]
                axes.errorbar([place + 0.1], [mean.mean], ends, fmt="o", color=f"C{place}", capsize=4)
        upper.set_title(f"{what} ({unit})" if unit else what, fontsize=10)
        lower.axhline(0, color="0.5", linewidth=0.8)
        lower.set_xticks(range(len(found)), list(found), rotation=30, fontsize=8)
    panels[0, 0].set_ylabel("each")
    panels[1, 0].set_ylabel("less utilities, same seed")
