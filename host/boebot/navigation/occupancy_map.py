"""Maps of cells, free, occupied or unknown, as ROS keeps them: a picture and a YAML file beside it (`map_server`).

Row 0 of the table is that of the smallest y; in the picture it is the last one. A pixel of 0 (black) is occupied, one
of 254 free, one of 205 unknown.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boebot.errors import BrainError
from boebot.navigation.lattice import Lattice, cells_of
from boebot.navigation.line_map import LineMap
from boebot.showing import Grid

if TYPE_CHECKING:
    from PIL import Image

    from boebot.navigation.line_map import Floats

FREE, UNKNOWN, OCCUPIED = 0.0, math.nan, 1.0
FREE_BELOW, OCCUPIED_ABOVE = 0.196, 0.65  # map_server's own thresholds
PIXELS = {"free": 254, "unknown": 205, "occupied": 0}
LARGEST = 50_000_000  # pixels
MODES = ("trinary", "scale")  # of map_server; what "scale" has between free and occupied is unknown here


@dataclass(frozen=True)
class OccupancyMap:
    """A map of cells.

    Attributes:
        values: 0 (free) to 1 (occupied), NaN where nothing is known, shape (rows, columns).
        cell: side of a cell (m).
        x, y: lower left corner (m).
    """

    values: Floats
    cell: float
    x: float = 0.0
    y: float = 0.0

    @classmethod
    def of(cls, plan: LineMap, cell: float = 0.05) -> OccupancyMap:
        """Of a map of lines: a cell is occupied where a line passes through it or it is solid. `cell`: its side (m).

        Raises:
            BrainError: `cell` is no length, or the map has too many cells of it.
        """
        low, _ = plan.bounds
        rows, columns = cells_of(plan, cell)
        row, column = np.indices((rows, columns)).reshape(2, -1)
        centres = np.column_stack((low[0] + (column + 0.5) * cell, low[1] + (row + 0.5) * cell))
        occupied = (plan.distance(centres) <= cell * math.sqrt(0.5)) | plan.is_solid(centres)
        return cls(occupied.reshape(rows, columns).astype(float), cell, float(low[0]), float(low[1]))

    def grid(self) -> Grid:
        """To draw it: `robot.sketch("map", grid=drawn.grid(), frame="arena")`."""
        return Grid(self.values, self.cell, self.x, self.y)

    def lattice(self, radius: float, margin: float = 0.05, *, diagonal: bool = True) -> Lattice:
        """Where the centre of a robot of that radius (m) may be, with a margin (m); nowhere that is unknown.

        Raises:
            BrainError: radius or margin is no length.
        """
        if not (0 <= radius < math.inf and 0 <= margin < math.inf):
            raise BrainError(f"a lattice for a radius of {radius!r} m and a margin of {margin!r} m; expected lengths")
        blocked = ~(self.values < FREE_BELOW)
        reach = math.ceil((radius + margin) / self.cell)
        padded = np.pad(blocked, reach)
        near = np.zeros_like(blocked)
        rows, columns = blocked.shape
        for down in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                if math.hypot(down, right) * self.cell < radius + margin:
                    near |= padded[reach + down : reach + down + rows, reach + right : reach + right + columns]
        return Lattice(~near, self.cell, self.x, self.y, diagonal)

    def line_map(self, name: str = "map") -> LineMap:
        """The edges of what is occupied, as lines."""
        occupied = np.pad(self.values >= OCCUPIED_ABOVE, 1)
        lines: list[tuple[float, float, float, float]] = []
        for row, column in np.argwhere(occupied[:-1] != occupied[1:]).tolist():  # below row `row` of the map
            lines.append((column - 1, row, column, row))
        for row, column in np.argwhere(occupied[:, :-1] != occupied[:, 1:]).tolist():
            lines.append((column, row - 1, column, row))
        ends = np.array(_joined(lines), dtype=float).reshape(-1, 2, 2) * self.cell + np.array((self.x, self.y))
        return LineMap.from_lines(ends, name)

    def save(self, path: str | Path) -> list[Path]:
        """Writes PATH.yaml and PATH.pgm, as `map_server` reads them; returns their paths.

        Raises:
            BrainError: they cannot be written.
        """
        import yaml
        from PIL import Image

        stem = Path(path)
        stem = stem.with_suffix("") if stem.suffix in (".yaml", ".pgm") else stem
        pixels = np.full(self.values.shape, PIXELS["unknown"], dtype=np.uint8)
        pixels[self.values < FREE_BELOW] = PIXELS["free"]
        pixels[self.values > OCCUPIED_ABOVE] = PIXELS["occupied"]
        said = {
            "image": f"{stem.name}.pgm",
            "mode": "trinary",
            "resolution": self.cell,
            "origin": [self.x, self.y, 0.0],
            "negate": 0,
            "occupied_thresh": OCCUPIED_ABOVE,
            "free_thresh": FREE_BELOW,
        }
        files = [stem.with_name(f"{stem.name}.yaml"), stem.with_name(f"{stem.name}.pgm")]
        try:
            Image.fromarray(pixels[::-1]).save(files[1])
            files[0].write_text(yaml.safe_dump(said, sort_keys=False), encoding="utf-8")
        except OSError as error:
            raise BrainError(f"{stem}: the map cannot be written: {error.strerror or error}") from None
        return files

    @classmethod
    def load(cls, path: str | Path) -> OccupancyMap:
        """Reads a map of `map_server`, by its YAML file.

        Raises:
            BrainError: file, key or value is wrong; it says which.
        """
        import yaml
        from PIL import Image

        file = Path(path)
        try:
            said = yaml.safe_load(file.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
            raise BrainError(
                f"{file} is no map: {str(error).splitlines()[0]}; expected a YAML file of map_server"
            ) from None
        if not isinstance(said, dict):
            raise BrainError(f"{file} is no map; expected keys image, resolution and origin")
        cell = _number(file, said, "resolution", 1e-6)
        origin: Any = said.get("origin")
        is_pose = isinstance(origin, list) and len(origin) == 3 and all(isinstance(one, int | float) for one in origin)
        if not (is_pose and all(map(math.isfinite, origin))):
            raise BrainError(f"{file}: origin is {origin!r}; expected [x, y, yaw] in m and rad")
        if origin[2]:
            raise BrainError(f"{file}: origin is turned by {origin[2]} rad; expected a yaw of 0")
        if said.get("mode", "trinary") not in MODES:
            raise BrainError(f"{file}: mode is {said['mode']!r}; expected {' or '.join(MODES)}")
        try:
            with Image.open(file.parent / str(said.get("image"))) as picture:
                if picture.width * picture.height > LARGEST:
                    raise BrainError(f"{file}: {said['image']} has more than {LARGEST:,} cells")
                light = _light(picture)[::-1]
        except (OSError, ValueError, Image.DecompressionBombError) as error:
            raise BrainError(f"{file}: image {said.get('image')!r} cannot be read: {error}") from None
        dark = light if said.get("negate") else 1.0 - light
        above = _number(file, said, "occupied_thresh", 0.0, OCCUPIED_ABOVE)
        below = _number(file, said, "free_thresh", 0.0, FREE_BELOW)
        values = np.where(dark > above, OCCUPIED, np.where(dark < below, FREE, UNKNOWN))
        return cls(values, cell, float(origin[0]), float(origin[1]))


def _light(picture: Image.Image) -> Floats:
    """How bright each pixel is, 0 to 1; pictures with 16 bits as well."""
    if picture.mode.startswith("I"):
        return np.asarray(picture, dtype=float) / 65535.0
    return np.asarray(picture.convert("L"), dtype=float) / 255.0


def _number(file: Path, said: dict[str, Any], key: str, least: float, usual: float | None = None) -> float:
    value = said.get(key, usual)
    if not isinstance(value, int | float) or isinstance(value, bool) or not least <= value < math.inf:
        raise BrainError(f"{file}: {key} is {value!r}; expected a number from {least:g}")
    return float(value)


def _joined(lines: list[tuple[float, float, float, float]]) -> list[tuple[float, float, float, float]]:
    """Edges of cells, row by row, joined where they go on."""
    found: list[tuple[float, float, float, float]] = []
    level = sorted(line for line in lines if line[1] == line[3])
    upright = sorted((line for line in lines if line[1] != line[3]), key=lambda line: (line[0], line[1]))
    for x0, y0, x1, y1 in [*sorted(level, key=lambda line: (line[1], line[0])), *upright]:
        if found and found[-1][2:] == (x0, y0) and (found[-1][1] == y1 or found[-1][0] == x1):
            found[-1] = (*found[-1][:2], x1, y1)
        else:
            found.append((x0, y0, x1, y1))
    return found
