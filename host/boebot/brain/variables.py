"""State variables: what sensory preprocessing makes of readings (section 8.2.1 of the notes, Fig. 8.1).

A state variable is a number from 0 to 1, made at each step of the brain from what its sensors say:

    z = (1/j) Σ Σ_i  (8.1)        z = min Σ_i  (8.2)        z = max Σ_i  (8.3)

Missing and stale readings are left out of the sums; where nothing is left, z is 0. The lag of the utilities filters
such gaps out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot

Read = Callable[["Robot"], float | None]


@dataclass(frozen=True)
class StateVariable:
    """One state variable.

    Args:
        name: by which the weights of utilities name it.
        read: gives its value, from 0 to 1 (beyond that it is limited), from a robot. None: nothing is known, 0.
        needs: devices without which it is not known, as `Robot.has` names them.
    """

    name: str
    read: Read
    needs: tuple[str, ...] = ()

    def value(self, robot: Robot) -> float:
        """z, from 0 to 1.

        Raises:
            BrainError: `read` gave no number.
        """
        raw = self.read(robot)
        if type(raw) is float and 0.0 <= raw <= 1.0:
            return raw
        if raw is None:
            return 0.0
        try:
            if math.isnan(raw):
                raise ValueError
            return min(max(float(raw), 0.0), 1.0)
        except (TypeError, ValueError):
            raise BrainError(f"state variable {self.name!r} is {raw!r}; expected a number from 0 to 1") from None


def mean(readings: Iterable[float | None]) -> float | None:
    """(8.1), of those that are known."""
    known = [reading for reading in readings if reading is not None]
    return sum(known) / len(known) if known else None


def minimum(readings: Iterable[float | None]) -> float | None:
    """(8.2), of those that are known."""
    return min([reading for reading in readings if reading is not None], default=None)


def maximum(readings: Iterable[float | None]) -> float | None:
    """(8.3), of those that are known."""
    return max([reading for reading in readings if reading is not None], default=None)
