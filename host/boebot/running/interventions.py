"""What a person does to a run between two steps of its brain: drives by hand, lifts the robot, changes a parameter.

Whoever watches a run (boebot.live) hands interventions over; they are carried out here, before a step of the brain, and
each goes into the record with its time. A simulated run with the same interventions at the same steps is the same run
bit for bit: `boebot run --again` takes them from the record.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Protocol

import msgspec

from boebot.errors import BoebotError
from boebot.running.brain_parameters import set_parameters

if TYPE_CHECKING:
    from boebot.record.record import Record
    from boebot.record.result import RunResult
    from boebot.running.driver import Driver, Task

STREAM = "intervention"  # of the record
SLIDE_S = 1.0  # of the run; a slider that is dragged gives new values all the time


class Intervention(msgspec.Struct, frozen=True, tag_field="kind", tag=str.lower):
    """One of those below, of one robot."""


class Hand(Intervention, frozen=True):
    """The robot is driven by these motor signals (-1 to 1), whatever its brain says, until `Release`."""

    left: float
    right: float


class Release(Intervention, frozen=True):
    """Its brain drives it again."""


class Stop(Intervention, frozen=True):
    """Its motors are latched off."""


class Arm(Intervention, frozen=True):
    """They are no longer."""


class Place(Intervention, frozen=True):
    """A simulated robot is lifted and put elsewhere: x (m), y (m), heading (rad)."""

    x: float
    y: float
    heading: float


class Shape(Intervention, frozen=True):
    """So is a moving shape of the arena, the `index`-th from 0."""

    index: int
    x: float
    y: float
    heading: float


class Parameter(Intervention, frozen=True):
    """A parameter of a process of its brain gets another value; `name`: as "avoid.turn"."""

    name: str
    value: float


Deed = Hand | Release | Stop | Arm | Place | Shape | Parameter
_DECODER: msgspec.json.Decoder[Deed] = msgspec.json.Decoder(Deed)


class Onlooker(Protocol):
    """Who watches a run, and may interfere with it."""

    def begin(self, robots: Sequence[Hands], results: Sequence[RunResult]) -> None:
        """The run begins. `results`: what is known of each robot."""

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """The brain of a robot (from 0) is about to step: what is done to the robot first. It may wait.

        Raises:
            BoebotError: the run is to end.
        """

    def refuse(self, number: int, error: BoebotError) -> None:
        """What was to be done cannot be done.

        Raises:
            BoebotError: the run is to end.
        """

    def look(self, time_s: float) -> None:
        """Steps are done; nothing happens meanwhile."""


class Hands:
    """What is done to one robot of a run.

    Attributes:
        driver, task: of the robot.
        onlooker: who does it.
        held: the motor signals that it is driven by; None: its brain drives it.
        count: of interventions so far, as a result counts them (`touched`).
    """

    def __init__(self, driver: Driver, task: Task, number: int, onlooker: Onlooker) -> None:
        """`number`: of the robot, from 0."""
        self.driver, self.task = driver, task
        self.held: Hand | None = None
        self._tally = Tally()
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
                self.onlooker.refuse(self._number, error)
            else:
                self._tally.add(time_s, one)
                self.task.record.append(STREAM, time_s, msgspec.json.encode(one))

    def after_step(self) -> None:
        """Who drives by hand has the last word."""
        if self.held is not None:
            self.driver.robot.drive(self.held.left, self.held.right)

    def _carry_out(self, one: Deed) -> None:
        robot = self.driver.robot
        match one:
            case Hand():
                self.held = one
            case Release():
                self.held = None
            case Stop():
                robot.emergency_stop()
            case Arm():
                robot.arm()
            case Place(x, y, heading):
                self.driver.session.place(x, y, heading)
            case Shape(index, x, y, heading):
                self.driver.session.place_shape(index, x, y, heading)
            case Parameter(name, value):
                set_parameters(self.task.brain, {name: value})


class Repeated:
    """Does again what a record says that was done (an `Onlooker`)."""

    def __init__(self, records: Sequence[Record]) -> None:
        """`records`: one for each robot."""
        self._due = [interventions(record) for record in records]

    def begin(self, robots: Sequence[Hands], results: Sequence[RunResult]) -> None:
        """See `Onlooker`."""

    def before_step(self, number: int, time_s: float) -> Iterable[Deed]:
        """See `Onlooker`."""
        due = self._due[number]
        while due and due[0][0] <= time_s:
            yield due.pop(0)[1]

    def refuse(self, number: int, error: BoebotError) -> None:
        """What could be done once can be done again, or the runs differ: they are compared."""

    def look(self, time_s: float) -> None:
        """Nobody looks."""


def interventions(record: Record) -> list[tuple[float, Deed]]:
    """Those of a robot's run, with their times (s)."""
    return [(time_s, _DECODER.decode(data)) for time_s, data in record.rows(STREAM)]


def in_words(data: bytes) -> str:
    """An intervention as it stands in a record."""
    match _DECODER.decode(data):
        case Hand(left, right):
            return f"driven by hand: {left:+.2f}, {right:+.2f}"
        case Release():
            return "the brain drives again"
        case Stop():
            return "motors latched off by hand"
        case Arm():
            return "motors armed by hand"
        case Place(x, y, heading):
            return f"put at {x:.2f}, {y:.2f} m, {math.degrees(heading):.0f}°"
        case Shape(index, x, y):
            return f"moving shape {index + 1} put at {x:.2f}, {y:.2f} m"
        case Parameter(name, value):
            return f"{name} = {value:g}"


def touched(record: Record) -> int:
    """How often a person has interfered with a robot's run, as `Tally` counts."""
    tally = Tally()
    for time_s, one in interventions(record):
        tally.add(time_s, one)
    return tally.count


class Tally:
    """Counts interventions: driving by hand once, until the brain drives again; a parameter that is moved on within
    `SLIDE_S` of the run, and nothing else in between, once.

    Attributes:
        count: so far.
    """

    def __init__(self) -> None:
        self.count = 0
        self._by_hand = False
        self._slid: tuple[str, float] = "", 0.0  # the parameter that was moved last, and when

    def add(self, time_s: float, one: Deed) -> None:
        """It has been carried out before the step at that time of the run."""
        name, last_s = self._slid
        self._slid = (one.name, time_s) if isinstance(one, Parameter) else ("", 0.0)
        if isinstance(one, Hand):
            self.count += not self._by_hand
            self._by_hand = True
        elif isinstance(one, Release):
            self._by_hand = False
        else:
            self.count += not (isinstance(one, Parameter) and one.name == name and time_s - last_s < SLIDE_S)
