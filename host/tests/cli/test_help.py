"""What `help` and editors show: every parameter of what a user calls is explained where it is called."""

from __future__ import annotations

import inspect
import re
from types import ModuleType

import pytest

import boebot
import boebot.behaviors
import boebot.brain
import boebot.cognition

MODULES = (boebot, boebot.behaviors, boebot.brain, boebot.cognition)
MADE_BY_THE_KIT = (boebot.Robot, boebot.Observation, boebot.RunResult, boebot.TogetherResult)


def public() -> list[tuple[str, object]]:
    named = [(f"{module.__name__}.{name}", getattr(module, name)) for module in MODULES for name in module.__all__]
    return [(name, thing) for name, thing in named if not isinstance(thing, ModuleType)]


def explained(thing: object) -> str:
    made = vars(thing).get("__init__") if isinstance(thing, type) else None
    return f"{inspect.getdoc(thing)}\n{made and inspect.getdoc(made)}"


@pytest.mark.parametrize(("name", "thing"), public(), ids=[name for name, _ in public()])
def test_every_parameter_is_explained(name: str, thing: object) -> None:
    text = explained(thing)
    assert len(text.split()) > 2
    if not callable(thing) or (isinstance(thing, type) and issubclass(thing, (BaseException, *MADE_BY_THE_KIT))):
        return
    lines = re.findall(r"^\s+(\w+(?:, \w+)*): \S|^`(\w+)`:|; `(\w+)`:", text, re.MULTILINE)
    names = {word for found in lines for group in found for word in group.split(", ")}
    parameters = inspect.signature(thing).parameters
    assert len(parameters) == 1 or set(parameters) <= names, f"{name} does not say what {set(parameters) - names} are"


def test_module_says_what_to_call_for_what() -> None:
    assert boebot.__doc__ is not None
    missing = [name for name in boebot.__all__ if not re.search(rf"\b{name}", boebot.__doc__)]
    assert missing == ["Command", "Observation"], "which a brain meets as Robot's"
