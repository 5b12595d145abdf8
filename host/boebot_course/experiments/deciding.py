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
from collections.abc import Callable, Collection, Mapping
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
Rule = Callable[["Arbiter", Mapping[str, float]], str]
"""The name of the one that drives, of those that call, with their utilities, in ORDER."""
FIGURES = {"way": "m", "touches": "", "charging": "s"}


@dataclass(kw_only=True)
class Arbiter(MotorBehavior):
    """Has the motors all the time, and lets others drive, one at a time by `rule`; by default the first in ORDER.

    Its own utility, tanh 20 = 1, is above all others: by the brain's own rule it is always active.
    """

    rule: Rule = field(default=lambda arbiter, calls: next(iter(calls)))
    utility: Utility = field(default_factory=lambda: Utility(b=20.0))

    def govern(self, demo: Brain) -> Brain:
        """That brain, with this above it."""
        self.brain = Brain([self, *demo.given], demo.variables)
        self.behaviors = {each.name: each for each in self.brain.processes if isinstance(each, MotorBehavior)}
        return self.brain

    def enter(self, robot: Robot) -> None:
        self.said: dict[str, Command] = {}  # by those that are active, last

    def step(self, robot: Robot) -> None:
        utilities = {name: self.brain.utility(self.behaviors[name]) for name in ORDER}
        self.decide({name: utility for name, utility in utilities.items() if utility >= utilities["wander"]}, robot)

    def decide(self, calls: Mapping[str, float], robot: Robot) -> None:
        """One drives."""
        name = self.rule(self, calls)
        self.activate([name], robot)
        self.behaviors[name].step(robot)

    def activate(self, names: Collection[str], robot: Robot) -> None:
        """These, and no others. What one drives that is active no more is over."""
        for name in [name for name in self.said if name not in names]:
            self.behaviors[name].exit(robot)
            del self.said[name]
        for name in [name for name in names if name not in self.said]:
            robot.stop()
            self.behaviors[name].enter(robot)
            self.said[name] = robot.command


def tree() -> Rule:
    """A rule: the leaf that a tick of a behavior tree comes to.

    Raises:
        BoebotError: py-trees is not installed.
    """
    trees = missing.imported("py_trees", "a behavior tree", "py-trees", "learn")
    status = trees.common.Status
    calls: dict[str, float] = {}
    is_full = False

    def leaf(name: str, says: Callable[[], object]) -> object:
        return trees.meta.create_behaviour_from_function(lambda node: says())(name)

    def branch(name: str) -> object:
        def asked() -> object:
            return status.SUCCESS if name in calls else status.FAILURE

        def driving() -> object:
            return status.SUCCESS if name == "charge" and is_full else status.RUNNING

        leaves = [leaf(f"{name}?", asked), leaf(name, driving)]
        return trees.composites.Sequence(f"{name} if called", memory=name == "charge", children=leaves)

    root = trees.composites.Selector("robot", memory=False, children=list(map(branch, ORDER)))

    def rule(arbiter: Arbiter, called: Mapping[str, float]) -> str:
        nonlocal calls, is_full
        calls = dict(called)
        is_full = arbiter.other(ChargeBattery).charging and "charge" not in calls
        root.tick_once()
        return str(root.tip().name)

    return rule


@dataclass(kw_only=True)
class Voting(Arbiter):
    """Lets all that call step, and drives by their votes on commands."""

    def decide(self, calls: Mapping[str, float], robot: Robot) -> None:
        self.activate(calls.keys(), robot)
        votes = np.zeros((len(SIGNALS), len(SIGNALS)))
        for name, said in self.said.items():
            robot.command = said  # what it does not say anew holds on
            self.behaviors[name].step(robot)
            self.said[name] = robot.command
            left, right = (np.exp(-(((SIGNALS - own) / WIDTH) ** 2) / 2) for own in robot.command[1:])
            votes += WEIGHTS[name] * np.outer(left, right)
        signals = [float(SIGNALS[index]) for index in np.unravel_index(votes.argmax(), votes.shape)]
        if any(signals):
            robot.drive(*signals)
        else:
            robot.stop()


def demo() -> Brain:
    """The demonstration brain."""
    return economics.sweeper(economics.BY_HAND)


WAYS: dict[str, Callable[[], Brain]] = {
    "utilities": demo,
    "priorities": lambda: Arbiter().govern(demo()),
    "tree": lambda: Arbiter(rule=tree()).govern(demo()),
    "voting": lambda: Voting().govern(demo()),
}


def figures_of(brain: Brain, seed: int, seconds: float = SECONDS) -> dict[str, float]:
    """Of one run from a free place by chance; "low": 1 where the battery ran down."""
    described = economics.robot()
    pose = load_arena("station").free_start(described.body.reach_m, seed)
    trial, low_after = economics.until_low(brain, described, seed, seconds, pose)
    record = decisions(trial.result)
    charging = record.values[:, record.names.variables.index("charging")] > 0
    utilities = np.column_stack([record.utility_of(name) for name in ORDER])
    first = (utilities >= utilities[:, -1:]).argmax(axis=1)
    return {
        "way": trial.way,
        "touches": float(trial.result.whisker_touches or 0),
        "contacts": float(trial.result.true_contacts or 0),
        "charging": float(charging.sum()) * brain.PERIOD,
        "low": float(low_after < math.inf),
        "otherwise": float((first != utilities.argmax(axis=1)).mean()),
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
    runs = {name: [figures_of(brain(), one) for one in seeds] for name, brain in WAYS.items()}
    found = {
        name: {figure: np.array([run[figure] for run in those]) for figure in those[0]} for name, those in runs.items()
    }
    demo_runs = found["utilities"]
    otherwise = 100 * float(demo_runs["otherwise"].mean())
    measured = [
        Measured("utilities: share of steps at which priorities would choose otherwise", otherwise, "%"),
        Measured("contacts of the body, in all runs", sum(float(own["contacts"].sum()) for own in found.values())),
    ]
    for name, own in found.items():
        least = {"way": FARTHEST_WITHOUT}
        measured += [
            _said(f"{name}: {figure}", own[figure], unit, least.get(figure, -math.inf))
            for figure, unit in FIGURES.items()
        ]
        low = int(own["low"].sum())
        measured.append(Measured(f"{name}: runs whose battery ran down ({rates.in_words(low, PAIRS)})", low))
        if name != "utilities":
            measured += [
                _said(f"{name} less utilities: {figure}", own[figure] - demo_runs[figure], unit, compared=True)
                for figure, unit in FIGURES.items()
            ]
    data = {"way_to_decide": np.repeat(list(WAYS), PAIRS), "seed": np.tile(seeds, len(WAYS))}
    columns = {
        "way": "way_m",
        "touches": "touches",
        "contacts": "contacts",
        "charging": "charging_s",
        "low": "battery_low",
    }
    data |= {column: np.concatenate([own[figure] for own in found.values()]) for figure, column in columns.items()}
    return Outcome(measured, data, lambda figure: _draw(figure, found))


def _said(what: str, values: Floats, unit: str, least: float = -math.inf, *, compared: bool = False) -> Measured:
    mean = rates.mean_of(values)
    words = f"{mean.least:.3g} to {mean.most:.3g}"
    if compared:
        words += ": more" if mean.least > 0 else ": less" if mean.most < 0 else ": cannot be told apart"
    return Measured(f"{what} ({words})", mean.mean, unit, least)


def _draw(figure: Figure, found: Mapping[str, Mapping[str, Floats]]) -> None:
    words = {"way": "way driven (m)", "touches": "touches of whiskers", "charging": "time on the charger (s)"}
    panels = figure.subplots(2, len(FIGURES), sharex=True)
    for column, (key, label) in enumerate(words.items()):
        for place, own in enumerate(found.values()):
            for axes, values in zip(panels[:, column], (own[key], own[key] - found["utilities"][key]), strict=True):
                mean = rates.mean_of(values)
                axes.plot(place + np.linspace(-0.3, -0.1, PAIRS), values, ".", color="0.75", markersize=4)
                ends = [[mean.mean - mean.least], [mean.most - mean.mean]]
                axes.errorbar([place + 0.1], [mean.mean], ends, fmt="o", color=f"C{place}", capsize=4)
        panels[0, column].set_title(label, fontsize=10)
        panels[1, column].axhline(0, color="0.5", linewidth=0.8)
        panels[1, column].set_xticks(range(len(found)), list(found), rotation=30, fontsize=8)
    panels[0, 0].set_ylabel("each")
    panels[1, 0].set_ylabel("less utilities, same seed")
