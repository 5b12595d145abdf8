"""The attributes by which a brain reads devices: `robot.ping`, `robot.whisker_left`, any name in the robot's file.

Editors and type checkers know the names of the bundled robots by `attributes.pyi`, which the build makes of robots and
kinds of devices; `device` reads any other name with a type.
"""

from __future__ import annotations

from typing import TypeVar

from boebot.errors import BrainError

Reading = TypeVar("Reading")


class Attributes:
    """What `Robot` and `Observation` have in common; each finds its readings itself."""

    __slots__ = ()

    def device(self, name: str, reading: type[Reading]) -> Reading:
        """The reading of the device of that name, as one of that type (`Ping`, `Light`, ...).

        Raises:
            NoDeviceError: the robot has no such device.
            BrainError: its reading is of another type.
        """
        found = getattr(self, name)
        if not isinstance(found, reading):
            raise BrainError(f"device {name!r} gives {type(found).__name__}, not {reading.__name__}")
        return found
