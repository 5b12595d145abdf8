"""What a brain may see, and that it sees no more: section 3.2.3 of the notes, E66.

From the robot that a brain is handed no chain of attributes, private ones included, of properties, containers, bound
methods, closures and defaults leads to anything but sensor values, the robot's lengths and the brain's own commands and
chance. The walk follows what Python's garbage collector says that an object refers to, so that nothing is too private
for it, and knows by name the few kinds of objects that may be met. What the modules import that brains are made of is
checked by the kit's tests alone.

What nobody can guarantee in Python: a brain that imports the simulator itself, walks the interpreter's frames or lists
all objects of the process finds the world. Its source then shows it, and it finds nothing on a robot.
"""

from __future__ import annotations

import functools
import gc
from collections import Counter
from collections.abc import Iterator
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import NamedTuple

import numpy as np

import boebot
from boebot.robot import Robot
from boebot_course.experiment import Figure, Measured, Outcome, exactly, experiment

ALLOWED = (
    "builtins",
    "random",
    "types",
    "functools",
    "boebot.robot",
    "boebot.showing",
    "boebot.description.equipment",
    "boebot.devices",
    "boebot.link.messages",
)
"""Where the classes come from whose objects a brain may meet: readings, lengths, commands, chance, what it shows."""
READ = ("boebot.devices", "boebot.description.equipment")
"""Of these, what a brain reads: devices and readings."""
LIMIT = 200_000  # objects


def is_within(module: str, names: tuple[str, ...]) -> bool:
    """One of these modules, or within one."""
    return any(module == name or module.startswith(f"{name}.") for name in names)


class Met(NamedTuple):
    """An object that can be reached."""

    way: str
    """how, from where the walk began"""
    kind: str
    """the full name of its class"""

    @property
    def is_foreign(self) -> bool:
        """No brain should meet it."""
        return not is_within(self.kind, ALLOWED)


def walk(start: object) -> list[Met]:
    """All that an object leads to, to the first foreign one on each way; modules and classes do not count: any brain
    can import them."""
    seen: dict[int, object] = {}  # kept, so that no other object gets its id
    met = []
    waiting: list[tuple[str, object]] = [("robot", start)]
    while waiting:
        way, thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, type | ModuleType):
            continue
        seen[id(thing)] = thing
        if len(seen) > LIMIT:
            raise RuntimeError("the walk does not end")
        kind = type(thing)
        met.append(Met(way, f"{kind.__module__}.{kind.__qualname__}"))
        if not met[-1].is_foreign:
            waiting += [(f"{way}.{name}", one) for name, one in _parts(thing)]
    return met


def _parts(thing: object) -> Iterator[tuple[str, object]]:
    if isinstance(thing, FunctionType):  # its globals are its module
        for name, cell in zip(thing.__code__.co_freevars, thing.__closure__ or (), strict=True):
            yield f"closure {name}", cell.cell_contents
        yield "defaults", (thing.__defaults__, thing.__kwdefaults__, vars(thing))
        return
    if isinstance(thing, BuiltinFunctionType | MethodType):
        yield "__self__", thing.__self__
        yield "__func__", getattr(thing, "__func__", None)
        return
    for index, one in enumerate(gc.get_referents(thing)):
        yield f"referent {index}", one
    for name in dir(type(thing)):  # properties give what is made only when it is asked for
        if isinstance(getattr(type(thing), name, None), property | functools.cached_property):
            try:
                yield name, getattr(thing, name)
            except boebot.BoebotError:  # a device that the robot lacks
                continue


LOOKS_AT = 0.5  # s
RUNS = (("shieldbot", "native"), ("arsim", "direct"))


@experiment("E66", robot="shieldbot (native), arsim")
def no_truth(seed: int) -> Outcome:
    """No truth can be reached from a brain

    In the notes: section 1.2.4, Fig. 1.18; section 3.2.3

    Figure: Objects that a brain can reach from the robot that it is handed, by the module of their class.

    Expected: None. The walk must find devices and readings, on arsim of infra-red, odometer and compass, on
    shieldbot of more, or it has not looked.
    """
    measured: list[Measured] = []
    counts: dict[str, Counter[str]] = {}
    for robot, on in RUNS:
        met: list[Met] = []

        def look(robot: Robot, met: list[Met] = met) -> None:
            """A brain that drives, and once takes stock of all that it can reach."""
            robot.drive(0.3, 0.3)
            if not met and robot.time >= LOOKS_AT:
                met += walk(robot)

        boebot.run(look, robot=robot, on=on, seconds=1, seed=seed)
        counts[robot] = Counter(one.kind.rpartition(".")[0] for one in met)
        devices = {one.kind for one in met if is_within(one.kind, READ)}
        measured += [
            # kinds: of objects themselves there are some more where the interpreter has run other things before
            Measured(f"{robot}: kinds of objects that can be reached", len({one.kind for one in met}), least=10),
            Measured(f"{robot}: kinds of devices and readings among them", len(devices), least=3),
            exactly(
                f"{robot}: objects of the simulator, or that no brain should meet",
                sum(one.is_foreign for one in met),
                0,
            ),
        ]
    modules = sorted(set().union(*counts.values()))

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        places = np.arange(len(modules))
        for number, (robot, of_module) in enumerate(counts.items()):
            axes.barh(places + 0.4 * number, [of_module[module] for module in modules], 0.4, label=robot)
        axes.set_xscale("log")
        axes.set(xlabel="objects", yticks=places + 0.2, yticklabels=modules)
        axes.tick_params(axis="y", labelsize="small")
        axes.legend()

    data = {"module": modules} | {robot: [of[module] for module in modules] for robot, of in counts.items()}
    return Outcome(measured, data, draw)
