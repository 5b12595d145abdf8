"""What a brain is made of: processes (section 8.2 of the notes), motor behaviors and cognitive ones, in one form.

A process is a dataclass: its fields are *parameters*, which stay as they are throughout a run; its *state* is set in
`enter` and changed in `step`; what others may ask of it is set in `forget`, too.

    @dataclass(kw_only=True)
    class Spin(MotorBehavior):
        \"""Turn on the spot, now and then the other way.\"""

        signal: float = 0.4

        def enter(self, robot: Robot) -> None:
            self.turning = self.signal

        def step(self, robot: Robot) -> None:
            if self.chance(0.1, per=1.0):
                self.turning = -self.turning
            robot.drive(-self.turning, self.turning)
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, TypeVar

from boebot.brain import checks
from boebot.brain.utility import Utility
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Robot

P = TypeVar("P", bound="Process")


@dataclass(kw_only=True)
class Process:
    """One process of a brain; see `MotorBehavior` and `CognitiveProcess`.

    Args:
        name: how others refer to it; by default that of its class: FollowWall is "follow_wall".
        utility: how useful it is, as a function of the brain's state variables.
        period: s from step to step while active, a multiple of the brain's; None: at each step of the brain.

    Attributes:
        random: its own `random.Random`: what others draw changes none of its numbers. Seeded by the run's seed and
            the process's name.
        step_time: seconds from one of its steps to the next.
    """

    NEEDS: ClassVar[tuple[str, ...]] = ()
    """Devices without which it cannot work, as `Robot.has` names them."""

    name: str = ""
    utility: Utility = field(default_factory=Utility)
    period: float | None = None

    def __post_init__(self) -> None:
        self.name = self.name or snake_case(type(self).__name__)
        if not isinstance(self.name, str):
            raise BrainError(f"a process is called {self.name!r}; expected a text")
        if not isinstance(self.utility, Utility):
            raise BrainError(f"{self.name}: utility is {self.utility!r}; expected a Utility(...)")
        checks.check_numbers(self)
        if self.period is not None and not (isinstance(self.period, int | float) and 0 < self.period < math.inf):
            raise BrainError(f"{self.name}: period is {self.period!r}; expected seconds from step to step")
        self.random = random.Random()
        self.step_time = math.nan
        self._others: Callable[[object], Process] = _alone
        self._kick: Callable[[Process, float], None] = _unheard
        self.has_changed = False  # parameters have since it was made
        self.forget()

    def forget(self) -> None:
        """Called when it is made, and when a run begins: sets what others may ask of it before it was ever active.

        State variables are read before the first process is entered, and a process may sleep through a whole run: what
        an earlier run left behind must not be found here.
        """

    @property
    def is_made(self) -> bool:
        """A class of somebody's own has not kept it from being set up."""
        return "step_time" in vars(self)

    def enter(self, robot: Robot) -> None:
        """Called when it becomes active, before its first step: sets its state."""

    def step(self, robot: Robot) -> None:
        """Called at each of its steps while it is active.

        A motor behavior drives the robot here; what it does not say anew holds on.
        """
        raise BrainError(f"{self.name}: class {type(self).__name__} has no step(self, robot)")

    def exit(self, robot: Robot) -> None:
        """Called when it is active no more."""

    def companions(self) -> Sequence[Process]:
        """Other processes that it brings with it, such as a reflex its releasing mechanism."""
        return ()

    # ---- for use in enter, step and exit -----------------------------------------------------------------------

    def chance(self, probability: float, per: float | None = None) -> bool:
        """True with that probability, by its `random`.

        Args:
            probability: 0..1, of happening within `per` seconds: behaves alike whatever the time from step to step is,
                p' = 1 - (1 - p)^(step_time / per).
            per: seconds that the probability is meant for; None: it is meant as it stands.
        """
        if per is not None:
            probability = 1.0 - (1.0 - probability) ** (self.step_time / per)
        return self.random.random() < probability

    def other(self, kind: type[P]) -> P:
        """The brain's process of that class.

        Raises:
            BrainError: there is none, or more than one.
        """
        found = self._others(kind)
        assert isinstance(found, kind)
        return found

    def kick(self, process: Process | str, gamma: float) -> None:
        """Sets the gamma parameter of a process, which then decays: above 0 to call it, below 0 to keep it off.

        Raises:
            BrainError: there is no such process, or gamma is not finite.
        """
        if not math.isfinite(gamma):
            raise BrainError(f"{self.name}: a gamma parameter of {gamma!r}; expected a finite number")
        found = self._others(process) if isinstance(process, str) else process
        self._kick(found, gamma)

    # ---- for the brain ----------------------------------------------------------------------------------------------

    def join(
        self,
        step_time: float,
        source: random.Random,
        others: Callable[[object], Process],
        kick: Callable[[Process, float], None],
    ) -> None:
        """A run begins. What has been made of parameters that have changed is made anew."""
        if self.has_changed:
            self.__post_init__()
        else:
            self.forget()
        self.step_time, self.random = step_time, source
        self._others, self._kick = others, kick


@dataclass(kw_only=True)
class MotorBehavior(Process):
    """A process that drives the motors. Exactly one of them is active: that of the highest utility.

    Args:
        name, utility, period: as of every process (`boebot.brain.Process`).
    """


@dataclass(kw_only=True)
class CognitiveProcess(Process):
    """A process that works out something and does not touch the motors. All with a utility above 0 are active.

    Its utility is by default tanh(1): it is always active.

    Args:
        name, utility, period: as of every process (`boebot.brain.Process`).
    """

    utility: Utility = field(default_factory=lambda: Utility(b=1.0))


def snake_case(name: str) -> str:
    """The name of a class as that of a process: FollowWall, follow_wall."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name).lower()


def _alone(kind: object) -> Process:
    raise BrainError(f"{getattr(kind, '__name__', kind)}: the process belongs to no brain yet")


def _unheard(process: Process, gamma: float) -> None:
    raise BrainError(f"{process.name}: the process belongs to no brain yet")
