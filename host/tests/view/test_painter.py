"""What pictures show: every thing of a floor plan in its place and colour, and of a robot only what it has."""

from __future__ import annotations

import copy
import math
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

import boebot
from boebot.arenas.description import ArenaDescription, Charger, Light, Patch
from boebot.arenas.floor_plan import FloorPlan, Moving, Solid
from boebot.description.outlines import way_out
from boebot.description.robots import RobotDescription, load_robot
from boebot.record import overview
from boebot.result import RunResult
from boebot.running import loop
from boebot.view import picture, scene, style
from boebot.view.painter import draw_arena, draw_robot, frame, legend_entries, paint
from peer import InProcess, Peer

numbers = st.floats(-3, 3)


def box(x: float, y: float, side: float = 0.4) -> np.ndarray:
    half = side / 2
    return np.array([(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)])


def obstacle(x: float, y: float, **said: float) -> Solid:
    return Solid(kind="obstacle", points=box(x, y), **said)  # type: ignore[arg-type]


WAY = {"time": np.array([0.0, 1.0]), "x": np.array([1.0, 3.0]), "y": np.zeros(2), "heading": np.zeros(2)}
PLAN = FloorPlan(
    described=ArenaDescription(
        "plan",
        patch=[Patch(corners_m=box(-1, -1).tolist(), grip=0.9), Patch(corners_m=box(0, -1).tolist(), grip=0.2)],
        light=[Light(x_m=1.0, y_m=-1.0, height_m=0.1, power_w=1.0)],
        charger=Charger(x_m=1.6, y_m=-1.6, radius_m=0.2),
    ),
    solids=[
        Solid(kind="outline", points=box(0, 0, 4.0)),
        obstacle(-1, 1),
        obstacle(0, 1, infrared_reflectance=0.5),
        obstacle(1, 1, height=0.04),
        Solid(kind="disc", points=np.array([(-1.0, 0.0)]), radius=0.2),
        Solid(kind="wall", points=np.array([(0.0, -0.3), (0.0, 0.3)])),
    ],
    moving=[Moving(solid=Solid(kind="disc", points=np.zeros((1, 2)), radius=0.15), **WAY)],
)
# where, and what colour is there; off the middle, where a word may stand
SEEN = [
    ((0.4, 0.45), style.FLOOR),
    ((-1.15, 1.15), style.SOLID),
    ((-0.15, 1.17), style.DULL),
    ((-1.1, 0.1), style.SOLID),
    ((0.0, 0.1), style.EDGE),
    ((-1.17, -1.17), style.ROUGH),
    ((-0.17, -1.17), style.SMOOTH),
    ((1.0, -1.0), style.LAMP),
    ((1.05, 0.05), style.MOVING),
    ((2.0, -0.7), style.EDGE),
]


@cache
def pixels() -> tuple[np.ndarray, Figure]:
    """The plan, 4.4 m by 4.4 m at 200 pixels a metre."""
    figure = Figure(figsize=(4.4, 4.4), dpi=200)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    draw_arena(axes, PLAN)
    frame(axes, np.array((-2.2, -2.2)), np.array((2.2, 2.2)))
    canvas.draw()  # type: ignore[no-untyped-call]
    return np.asarray(canvas.buffer_rgba())[:, :, :3].astype(int), figure  # type: ignore[no-untyped-call]


def colour_at(shown: np.ndarray, x: float, y: float) -> np.ndarray:
    colour: np.ndarray = shown[round((2.2 - y) * 200), round((x + 2.2) * 200)]
    return colour


@pytest.mark.parametrize(("place", "colour"), SEEN, ids=[f"{place}: {colour}" for place, colour in SEEN])
def test_each_thing_is_filled_by_its_kind(place: tuple[float, float], colour: str) -> None:
    shown, _ = pixels()
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    assert np.abs(colour_at(shown, *place) - wanted).max() <= 3


def test_low_things_are_hatched_and_the_charger_is_tinted() -> None:
    shown, _ = pixels()
    low = shown[round((2.2 - 1.15) * 200) : round((2.2 - 0.85) * 200), round((0.85 + 2.2) * 200) : round(3.35 * 200)]
    solid = shown[round((2.2 - 1.15) * 200) : round((2.2 - 0.85) * 200), round(1.05 * 200) : round(1.35 * 200)]
    assert np.ptp(low.sum(axis=2)) > 300 and np.ptp(solid.sum(axis=2)) < 30
    red, green, _ = colour_at(shown, 1.7, -1.6)
    assert green - red > 30


def test_words_say_what_cannot_be_seen() -> None:
    _, figure = pixels()
    said = {text.get_text() for text in figure.axes[0].texts}
    assert said == {"grip 0.9", "grip 0.2", "charger", "IR 50%", "4 cm high"}
    assert figure.axes[0].get_xlabel() == "x (m)" and figure.axes[0].get_ylabel() == "y (m)"


def test_legend_has_only_kinds_that_are_drawn() -> None:
    words = [str(entry.get_label()) for entry in legend_entries(PLAN)]
    assert words == ["throws back less", "low: some sensors look over it", "lamp", "moves, shown at the start"]
    assert legend_entries(PLAN)[2].get_marker() == "*", "a lamp is a star there, too"  # type: ignore[attr-defined]
    assert legend_entries(FloorPlan(solids=[Solid(kind="outline", points=box(0, 0))])) == []


@given(numbers, numbers, st.floats(-7, 7), st.floats(0, 1))
def test_a_moving_shape_is_turned_and_shifted(x: float, y: float, heading: float, share: float) -> None:
    """Against shapely; between two poses it is where a straight and even way has it."""
    time = np.array([2.0, 4.0])
    moving = Moving(
        solid=obstacle(0.3, -0.1), time=time, x=np.array([0.0, x]), y=np.array([0.0, y]), heading=np.array([0, heading])
    )
    placed = moving.at(2.0 + 2.0 * share)
    turned = shapely.affinity.rotate(shapely.Polygon(box(0.3, -0.1)), share * heading, origin=(0, 0), use_radians=True)
    expected = shapely.affinity.translate(turned, share * x, share * y)
    assert np.allclose(placed.points, np.array(expected.exterior.coords)[:4], atol=1e-9)
    assert moving.pose(-1.0) == (0.0, 0.0, 0.0) and moving.pose(9.0) == pytest.approx((x, y, heading))


# ---- of a run --------------------------------------------------------------------------------------------------------


def run_of(robot: str, monkeypatch: pytest.MonkeyPatch, plan: FloorPlan | None = None, seconds: float = 2) -> RunResult:
    peer = Peer(load_robot(robot))
    monkeypatch.setattr(loop, "open_world", lambda url, requests: InProcess(peer))
    result = boebot.run(lambda it: it.drive(0.5, 0.45), robot=robot, seconds=seconds)
    if plan is not None:
        result.plan = plan
    return result


def test_open_field_is_framed_by_the_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """An obstacle is no floor, and one far away does not make the path small."""
    far = obstacle(50, 50)
    result = run_of("shieldbot", monkeypatch, FloorPlan(solids=[far]))
    view = scene.view(result)
    low, high = scene.bounds(view)
    assert view.plan.outlines == [] and view.plan.obstacles == [far]
    for axis, values in enumerate((view.path.x, view.path.y)):
        assert low[axis] < values.min() - 0.2 and high[axis] > values.max() + 0.2
    assert (high - low).max() < 1.5 and (high - low).min() > 0.35 * (high - low).max()


def test_room_is_framed_by_its_walls(monkeypatch: pytest.MonkeyPatch) -> None:
    view = scene.view(run_of("shieldbot", monkeypatch))
    low, high = scene.bounds(view)
    wall = view.plan.outlines[0].points
    assert (low < wall.min(axis=0)).all() and (low > wall.min(axis=0) - 0.2).all()
    assert (high > wall.max(axis=0)).all() and (high < wall.max(axis=0) + 0.2).all()


@pytest.mark.parametrize(("robot", "estimate"), [("shieldbot", True), ("shieldbot-basic", False), ("boebot", False)])
def test_picture_names_only_what_the_robot_has(
    robot: str, estimate: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    result = run_of(robot, monkeypatch)
    named: list[str] = []
    texts: list[str] = []
    monkeypatch.setattr(Figure, "legend", lambda self, handles, **_: named.extend(h.get_label() for h in handles))
    monkeypatch.setattr(Figure, "text", lambda self, x, y, text, **_: texts.append(text))
    picture.draw([result], None).save(tmp_path / "run.png")
    assert ("path by odometry" in named) == estimate
    assert "whisker touch" not in named, "none happened"
    assert any("0 whisker touches" in text for text in texts)
    assert any("odometry off" in text for text in texts) == estimate


def test_names_are_no_formulas(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """matplotlib would set what stands between two $ as mathematics, or fail at it."""
    result = run_of("shieldbot", monkeypatch)
    result.brain = "my $brain_{ and my \\frac$"
    assert picture.draw([result], None).save(tmp_path / "run.png").stat().st_size > 10_000


def test_robot_without_whiskers_or_ways_to_measure_says_nothing_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = load_robot("shieldbot-basic")
    fewer = {
        name: msgspec.structs.replace(device, on=False) if name.startswith("whisker") else device
        for name, device in whole.device.items()
    }
    result = run_of("shieldbot-basic", monkeypatch)
    result.robot = msgspec.structs.replace(whole, device=fewer)
    result.world = None
    table = result.table()
    assert [
        table[name]
        for name in ("true_distance_m", "odometry_distance_m", "true_contacts", "whisker_touches", "odometry_error_m")
    ] == [None] * 5
    assert not scene.view(result).path_is_seen and "distance unknown" in result.summary()


def test_pictures_show_the_sensors_that_are_on() -> None:
    shown = {
        name: set(scene.device_items(load_robot(name))) for name in ("shieldbot", "shieldbot-basic", "boebot", "arsim")
    }
    pair = {"infrared_left", "infrared_right"}
    whiskers = {"whisker_left", "whisker_right"}
    lights = {"light_left", "light_right"}
    assert shown["shieldbot"] == {*pair, "ping", *whiskers}
    assert shown["shieldbot-basic"] == {*pair, *lights, *whiskers}
    assert shown["boebot"] == {"analog_infrared", *pair, *lights, "ping", "turret", *whiskers}
    assert shown["arsim"] == pair
    assert scene.pivot(load_robot("boebot")) == (0.045, 0.0) and scene.pivot(load_robot("shieldbot")) is None


OUTLINES = {"circle": [], "box": [(-0.08, -0.05), (0.06, -0.05), (0.06, 0.05), (-0.08, 0.05)]}


def shaped(robot: RobotDescription, outline: list[tuple[float, float]]) -> RobotDescription:
    return msgspec.structs.replace(robot, body=msgspec.structs.replace(robot.body, outline_m=outline))


@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
@pytest.mark.parametrize(("x", "y", "heading"), [(0.0, 0.0, 0.0), (1.2, -0.7, 2.5)])
def test_the_body_is_drawn_as_what_meets_things(
    outline: list[tuple[float, float]], x: float, y: float, heading: float
) -> None:
    """The filled patch, against shapely; its nose lies within."""
    robot = shaped(load_robot("shieldbot"), outline)
    axes = Figure().subplots()
    axes.set(xlim=(x - 0.2, x + 0.2), ylim=(y - 0.2, y + 0.2))
    draw_robot(axes, robot, (x, y, heading), style.END)
    drawn = {}
    for patch in axes.patches:
        (pixels,) = patch.get_path().transformed(patch.get_transform()).to_polygons()
        drawn[patch.get_facecolor()] = shapely.Polygon(axes.transData.inverted().transform(pixels))
    body, nose = drawn[to_rgba(style.BODY)], drawn[to_rgba(style.END)]
    shape = shapely.Polygon(outline) if outline else shapely.Point(0, 0).buffer(robot.body.radius_m, 64)
    turned = shapely.affinity.rotate(shape, heading, origin=(0, 0), use_radians=True)
    assert shapely.hausdorff_distance(body, shapely.affinity.translate(turned, x, y)) < (1e-9 if outline else 2e-4)
    assert body.contains(nose)


def test_the_ghost_is_drawn_as_the_body(monkeypatch: pytest.MonkeyPatch) -> None:
    result = run_of("shieldbot", monkeypatch)
    odometry = result.odometry
    assert odometry is not None
    axes = Figure().subplots()
    paint(axes, scene.ghost_items(shaped(result.robot, OUTLINES["box"])), pose=odometry.at(-1))
    (ghost,) = axes.patches
    corners = (ghost.get_transform() - axes.transData).transform(ghost.get_path().vertices)
    end = odometry.at(-1)
    turned = shapely.affinity.rotate(shapely.Polygon(OUTLINES["box"]), end[2], origin=(0, 0), use_radians=True)
    expected = shapely.affinity.translate(turned, *end[:2])
    assert shapely.hausdorff_distance(shapely.Polygon(corners), expected) < 1e-9


@given(st.lists(st.tuples(st.floats(0.1, 1.0), st.floats(0.2, 1.0)), min_size=4, max_size=12))
def test_the_way_out_is_the_nearest_edge_ahead(star: list[tuple[float, float]]) -> None:
    """Of polygons around the origin, against shapely."""
    steps = np.cumsum([step for _, step in star])
    angles = 2 * math.pi * steps / steps[-1]
    corners = [(r * math.cos(a), r * math.sin(a)) for (r, _), a in zip(star, angles.tolist(), strict=True)]
    if not shapely.Polygon(corners).contains(shapely.Point(0, 0)):
        return
    ring = shapely.LinearRing(corners).intersection(shapely.LineString([(0, 0), (2, 0)]))
    assert way_out(corners) == pytest.approx(ring.distance(shapely.Point(0, 0)), abs=1e-9)


LASERS = """
extends = 'roller'
name = 'lasers'
[device.laser]
rays = 682
step_rad = 0.006135923
sigma = 0.0
position_m = [0.05, -0.02]
[device.rear]
type = "laser_range_finder"
rays = 7
step_rad = 0.2
sigma = 0.0
range_m = 0.5
position_m = [-0.1, 0.03]
heading_rad = 3.0
"""


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    """A turning robot with two lasers without noise: one that is read every 0.1 s, one every 0.01 s."""
    robot = tmp_path_factory.mktemp("robot") / "lasers.toml"
    robot.write_text(LASERS)
    return boebot.run(lambda it: it.drive(0.2, 0.6), robot=robot, arena="room", seconds=3)


def misses(scanned: RunResult, swept: scene.Swept, index: int) -> np.ndarray:
    """How far the ends of a sweep's rays are from the nearest edge in their way, or from the reach (m), by shapely."""
    edges = shapely.union_all([shapely.LinearRing(solid.points) for solid in scanned.plan.solids])
    sensor, *ends = swept.area(index)
    found = []
    for end in ends:
        far = math.dist(sensor, end)
        ray = shapely.LineString([sensor, sensor + 10 * (end - sensor) / far])
        nearest = shapely.Point(sensor).distance(ray.intersection(edges))
        found.append(far - min(nearest, swept.sweeps.reach))
    return np.abs(found)


def test_a_sweep_ends_at_the_walls_seen_from_where_it_was_taken(scanned: RunResult) -> None:
    ahead, rear = scene.view(scanned).swept
    assert np.allclose(np.diff(ahead.time), 0.1) and np.allclose(np.diff(rear.time), 0.01)
    for swept, rays in ((ahead, 682), (rear, 7)):
        for index in (0, len(swept.time) // 2, -1):
            assert len(swept.area(index)) == 1 + rays
            assert misses(scanned, swept, index).max() < 1e-3
    lengths = [math.dist(rear.area(0)[0], end) for end in rear.area(0)[1:]]
    assert max(lengths) == pytest.approx(0.5), "nothing within reach"


def test_sweeps_older_than_the_tick_that_has_them_are_where_they_were_taken(
    scanned: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a long run few ticks are shown, at which a laser's last sweep is up to its period old."""
    monkeypatch.setattr(overview, "POINTS", 43)
    few = copy.copy(scanned)
    few.__dict__.pop("overview", None)
    ahead, _ = scene.view(few).swept
    assert few.overview.columns.time[1] == pytest.approx(0.07)
    index = int(np.argmax(few.overview.columns.time[ahead.ticks] - ahead.time))
    assert few.overview.columns.time[ahead.ticks[index]] - ahead.time[index] > 0.05
    assert np.median(misses(few, ahead, index)) < 2e-3


def test_picture_has_the_sweeps_of_start_and_end(scanned: RunResult) -> None:
    drawn = [patch.get_xy()[:-1] for patch in picture.draw([scanned], None).axes.patches if isinstance(patch, Polygon)]
    for swept in scene.view(scanned).swept:
        for index in (0, -1):
            area = swept.area(index)
            assert sum(np.array_equal(points, area) for points in drawn) == 1


# ---- the result in a few words ---------------------------------------------------------------------------------------


def test_repr_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    result = run_of("shieldbot", monkeypatch)
    assert repr(result) == (
        f"<RunResult: <lambda> on shieldbot (native) in square, 2.0 s, true distance {result.true_distance:.2f} m, "
        "0 true contacts, 0 whisker touches, seed 1, "
        "complete>"
    )
    assert len(repr(result.record)) < 200 and "201 telemetry" in repr(result.record)


def test_notebooks_get_a_table_without_markup_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    result = run_of("shieldbot", monkeypatch)
    result.brain = "<b>bold</b>"
    shown = result._repr_html_()
    assert "<b>" not in shown and "&lt;b&gt;" in shown
    assert "<tr><th>true distance</th>" in shown and "<td>m</td>" in shown


def test_slow_readings_are_counted_with_their_greatest_age(monkeypatch: pytest.MonkeyPatch) -> None:
    table = run_of("shieldbot-basic", monkeypatch).table()
    assert table["slow_readings"] == pytest.approx(100, abs=3), "one in two ticks for 2 s"
    assert table["slow_reading_age_s"] is not None and 0.020 <= float(table["slow_reading_age_s"]) <= 0.070
    assert run_of("shieldbot", monkeypatch).table()["slow_readings"] is None
    assert math.isclose(float(table["run_time_s"] or 0), 2.0)
