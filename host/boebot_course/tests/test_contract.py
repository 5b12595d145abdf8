"""E66: no brain reaches the world's truth (notes, section 3.2.3).

What these tests guarantee:

* The modules that brains are made of import neither the simulator nor any module of the library that holds truth, runs
  robots or talks to boards, not even by way of others: a program that imports all of them has loaded none of those.
* From the `Robot` that a brain gets, and from its `Observation`, nothing leads to the world: what is walked, and what
  may be met, is in boebot_course.experiments.contract.
"""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest

import boebot
from boebot.boards import Truth
from boebot.robot import Robot
from boebot_course.experiments.contract import Met, is_within, walk

ROOMS = ("boebot.brain", "boebot.behaviors", "boebot.cognition", "boebot.navigation", "boebot.brains")
"""Packages that brains are made of."""
FORBIDDEN = (
    "sim_bridge",
    "boebot.boards",
    "boebot_course",
    "boebot_timing",
    "boebot.record",
    "boebot.running",
    "boebot.view",
    "boebot.link.link",
    "boebot.link.session",
    "boebot.link.transport",
    "boebot.link.delivery",
    "serial",
)
"""Modules of the world, of what opens it, and of what holds a run's truth."""
ARENAS = "boebot.arenas"
MAPS = "boebot.navigation.line_map"
"""The one module of these rooms that imports arenas: it makes a map of the one that a brain's author names."""

IMPORTS = """
import importlib, json, pkgutil, sys
for part in sys.argv[1:]:
    module = importlib.import_module(part)
    for found in pkgutil.walk_packages(module.__path__, part + "."):
        importlib.import_module(found.name)
from boebot import Command, Observation, Robot
print(json.dumps(sorted(sys.modules)))
"""


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


def forbidden(found: Mapping[str, set[str]]) -> list[tuple[str, str]]:
    """Modules that import what they may not, and what that is."""
    return [
        (module, name)
        for module, names in found.items()
        for name in names
        if is_within(name, FORBIDDEN) or (is_within(name, (ARENAS,)) and module != MAPS)
    ]


def loaded(*imports: str) -> list[str]:
    """All modules of a fresh interpreter that has imported these and all below them."""
    done = subprocess.run([sys.executable, "-c", IMPORTS, *imports], capture_output=True, text=True, check=True)
    return [str(name) for name in json.loads(done.stdout)]


def test_what_brains_are_made_of_loads_no_simulator_and_nothing_that_holds_truth() -> None:
    found = loaded(*ROOMS)
    assert {"boebot.behaviors.avoid", "boebot.cognition.odometry", "boebot.brains.wander"} <= set(found)
    assert [name for name in found if is_within(name, FORBIDDEN)] == []


def test_the_test_of_imports_sees_what_it_looks_for() -> None:
    found = loaded(*ROOMS, "boebot.running")
    assert "boebot.boards" in [name for name in found if is_within(name, FORBIDDEN)]


def test_no_module_of_brains_imports_a_forbidden_one_even_when_called() -> None:
    home = Path(boebot.__file__).parent.parent
    found = {
        f"{room}.{path.stem}".removesuffix(".__init__"): set(imported(path.read_text(encoding="utf-8")))
        for room in ROOMS
        for path in (home / room.replace(".", "/")).glob("*.py")
    }
    assert "boebot.behaviors.avoid" in found and forbidden(found) == []
    assert forbidden({"boebot.brains.wander": {"boebot.arenas.arena"}}) != [], "a map is for authors to give"


def test_imports_for_type_checkers_do_not_count() -> None:
    source = "import a\nif TYPE_CHECKING:\n    import b\nelse:\n    from c import d\ndef f():\n    import e.g\n"
    assert set(imported(source)) == {"a", "c", "c.d", "e.g"}


# ---- at run time ----------------------------------------------------------------------------------------------------


def foreign(start: object) -> list[str]:
    """Ways to objects that no brain should meet."""
    return [f"{one.way}: {one.kind}" for one in walk(start) if one.is_foreign]


@pytest.mark.parametrize("robot", ["shieldbot", "shieldbot-quad", "shieldbot-turret", "arsim", "roller"])
def test_e66_nothing_leads_from_a_robot_to_the_world(robot: str) -> None:
    """The boards are the native one and direct; what the AVR image runs on is driven as the native one is."""
    met: list[Met] = []

    def step(seen: Robot) -> None:
        if seen.tick > 20 and not met:
            met.extend(walk(seen))
        seen.drive(0.2, 0.2)

    result = boebot.run(step, robot, arena="arsim", seconds=0.6)
    truth = result.truth
    assert truth is not None and len(truth.time), "there was a truth to find"
    assert [one for one in met if one.is_foreign] == []
    kinds = {one.kind for one in met}
    assert {"boebot.robot.Robot", "boebot.robot.Observation", "boebot.description.equipment.Equipment"} <= kinds


@pytest.mark.parametrize(
    "plant",
    [
        lambda robot, truth: setattr(robot, "command", truth),
        lambda robot, truth: setattr(robot, "_seed", {"a": [(truth,)]}),
        lambda robot, truth: robot.observation.equipment.readers.update(ping=lambda sample: truth),
        lambda robot, truth: robot.observation.equipment.readers.update(ping=lambda sample, hidden=truth: None),
        lambda robot, truth: setattr(robot, "slow_command", truth.__class__.__eq__.__get__(truth)),
    ],
    ids=["attribute", "private container", "closure", "default", "bound method"],
)
def test_the_walk_finds_hidden_truth(plant: Callable[[Robot, Truth], None]) -> None:
    found: list[list[str]] = []
    truth = boebot.run(lambda robot: None, "arsim", arena="arsim", seconds=0.05).truth
    assert truth is not None

    def step(robot: Robot) -> None:
        if not found:
            command = robot.command
            plant(robot, truth)
            found.append(foreign(robot))
            robot.command, robot.slow_command = command, None

    boebot.run(step, "arsim", arena="arsim", seconds=0.1)
    assert any(way.endswith("boebot.boards.Truth") for way in found[0])
