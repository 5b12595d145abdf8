"""What a brain did and showed in a run, from its record: of a brain of processes the state variables, utilities and
active processes of each of its steps, and why it switched (section 8.2 of the notes); of any brain its values and
sketches (`robot.show`, `robot.sketch`)."""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypedDict

import msgspec
import numpy as np
from numpy.typing import NDArray

from boebot.record.blocks import few
from boebot.showing import SKETCH, VALUES, Sketch

if TYPE_CHECKING:  # the record of a run without such a brain does without
    from boebot.brain.brain import Brain, Switch
    from boebot.record.blocks import Block, Row
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

    def thinned(self, most: int) -> BrainRecord:
        """About `most` of its steps, and before each of them the last switch of either kind; counts and shares stay."""
        steps = few(len(self), most)
        last: dict[tuple[int, bool], Switch] = {}
        for switch in self.switches:
            last[int(np.searchsorted(self.time[steps], switch.time)), switch.on in self.names.behaviors] = switch
        names = ("time", "motor", "values", "utilities", "gammas")
        thin: dict[str, Any] = {name: getattr(self, name)[steps] for name in names}
        return replace(self, switches=tuple(sorted(last.values(), key=lambda switch: switch.time)), **thin)

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


def read_brain(record: Record, names: BrainNames) -> BrainRecord:
    """All of it."""
    return _brain_of(names, record.block(STEPS), tuple(each_switch(record)))


def each_part(record: Record, names: BrainNames) -> Iterator[BrainRecord]:
    """The steps part by part, each small, without the switches."""
    return (_brain_of(names, block, ()) for block in record.blocks(STEPS))


def each_switch(record: Record) -> Iterator[Switch]:
    """The switches one by one, oldest first."""
    from boebot.brain.brain import Switch

    for time_s, data in record.each_row(SWITCHES):
        yield Switch(time_s, *msgspec.json.decode(data))


def _brain_of(names: BrainNames, block: Block, switches: tuple[Switch, ...]) -> BrainRecord:
    rows, time = block.table(names.row), block.times
    behavior = [names.behaviors.index(name) if name in names.behaviors else -1 for name in names.processes]
    motor = np.array(behavior, dtype=np.intp)[rows["process"].astype(np.intp)]
    lasted = np.zeros(len(names.behaviors))
    np.add.at(lasted, motor, np.diff(time, append=time[-1:]))
    changed = sum(switch.off in names.behaviors for switch in switches)
    columns = (rows["values"], rows["utilities"], rows["gammas"])
    return BrainRecord(names, time, motor, *columns, switches, changed, lasted)


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


def names_in(rows: Iterable[Row]) -> dict[str, bool]:
    """Of all that is shown in those rows of the stream, and whether it was ever a text."""
    names: dict[str, bool] = {}
    for _, data in rows:
        for name, value in msgspec.json.decode(data).items():
            names[name] = names.get(name, False) or isinstance(value, str)
    return names


def read_shown(record: Record, most: int | None = None) -> Shown:
    """All of it. `most`: about how many rows at most, the first and the last among them."""
    rows = record.rows(VALUES)
    return shown_in([rows[index] for index in few(len(rows), most)], names_in(rows))


def shown_in(rows: Iterable[Row], names: Mapping[str, bool]) -> Shown:
    """Of those rows. `names`: of all that is shown, and whether it is a text (`names_in`)."""
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


def read_layers(record: Record, most: int | None = SKETCH_BYTES) -> list[Layer]:
    """The sketches, layer by layer in the order of their first ones. `most`: about how many bytes of them; a layer that
    has more than its share changes less often."""
    sizes: dict[str, list[int]] = {}
    for _, data in record.each_row(SKETCH):
        sizes.setdefault(_sketch(data).layer, []).append(len(data))
    wanted = {
        name: few(len(own), None if most is None else most * len(own) // (sum(own) * len(sizes))).tolist()
        for name, own in sizes.items()
    }
    seen, kept = Counter[str](), dict[str, list[tuple[float, Sketch]]]()
    for time_s, data in record.each_row(SKETCH):
        sketch = _sketch(data)
        if seen[sketch.layer] == wanted[sketch.layer][len(kept.setdefault(sketch.layer, []))]:
            kept[sketch.layer].append((time_s, sketch))
        seen[sketch.layer] += 1
    return [Layer(name, np.array([row[0] for row in rows]), [row[1] for row in rows]) for name, rows in kept.items()]


def _sketch(data: bytes) -> Sketch:
    return msgspec.json.decode(data, type=Sketch)
