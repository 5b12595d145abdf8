"""What a brain did and showed in a run, from its record: of a brain of processes the state variables, utilities and
active processes of each of its steps, and why it switched (section 8.2 of the notes); of any brain its values and
sketches (`robot.show`, `robot.sketch`)."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypedDict

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.showing import VALUES, Sketch

if TYPE_CHECKING:  # the record of a run without such a brain does without
    from boebot.brain.brain import Brain, Switch
    from boebot.record.blocks import Row
    from boebot.record.record import Record
    from boebot.record.truth import Floats
    from boebot.robot import Robot

STEPS, SWITCHES = "brain_step", "switch"  # streams
SKETCH_BYTES = 3_000_000  # of all sketches that are drawn


class MadeOf(TypedDict):
    """What a brain is made of, as the table of a file, with the whole names of classes. Beside it `undescribed`, in
    words, what no file can say: where there is nothing of this kind, the table composes the same brain."""

    period_s: float
    margin: float
    variable: dict[str, dict[str, str] | None]
    process: dict[str, dict[str, Any]]
    undescribed: list[str]


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
        from boebot.brain.process import MotorBehavior

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
    from boebot.brain.brain import Switch

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


# ---- what it showed --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Shown:
    """The values over time; each row holds until the next one.

    Attributes:
        time: of the rows (s of the run), shape (n,).
        numbers: by name, shape (n,); NaN: not shown then.
        texts: by name, n of them; "": not shown then.
    """

    time: Floats
    numbers: dict[str, Floats]
    texts: dict[str, list[str]]

    def at(self, times: Floats) -> Shown:
        """What was shown at these times."""
        row = np.searchsorted(self.time, times + 1e-9, side="right")  # 0: nothing yet
        return Shown(
            times,
            {name: np.concatenate(([math.nan], values))[row] for name, values in self.numbers.items()},
            {name: [["", *values][index] for index in row.tolist()] for name, values in self.texts.items()},
        )


def shown_names(record: Record) -> dict[str, bool]:
    """Of all that was shown, and whether it was ever a text."""
    return names_in(record.each_row(VALUES))


def names_in(rows: Iterable[Row]) -> dict[str, bool]:
    """The same of those rows."""
    names: dict[str, bool] = {}
    for _, data in rows:
        for name, value in msgspec.json.decode(data).items():
            names[name] = names.get(name, False) or isinstance(value, str)
    return names


def read_shown(record: Record, most: int | None = None) -> Shown:
    """All of it. `most`: how many rows at most, the first and the last among them."""
    count = record.count(VALUES)
    stride = 1 if most is None else max(1, math.ceil(count / most))
    rows = enumerate(record.each_row(VALUES))
    return shown_in((row for index, row in rows if index % stride == 0 or index == count - 1), shown_names(record))


def shown_in(rows: Iterable[Row], names: Mapping[str, bool]) -> Shown:
    """Of those rows. `names`: of all that is shown, and whether it is a text (`shown_names`)."""
    decoded = [(time_s, msgspec.json.decode(data)) for time_s, data in rows]
    return Shown(
        np.array([time_s for time_s, _ in decoded]),
        {name: np.array([_number(row.get(name)) for _, row in decoded]) for name, text in names.items() if not text},
        {name: [_text(row.get(name)) for _, row in decoded] for name, text in names.items() if text},
    )


def _number(value: float | str | None) -> float:
    return math.nan if value is None else float(value)


def _text(value: float | str | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:g}"


@dataclass(frozen=True)
class Layer:
    """What one layer of the sketches showed.

    Attributes:
        name: its name.
        time: from when on (s of the run), shape (n,).
        sketches: what, n of them.
    """

    name: str
    time: Floats
    sketches: list[Sketch]


class _Kept:
    """The rows of one layer: all of them, or every second, fourth, eighth... and the last one."""

    def __init__(self) -> None:
        self.rows: list[tuple[float, Sketch]] = []
        self.size = 0
        self._stride = 1
        self._count = 0
        self._last: tuple[float, Sketch] | None = None

    def add(self, time_s: float, sketch: Sketch) -> None:
        """One more."""
        self._last = time_s, sketch
        if self._count % self._stride == 0:
            self.rows.append(self._last)
            self.size += _size(sketch)
        self._count += 1

    def thin(self) -> None:
        """Half of them, with the first."""
        self.rows = self.rows[::2]
        self._stride *= 2
        self.size = sum(_size(sketch) for _, sketch in self.rows)

    def layer(self, name: str) -> Layer:
        """What is left."""
        rows = self.rows if self._last is None or self.rows[-1] is self._last else [*self.rows, self._last]
        return Layer(name, np.array([time_s for time_s, _ in rows]), [sketch for _, sketch in rows])


def _size(sketch: Sketch) -> int:
    return 100 + 8 * sketch.size + (0 if sketch.grid is None else len(sketch.grid.cells))


def read_layers(rows: Iterable[Row], most: int | None = SKETCH_BYTES) -> list[Layer]:
    """The sketches in those rows, layer by layer in the order of their first ones. `most`: about how many bytes of
    them; a layer that has more changes less often."""
    layers: dict[str, _Kept] = {}
    for time_s, data in rows:
        sketch = msgspec.json.decode(data, type=Sketch)
        layers.setdefault(sketch.layer, _Kept()).add(time_s, sketch)
        while most is not None and sum(kept.size for kept in layers.values()) > most:
            greatest = max(layers.values(), key=lambda kept: len(kept.rows) > 1 and kept.size)
            if len(greatest.rows) < 2:
                break
            greatest.thin()
    return [kept.layer(name) for name, kept in layers.items()]
