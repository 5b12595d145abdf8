"""What a person does to a run between two steps of its brain: drives by hand, lifts the robot, changes a parameter; and
the faults that it was asked for with.

Whoever watches a run (boebot.live) hands interventions over; they are carried out here, before a step of the brain, and
each goes into the record with its time. A simulated run with the same interventions at the same steps is the same run
bit for bit: `boebot replay --again` takes them from the record.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from operator import itemgetter

import msgspec

from boebot.brains import LoadedBrain
from boebot.description.equipment import check_setting
from boebot.errors import BoebotError
from boebot.record.interventions import (
    STREAM,
    Arm,
    Deed,
    Fault,
    Hand,
    Parameter,
    Place,
    Release,
    Set,
    Shape,
    Stop,
    Tally,
    Typed,
)
from boebot.record.run import Run
from boebot.robot import Robot
from boebot.running.brain_parameters import set_parameters
from boebot.running.driver import Driver
from boebot.running.faults import Fired, inject
from boebot.running.tasks import Request, Task


class Onlooker:
    """Who watches a run, and may interfere with it; this one does neither."""

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        """The run begins. `results`: what is known of each robot."""

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """The brain of a robot (from 0) is about to step: what is done to the robot first. It may wait.

        Raises:
            BoebotError: the run is to end.
        """
        return ()

    def refuse(self, number: int, error: BoebotError) -> None:
        """What was to be done cannot be done.

        Raises:
            BoebotError: the run is to end.
        """

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        """Steps are done; nothing happens meanwhile. `is_over`: nothing happens any more, and all is in the record."""


class Together(Onlooker):
    """Several of them."""

    def __init__(self, *onlookers: Onlooker) -> None:
        self._onlookers = onlookers

    def begin(self, robots: Sequence[Hands], results: Sequence[Run]) -> None:
        """See `Onlooker`."""
        for one in self._onlookers:
            one.begin(robots, results)

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """See `Onlooker`."""
        for one in self._onlookers:
            yield from one.before_step(number, time_s)

    def refuse(self, number: int, error: BoebotError) -> None:
        """See `Onlooker`."""
        for one in self._onlookers:
            one.refuse(number, error)

    def look(self, time_s: float, *, is_over: bool = False) -> None:
        """See `Onlooker`."""
        for one in self._onlookers:
            one.look(time_s, is_over=is_over)


def script(request: Request, tasks: Sequence[Task]) -> Repeated:
    """What a run was asked for with: faults, and what is done at the one robot that a program drives."""
    deeds: list[tuple[float, Deed]] = [(time_s, Typed(text, scripted=True)) for text, time_s in request.typed]
    deeds += [(time_s, Set(part, float(value), scripted=True)) for part, value, time_s in request.inputs]
    deeds.sort(key=itemgetter(0))
    return Repeated([[*((0.0, one) for one in task.faults), *deeds * task.brain.is_program] for task in tasks])


class Hands:
    """What is done to one robot of a run.

    Attributes:
        driver, task: of the robot.
        onlooker: who does it.
        held: the motor signals that it is driven by; None: its brain drives it.
        count: of interventions so far, as a result counts them (`touched`).
        faults: those that were begun, and what says how often each has fired.
    """

    def __init__(self, driver: Driver, task: Task, number: int, onlooker: Onlooker) -> None:
        """`number`: of the robot, from 0."""
        self.driver, self.task = driver, task
        self.held: Hand | None = None
        self._tally = Tally()
        self.faults: dict[str, Fired] = {}
        self.onlooker, self._number = onlooker, number

    @property
    def count(self) -> int:
        """See above."""
        return self._tally.count

    def before_step(self, time_s: float) -> None:
        """What is due."""
        for one in self.onlooker.before_step(self._number, time_s):
            try:
                self._carry_out(one)
            except BoebotError as error:
                if isinstance(one, Fault):
                    raise
                self.onlooker.refuse(self._number, error)
            else:
                self._tally.add(time_s, one)
                self.task.record.append(STREAM, time_s, msgspec.json.encode(one))

    def after_step(self) -> None:
        """Who drives by hand has the last word."""
        if self.held is not None:
            self.driver.robot.drive(self.held.left, self.held.right)

    def _carry_out(self, one: Deed) -> None:
        match one:
            case Place(x, y, heading):
                self.driver.session.place(x, y, heading)
            case Shape(index, x, y, heading):
                self.driver.session.place_shape(index, x, y, heading)
            case Typed(text):
                self.driver.type(text)
            case Set(part, value):
                check_setting(self.driver.description, part, value)
                self.driver.session.set_part(part, value)
            case Fault():
                driver, bad_line = self.driver, partial(self.driver.bad_line, self.task.seed)
                offset_s = driver.status().clock_offset
                self.faults[str(one)] = inject(one, driver.description, driver.session, bad_line, offset_s)
                driver.has_faults = True
            case _ if self.driver.is_program:
                raise BoebotError("a program drives this robot, no brain: it takes what is typed, and buttons")
            case _:
                self.held = carry_out(one, self.driver.robot, self.task.brain, self.held)


def carry_out(one: Deed, robot: Robot, brain: LoadedBrain, held: Hand | None) -> Hand | None:
    """Does to robot and brain what needs no world. Returns by which signals the robot is driven by hand then; `held`:
    by which it was.

    Raises:
        BrainError: the brain has no such parameter, or refuses the value.
    """
    match one:
        case Hand():
            return one
        case Release():
            return None
        case Stop():
            robot.emergency_stop()
        case Arm():
            robot.arm()
        case Parameter(name, value):
            set_parameters(brain, {name: value})
    return held


class Repeated(Onlooker):
    """Does what a script says, or again what a record says that was done. What could be done once can be done again, or
    the runs differ: they are compared."""

    def __init__(self, due: Sequence[list[tuple[float, Deed]]]) -> None:
        """`due`: of each robot its deeds with their times (s), in order."""
        self._due = due

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """See `Onlooker`."""
        due = self._due[number]
        while due and due[0][0] <= time_s:
            yield due.pop(0)[1]
