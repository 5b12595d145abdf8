"""What a brain of processes did in a run: the state variables, utilities and active processes of each of its steps, and
why it switched (section 8.2 of the notes). Made when a run has ended; it changes no more.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.brain.brain import Brain, BrainStep, Switch
    from boebot.record.record import Record
    from boebot.record.series import Floats
    from boebot.robot import Robot


STEPS, SWITCHES = "brain_step", "switch"  # streams


@dataclass(frozen=True, repr=False)
class BrainRecord:
    """Steps and switches of one run.

    Attributes:
        processes: names of all processes, in the order of each step's utilities.
        behaviors: those that are motor behaviors.
        variables: names of the state variables, in the order of each step's values.
        steps: oldest first. One in which the brain failed is not among them.
        switches: oldest first.
    """

    processes: tuple[str, ...]
    behaviors: tuple[str, ...]
    variables: tuple[str, ...]
    steps: tuple[BrainStep, ...]
    switches: tuple[Switch, ...]

    @classmethod
    def of(cls, brain: Brain | None, robot: Robot) -> BrainRecord | None:
        """What a brain did with that robot: nothing if it never stepped. None: of a brain without processes."""
        if brain is None:
            return None
        met = brain.has_stepped(robot)
        return cls(
            processes=tuple(process.name for process in brain.processes),
            behaviors=tuple(process.name for process in brain.processes if isinstance(process, MotorBehavior)),
            variables=tuple(variable.name for variable in brain.variables),
            steps=tuple(brain.steps) if met else (),
            switches=tuple(brain.switches) if met else (),
        )

    @classmethod
    def read(
        cls, record: Record, processes: tuple[str, ...], behaviors: tuple[str, ...], variables: tuple[str, ...]
    ) -> BrainRecord:
        """From the streams of a record (`append_brain`), and the names."""
        from boebot.brain.brain import BrainStep, Switch

        z, u = len(variables), len(processes)
        steps = []
        for time_s, data in record.rows(STEPS):
            motor, *numbers = struct.unpack(f"<{1 + z + 2 * u}d", data)
            values = tuple(numbers)
            steps.append(BrainStep(time_s, processes[int(motor)], values[:z], values[z : z + u], values[z + u :]))
        switches = (Switch(time_s, *msgspec.json.decode(data)) for time_s, data in record.rows(SWITCHES))
        return cls(processes, behaviors, variables, tuple(steps), tuple(switches))

    def __repr__(self) -> str:
        """How much there is."""
        return f"<BrainRecord: {len(self.steps)} steps, {len(self.switches)} switches of {', '.join(self.processes)}>"

    @property
    def cognitive(self) -> tuple[str, ...]:
        """Names of the cognitive processes."""
        return tuple(name for name in self.processes if name not in self.behaviors)

    @cached_property
    def time(self) -> Floats:
        """Time of each step (s), by the run's clock."""
        return np.array([step.time for step in self.steps], dtype=float)

    @cached_property
    def values(self) -> Floats:
        """State variables z, shape (steps, variables)."""
        return self._table([step.variables for step in self.steps], len(self.variables))

    @cached_property
    def utilities(self) -> Floats:
        """Utilities u, shape (steps, processes)."""
        return self._table([step.utilities for step in self.steps], len(self.processes))

    @cached_property
    def gammas(self) -> Floats:
        """Gamma parameters, shape (steps, processes)."""
        return self._table([step.gammas for step in self.steps], len(self.processes))

    @cached_property
    def active(self) -> np.ndarray:
        """Which processes were active, shape (steps, processes), bool: the chosen motor behavior, and all cognitive
        processes with a utility above 0."""
        active = self.utilities > 0
        chosen = np.array([step.motor for step in self.steps], dtype=object)
        for index, name in enumerate(self.processes):
            if name in self.behaviors:
                active[:, index] = chosen == name
        return active

    @cached_property
    def motor(self) -> np.ndarray:
        """Index in `behaviors` of the active one, at each step."""
        index = {name: number for number, name in enumerate(self.behaviors)}
        return np.array([index[step.motor] for step in self.steps], dtype=np.intp)

    @property
    def behavior_switches(self) -> tuple[Switch, ...]:
        """Those from one motor behavior to another: without the first choice, and without cognitive processes."""
        return tuple(switch for switch in self.switches if switch.off in self.behaviors)

    def utility_of(self, process: str) -> Floats:
        """Utilities of one process, by its name."""
        utilities: Floats = self.utilities[:, self.processes.index(process)]
        return utilities

    def shares(self, end: float = 0.0) -> dict[str, float]:
        """The share of time, 0 to 1, of each motor behavior: what is active at a step is so until the next one, the
        last one until `end` (s)."""
        if not self.steps:
            return dict.fromkeys(self.behaviors, 0.0)
        lasting = np.diff(self.time, append=max(end, self.time[-1]))
        if not lasting.sum() > 0:  # a single step, at the end
            lasting = np.ones(len(self.steps))
        each = np.bincount(self.motor, weights=lasting, minlength=len(self.behaviors)) / lasting.sum()
        return dict(zip(self.behaviors, each.tolist(), strict=True))

    @staticmethod
    def _table(rows: list[tuple[float, ...]], columns: int) -> Floats:
        return np.array(rows, dtype=float).reshape(len(rows), columns)


def append_brain(record: Record, brain: Brain | None, robot: Robot) -> None:
    """Puts what a brain of processes has done with that robot, and is not in the record yet, into its streams."""
    if brain is None or not brain.has_stepped(robot):
        return
    index = {process.name: number for number, process in enumerate(brain.processes)}
    for step in brain.steps[record.count(STEPS) :]:
        numbers = (index[step.motor], *step.variables, *step.utilities, *step.gammas)
        record.append(STEPS, step.time, struct.pack(f"<{len(numbers)}d", *numbers))
    for switch in brain.switches[record.count(SWITCHES) :]:
        record.append(SWITCHES, switch.time, msgspec.json.encode(switch[1:]))
