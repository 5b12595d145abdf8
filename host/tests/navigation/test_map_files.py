"""Files of maps as `map_server` reads them: cells worked out by hand from its rule, and files that are none; steps of
lattices, by shapely.

The rule (nav2_map_server, map_io): a pixel's shade is the mean of its channels, in trinary maps with alpha; dark = 1 -
shade, or the shade if negated; above occupied_thresh occupied, below free_thresh free, else unknown, in maps of scale
the share of the way between. There a pixel that is not opaque is unknown. In raw maps 0 to 100 are per cent.
"""

from __future__ import annotations

import io
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from boebot.errors import AnalysisError, BoebotError, BrainError
from boebot.image.elf import read_image
from boebot.navigation import Lattice, LineMap, OccupancyMap, search
from boebot.navigation.occupancy_map import LONGEST
from boebot.result import read_run
from boebot_can.log import read_log
from boebot_timing.table import read_table
from sim_bridge.boards import avr
from sim_bridge.reading_table import ReadingTable

NAN = math.nan
SAID = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
GRAY = b"P5\n3 1\n255\n" + bytes((254, 0, 205))
FULL = SAID + "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n"


def read(folder: Path, said: str, picture: bytes = GRAY) -> OccupancyMap:
    (folder / "m.yaml").write_text(said, encoding="utf-8")
    (folder / "m.pgm").write_bytes(picture)
    return OccupancyMap.load(folder / "m.yaml")


def row(folder: Path, said: str, picture: bytes = GRAY) -> list[float]:
    (values,) = read(folder, said, picture).values.tolist()
    return list(values)


def png(pixels: list[tuple[int, ...]], mode: str) -> bytes:
    image = Image.new(mode, (len(pixels), 1))
    for column, pixel in enumerate(pixels):
        image.putpixel((column, 0), pixel)
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


@pytest.mark.parametrize("text", ["0", "'0'", '"false"', "No", "off"])
def test_negate_is_read_from_its_text(text: str, tmp_path: Path) -> None:
    assert row(tmp_path, f"{SAID}negate: {text}\n") == pytest.approx([0, 1, NAN], nan_ok=True)


@pytest.mark.parametrize("text", ["1", "'1'", '"true"', "Yes", "on"])
def test_negated_in_any_way_of_writing(text: str, tmp_path: Path) -> None:
    # shades 254/255, 0 and 205/255 = 0.80 are now how likely it is that something is there
    assert row(tmp_path, f"{SAID}negate: {text}\n") == [1, 0, 1]


@pytest.mark.parametrize(
    ("pixels", "mode", "trinary", "scale"),
    [
        # (255 + 100 + 0) / 3 / 255: dark 0.536; of the way from 0.196 to 0.65 that is 0.749
        ([(255, 100, 0)], "RGB", [NAN], [0.75]),
        # blue is as bright as green: dark 2/3 > 0.65; (255 + 255) / 3 / 255: dark 1/3, 0.302 of the way
        ([(0, 0, 255), (0, 255, 255)], "RGB", [1, NAN], [1, 0.3]),
        # alpha is the fourth channel: dark 0.25, 0, 0.75, 1; 51 / 255: dark 0.2
        ([(255, 255, 255, 0), (255, 255, 255, 255)], "RGBA", [NAN, 0], [NAN, 0]),
        ([(0, 0, 0, 255), (0, 0, 0, 0), (255, 255, 255, 51)], "RGBA", [1, 1, NAN], [1, NAN, NAN]),
        # as of grey and alpha: three channels of 100, dark (1 - (300 + 255) / 1020) = 0.456
        ([(100, 255)], "LA", [NAN], [0.91]),  # without alpha 1 - 100 / 255 = 0.608, 0.907 of the way
    ],
)
def test_colours_and_alpha(
    pixels: list[tuple[int, ...]], mode: str, trinary: list[float], scale: list[float], tmp_path: Path
) -> None:
    picture = png(pixels, mode)
    assert row(tmp_path, f"{SAID}mode: trinary\n", picture) == pytest.approx(trinary, nan_ok=True)
    assert row(tmp_path, f"{SAID}mode: scale\n", picture) == pytest.approx(scale, nan_ok=True)


def test_raw_pixels_are_per_cent(tmp_path: Path) -> None:
    picture = b"P5\n4 1\n255\n" + bytes((0, 37, 100, 101))
    said = f"{SAID}mode: raw\nnegate: 1\n"  # which a raw map does not mind
    assert row(tmp_path, said, picture) == pytest.approx([0, 0.37, 1, NAN], nan_ok=True)
    wide = b"P5\n2 1\n65535\n" + np.array((257 * 37, 257 * 101), dtype=">u2").tobytes()
    assert row(tmp_path, said, wide) == pytest.approx([0.37, NAN], nan_ok=True)


def test_numbers_are_read_as_by_cpp(tmp_path: Path) -> None:
    found = read(tmp_path, FULL.replace("0.05", "5e-2").replace("[0, 0, 0]", "['-1', +2., 0.0]"))
    assert (found.cell, found.x, found.y) == (0.05, -1.0, 2.0)


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (SAID + "occupied_thresh: 65\n", "occupied_thresh is 65.0; expected a finite number from 0 to 1"),
        (SAID + "free_thresh: 25\noccupied_thresh: 65\n", "occupied_thresh is 65.0; expected"),
        (SAID + "free_thresh: -0.1\n", "free_thresh is -0.1; expected a finite number from 0 to 1"),
        (SAID + "free_thresh: 0.7\n", "free_thresh is 0.7; expected less than occupied_thresh, 0.65"),
        (SAID + "negate: maybe\n", "negate is 'maybe'; expected 0 or 1, false or true"),
        (SAID + "negate: [0]\n", "negate is .*; expected 0 or 1"),
        (SAID + "resolution: 0.1\n", "'resolution' is given twice"),
        (SAID + "mode: Trinary\n", "mode is 'Trinary'; expected trinary, scale, raw"),
        (SAID.replace("0.05", "1" * 5000), "resolution is inf; expected a finite number"),
        (SAID.replace("0.05", "2001-99-99"), "resolution is '2001-99-99'; expected a finite number"),
        (SAID + "#" + "x" * 3_000_000, "it has 3,000,0.. bytes; expected at most 10,000"),
        ("[" * 100_000, "is no map"),
        ("{" * (LONGEST - 1), "is no map: it has more than 100 brackets"),
        ("- " * (LONGEST // 2), "is no map: it is nested too deeply"),
        ("a: &a [x,x]\n" + "".join(f"{b}: &{b} [*{a},*{a}]\n" for a, b in zip("abcdef", "bcdefg", strict=True))
         + SAID.replace("[0, 0, 0]", "*g"), "origin is"),
        (SAID.replace("m.pgm", "/dev/zero"), "image '/dev/zero' cannot be read: it is a pipe or a device"),
        (SAID.replace("m.pgm", "."), "image '.' cannot be read: it is a folder"),
        (SAID.replace("m.pgm", "pipe"), "image 'pipe' cannot be read: it is a pipe or a device"),
    ],
    ids=lambda text: text[:40],
)  # fmt: skip
def test_wrong_file_is_one_sentence_at_once(said: str, sentence: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    started = time.process_time()
    with pytest.raises(BrainError, match=sentence) as caught:
        read(tmp_path, said)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 600
    assert time.process_time() - started < 1.0


@pytest.mark.parametrize(
    "picture",
    [
        b"P5\n#" + b"x" * 3_000_000 + GRAY[2:],
        b"P2\n" + b" " * 3_000_000,
        b"P5\n" + b"[" * 100_000,
        b"P2\n7000 7000\n255\n1 2 3",
        b"P5\n99999999 99999999\n255\n",
        b"P5\n8000 8000\n255\n",
        b"Pf\n1 1\n-1.0\n" + bytes(4),
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n",
    ],
    ids=["comment", "spaces", "brackets", "text cut", "huge", "large", "floats", "program"],
)
def test_picture_that_is_none_is_one_sentence_at_once(picture: bytes, tmp_path: Path) -> None:
    started = time.process_time()
    with pytest.raises(BrainError, match=r"image 'm\.pgm' cannot be read") as caught:
        read(tmp_path, SAID, picture)
    assert "\n" not in str(caught.value) and time.process_time() - started < 1.0


def test_pipe_and_folder_are_no_map(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "m.yaml")
    with pytest.raises(BrainError, match="it is a pipe or a device, no file"):
        OccupancyMap.load(tmp_path / "m.yaml")
    with pytest.raises(BrainError, match="it is a folder, no file"):
        OccupancyMap.load(tmp_path)


@pytest.mark.parametrize(
    "read",
    [ReadingTable.load, avr.create, read_table, read_image, read_run, read_log],
    ids=lambda one: one.__qualname__,
)
def test_no_other_reader_waits_for_a_pipe(read: Callable[[Path], object], tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises((BoebotError, AnalysisError), match="it is a pipe or a device, no file"):
            read(path)


WORDS = st.sampled_from(
    ["0", "1", "0.5", "-1", "65", ".nan", "1e999", "~", "true", "'", "[", "{", "&a", "*a", "!!int", "2001-01-01", "raw"]
)
KEYS = st.sampled_from(["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode", "<<"])
LINES = st.lists(st.tuples(KEYS, st.one_of(WORDS, st.text(max_size=20))).map(": ".join), max_size=4).map("\n".join)
PICTURES = [GRAY, b"P2\n#\n3 1\n255\n254 0 205\n", png([(1, 2, 3, 4)] * 3, "RGBA"), png([(1, 2)] * 3, "LA")]


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    data = bytearray(draw(st.sampled_from(PICTURES)))
    for _ in range(draw(st.integers(0, 4))):
        place = draw(st.integers(0, max(0, len(data) - 1)))
        data[place : place + draw(st.integers(0, 3))] = draw(st.binary(max_size=6))
    return bytes(data)


@given(st.one_of(LINES, LINES.map(FULL.__add__), LINES.map(lambda lines: lines + "\n" + FULL)), mutated())
def test_any_file_is_a_map_or_one_sentence(tmp_path_factory: pytest.TempPathFactory, said: str, picture: bytes) -> None:
    folder = tmp_path_factory.getbasetemp()
    sentence, started = "", time.process_time()
    try:
        assert read(folder, said.encode(errors="replace").decode(), picture).values.size
    except BrainError as error:
        sentence = str(error)
    assert "\n" not in sentence and len(sentence) < 2000 and time.process_time() - started < 1.0


# ---- maps that are made ----


def test_map_with_numbers_of_numpy_is_saved(tmp_path: Path) -> None:
    made = OccupancyMap(np.zeros((2, 2)), np.float64(0.1), np.float32(0.5), np.int64(1))  # type: ignore[arg-type]
    found = OccupancyMap.load(made.save(tmp_path / "m")[0])
    assert (found.cell, found.x, found.y) == (0.1, 0.5, 1.0)


@pytest.mark.parametrize(
    ("values", "cell", "sentence"),
    [
        (np.array([[-1, 0, 100]]), 0.05, "values are .*; expected rows of 0 to 1, NaN: unknown"),  # of a ROS message
        (np.zeros(3), 0.05, "expected rows"),
        (np.zeros((1, 0)), 0.05, "expected rows"),
        (np.zeros((1, 1)), 0.0, "cell is 0.0; expected a finite number"),
    ],
)
def test_map_that_is_none(values: np.ndarray, cell: float, sentence: str) -> None:
    with pytest.raises(BrainError, match=sentence):
        OccupancyMap(values, cell)


def test_lattice_of_what_is_no_length_is_one_sentence_and_of_a_giant_is_forbidden() -> None:
    drawn = OccupancyMap(np.array([[0.0, 1.0, 0.0]]), 0.05)
    lengths: list[tuple[Any, float, str]] = [(math.nan, 0.0, "radius"), (0.1, -1.0, "margin"), ("a", 0.0, "radius")]
    for radius, margin, name in lengths:
        for made in (lambda *of: Lattice.of(WALL, *of), drawn.lattice):
            with pytest.raises(BrainError, match=f"a lattice: {name} is .*; expected a finite number of at least 0"):
                made(radius, margin)
    with pytest.raises(BrainError, match="cells of 'a' m; expected a length above 0"):
        Lattice.of(WALL, 0.1, 0.0, "a")  # type: ignore[arg-type]
    assert not drawn.lattice(1e9).free.any()
    assert np.asarray(Lattice(np.array([[1, 0]])).grid().values).tolist() == [[False, True]], "numbers are truths"


# ---- steps of a lattice, by shapely ----

WALL = LineMap.from_lines(
    np.array([(0, 0, 4, 0), (4, 0, 4, 4), (4, 4, 0, 4), (0, 4, 0, 0), (1.9, 0, 1.9, 3), (2.4, 1, 2.4, 4)])
)


def steps(lattice: Lattice) -> list[shapely.LineString]:
    cells = [(int(row), int(column)) for row, column in np.argwhere(lattice.free)]
    return [
        shapely.LineString((lattice.centre(cell), lattice.centre(other)))
        for cell in cells
        for other, _ in lattice.neighbours(cell)
    ]


@pytest.mark.parametrize("diagonal", [False, True])
@pytest.mark.parametrize("cell", [0.1, 0.2, 0.31, 0.4, 0.5, 0.8])
@pytest.mark.parametrize(("radius", "margin"), [(0.07, 0.05), (0.0, 0.0), (0.1, 0.0)])
def test_no_step_comes_nearer_to_a_line_than_the_radius(
    cell: float, radius: float, margin: float, diagonal: bool
) -> None:
    walls = shapely.multilinestrings([shapely.linestrings(WALL.segments)])[0]
    found = steps(Lattice.of(WALL, radius, margin, cell, diagonal=diagonal))
    assert found and shapely.distance(walls, found).min() >= radius
    assert not shapely.intersects(walls, found).any()


def test_way_between_the_walls_goes_round_them() -> None:
    """From left to right: over the first wall, under the second; with cells for which there is no room, no way."""
    for cell in (0.05, 0.1, 0.4):
        lattice = Lattice.of(WALL, 0.07, 0.05, cell)
        begin, end = (lattice.nearest_free(*place, within=0.6) for place in ((0.6, 0.6), (3.4, 3.4)))
        assert begin is not None and end is not None
        path = [lattice.centre(node) for node in search(lattice, begin, end).path]
        walls = shapely.multilinestrings([shapely.linestrings(WALL.segments)])[0]
        assert bool(path) == (cell < 0.4) and (not path or not walls.intersects(shapely.LineString(path)))


@pytest.mark.parametrize("diagonal", [False, True])
@pytest.mark.parametrize(("radius", "margin"), [(0.0, 0.0), (0.15, 0.0), (0.15, 0.05), (0.31, 0.0), (0.33, 0.01)])
def test_lattice_of_cells_keeps_off_all_of_an_occupied_cell(radius: float, margin: float, diagonal: bool) -> None:
    values = np.zeros((14, 14))
    values[5:8, 6] = values[8, 7] = 1.0
    values[2, 2] = NAN
    drawn = OccupancyMap(values, 0.2)
    squares = shapely.union_all(
        [shapely.box(c * 0.2, r * 0.2, c * 0.2 + 0.2, r * 0.2 + 0.2) for r, c in np.argwhere(~(values < 0.5))]
    )
    lattice = drawn.lattice(radius, margin, diagonal=diagonal)
    found = steps(lattice)
    assert found and shapely.distance(squares, found).min() >= radius - 1e-9
    assert not any(squares.buffer(-1e-9).intersects(step) for step in found)
    centres = shapely.points([lattice.centre((int(r), int(c))) for r, c in np.argwhere(lattice.free)])
    assert shapely.distance(squares, centres).min() >= radius + margin - 1e-9
    if radius + margin == 0.0:
        assert np.array_equal(lattice.free, values < 0.5), "nothing else is forbidden"
