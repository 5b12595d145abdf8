"""E66: no brain reaches the world's truth (THEORY section 7.3).

What these tests guarantee:

* The modules that brains are made of import neither the simulator nor any module of the library that holds truth, runs
  robots or talks to boards, not even by way of others: a process that has imported all of them has loaded none of those.
* From the `Robot` that a brain gets, and from its `Observation`, no chain of attributes, private ones included, of
  properties, containers, bound methods, closures and defaults leads to anything but sensor values, the robot's lengths
  and the brain's own commands and chance. The walk follows what Python's garbage collector says that an object refers
  to, so that nothing is too private for it, and knows by name the few kinds of objects that may be met.

What nobody can guarantee in Python: a brain that imports the simulator itself, walks the interpreter's frames or lists
all objects of the process finds the world. It then does so in so many words, and would find nothing on a robot.
"""

from __future__ import annotations

import functools
import gc
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType

import pytest

import boebot
from boebot.boards import Truth
from boebot.robot import Robot

PARTS = ("boebot.brain", "boebot.behaviors", "boebot.cognition", "boebot.brains")
FORBIDDEN = (
    "sim_bridge",
    "boebot.boards",
    "boebot.driving",
    "boebot.experiments",
    "boebot.floor_plan",
    "boebot.record",
    "boebot.report",
    "boebot.result",
    "boebot.runner",
    "boebot.series",
    "boebot.tasks",
    "boebot.together",
    "boebot.link.session",
    "boebot.link.transport",
    "boebot.link.traffic",
    "serial",
)
IMPORTS = """
import importlib, json, pkgutil, sys
for part in sys.argv[1:]:
    module = importlib.import_module(part)
    for found in pkgutil.walk_packages(module.__path__, part + "."):
        importlib.import_module(found.name)
from boebot import Command, Observation, Robot
print(json.dumps(sorted(sys.modules)))
"""

# where the classes come from whose objects a brain may meet; each holds readings, lengths, commands or chance
ALLOWED = (
    "builtins",
    "random",
    "types",
    "functools",
    "boebot.robot",
    "boebot.equipment",
    "boebot.readings",
    "boebot.devices",
    "boebot.link.messages",
)


def is_within(module: str, names: tuple[str, ...]) -> bool:
    return any(module == name or module.startswith(f"{name}.") for name in names)


def loaded(*imports: str) -> list[str]:
    """All modules of a fresh interpreter that has imported these and all below them."""
    done = subprocess.run([sys.executable, "-c", IMPORTS, *imports], capture_output=True, text=True, check=True)
    return [str(name) for name in json.loads(done.stdout)]


def test_what_brains_are_made_of_loads_no_simulator_and_nothing_that_holds_truth() -> None:
    found = loaded(*PARTS)
    assert {"boebot.behaviors.avoid", "boebot.cognition.odometry", "boebot.brains.wander"} <= set(found)
    assert [name for name in found if is_within(name, FORBIDDEN)] == []


def test_the_test_of_imports_sees_what_it_looks_for() -> None:
    found = loaded(*PARTS, "boebot.driving")
    assert "boebot.boards" in [name for name in found if is_within(name, FORBIDDEN)]


# ---- at run time ------------------------------------------------------------------------------------------------------


def referents(thing: object) -> Iterator[tuple[str, object]]:
    """What an object leads to, but for modules and classes, which whoever may import has anyway."""
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


def foreign(start: object, limit: int = 200_000) -> tuple[list[str], set[str]]:
    """Ways to objects that no brain should meet, and the classes of all that was met."""
    seen: dict[int, object] = {}
    ways, kinds = [], set()
    waiting: list[tuple[str, object]] = [("robot", start)]
    while waiting:
        way, thing = waiting.pop()
        if id(thing) in seen or isinstance(thing, type | ModuleType):
            continue
        seen[id(thing)] = thing  # kept, so that no other object gets its id
        assert len(seen) < limit, "the walk does not end"
        kind = type(thing)
        kinds.add(f"{kind.__module__}.{kind.__qualname__}")
        if not is_within(kind.__module__, ALLOWED):
            ways.append(f"{way}: {kind.__module__}.{kind.__qualname__}")
            continue
        waiting += [(f"{way}.{name}", one) for name, one in referents(thing)]
    return ways, kinds


@pytest.mark.parametrize("robot", ["shieldbot", "shieldbot-quad", "arsim"])
def test_e66_nothing_leads_from_a_robot_to_the_world(robot: str) -> None:
    """The boards are the native one and direct; what the AVR image runs on is driven as the native one is."""
    met: list[tuple[list[str], set[str]]] = []

    def step(seen: Robot) -> None:
        if seen.tick > 20 and not met:
            met.append(foreign(seen))
        seen.drive(0.2, 0.2)

    result = boebot.run(step, robot, arena="arsim", seconds=0.6)
    (ways, kinds), truth = met[0], result.truth
    assert truth is not None and len(truth.time), "there was a truth to find"
    assert ways == []
    assert {"boebot.robot.Robot", "boebot.robot.Observation", "boebot.equipment.Equipment"} <= kinds


@pytest.mark.parametrize(
    "plant",
    [
        lambda robot, truth: setattr(robot, "command", truth),
        lambda robot, truth: setattr(robot, "_seed", {"a": [(truth,)]}),
        lambda robot, truth: setattr(robot.observation.equipment, "ping", lambda sample: truth),
        lambda robot, truth: setattr(robot.observation.equipment, "ping", lambda sample, hidden=truth: None),
        lambda robot, truth: setattr(robot, "slow_command", truth.__class__.__eq__.__get__(truth)),
    ],
    ids=["attribute", "private container", "closure", "default", "bound method"],
)
def test_the_walk_finds_what_is_hidden(plant: Callable[[Robot, Truth], None]) -> None:
    found: list[list[str]] = []
    truth = boebot.run(lambda robot: None, "arsim", arena="arsim", seconds=0.05).truth
    assert truth is not None

    def step(robot: Robot) -> None:
        if not found:
            command = robot.command
            plant(robot, truth)
            found.append(foreign(robot)[0])
            robot.command, robot.slow_command = command, None

    boebot.run(step, "arsim", arena="arsim", seconds=0.1)
    assert any(way.endswith("boebot.boards.Truth") for way in found[0])
