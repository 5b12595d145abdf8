"""What a brain shows: named values, and sketches on the arena. Data, not drawing code: the record keeps them, and
tables, pictures and pages draw them.

Both are bounded, so that a brain that shows something in every step of a long run neither slows the run nor fills its
record. What is beyond the bounds is left out, and the run says so once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from boebot.errors import BrainError

VALUES, SKETCH = "shown", "sketch"  # streams of the record
FRAMES = ("start", "arena", "robot")

NAMES = 32  # values and layers, each, at most
LETTERS = 100  # of a name or of a text that is shown; a longer text is cut
POINTS = 20_000  # of a sketch: its points, and those of its lines
CELLS = 250_000  # of a grid
SKETCH_EACH_S = 0.1  # between two sketches of a layer that are kept
BYTES_S = 50_000  # a second of the run, in the long run
BYTES_AT_ONCE = 4_000_000
OCCUPIED, UNKNOWN = 254, 255  # values of a cell as it is kept; 0: free

_ON_TIME = 1e-9  # s; times are sums of ticks

ShownRow = tuple[str, float, bytes]
"""Of the record: stream, time (s), bytes."""


class Grid(NamedTuple):
    """A regular grid on the arena, for `robot.sketch`: a map of what is occupied, or where something is likely.

    Args:
        values: shape (rows, columns), 0 (free) to 1 (occupied), NaN: unknown; the first row is that of the smallest
            y.
        cell: length of a cell's side (m).
        x: of the lower left corner (m).
        y: of the lower left corner (m).
    """

    values: ArrayLike
    cell: float
    x: float = 0.0
    y: float = 0.0


class GridCells(msgspec.Struct, frozen=True):
    """A grid as it is kept."""

    rows: int
    columns: int
    cell: float
    """m"""
    x: float
    y: float
    """of the lower left corner (m)"""
    cells: bytes
    """row by row, 0 (free) to 254 (occupied), 255: unknown"""


class Sketch(msgspec.Struct, frozen=True):
    """What a layer shows, as it is kept; points are little-endian float32, x and y in turn (m)."""

    layer: str
    frame: str
    """"start": from where the robot stood as the run began, x ahead; "arena": the arena's own; "robot": from where it
    is, x ahead"""
    lines: list[bytes]
    points: bytes
    grid: GridCells | None

    @property
    def size(self) -> int:
        """How many points it has."""
        return (sum(map(len, self.lines)) + len(self.points)) // 8


class Showing:
    """What one brain shows in one run.

    Attributes:
        values: what is shown now, by name.
        is_kept: somebody takes what was shown, with `take`.
    """

    def __init__(self) -> None:
        self.values: dict[str, float | str] = {}
        self.is_kept = False
        self._rows: list[ShownRow] = []  # that nobody has taken yet
        self._notices: dict[str, str] = {}  # by what each is about
        self._shown_s = -math.inf  # when the values were shown
        self._kept_values = b"{}"
        self._layers: dict[str, _Layer] = {}
        self._room = float(BYTES_AT_ONCE)  # B that may be kept now
        self._room_s = 0.0  # when there was that much

    @property
    def notices(self) -> list[str]:
        """What the brain's author should know, in sentences."""
        return list(self._notices.values())

    def show(self, time_s: float, name: str, value: object) -> None:
        """See `boebot.Robot.show`."""
        if time_s != self._shown_s:
            self._keep_values()
            self._shown_s = time_s
        if value is None:
            self.values.pop(name, None)
            return
        if name not in self.values:
            _check_name("show", name)
            if len(self.values) >= NAMES:
                self._tell("names", f"the brain shows more than {NAMES} values: {name!r} and others are left out")
                return
        if isinstance(value, str):
            text = value if len(value) <= LETTERS else value[: LETTERS - 1] + "…"
            self.values[name] = text.encode(errors="replace").decode()  # as undecodable bytes of a file name
            return
        try:
            self.values[name] = float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            raise BrainError(f"show({name!r}, {value!r}) expects a number, a text or None") from None

    def sketch(
        self, time_s: float, name: str, lines: Sequence[ArrayLike], points: ArrayLike, grid: Grid | None, frame: str
    ) -> None:
        """See `boebot.Robot.sketch`."""
        if name not in self._layers:
            _check_name("sketch", name)
            if len(self._layers) >= NAMES:
                self._tell("layers", f"the brain sketches more than {NAMES} layers: {name!r} and others are left out")
                return
        if frame not in FRAMES:
            raise BrainError(f'sketch({name!r}): frame is {frame!r}; expected "start", "arena" or "robot"')
        made = Sketch(name, frame, _lines(name, lines), _points(name, "points", points), _cells(name, grid))
        if made.size > POINTS or (made.grid is not None and len(made.grid.cells) > CELLS):
            self._tell(
                "size", f"a sketch of {name!r} is left out; expected at most {POINTS:,} points and {CELLS:,} cells"
            )
            return
        layer = self._layers.setdefault(name, _Layer())
        layer.waiting = None if made == layer.kept else (time_s, made)
        if layer.waiting is not None and time_s >= layer.due_s - _ON_TIME:
            self._keep_sketch(layer)

    def take(self) -> list[ShownRow]:
        """What is to be kept, since this was last asked. It is taken from here, for a brain reaches its robot, and no
        way may lead from there to the record, which has the world's truth."""
        taken = self._rows[:]
        del self._rows[: len(taken)]  # the brain may add one meanwhile, in another thread
        return taken

    def end(self) -> None:
        """The run is over: what was shown last is to be kept."""
        self._keep_values()
        self._room = math.inf
        for layer in self._layers.values():
            if layer.waiting is not None:
                self._keep_sketch(layer)

    def _keep_values(self) -> None:
        """Those of the newest step, if they are new."""
        if self._shown_s > -math.inf:
            data = msgspec.json.encode(self.values)
            if data != self._kept_values and self._keep(VALUES, self._shown_s, data):
                self._kept_values = data

    def _keep_sketch(self, layer: _Layer) -> None:
        assert layer.waiting is not None
        time_s, sketch = layer.waiting
        if self._keep(SKETCH, time_s, msgspec.json.encode(sketch)):
            layer.waiting, layer.kept, layer.due_s = None, sketch, time_s + SKETCH_EACH_S

    def _keep(self, stream: str, time_s: float, data: bytes) -> bool:
        """Puts a row into the record, if there is room for it."""
        if self._room < math.inf and time_s > self._room_s:
            self._room = min(BYTES_AT_ONCE, self._room + BYTES_S * (time_s - self._room_s))
            self._room_s = time_s
        if len(data) > self._room:
            self._tell("bytes", f"the brain shows more than {BYTES_S // 1000} kB in a second: some of it is left out")
            return False
        self._room -= len(data)
        if self.is_kept:
            self._rows.append((stream, time_s, data))
        return True

    def _tell(self, about: str, sentence: str) -> None:
        """Once."""
        self._notices.setdefault(about, sentence)


@dataclass
class _Layer:
    """Of a sketch."""

    waiting: tuple[float, Sketch] | None = None
    """the newest, with its time (s), if it is not kept yet"""
    kept: Sketch | None = None
    """the newest that is kept"""
    due_s: float = -math.inf
    """from when on the next one may be kept"""


def _check_name(call: str, name: object) -> None:
    if not isinstance(name, str) or not 0 < len(name) <= LETTERS or not name.isprintable():
        raise BrainError(f"{call}({name!r}, ...) expects a name of 1 to {LETTERS} printable characters")


def _points(layer: str, what: str, points: ArrayLike) -> bytes:
    """Those that are numbers, and fit into float32."""
    try:
        pairs = np.asarray(points, dtype=np.float64)
    except (TypeError, ValueError):
        pairs = np.empty(1)
    if not pairs.size:
        return b""
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise BrainError(f"sketch({layer!r}): {what} expects pairs, as in [(0.1, 0.2), (0.3, 0.4)], in m")
    known = np.isfinite(pairs) & (np.abs(pairs) <= np.finfo(np.float32).max)
    return pairs[known.all(axis=1)].astype("<f4").tobytes()


def _lines(layer: str, lines: object) -> list[bytes]:
    """Each with its points."""
    if not isinstance(lines, list | tuple | np.ndarray):
        raise BrainError(f"sketch({layer!r}): lines expects a list of lines, as in [[(0, 0), (1, 0.5)]], in m")
    return [line for one in lines if (line := _points(layer, "each of lines", one))]


def _cells(layer: str, grid: Grid | None) -> GridCells | None:
    if grid is None:
        return None
    try:
        values, *place = grid
        table = np.asarray(values, dtype=np.float64)
        rows, columns = table.shape
        cell, x, y = (float(number) for number in place)
        if not (0 < cell < math.inf and math.isfinite(x) and math.isfinite(y)):
            raise ValueError
    except (TypeError, ValueError):
        raise BrainError(
            f"sketch({layer!r}): grid expects boebot.Grid(values, cell, x, y): a table of numbers from 0 to 1, the "
            "side of a cell in m, its lower left corner in m"
        ) from None
    known = np.isfinite(table)
    cells = np.where(known, np.rint(np.clip(np.where(known, table, 0.0), 0.0, 1.0) * OCCUPIED), UNKNOWN)
    return GridCells(rows, columns, cell, x, y, cells.astype(np.uint8).tobytes())
