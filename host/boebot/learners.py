"""What a learner sees, does and gains, whatever steps its robot: a run (boebot.env), or one of many worlds."""

from __future__ import annotations

import typing
from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from boebot.missing import imported
from boebot.robot import Command, Observation

if TYPE_CHECKING:
    import gymnasium as gymnasium
else:
    gymnasium = imported("gymnasium", "an environment for learners", "gymnasium", "learn")

Numbers = NDArray[np.float32]

AGE_MAXIMUM = 10.0  # s; what is older, or was never measured, is so old
NUMBER_MAXIMUM = 1e6  # of any other number, either way
PENALTY = 1.0  # of a step that ends with a touch


def forward(seen: Observation, command: Command) -> float:
    """The reward of a step unless another one is given: the drive forward, -1 to 1, less PENALTY at a touch."""
    touched = any(getattr(seen, name).pressed for name in seen.equipment.whiskers)
    return (command.left + command.right) / 2 - PENALTY * touched


def action_space() -> gymnasium.Space[Numbers]:
    """Motor signals, left and right."""
    return gymnasium.spaces.Box(-1.0, 1.0, (2,))


class FlatView:
    """What a robot's devices say as one array of numbers.

    Attributes:
        names: of the numbers, in order, such as "whisker_left.pressed".
        space: in which the array is.
    """

    def __init__(self, seen: Observation) -> None:
        """As of this observation, and of all others of the robot."""
        names: list[str] = []
        high: list[float] = []
        self._devices = [(name, _fields(getattr(seen, name).__class__)) for name in seen.equipment.readers]
        for device, fields in self._devices:
            for field, optional in fields:
                value, name = getattr(getattr(seen, device), field), f"{device}.{field}"
                count = len(_numbers(value, optional)) - (optional > 0)
                limit = AGE_MAXIMUM if field == "age" else 1.0 if isinstance(value, bool) else NUMBER_MAXIMUM
                names += [name] if count == 1 else [f"{name}.{index}" for index in range(count)]
                names += [f"{name}.known"] if optional else []
                high += [limit] * count + [1.0] * (optional > 0)
        self.names, top = tuple(names), np.array(high, np.float32)
        self._limits = (np.where(top == NUMBER_MAXIMUM, -top, 0).astype(np.float32), top)
        self.space: gymnasium.Space[Numbers] = gymnasium.spaces.Box(*self._limits)

    def __call__(self, seen: Observation) -> Numbers:
        """The numbers of an observation."""
        numbers: list[float] = []
        for device, fields in self._devices:
            reading = getattr(seen, device)
            for field, optional in fields:
                numbers += _numbers(getattr(reading, field), optional)
        return np.clip(np.array(numbers, np.float32), *self._limits)


def _numbers(value: Any, optional: int) -> Sequence[float]:
    """Those of a field; of one that may be None, see `_fields`, also whether it is known."""
    numbers = (0.0,) * optional if value is None else value if isinstance(value, tuple) else (value,)
    return (*numbers, value is not None) if optional else numbers


@cache
def _fields(reading: type) -> list[tuple[str, int]]:
    """The fields of a kind of reading; of one that may be None how many numbers it else is, or 0."""
    found = []
    for field, hint in typing.get_type_hints(reading).items():
        kinds = typing.get_args(hint)
        found.append((field, (len(typing.get_args(kinds[0])) or 1) if type(None) in kinds else 0))
    return found
