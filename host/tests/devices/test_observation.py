"""What a brain sees: each value with its unit, its age and whether it is valid, and nothing of it can be changed."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import pytest

import boebot
from boebot.description.equipment import Equipment
from boebot.description.robots import RobotDescription
from boebot.devices.latest import NO_MESSAGES
from boebot.devices.readings import Readings
from boebot.link import messages
from boebot.robot import Command, Observation
from steps import FULL, LAYOUT, QUAD, VEHICLE

LIBRARY = Path(boebot.__file__).parent
NOTHING = messages.Telemetry(*(0,) * len(messages.Telemetry._fields))


def views(description: RobotDescription) -> dict[str, tuple[object, ...]]:
    """What each device that the robot has says."""
    if description.has_board:
        seen = Observation(NOTHING, Equipment(description, 0.01), 0.0, slow=NO_MESSAGES)
    else:
        sample = Readings(0, 1, (0.0,) * 9, (0.0,) * 9)
        seen = Observation(sample, Equipment(description, 0.01, LAYOUT), 0.0, slow=sample)
    return {name: getattr(seen, name) for name in seen.equipment.readers}


@pytest.mark.parametrize("description", [FULL, QUAD, VEHICLE], ids=lambda one: one.name)
def test_each_device_says_how_old_and_how_good_its_value_is(description: RobotDescription) -> None:
    found = views(description)
    assert len(found) >= 6
    for name, view in found.items():
        age, valid = view.age, view.valid  # type: ignore[attr-defined]
        assert not math.isnan(age) and age >= 0 and isinstance(valid, bool), name
        with pytest.raises(AttributeError):
            view.valid = True  # type: ignore[attr-defined]
        with pytest.raises(TypeError):
            view[0] = 1  # type: ignore[index]


def test_commands_and_observations_cannot_be_changed() -> None:
    seen = Observation(NOTHING, Equipment(FULL, 0.01), 0.0)
    with pytest.raises(AttributeError):
        seen.time = 1.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        Command("signal", 0.1, 0.2).left = 1.0  # type: ignore[misc]


def named_tuples(path: Path) -> list[ast.ClassDef]:
    found = [node for node in ast.parse(path.read_text()).body if isinstance(node, ast.ClassDef)]
    return [one for one in found if any(isinstance(base, ast.Name) and base.id == "NamedTuple" for base in one.bases)]


@pytest.mark.parametrize("path", [*(LIBRARY / "devices").glob("*.py")], ids=lambda one: one.stem)
def test_each_value_says_what_it_is_and_in_which_unit(path: Path) -> None:
    """A sentence stands below each field; the age is in seconds."""
    for view in named_tuples(path):
        following = dict(zip(view.body, view.body[1:], strict=False))
        for field in (one for one in view.body if isinstance(one, ast.AnnAssign)):
            below = following.get(field)
            said = below.value.value if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant) else None
            name = ast.unparse(field.target)
            assert isinstance(said, str), f"{view.name}.{name} says nothing"
            if name == "age":
                assert said.startswith("Seconds"), view.name
