"""A brain of processes: state variables, utilities, activation (section 8.2 of the notes).

A step, always in this order: state variables; decay of gamma; utilities; switches; the active cognitive processes, in
the order in which they were given; the active motor behavior.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from boebot.brain.process import CognitiveProcess, MotorBehavior, Process
from boebot.brain.utility import Utilities
from boebot.brain.variables import StateVariable
from boebot.errors import BrainError

if TYPE_CHECKING:
    from boebot.robot import Command, Robot

P = TypeVar("P")
_ON_TIME = 1e-9  # s; times are sums of ticks


class Switch(NamedTuple):
    """A process became active in place of another (motor behaviors), or became active or inactive (cognitive ones).

    Attributes:
        time: of the run (s).
        off: what was active, or "".
        on: the behavior that is active now, or "".
        reason: utilities, and what drives them most.
    """

    time: float
    off: str
    on: str
    reason: str


class BrainStep(NamedTuple):
    """What one step of the brain came to.

    Attributes:
        time: of the run (s).
        motor: the active motor behavior.
        variables: in the order of `Brain.variables`.
        utilities: in the order of `Brain.processes`.
        gammas: in the same order.
    """

    time: float
    motor: str
    variables: tuple[float, ...]
    utilities: tuple[float, ...]
    gammas: tuple[float, ...]


class Brain:
    """Processes and the state variables that their utilities depend on. Give it to `boebot.run`.

    Attributes:
        processes: all of them, with those that others brought along.
        given: those that it was made of.
        variables: the state variables.
        steps: one BrainStep for each step of the present run that `take` has not given yet. A run takes them into its
            record as it goes on: they are in the result's `brain_record`.
        switches: one Switch for each change of the active behavior, as long.
        begun: names of the processes that have been active in the present or last run.
        margin: by how much a motor behavior's utility must exceed the active one's to take over.
    """

    def __init__(
        self,
        processes: Iterable[Process],
        variables: Iterable[StateVariable] = (),
        *,
        period: float = 0.05,
        margin: float = 0.0,
    ) -> None:
        """
        Args:
            processes: at least one motor behavior; cognitive processes are carried out in this order.
            variables: state variables that the utilities' weights name.
            period: seconds from step to step.
            margin: by how much a motor behavior's utility must exceed the active one's to take over; the notes need
                none, their utilities' lag keeps behaviors from flickering.

        Raises:
            BrainError: the parts do not fit together.
        """
        given = _checked(processes, Process, "processes")
        self.given: tuple[Process, ...] = tuple(given)
        self.processes: tuple[Process, ...] = tuple(given + [one for each in given for one in each.companions()])
        self.variables = tuple(_checked(variables, StateVariable, "state variables"))
        self.steps: list[BrainStep] = []
        self.switches: list[Switch] = []
        self.begun: set[str] = set()
        self.PERIOD = period
        self.margin = margin
        self._check()
        self.NEEDS = _united([*(each.NEEDS for each in self.processes), *(each.needs for each in self.variables)])
        self._utilities = Utilities(
            [process.utility for process in self.processes], [variable.name for variable in self.variables]
        )
        self._motor = [index for index, each in enumerate(self.processes) if isinstance(each, MotorBehavior)]
        self._cognitive = [index for index, each in enumerate(self.processes) if isinstance(each, CognitiveProcess)]
        self._active: list[bool] = []
        self._every: list[int] = []  # of the brain's steps, how many to one of each process
        self._wait: list[int] = []  # steps of the brain until its next one
        self._driving = -1
        self._robot: Robot | None = None
        self._time = 0.0

    def __repr__(self) -> str:
        """What it is made of."""
        variables = ", ".join(variable.name for variable in self.variables)
        made_of = ", ".join(process.name for process in self.processes)
        return f"<Brain: {made_of}{f'; by {variables}' if variables else ''}>"

    def __getstate__(self) -> dict[str, Any]:
        """To copy and pickle it: without the robot, so that the copy begins afresh."""
        return {**vars(self), "_robot": None}

    def _check(self) -> None:
        if not self.processes or not any(isinstance(each, MotorBehavior) for each in self.processes):
            raise BrainError("a brain needs at least one motor behavior")
        for kind, names in (
            ("processes", [process.name for process in self.processes]),
            ("state variables", [variable.name for variable in self.variables]),
        ):
            twice = next((name for name in names if names.count(name) > 1), None)
            if twice is not None:
                raise BrainError(f"two {kind} are called {twice!r}; expected another name= for each")
        if not (isinstance(self.PERIOD, int | float) and 0 < self.PERIOD < math.inf):
            raise BrainError(f"a brain's period of {self.PERIOD!r}; expected seconds from step to step")
        if not (isinstance(self.margin, int | float) and 0 <= self.margin < math.inf):
            raise BrainError(f"a margin of {self.margin!r}; expected 0 or more")

    # ---- a run -------------------------------------------------------------------------------------------------

    def step(self, robot: Robot) -> None:
        """One step, of a new run if that robot has not been seen before."""
        now, utilities = robot.time, self._utilities
        if robot is not self._robot:
            self._begin(robot)
            z = self._read(robot)
            utilities.start(z)
        else:
            z = self._read(robot)
            utilities.advance(z, now - self._time)
        self._time = now
        self._activate(robot, z)
        before, active = robot.command, self._active
        for index in self._cognitive:
            if active[index]:
                self._step_if_due(index, robot)
                self._check_hands_off(index, robot, before)
        self._step_if_due(self._driving, robot)
        name = self.processes[self._driving].name
        self.steps.append(BrainStep(now, name, z, tuple(utilities.values), tuple(utilities.gammas)))

    def change(self, process: Process, fields: Mapping[str, Any]) -> None:
        """Parameters of one of its processes get other values, which that takes; also while a run goes on."""
        vars(process).update(fields, has_changed=True)
        self._utilities.follow([each.utility for each in self.processes])

    @property
    def active(self) -> str:
        """Name of the active motor behavior."""
        return self.processes[self._driving].name if self._driving >= 0 else ""

    def take(self, robot: Robot) -> tuple[list[BrainStep], list[Switch]]:
        """The steps and switches of that robot's run since this was last asked; they are forgotten here."""
        if robot is not self._robot:
            return [], []
        steps, switches = self.steps[:], self.switches[:]
        del self.steps[: len(steps)]  # the brain may add one meanwhile, in another thread
        del self.switches[: len(switches)]
        return steps, switches

    def utility(self, process: Process) -> float:
        """The present utility of one of the brain's processes."""
        return self._utilities.values[self._place(process)]

    def gamma(self, process: Process) -> float:
        """The present gamma parameter of one of the brain's processes."""
        return self._utilities.gammas[self._place(process)]

    def _begin(self, robot: Robot) -> None:
        self._robot = robot
        self.steps, self.switches, self.begun = [], [], set()
        count = len(self.processes)
        self._active, self._every, self._wait = [False] * count, [], [0] * count
        self._driving = -1
        for process in self.processes:
            period = process.period or robot.period
            ratio = period / robot.period
            if ratio < 1 - _ON_TIME or abs(ratio - round(ratio)) > 1e-6:
                raise BrainError(
                    f"{process.name}: a period of {period:g} s; expected a multiple of the brain's, {robot.period:g} s"
                )
            self._every.append(round(ratio))
            process.join(period, robot.stream(process.name), self._find, self._kick)

    def _read(self, robot: Robot) -> tuple[float, ...]:
        return tuple([variable.value(robot) for variable in self.variables])

    def _activate(self, robot: Robot, z: Sequence[float]) -> None:
        """Motor behaviors: the one of the highest utility. Cognitive processes: all with a utility above 0."""
        values = self._utilities.values
        best = max(self._motor, key=values.__getitem__)  # of equals, the first
        if self._driving < 0 or values[best] > values[self._driving] + self.margin:
            self._switch_motor(robot, best, z)
        active = self._active
        for index in self._cognitive:
            wanted = values[index] > 0
            if wanted != active[index]:
                name = self.processes[index].name
                self._note(robot, "" if wanted else name, name if wanted else "", self._reason(index, z))
                before = robot.command
                self._turn(robot, index, wanted)
                self._check_hands_off(index, robot, before)

    def _check_hands_off(self, index: int, robot: Robot, before: Command) -> None:
        if robot.command != before:
            name = self.processes[index].name
            raise BrainError(f"cognitive process {name!r} drives the motors; only motor behaviors may")

    def _switch_motor(self, robot: Robot, index: int, z: Sequence[float]) -> None:
        last = self._driving
        reason = self._reason(index, z)
        if last >= 0:
            reason += f", above {self._named(last)}"
        self._note(robot, self.active, self.processes[index].name, reason)
        if last >= 0:
            self._turn(robot, last, False)
            robot.stop()  # what the last one wanted of the motors is over
        self._driving = index
        self._turn(robot, index, True)

    def _turn(self, robot: Robot, index: int, on: bool) -> None:
        self._active[index] = on
        if on:
            self._wait[index] = 0
            self.begun.add(self.processes[index].name)
            self.processes[index].enter(robot)
        else:
            self.processes[index].exit(robot)

    def _step_if_due(self, index: int, robot: Robot) -> None:
        # counted, not timed: a board's telemetry may come a tick late, and the step after that is none too many
        wait = self._wait
        if wait[index] == 0:
            wait[index] = self._every[index]
            self.processes[index].step(robot)
        wait[index] -= 1

    # ---- what processes ask ---------------------------------------------------------------------------------------

    def _find(self, wanted: object) -> Process:
        if isinstance(wanted, str):
            found = [process for process in self.processes if process.name == wanted]
            what = repr(wanted)
        else:
            assert isinstance(wanted, type)
            found = [process for process in self.processes if isinstance(process, wanted)]
            what = wanted.__name__
        if len(found) != 1:
            names = ", ".join(process.name for process in self.processes)
            raise BrainError(f"{'no' if not found else 'more than one'} process {what}; this brain has {names}")
        return found[0]

    def _place(self, process: Process) -> int:
        for index, each in enumerate(self.processes):
            if each is process:
                return index
        raise BrainError(f"{process.name}: not one of this brain's processes")

    def _kick(self, process: Process, gamma: float) -> None:
        self._utilities.gammas[self._place(process)] = gamma

    # ---- reasons -------------------------------------------------------------------------------------------------

    def _note(self, robot: Robot, off: str, on: str, reason: str) -> None:
        self.switches.append(Switch(robot.time, off, on, reason))

    def _named(self, index: int) -> str:
        return f"{self.processes[index].name} {self._utilities.values[index]:.3f}"

    def _reason(self, index: int, z: Sequence[float]) -> str:
        shares = self._utilities.shares(index, z)[:2]
        text = ", ".join(f"{share.cause} {share.value:+.2f}" for share in shares)
        return f"{self._named(index)} ({text or 'no input'})"


def _checked(given: Iterable[P], kind: type[P], what: str) -> list[P]:
    """As a list, in which nothing else is."""
    try:
        parts = list(given)
    except TypeError:
        raise BrainError(f"a brain's {what} are {given!r}; expected a list of them") from None
    for part in parts:
        if isinstance(part, type) and issubclass(part, kind):
            raise BrainError(f"among a brain's {what} is the class {part.__name__}; expected {part.__name__}()")
        if not isinstance(part, kind):
            raise BrainError(f"among a brain's {what} is {part!r}; expected a {kind.__name__}")
        if isinstance(part, Process) and not part.is_made:
            raise BrainError(f"{type(part).__name__} is not ready; expected super().__init__() in its __init__")
    return parts


def _united(lists: Iterable[Sequence[str]]) -> tuple[str, ...]:
    """All names, each once, in the order of their first appearance."""
    return tuple(dict.fromkeys(name for names in lists for name in names))
