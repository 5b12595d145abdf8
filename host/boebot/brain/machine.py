"""A finite-state machine for behaviors: states are methods, a transition is what a method returns.

    def enter(self, robot: Robot) -> None:
        self.machine = Machine(robot, self.straight)

    def step(self, robot: Robot) -> None:
        self.machine.step(robot)

    def straight(self, robot: Robot) -> State | None:
        robot.drive(0.5, 0.5)
        return self.turn if self.chance(0.01, per=0.01) else None

    def turn(self, robot: Robot) -> State | None:
        ...

The notes' behaviors are such machines (sections 5.1 and 5.2): the state reached is carried out at the next step.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from boebot.robot import Robot

State = Callable[["Robot"], Any]
"""Does what its state does, and returns the next state, or None: stay."""


class Machine:
    """A finite-state machine.

    Args:
        robot: as `enter` or `step` got it.
        start: the first state: a method of the robot that does a step and returns the next state, or None to stay.

    Attributes:
        since: the time (s) at which the present state began.
    """

    def __init__(self, robot: Robot, start: State) -> None:
        self._state = start
        self.since = robot.time

    @property
    def state(self) -> str:
        """Name of the present state's method."""
        return str(getattr(self._state, "__name__", self._state))

    def time(self, robot: Robot) -> float:
        """Seconds in the present state."""
        return robot.time - self.since

    def step(self, robot: Robot) -> None:
        """One step of the present state."""
        following = self._state(robot)
        if following is not None:
            self.go(robot, following)

    def go(self, robot: Robot, state: State) -> None:
        """To that state, from its beginning; it is first carried out at the next step."""
        self._state = state
        self.since = robot.time
