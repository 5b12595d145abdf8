"""Maps of cells, free, occupied or unknown, as ROS keeps them: a picture and a YAML file beside it (`map_server`).

Row 0 of the table is that of the smallest y; in the picture it is the last one. A pixel of 0 (black) is occupied, one
of 254 free, one of 205 unknown. Keys, modes and pixels are read as by nav2's `map_server`.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from boebot.arguments import number, shown
from boebot.errors import BrainError
from boebot.files import regular
from boebot.navigation.lattice import Lattice, cells_of, lengths
from boebot.navigation.line_map import LineMap
from boebot.showing import Grid

if TYPE_CHECKING:
    from boebot.navigation.line_map import Floats

FREE, UNKNOWN, OCCUPIED = 0.0, math.nan, 1.0
FREE_BELOW, OCCUPIED_ABOVE = 0.196, 0.65  # map_server's own thresholds
PIXELS = {"free": 254, "unknown": 205, "occupied": 0}
LARGEST = 50_000_000  # pixels
LONGEST, BRACKETS = 10_000, 100  # bytes of a YAML file and of a picture's header; brackets of a YAML file
SWITCH = {text: index for index, two in enumerate(("0 false no off n", "1 true yes on y")) for text in two.split()}
MODES = ("trinary", "scale", "raw")
FORMATS = ("BMP", "GIF", "JPEG", "PNG", "PPM")


@dataclass(frozen=True)
class OccupancyMap:
    """A map of cells.

    Attributes:
        values: 0 (free) to 1 (occupied), NaN where nothing is known, shape (rows, columns).
        cell: side of a cell (m).
        x, y: lower left corner (m).

    Raises:
        BrainError: one of them is something else.
    """

    values: Floats
    cell: float
    x: float = 0.0
    y: float = 0.0

    def __post_init__(self) -> None:
        """Numbers become Python's, which YAML knows."""
        for name, least in (("cell", 1e-6), ("x", -math.inf), ("y", -math.inf)):
            value = number(f"a map of cells: {name}", getattr(self, name), BrainError, least=least)
            object.__setattr__(self, name, value)
        values = np.asarray(self.values, dtype=float)
        if values.ndim != 2 or not values.size or not (np.isnan(values) | (values >= 0) & (values <= 1)).all():
            raise BrainError(f"a map of cells: values are {shown(self.values)}; expected rows of 0 to 1, NaN: unknown")
        object.__setattr__(self, "values", values)

    @classmethod
    def of(cls, plan: LineMap, cell: float = 0.05) -> OccupancyMap:
        """Of a map of lines: a cell is occupied where a line passes through it or it is solid. `cell`: its side (m).

        Raises:
            BrainError: `cell` is no length, or the map has too many cells of it.
        """
        shape, centres = cells_of(plan, cell)
        occupied = (plan.distance(centres) <= cell * math.sqrt(0.5)) | plan.is_solid(centres)
        return cls(occupied.reshape(shape).astype(float), cell, *plan.bounds[0])

    def grid(self) -> Grid:
        """To draw it: `robot.sketch("map", grid=drawn.grid(), frame="arena")`."""
        return Grid(self.values, self.cell, self.x, self.y)

    def lattice(self, radius: float, margin: float = 0.05, *, diagonal: bool = True) -> Lattice:
        """Where the centre of a robot of that radius (m) may be, with a margin (m); nowhere that is unknown.

        Raises:
            BrainError: radius or margin is no length.
        """
        radius, margin = lengths(radius, margin)
        blocked = ~(self.values < FREE_BELOW)
        # To the nearest point of a blocked cell. Halfway along a diagonal step that point may be nearer than from both
        # ends, by Pythagoras up to this; within sqrt(2) cells it is not, as no diagonal cuts a corner.
        least = radius + margin
        if radius > self.cell * math.sqrt(2.0):
            least = max(least, math.hypot(radius, self.cell * math.sqrt(0.5)))
        reach = min(math.ceil(least / self.cell + 0.5), max(blocked.shape))
        padded = np.pad(blocked, reach)
        near = blocked.copy()
        rows, columns = blocked.shape
        for down in range(-reach, reach + 1):
            for right in range(-reach, reach + 1):
                gap = math.hypot(max(abs(down) - 0.5, 0.0), max(abs(right) - 0.5, 0.0)) * self.cell
                if gap < least - 1e-9:
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
        file = Path(path)
        said = _said(file)
        cell = _number(file, "resolution", said.get("resolution"), 1e-6)
        origin = said.get("origin")
        if not isinstance(origin, list) or len(origin) != 3:
            raise BrainError(f"{file}: origin is {shown(origin)}; expected [x, y, yaw] in m and rad")
        x, y, yaw = (_number(file, "origin", text, -math.inf) for text in origin)
        if yaw:
            raise BrainError(f"{file}: origin is turned by {yaw} rad; expected a yaw of 0")
        mode, negate = said.get("mode", "trinary"), str(said.get("negate", "0"))
        if mode not in MODES:
            raise BrainError(f"{file}: mode is {shown(mode)}; expected {', '.join(MODES)}")
        if negate.lower() not in SWITCH:
            raise BrainError(f"{file}: negate is {shown(negate)}; expected 0 or 1, false or true")
        above = _number(file, "occupied_thresh", said.get("occupied_thresh", str(OCCUPIED_ABOVE)), 0.0, 1.0)
        below = _number(file, "free_thresh", said.get("free_thresh", str(FREE_BELOW)), 0.0, 1.0)
        if below >= above:
            raise BrainError(f"{file}: free_thresh is {below:g}; expected less than occupied_thresh, {above:g}")
        sums, most, opaque = _picture(file, said.get("image"), mode)
        shade = np.arange(most + 1) / most  # of each sum that a pixel can have; 1: white
        dark = shade if SWITCH[negate.lower()] else 1.0 - shade
        between = np.rint((dark - below) / (above - below) * 100) / 100 if mode == "scale" else UNKNOWN
        values = np.where(dark > above, OCCUPIED, np.where(dark < below, FREE, between))
        if mode == "raw":  # pixels of 0 to 100 are per cent
            level = np.rint(shade * 255)
            values = np.where(level <= 100, level / 100, UNKNOWN)
        return cls(np.where(opaque, values[sums], UNKNOWN)[::-1], cell, x, y)


def _said(file: Path) -> dict[str, str | list[str]]:
    """What a YAML file says by key, in the texts that are there: '0', "0" and 0 are the same to map_server."""
    import yaml

    try:
        text = regular(file, LONGEST).read_text(encoding="utf-8")
        if text.count("[") + text.count("{") > BRACKETS:  # the time that yaml takes grows with their square
            raise ValueError(f"it has more than {BRACKETS} brackets")
        root = yaml.compose(text, yaml.SafeLoader)
    except (OSError, ValueError, yaml.YAMLError, RecursionError) as error:
        what = getattr(error, "strerror", None) or str(error).splitlines()[0]
        what = "it is nested too deeply" if isinstance(error, RecursionError) else what
        raise BrainError(f"{file} is no map: {what}; expected a YAML file of map_server") from None
    if not isinstance(root, yaml.MappingNode):
        raise BrainError(f"{file} is no map; expected keys image, resolution and origin")

    def plain(node: yaml.Node) -> str:
        return str(node.value) if isinstance(node, yaml.ScalarNode) else "..."

    said: dict[str, str | list[str]] = {}
    for key, node in root.value:
        if plain(key) in said:
            raise BrainError(f"{file}: {shown(plain(key))} is given twice; expected each key once")
        said[plain(key)] = list(map(plain, node.value)) if isinstance(node, yaml.SequenceNode) else plain(node)
    return said


def _picture(file: Path, name: object, mode: object) -> tuple[Any, int, Any]:
    """Of the picture that a map's file names: sums of each pixel's channels, the largest that there can be, and
    whether the pixel counts. Trinary maps have alpha among the channels; in maps of scale it makes a pixel unknown."""
    from PIL import Image

    try:
        path = regular(file.parent / str(name), LARGEST * 8)
        with path.open("rb") as opened:
            head = opened.read(LONGEST)
        if len(head) == LONGEST and head[:1] == b"P" and len(re.sub(rb"#[^\r\n]*", b"", head).split(maxsplit=4)) < 4:
            raise ValueError(f"its header has more than {LONGEST:,} bytes")
        with Image.open(path, formats=FORMATS) as picture:
            if picture.mode == "F" or picture.width * picture.height > LARGEST:
                raise ValueError(f"expected at most {LARGEST:,} pixels, whole numbers")
            if picture.mode.startswith("I"):
                return np.clip(np.asarray(picture).astype(int), 0, 65535), 65535, True
            has_alpha = picture.has_transparency_data
            pixels = np.asarray(picture.convert("RGBA" if has_alpha else "RGB"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        what = getattr(error, "strerror", None) or error
        raise BrainError(f"{file}: image {shown(name)} cannot be read: {what}") from None
    opaque = pixels[..., 3] == 255 if has_alpha and mode == "scale" else True
    counted = pixels if mode == "trinary" else pixels[..., :3]
    return counted.sum(axis=2, dtype=np.uint16), 255 * counted.shape[2], opaque


def _number(file: Path, key: str, text: object, least: float, most: float = math.inf) -> float:
    try:
        value: object = float(str(text))
    except ValueError:
        value = text
    return number(f"{file}: {key}", value, BrainError, least=least, most=most)


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
