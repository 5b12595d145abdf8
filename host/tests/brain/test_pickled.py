"""Brains made of the kit's parts can be copied and pickled: for other processes, and to keep them."""

from __future__ import annotations

import inspect
import pickle
import subprocess
import sys
from typing import Any

import pytest

import boebot
from boebot import behaviors, cognition, navigation
from boebot.brain import Process, StateVariable
from boebot.brains import bundled, load_brain
from boebot.navigation import LineMap

PLACES = {  # of the bundled brains of processes: robot, arena
    "clearway": ("shieldbot", "room"),
    "demo": ("shieldbot-charging", "station"),
    "explore": ("roller", "office"),
    "rounds": ("roller-charging", "office"),
}
NEEDED: dict[str, dict[str, Any]] = {
    "BatteryLevel": {"empty": 5.0, "full": 7.8},
    "Localization": {"plan": LineMap.of("room")},
}


def test_all_bundled_brains_of_processes_are_here() -> None:
    assert {name for name in bundled() if load_brain(name).brain is not None} == set(PLACES)


@pytest.mark.parametrize("name", PLACES)
def test_an_unpickled_brain_commands_the_same(name: str) -> None:
    """Before a run and after one: a brain that has run has met a robot, and begins afresh."""
    robot, arena = PLACES[name]
    brain = load_brain(name).brain
    assert brain is not None
    fresh = pickle.dumps(brain)
    runs = [boebot.run(brain, robot, arena=arena, seconds=2)]
    for data in (fresh, pickle.dumps(brain)):
        copy = pickle.loads(data)
        runs.append(boebot.run(copy, robot, arena=arena, seconds=2))
        assert copy.processes[0] is not brain.processes[0]
    first, *others = (run.record.steps for run in runs)
    assert len(first) == 40 and others == [first, first]


def test_another_process_reads_a_brain_whose_classes_are_in_a_bundled_file() -> None:
    code = "import pickle, sys; print(pickle.load(sys.stdin.buffer).processes[3].localization.plan)"
    data = pickle.dumps(load_brain("rounds").brain)
    done = subprocess.run([sys.executable, "-c", code], input=data, capture_output=True, check=True)
    assert done.stdout.startswith(b"<LineMap of office")


def offered() -> list[tuple[type[Process], str]]:
    """Classes of processes, and what makes a state variable of them."""
    kinds = [getattr(module, name) for module in (behaviors, cognition, navigation) for name in module.__all__]
    processes = [kind for kind in kinds if inspect.isclass(kind) and issubclass(kind, Process)]
    return [(kind, name) for kind in processes for name in dir(kind) if name.endswith("variable")]


@pytest.mark.parametrize(("kind", "name"), offered())
def test_a_state_variable_of_a_process_is_pickled_with_it(kind: type[Process], name: str) -> None:
    process = kind(**NEEDED.get(kind.__name__, {}))
    made = getattr(process, name)
    variable: StateVariable = made() if callable(made) else made
    other, copy = pickle.loads(pickle.dumps((process, variable)))
    assert copy.read.__self__ is other and other is not process
    assert (copy.name, copy.needs) == (variable.name, variable.needs)


def test_state_variables_of_sensors_are_pickled() -> None:
    for variable in (cognition.near(), cognition.contact()):
        assert pickle.loads(pickle.dumps(variable)) == variable
