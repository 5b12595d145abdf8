"""Maps of lines, lattices, convex cells and ROS's maps, against shapely and by hand."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image

from boebot.arenas import load_arena
from boebot.errors import BrainError
from boebot.navigation import Lattice, LineMap, OccupancyMap, search
from boebot.navigation.tighten import segment_distance

RADIUS, MARGIN = 0.07, 0.05
BEGIN, END = (-2.5, -1.5), (2.2, 1.2)


@pytest.fixture(scope="module")
def office() -> LineMap:
    return LineMap.of("office")


@pytest.fixture(scope="module")
def lattice(office: LineMap) -> Lattice:
    whole = Lattice.of(office, RADIUS, MARGIN, 0.05)
    start = whole.nearest_free(*BEGIN, within=0.2)
    assert start is not None
    return whole.reachable(start)


def geometry(plan: LineMap) -> tuple[shapely.Geometry, shapely.Geometry]:
    """Its lines, and where a robot's centre may be, in shapely's words."""
    lines = shapely.multilinestrings([shapely.linestrings(plan.segments)])[0]
    free = shapely.union_all([shapely.Polygon(shape) for shape in plan.outlines])
    solid = [shapely.Polygon(shape) for shape in plan.obstacles if len(shape) > 2]
    return lines, free.difference(shapely.union_all([one for one in solid if one.is_valid and one.area > 0]))


def test_distances_and_what_is_solid_agree_with_shapely(office: LineMap) -> None:
    lines, free = geometry(office)
    points = np.random.default_rng(1).uniform((-3.2, -2.2), (3.2, 2.2), (2000, 2))
    at = shapely.points(points)
    assert office.distance(points) == pytest.approx(shapely.distance(lines, at), abs=1e-12)
    away = office.distance(points) > 1e-9
    assert np.array_equal(office.is_solid(points)[away], ~shapely.contains(free, at)[away])


def test_scans_are_those_of_rays_in_the_arena(office: LineMap) -> None:
    arena = load_arena("office")
    poses = np.array([(-2.5, -1.5, 0.3), (0.1, 0.1, -2.0)])
    ranges = office.scans(poses, (-1.5, 1.5), 31, 2.0)
    for (x, y, heading), row in zip(poses, ranges, strict=True):
        rays = [arena.ray(x, y, heading + bearing, 2.0) for bearing in np.linspace(-1.5, 1.5, 31)]
        assert row == pytest.approx([-1.0 if far is None else far for far in rays], abs=1e-9)


def test_what_moves_is_in_no_map() -> None:
    arena = load_arena("showcase")
    assert arena.description.moving and LineMap(arena).outlines
    lines = LineMap(arena).segments
    walls = [len(wall.points_m) - 1 for wall in arena.description.wall]
    closed = [len(shape) for shape in arena.outlines]
    assert len(lines) == sum(closed) - sum(walls), "each side of a wall once"


def test_lattice_keeps_its_distance_and_is_in_one_piece(office: LineMap, lattice: Lattice) -> None:
    lines, free = geometry(office)
    centres = shapely.points([lattice.centre((int(row), int(column))) for row, column in np.argwhere(lattice.free)])
    assert shapely.distance(lines, centres).min() >= RADIUS + MARGIN - 1e-12
    assert shapely.contains(free, centres).all()
    whole = Lattice.of(office, RADIUS, MARGIN, 0.05)
    for row, column in np.argwhere(
        ~whole.free & (office.distance(lattice_centres(whole)).reshape(whole.free.shape) > 0.13)
    )[:50]:
        assert not shapely.contains(free, shapely.Point(whole.centre((int(row), int(column)))))


def lattice_centres(lattice: Lattice) -> np.ndarray:
    return np.array([lattice.centre(cell) for cell in itertools.product(range(lattice.rows), range(lattice.columns))])


def test_part_without_a_way_is_not_reachable() -> None:
    free = np.ones((3, 5), dtype=np.bool_)
    free[:, 2] = False
    left = Lattice(free).reachable((0, 0))
    assert left.free.tolist() == [[True, True, False, False, False]] * 3
    corner = np.array([[True, False], [False, True]])
    assert Lattice(corner).reachable((0, 0)).free.sum() == 1, "no diagonal between two forbidden cells"


def test_segments_distance_agrees_with_shapely(office: LineMap) -> None:
    lines, _ = geometry(office)
    ends = np.random.default_rng(2).uniform((-3, -2), (3, 2), (200, 2, 2))
    for begin, end in ends:
        expected = shapely.distance(lines, shapely.LineString((begin, end)))
        assert segment_distance(office, tuple(begin), tuple(end)) == pytest.approx(expected, abs=1e-9)


def test_map_of_ros_there_and_back(office: LineMap, tmp_path: Path) -> None:
    drawn = OccupancyMap.of(office, 0.05)
    files = drawn.save(tmp_path / "office")
    assert [path.name for path in files] == ["office.yaml", "office.pgm"]
    with Image.open(files[1]) as picture:
        assert picture.size == (120, 80) and set(np.asarray(picture).ravel().tolist()) == {0, 254}
    read = OccupancyMap.load(files[0])
    assert np.array_equal(read.values, drawn.values) and (read.cell, read.x, read.y) == (0.05, -3.0, -2.0)
    x, y, heading = -2.5, -1.5, 0.3
    (ranges,) = read.line_map().scans([(x, y, heading)], (-1.5, 1.5), 31, 8.0)
    angles = heading + np.linspace(-1.5, 1.5, 31)
    met = np.column_stack((x + ranges * np.cos(angles), y + ranges * np.sin(angles)))
    assert ranges.min() > 0 and office.distance(met).max() < 0.05 * math.sqrt(2), "they end at walls, a cell thicker"
    free = read.lattice(RADIUS, MARGIN).free
    assert (office.distance(lattice_centres(read.lattice(RADIUS))).reshape(free.shape)[free] > RADIUS).all()


def test_map_of_others_with_unknown_cells_and_negated(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0, 205, 254], [254, 254, 254]], dtype=np.uint8)).save(tmp_path / "m.png")
    said = (
        "image: m.png\nresolution: 0.5\norigin: [1.0, 2.0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "m.yaml").write_text(said)
    found = OccupancyMap.load(tmp_path / "m.yaml")
    assert found.values[0].tolist() == [0, 0, 0], "the lowest row of the picture is the first"
    assert found.values[1][0] == 1 and math.isnan(found.values[1][1]) and found.values[1][2] == 0
    (tmp_path / "m.yaml").write_text(said.replace("negate: 0", "negate: 1"))
    assert OccupancyMap.load(tmp_path / "m.yaml").values[1][0] == 0


SAID = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"


@pytest.mark.parametrize(
    "picture",
    [
        b"P5\n# by hand\n3 1\n255\n" + bytes((254, 0, 205)),
        b"P2\n3 1\n255\n254 0 205\n",
        b"P5\n3 1\n65535\n" + np.array((65278, 0, 52685), dtype=">u2").tobytes(),
        b"P2\n3 1\n1000\n996 0 804\n",
    ],
    ids=["comment", "as text", "16 bit", "brightest is 1000"],
)
def test_pictures_of_all_kinds_are_read(picture: bytes, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(SAID)
    (tmp_path / "m.pgm").write_bytes(picture)
    assert OccupancyMap.load(tmp_path / "m.yaml").values.tolist() == [[0.0, 1.0, pytest.approx(math.nan, nan_ok=True)]]


@pytest.mark.parametrize(
    "picture",
    [b"", b"P5\n3 ", b"P5\n3 1\n255\n\xfe", b"P2\n3 1\n255\n254 0", b"P5\n1000000 1000000\n255\n\xfe"],
    ids=["empty", "header cut", "cut", "text cut", "huge"],
)
def test_picture_that_is_cut_is_one_sentence(picture: bytes, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(SAID)
    (tmp_path / "m.pgm").write_bytes(picture)
    with pytest.raises(BrainError, match=r"image 'm\.pgm' cannot be read"):
        OccupancyMap.load(tmp_path / "m.yaml")


def test_name_with_a_dot_is_kept(tmp_path: Path) -> None:
    files = OccupancyMap(np.zeros((1, 1)), 0.05).save(tmp_path / "hall.v2")
    assert [path.name for path in files] == ["hall.v2.yaml", "hall.v2.pgm"]


def test_cells_that_are_none(office: LineMap) -> None:
    for cell in (0.0, -1.0, math.nan, 1e-6):
        for made in (lambda cell: Lattice.of(office, RADIUS, MARGIN, cell), lambda cell: OccupancyMap.of(office, cell)):
            with pytest.raises(BrainError, match=r"cells of .* m"):
                made(cell)


def test_no_path_begins_in_a_forbidden_cell(lattice: Lattice) -> None:
    """Also not where a free cell is beside it."""
    rows, columns = np.nonzero(~lattice.free[:, :-1] & lattice.free[:, 1:])
    forbidden = int(rows[0]), int(columns[0])
    free = forbidden[0], forbidden[1] + 1
    assert search(lattice, forbidden, free).path == search(lattice, free, forbidden).path == []


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ("- 1\n", "is no map; expected keys image, resolution and origin"),
        ("image: [\n", "is no map: .*expected a YAML file of map_server"),
        ("image: m.pgm\nresolution: none\norigin: [0, 0, 0]\n", "resolution is 'none'; expected a finite number"),
        ("image: m.pgm\nresolution: 0.05\norigin: [0, 0]\n", r"origin is \['0', '0'\]; expected \[x, y, yaw\]"),
        ("image: m.pgm\nresolution: 0.05\norigin: [.nan, 0, 0]\n", "origin is '.nan'; expected a finite number"),
        ("image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0.1]\n", "origin is turned by 0.1 rad; expected a yaw of 0"),
        (SAID, "image 'm.pgm' cannot be read"),
    ],
)
def test_wrong_map_is_one_sentence(said: str, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(said)
    with pytest.raises(BrainError, match=sentence) as caught:
        OccupancyMap.load(tmp_path / "m.yaml")
    assert "\n" not in str(caught.value)


def test_lines_that_are_none() -> None:
    with pytest.raises(BrainError, match=r"expects segments, shape \(n, 2, 2\), in m"):
        LineMap.from_lines([(0, 0), (1, 1), (2, 2)])
    crossing = LineMap.from_lines([[(0, 0), (1, 0)], [(0, 1), (1, 1)]])
    assert crossing.distance([(0.5, 0.25)]) == pytest.approx([0.25])
