"""What a brain may see, and that it sees no more: section 7.3 of the specification, E66.

Two checks. *Static*: no module that brains are made of imports the simulator, or what opens boards and knows the truth
of a run. *At run time*: nothing that a brain can reach from the robot that it is handed, by attributes, items and
closures however deep, is an object of those.
"""

from __future__ import annotations

import ast
import types
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import boebot
from boebot.experiments.experiment import Measured, Outcome, Progress, exactly, experiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from boebot.robot import Robot

ROOMS = ("brain", "behaviors", "cognition", "brains")
"""Packages of the library that brains are made of."""
FORBIDDEN = ("sim_bridge", "boebot.boards", "boebot.driving", "boebot.result", "boebot.runner", "boebot.together")
"""The world, what opens it, and what holds a run's truth."""


def is_forbidden(module: str) -> bool:
    """One of these modules, or within one."""
    return any(module == name or module.startswith(f"{name}.") for name in FORBIDDEN)


def imported(source: str) -> Iterator[str]:
    """Full names of what a module imports when it is run: not what only type checkers see."""
    waiting: list[ast.AST] = [ast.parse(source)]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            waiting += node.orelse
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        waiting += ast.iter_child_nodes(node)


def imports() -> dict[str, set[str]]:
    """What each module of these rooms imports."""
    home = Path(boebot.__file__).parent
    found = {}
    for room in ROOMS:
        for path in sorted((home / room).glob("*.py")):
            module = ".".join(("boebot", room, path.stem)).removesuffix(".__init__")
            found[module] = set(imported(path.read_text(encoding="utf-8")))
    return found


def reachable(start: object) -> list[object]:
    """All that attributes, public and private, items, bound methods and closures lead to; not through modules, classes
    or a function's globals, which are the same for all of the program."""
    seen: dict[int, object] = {}
    waiting = deque([start])
    while waiting:
        thing = waiting.popleft()
        if id(thing) in seen or isinstance(thing, type | types.ModuleType | str | bytes | int | float | complex):
            continue
        seen[id(thing)] = thing
        waiting += _parts(thing)
    return list(seen.values())


def _parts(thing: object) -> Iterator[object]:
    if isinstance(thing, np.ndarray | np.generic):
        return  # numbers; their attributes are new views of them without end
    if isinstance(thing, dict):
        yield from thing.keys()
        yield from thing.values()
    elif isinstance(thing, list | tuple | set | frozenset):
        yield from thing
    for cell in getattr(thing, "__closure__", None) or ():
        yield cell.cell_contents
    if isinstance(thing, types.MethodType):
        yield thing.__self__
        yield thing.__func__
    for name in dir(thing):
        if not name.startswith("__"):
            try:
                part = getattr(thing, name)
            except Exception:  # a property may have any reason not to answer, such as a device that is not there
                continue
            yield part


def belongs_to(thing: object) -> str:
    """The module of a thing's class, or of a function."""
    return str(getattr(thing, "__module__", None) or type(thing).__module__)


class Walker:
    """A brain that drives, and once takes stock of all that it can reach.

    Attributes:
        found: how many things, by the module that they belong to.
    """

    def __init__(self, at: float) -> None:
        """`at`: when (s)."""
        self.at = at
        self.found: dict[str, int] = {}

    def step(self, robot: Robot) -> None:
        """Looks once."""
        robot.drive(0.3, 0.3)
        if not self.found and robot.time >= self.at:
            for thing in reachable(robot):
                module = belongs_to(thing)
                self.found[module] = self.found.get(module, 0) + 1


RUNS = (("shieldbot", "native"), ("arsim", "direct"))


@experiment(
    "E66",
    title="No truth can be reached from a brain",
    source="section 7.3 of the specification",
    caption="Objects that a brain can reach from the robot that it is handed, by the module that they belong to.",
    robot="shieldbot (native), arsim",
    criterion="The specification: none. The walk must find devices and readings, or it has not looked.",
)
def no_truth(seed: int, progress: Progress) -> Outcome:
    found = imports()
    guilty = sum(is_forbidden(name) for names in found.values() for name in names)
    measured = [
        Measured("modules that brains are made of", len(found), least=len(ROOMS)),
        exactly("imports of the simulator or of what knows the truth", guilty, 0),
    ]
    counts: dict[str, dict[str, int]] = {}
    for number, (robot, on) in enumerate(RUNS):
        walker = Walker(0.5)
        boebot.run(walker, robot=robot, on=on, seconds=1, seed=seed)
        counts[robot] = walker.found
        measured += [
            Measured(f"{robot}: objects that can be reached", sum(walker.found.values()), least=10),
            Measured(f"{robot}: modules of devices and readings among them", _devices(walker.found), least=2),
            exactly(f"{robot}: objects of the simulator or of what knows the truth", _forbidden(walker.found), 0),
        ]
        progress((number + 1) / len(RUNS))
    modules = sorted(set().union(*counts.values()))

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        places = np.arange(len(modules))
        for number, (robot, of_module) in enumerate(counts.items()):
            axes.barh(places + 0.4 * number, [of_module.get(module, 0) for module in modules], 0.4, label=robot)
        axes.set_xscale("log")
        axes.set(xlabel="objects", yticks=places + 0.2, yticklabels=modules)
        axes.tick_params(axis="y", labelsize="xx-small")
        axes.legend()

    data = {"module": modules} | {robot: [of.get(module, 0) for module in modules] for robot, of in counts.items()}
    return Outcome(measured, data, draw)


def _devices(found: dict[str, int]) -> int:
    return sum(module.startswith(("boebot.devices.", "boebot.readings")) for module in found)


def _forbidden(found: dict[str, int]) -> int:
    return sum(count for module, count in found.items() if is_forbidden(module))
