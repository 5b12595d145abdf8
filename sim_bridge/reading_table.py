"""Tables of readings: noise as the real sensor has it, section 3.2.2 of the notes (world/sensors/table_noise.h).

Readings of one real sensor are recorded at some distances and angles of incidence. A simulated reading draws one of
them from each of the four bins around the question and interpolates. One table per sensor keeps what makes equal
sensors unlike.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from boebot.arguments import shown, whole
from boebot.errors import RobotError
from boebot.files import regular
from sim_bridge.compiled import ffi, lib
from sim_bridge.vehicles.checked_structs import number

COLUMNS: Final = ("distance_m", "angle_rad", "reading")


class ReadingTable:
    """Readings of a real sensor, by distance (m) and angle of incidence (rad, 0: straight at the surface).

    Attributes:
        distances: of the bins, increasing.
        angles: of the bins, increasing.
        data: distances, angles, how many readings each bin has, and all of them.
        handle: the C table.
    """

    def __init__(self, distances: Sequence[float], angles: Sequence[float], samples: Sequence[Any]) -> None:
        """`samples[i][j]`: the readings at `distances[i]` and `angles[j]`, at least one.

        Raises:
            RobotError: bins that do not increase, an empty one, or a number that is not finite.
        """
        self.distances = _bins("distances", distances)
        self.angles = _bins("angles", angles)
        counts: list[int] = []
        flat: list[float] = []
        for i, row in enumerate(_listed("samples", samples, len(self.distances), "one for each distance")):
            for j, drawn in enumerate(_listed(f"samples[{i}]", row, len(self.angles), "one for each angle")):
                readings = _listed(f"samples[{i}][{j}]", drawn, None, "readings")
                counts.append(len(readings))
                flat += [number("table", f"samples[{i}][{j}][{k}]", value) for k, value in enumerate(readings)]
        self.data = (tuple(self.distances), tuple(self.angles), tuple(counts), tuple(flat))
        handle = lib.table_noise_new(
            ffi.new("double[]", self.distances), len(self.distances),
            ffi.new("double[]", self.angles), len(self.angles),
            ffi.new("int[]", counts), ffi.new("double[]", flat),
        )  # fmt: skip
        if handle == ffi.NULL:
            raise RobotError(f"table: no memory for {len(flat)} readings")
        self.handle = ffi.gc(handle, lib.table_noise_destroy)

    @classmethod
    def load(cls, path: str | Path) -> ReadingTable:
        """From a CSV file with the columns distance_m, angle_rad, reading; a row for each reading.

        Raises:
            RobotError: it cannot be read, a cell is no number, or a distance was not measured at all angles.
        """
        if not isinstance(path, (str, Path)):
            raise RobotError(f"table is {shown(path)}; expected the path of a CSV file")
        name = Path(path).name
        try:
            with regular(Path(path)).open(newline="", encoding="utf-8") as file:
                rows = [(index, row) for index, row in enumerate(csv.reader(file), start=1) if row]
        except (OSError, UnicodeDecodeError, csv.Error, ValueError) as cause:
            raise RobotError(f"table {name} cannot be read: {cause}") from None
        if not rows or tuple(cell.strip() for cell in rows[0][1]) != COLUMNS:
            raise RobotError(f"{name}:1: expected the columns {', '.join(COLUMNS)}")
        bins: dict[tuple[float, float], list[float]] = {}
        for line, row in rows[1:]:
            distance, angle, reading = _cells(f"{name}:{line}", row)
            bins.setdefault((distance, angle), []).append(reading)
        distances, angles = (sorted({place[axis] for place in bins}) for axis in (0, 1))
        for distance in distances:
            for angle in angles:
                if (distance, angle) not in bins:
                    raise RobotError(f"{name}: there is no reading at {distance:g} m and {angle:g} rad; expected some")
        return cls(distances, angles, [[bins[distance, angle] for angle in angles] for distance in distances])

    def readings(self, distance: float, angle: float, count: int, *, seed: int = 1) -> NDArray[np.float64]:
        """`count` simulated readings at a distance (m) and angle (rad), shape (count,); outside as at the border.

        Raises:
            RobotError: a number is not finite, or `count` negative.
        """
        place = number("table", "distance", distance), number("table", "angle", angle)
        key = whole("table: seed", seed, RobotError, least=-(2**63), most=2**64 - 1) & (2**64 - 1)
        source = ffi.new("noise_source *", {"seed": key, "on": 1})
        many = whole("table: count", count, RobotError, least=0, most=10**8)
        return np.array([lib.table_noise_read(self.handle, *place, source) for _ in range(many)], dtype=np.float64)


def _listed(key: str, value: Any, count: int | None, what: str) -> list[Any]:
    """`value` as a list of `count` things; of one at least where `count` is None."""
    try:
        found = None if isinstance(value, str | bytes | dict) else list(value)
    except TypeError:
        found = None
    expected = what if count is None else f"{count}, {what}"
    if found is None:
        raise RobotError(f"table: {key} is {shown(value)}; expected a list: {expected}")
    if len(found) != count if count is not None else not found:
        raise RobotError(f"table: {key} has {len(found)} entries; expected {expected}")
    return found


def _bins(key: str, values: Any) -> list[float]:
    found = [number("table", f"{key}[{i}]", value) for i, value in enumerate(_listed(key, values, None, "bins"))]
    for i in range(1, len(found)):
        if not found[i] > found[i - 1]:
            raise RobotError(f"table: {key}[{i}] is {found[i]:g}; expected more than {key}[{i - 1}], {found[i - 1]:g}")
    return found


def _cells(place: str, row: list[str]) -> tuple[float, float, float]:
    values: list[float] = []
    for column, cell in zip(COLUMNS, row, strict=False):
        try:
            values.append(float(cell))
        except ValueError:
            values.append(math.nan)
        if not math.isfinite(values[-1]):
            raise RobotError(f"{place}: {column} is {shown(cell)}; expected a finite number")
    if len(row) != len(COLUMNS):
        raise RobotError(f"{place}: {len(row)} columns; expected {len(COLUMNS)}, {', '.join(COLUMNS)}")
    return values[0], values[1], values[2]
