"""What a brain of processes did in a run, from its record: the state variables, utilities and active processes of each
of its steps, and why it switched (section 8.2 of the notes).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.brain.brain import Brain, Switch
from boebot.brain.process import MotorBehavior

if TYPE_CHECKING:
    from boebot.record.record import Record
    from boebot.record.truth import Floats
    from boebot.robot import Robot


STEPS, SWITCHES = "brain_step", "switch"  # streams


@dataclass(frozen=True)
class BrainNames:
    """What a brain is made of.

    Attributes:
        processes: names of all processes, in the order of each step's utilities.
        behaviors: those that are motor behaviors.
        variables: names of the state variables, in the order of each step's values.
    """

    processes: tuple[str, ...]
    behaviors: tuple[str, ...]
    variables: tuple[str, ...]

    @classmethod
    def of(cls, brain: Brain | None) -> BrainNames | None:
        """None: of a brain without processes."""
        if brain is None:
            return None
        return cls(
            processes=tuple(process.name for process in brain.processes),
            behaviors=tuple(process.name for process in brain.processes if isinstance(process, MotorBehavior)),
            variables=tuple(variable.name for variable in brain.variables),
        )

    @property
    def cognitive(self) -> tuple[str, ...]:
        """Names of the cognitive processes."""
        return tuple(name for name in self.processes if name not in self.behaviors)

    @property
    def row(self) -> np.dtype[np.void]:
        """A row of the stream of steps."""
        z, u = len(self.variables), len(self.processes)
        numbers = [("values", "<f8", (z,)), ("utilities", "<f8", (u,)), ("gammas", "<f8", (u,))]
        return np.dtype([("process", "<f8"), *numbers])


@dataclass(frozen=True, repr=False)
class BrainRecord:
    """Steps and switches of one run. A step in which the brain failed is not among them.

    Attributes:
        names: of processes and state variables.
        time: of each step (s), by the run's clock, shape (steps,).
        motor: index in `names.behaviors` of the active one, shape (steps,).
        values: state variables z, shape (steps, variables).
        utilities: u, shape (steps, processes).
        gammas: gamma parameters, shape (steps, processes).
        switches: oldest first; of few of the steps, only the last ones before each.
        behavior_switches: how many there were from one motor behavior to another: without the first choice, and
            without cognitive processes.
        lasted: how long each motor behavior was active until the last step (s), shape (behaviors,).
    """

    names: BrainNames
    time: Floats
    motor: NDArray[np.intp]
    values: Floats
    utilities: Floats
    gammas: Floats
    switches: tuple[Switch, ...]
    behavior_switches: int
    lasted: Floats

    def __repr__(self) -> str:
        """How much there is."""
        return f"<BrainRecord: {len(self)} steps, {len(self.switches)} switches of {', '.join(self.names.processes)}>"

    def __len__(self) -> int:
        """How many steps there are."""
        return len(self.time)

    @cached_property
    def active(self) -> NDArray[np.bool_]:
        """Which processes were active, shape (steps, processes): the chosen motor behavior, and all cognitive
        processes with a utility above 0."""
        active: NDArray[np.bool_] = self.utilities > 0
        for index, name in enumerate(self.names.behaviors):
            active[:, self.names.processes.index(name)] = self.motor == index
        return active

    def utility_of(self, process: str) -> Floats:
        """Utilities of one process, by its name, shape (steps,)."""
        utilities: Floats = self.utilities[:, self.names.processes.index(process)]
        return utilities

    def shares(self, end: float = 0.0) -> dict[str, float]:
        """The share of time, 0 to 1, of each motor behavior: what is active at a step is so until the next one, the
        last one until `end` (s)."""
        lasted = self.lasted.copy()
        if len(self):
            lasted[self.motor[-1]] += max(0.0, end - float(self.time[-1]))
            if not lasted.sum() > 0:  # a single step, at the end
                lasted[self.motor[-1]] = 1.0
        shares = lasted / (lasted.sum() or 1.0)
        return dict(zip(self.names.behaviors, shares.tolist(), strict=True))


def append_brain(record: Record, brain: Brain | None, robot: Robot) -> None:
    """Moves what a brain of processes has done with that robot into the record."""
    if brain is None:
        return
    steps, switches = brain.take(robot)
    index = {process.name: number for number, process in enumerate(brain.processes)}
    for step in steps:
        numbers = (index[step.motor], *step.variables, *step.utilities, *step.gammas)
        record.append(STEPS, step.time, struct.pack(f"<{len(numbers)}d", *numbers))
    for switch in switches:
        record.append(SWITCHES, switch.time, msgspec.json.encode(switch[1:]))


def read_brain(record: Record, names: BrainNames, most: int | None = None) -> BrainRecord:
    """All of it. `most`: how many steps at most; the first and the last are among them."""
    stride = 1 if most is None else max(1, math.ceil(record.count(STEPS) / most))
    last = record.count(STEPS) - 1
    times, rows, lasted = [np.empty(0)], [np.empty(0, dtype=names.row)], np.zeros(len(names.behaviors))
    seen, before = 0, None
    for time, some in _parts(record, names):
        number = seen + np.arange(len(some))
        kept = (number % stride == 0) | (number == last)
        times.append(time[kept])
        rows.append(some[kept])
        seen += len(some)
        ends, motor = np.append(time[1:], time[-1]), _motor(some, names)
        lasted += np.bincount(motor, weights=ends - time, minlength=len(lasted))
        if before is not None:
            lasted[before[1]] += time[0] - before[0]
        before = time[-1], motor[-1]
    time = np.concatenate(times)
    switches, count = _switches(record, names, time if stride > 1 else None)
    return _made(names, time, np.concatenate(rows), switches, count, lasted)


def each_part(record: Record, names: BrainNames) -> Iterator[BrainRecord]:
    """The steps part by part, each small, without the switches."""
    for time, rows in _parts(record, names):
        yield _made(names, time, rows, (), 0, np.zeros(len(names.behaviors)))


def each_switch(record: Record) -> Iterator[Switch]:
    """The switches one by one, oldest first."""
    for time_s, data in record.each_row(SWITCHES):
        yield Switch(time_s, *msgspec.json.decode(data))


def _parts(record: Record, names: BrainNames) -> Iterator[tuple[Floats, NDArray[np.void]]]:
    for block in record.blocks(STEPS):
        yield block.times, block.table(names.row)


def _made(
    names: BrainNames,
    time: Floats,
    rows: NDArray[np.void],
    switches: tuple[Switch, ...],
    behavior_switches: int,
    lasted: Floats,
) -> BrainRecord:
    motor = _motor(rows, names)
    columns = (rows["values"], rows["utilities"], rows["gammas"])
    return BrainRecord(names, time, motor, *columns, switches, behavior_switches, lasted)


def _motor(rows: NDArray[np.void], names: BrainNames) -> NDArray[np.intp]:
    """Index in `names.behaviors` of the active one."""
    behavior = [names.behaviors.index(name) if name in names.behaviors else -1 for name in names.processes]
    return np.array(behavior, dtype=np.intp)[rows["process"].astype(np.intp)]


def _switches(record: Record, names: BrainNames, times: Floats | None) -> tuple[tuple[Switch, ...], int]:
    """The switches, and how many there were of motor behaviors. `times`: of the steps, where not all are kept."""
    kept: dict[tuple[int, bool], Switch] = {}
    all_of_them: list[Switch] = []
    count = 0
    for switch in each_switch(record):
        count += switch.off in names.behaviors
        if times is None:
            all_of_them.append(switch)
        else:
            kept[int(np.searchsorted(times, switch.time)), switch.on in names.behaviors] = switch
    switches = all_of_them if times is None else sorted(kept.values(), key=lambda switch: switch.time)
    return tuple(switches), count
