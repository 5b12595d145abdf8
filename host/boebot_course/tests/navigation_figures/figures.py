"""Each figure of navigation, with its criterion. Work is shared among the processors; what comes of it does not depend
on them."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import TypeVar

import numpy as np

from boebot.navigation import LineMap
from boebot.rates import interval
from boebot_course.experiment import Measured
from boebot_course.tests.navigation_figures import kidnapping, paths, tasks

WHERE: dict[kidnapping.Outcome, str] = {"right": "in the right room", "wrong": "in the wrong one", "lost": "lost"}
Thing = TypeVar("Thing")
Result = TypeVar("Result")


def side_by_side(work: Callable[[Thing], Result], things: Sequence[Thing]) -> list[Result]:
    """What comes of each thing, in their order."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(work, things))


def office_tasks(robot: str, on: str | None, count: int, least: int, mistaken: int) -> list[Measured]:
    """Arrived, and mistaken about it."""
    ended = side_by_side(tasks.tried, tasks.tasks(robot, count, on))
    arrived = sum(one.has_arrived for one in ended)
    low, high = (100 * share for share in interval(arrived, count))
    name = robot if on is None else f"{robot} on {on}"
    return [
        Measured(f"{name}: of {count} tasks, ended at the goal ({low:.0f} to {high:.0f} %)", arrived, least=least),
        Measured(
            f"{name}: said so more than {tasks.THERE_M:g} m away", sum(e.is_mistaken for e in ended), most=mistaken
        ),
        Measured(f"{name}: said that it is lost", sum(one.lost for one in ended)),
    ]


def kidnappings() -> list[Measured]:
    """To other places of the office."""
    plan = LineMap.of(tasks.ARENA)
    found = kidnapping.pairs(plan)
    alike = sum(error <= kidnapping.FITS for _, _, error in found)
    least, most = (100 * share for share in interval(alike, len(found)))
    of = f"of {len(found):,} random pairs ({least:.2f} to {most:.2f} %)"
    measured = [Measured(f"places that look alike, {of}", alike)]
    kinds = list(kidnapping.ESTIMATORS)
    work = partial(kidnapping.kidnapped, found=found)
    for kind, outcomes in zip(kinds, side_by_side(work, kinds), strict=True):
        measured += [
            Measured(f"{kind}: of {kidnapping.KIDNAPPINGS}, lost after two scans", outcomes["lost"], least=95),
            Measured(f"{kind}: found itself where it is", outcomes["right"]),
            Measured(f"{kind}: believes to be elsewhere", outcomes["wrong"]),
        ]
    return measured


def twins() -> list[Measured]:
    """Into one of two rooms that look alike."""
    cases = [(kind, start) for start in kidnapping.FROM for kind in kidnapping.ESTIMATORS]
    results = side_by_side(kidnapping.carried, cases)
    return [
        Measured(f"{kind}, from the {start}: of {kidnapping.KIDNAPPINGS}, {words}", outcomes[outcome])
        for (kind, start), outcomes in zip(cases, results, strict=True)
        for outcome, words in WHERE.items()
    ]


def lengths() -> list[Measured]:
    """Of planned paths, against the shortest ones."""
    parts = [*range(paths.ARENAS), None]
    found = side_by_side(paths.of, parts)
    office, others = np.array(found[-1]), np.array(found[:-1]).reshape(-1, 2)
    measured = []
    for name, ways in ((f"{paths.WAYS} ways in the office", office), (f"{paths.ARENAS} random arenas", others)):
        ratios = ways[:, 0] / ways[:, 1]
        measured.append(Measured(f"{name}: length against the shortest path, median", np.median(ratios), most=1.05))
        measured.append(Measured(f"{name}: greatest", ratios.max()))
        measured.append(Measured(f"{name}: least", ratios.min(), least=1 - 1e-3))
    return measured


FIGURES: dict[str, Callable[[], list[Measured]]] = {
    "Office tasks on roller": partial(office_tasks, "roller", None, 100, 97, 0),
    "Office tasks on shieldbot-turret": partial(office_tasks, "shieldbot-turret", "native", 100, 80, 2),
    "Office tasks on the AVR image": partial(office_tasks, "shieldbot-turret", "avr", 5, 4, 0),
    "Kidnapped": kidnappings,
    "Rooms that look alike": twins,
    "Lengths of paths": lengths,
}
