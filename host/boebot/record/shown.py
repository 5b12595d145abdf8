"""What a brain showed in a run (`robot.show`, `robot.sketch`), read from its record."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from boebot.showing import VALUES, Sketch

if TYPE_CHECKING:
    from boebot.record.blocks import Row
    from boebot.record.record import Record
    from boebot.record.truth import Floats

SKETCH_BYTES = 3_000_000  # of all sketches that are drawn


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
