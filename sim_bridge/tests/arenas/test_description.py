"""Arena files: what one may contain, what may be wrong with one, and the schema and page made from the types."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot import resources
from boebot.arenas import (
    Arena,
    ArenaDescription,
    Disc,
    Moving,
    Polygon,
    Wall,
    Waypoint,
    arena_names,
    load_arena,
)
from boebot.arenas.floor_plan import floor_plan, poses_of
from boebot.errors import ArenaError
from boebot.view import arena_picture
from sim_bridge.compiled import ffi, lib
from tools import arena_pages

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "docs" / "reference").is_dir())
PAGE = (ROOT / "docs/reference/arenas.md").read_text(encoding="utf-8")
TEXTS = [(resources.folder("arenas") / f"{name}.toml").read_text(encoding="utf-8") for name in arena_names()]
FRAME = "name = 'mine'\n"
SQUARE = "corners_m = [[0, 0], [1, 0], [1, 1], [0, 1]]\n"
MOVING = FRAME + "[[moving]]\nradius_m = 0.1\n"


def load_text(folder: Path, text: str | bytes) -> Arena:
    file = folder / "mine.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_arena(file)


def error_of(folder: Path, text: str | bytes) -> str:
    with pytest.raises(ArenaError) as caught:
        load_text(folder, text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (FRAME + "[[disc]]\nx_m = 1\ny_m = 1\nradius_m = 0", "mine.toml:5: disc[0].radius_m: expected float > 0.0"),
        (FRAME + "[[disc]]\nx_m = 1\nradius_m = 1", "mine.toml:2: disc[0]: the key 'y_m' is missing"),
        (FRAME + "[[wall]]\npoints_m = [[0, 0]]", "mine.toml:3: wall[0].points_m: expected array of length >= 2"),
        (
            FRAME + "[[wall]]\npoints_m = [[0, 0], [1, 0],\n  [1, 0]]",
            "mine.toml:3: wall[0].points_m[1] and the point after it are the same; expected an edge",
        ),
        (FRAME + f"[[patch]]\n{SQUARE}grip = -1", "mine.toml:4: patch[0].grip: expected float >= 0.0"),
        (FRAME + f"[[obstacle]]\n{SQUARE}height_m = 0", "mine.toml:4: obstacle[0].height_m: expected float > 0.0"),
        (
            FRAME + f"[[obstacle]]\n{SQUARE}sound_reflectance = 2",
            "mine.toml:4: obstacle[0].sound_reflectance: expected float <= 1.0",
        ),
        (FRAME + "[charger]\nx_m = 0\ny_m = 0\nradius_m = -1", "mine.toml:5: charger.radius_m: expected float > 0.0"),
        (FRAME + "charger = 5", "mine.toml:2: charger: expected object | null, got int"),
        (MOVING + "path = []", "mine.toml:4: moving[0].path: expected array of length >= 1"),
        (
            MOVING + "path = [\n{ time_s = 1, x_m = 0, y_m = 0 } ]",
            "mine.toml:4: moving[0].path[0].time_s is 1; expected 0 for the first waypoint",
        ),
        (
            MOVING + "path = [ { time_s = 0, x_m = 0, y_m = 0 },\n{ time_s = 0, x_m = 0, y_m = 0 } ]",
            "mine.toml:4: moving[0].path[1].time_s is 0; expected more than 0",
        ),
        (
            MOVING + "repeat = 'loop'\n[[moving.path]]\ntime_s = 0\nx_m = 0\ny_m = 0\n"
            "[[moving.path]]\ntime_s = 1\nx_m = 1\ny_m = 0",
            "mine.toml:9: moving[0].path[1]: expected the first waypoint again, as the path is a loop",
        ),
        (
            MOVING + f"{SQUARE}path = [ {{ time_s = 0, x_m = 0, y_m = 0 }} ]",
            "mine.toml:2: moving[0]: expected either corners_m or radius_m",
        ),
        (
            FRAME + "[start]\nx_m = 0.5\ny_m = 0.5\n[[obstacle]]\n" + SQUARE,
            "mine.toml:2: start: x_m = 0.5, y_m = 0.5 is in or behind something; expected free space",
        ),
        (
            FRAME
            + "[start]\nx_m = 0.05\ny_m = 0\n[[moving]]\nradius_m = 0.1\npath = [{ time_s = 0, x_m = 0, y_m = 0 }]",
            "mine.toml:2: start: x_m = 0.05, y_m = 0 is in or behind something; expected free space",
        ),
        (FRAME.encode() + b"title = '\xff'", "mine.toml cannot be read: "),
    ],
)
def test_wrong_file_is_told_with_line_key_and_expectation(tmp_path: Path, text: str | bytes, expected: str) -> None:
    assert error_of(tmp_path, text).startswith(expected)


def test_crossing_edges_of_a_large_polygon_are_found() -> None:
    turn = np.arange(20_000) * 2 * math.pi / 20_000
    corners = [(math.cos(t), math.sin(t)) for t in turn]
    Arena(ArenaDescription(name="ring", obstacle=[Polygon(corners)]))
    corners[15_000] = (0.0, 1.5)  # through the whole ring
    with pytest.raises(ArenaError, match=r"obstacle\[0\]\.corners_m: edges \d+ and \d+ cross or touch"):
        Arena(ArenaDescription(name="ring", obstacle=[Polygon(corners)]))


def test_a_million_edges_are_refused_at_once(tmp_path: Path) -> None:
    corners = [(0.0, 0.0)] * 1_000_000
    with pytest.raises(ArenaError, match="has 1,000,000 edges; expected at most 200,000"):
        Arena(ArenaDescription(name="large", obstacle=[Polygon(corners)]))
    with pytest.raises(ArenaError, match="expected at most 8,000,000"):
        load_text(tmp_path, FRAME + "[[wall]]\npoints_m = [" + "[0.125, 2.5], " * 1_000_000 + "]")


@pytest.mark.parametrize(
    "description",
    [
        {"obstacle": [Polygon([(0, 0), (1, math.nan), (1, 1)])]},
        {"obstacle": [Polygon([(0, 0), (1, 0)])]},
        {"wall": [Wall([(0, 0)])]},
        {"disc": [Disc(0, math.inf, 1)]},
        {"disc": [Disc(0, 0, math.nan)]},
        {"moving": [Moving([], radius_m=1)]},
        {"moving": [Moving([Waypoint(0, 0, math.nan)], radius_m=1)]},
        {"moving": [Moving([Waypoint(0, 0, 0), Waypoint(math.nan, 1, 0)], radius_m=1)]},
        {"moving": [Moving([Waypoint(0, 0, 0, math.nan)], radius_m=1)]},
        {"moving": [Moving([Waypoint(0, 0, 0)])]},
    ],
)
def test_descriptions_made_in_python_are_checked_as_well(description: dict[str, Any]) -> None:
    with pytest.raises(ArenaError):
        Arena(ArenaDescription(name="wrong", **description))


def test_showcase_holds_what_its_file_says() -> None:
    arena = load_arena("showcase")
    handle = arena.handle
    assert lib.arena_disc_count(handle) == 1
    assert lib.arena_grip(handle, 0, 0, 0.6) == 0.9
    assert lib.arena_grip(handle, 1.2, -1.2, 0.6) == 0.15
    assert lib.arena_grip(handle, -1.5, -1, 0.6) == 0.6
    light = lib.arena_lights(handle)[0]
    assert [lib.arena_is_at_charger(handle, 1.6, 1.2 + away) for away in (-0.149, 0.149, 0.151)] == [1, 1, 0]
    assert (light.x, light.y, light.height, light.power) == (1.6, 1.2, 0.25, 5.0)
    surfaces = [lib.arena_shape_at(handle, number).surface for number in range(6)]
    assert [surface.height for surface in surfaces] == [math.inf, math.inf, 0.04, math.inf, math.inf, math.inf]
    assert (surfaces[3].infrared_reflectance, surfaces[3].sound_reflectance) == (0.1, 0.2)
    assert not arena.is_free(1.0, -0.7, 0.05)  # the cart, at the start
    assert not arena.is_free(-1.75, 0.7, 0.05)  # the ball
    assert arena.is_free(1.3, 0.0, 0.05)


WAY = [Waypoint(0, 1, 2, 0), Waypoint(2, 3, 2, 1), Waypoint(3, 3, 5, 7)]


def pose_at(repeat: str, time: float) -> tuple[float, ...]:
    points = ffi.new("path_waypoint[]", [(p.time_s, p.x_m, p.y_m, p.heading_rad) for p in WAY])
    path = ffi.new("path *", {"waypoints": points, "count": len(WAY), "repeat": getattr(lib, f"PATH_{repeat}")})
    state = ffi.new("path_state *")
    lib.path_at(path, time, state)
    return state.x, state.y, state.heading, state.vx, state.vy, state.turn_rate


@pytest.mark.parametrize(
    ("repeat", "time", "expected"),
    [
        ("ONCE", -1, (1, 2, 0, 0, 0, 0)),
        ("ONCE", 0, (1, 2, 0, 1, 0, 0.5)),
        ("ONCE", 1, (2, 2, 0.5, 1, 0, 0.5)),
        ("ONCE", 2.5, (3, 3.5, 4, 0, 3, 6)),
        ("ONCE", 3, (3, 5, 7, 0, 0, 0)),
        ("ONCE", 1e6, (3, 5, 7, 0, 0, 0)),
        ("LOOP", 3, (1, 2, 0, 1, 0, 0.5)),
        ("LOOP", 301, (2, 2, 0.5, 1, 0, 0.5)),
        ("BACK_AND_FORTH", 3, (3, 5, 7, 0, -3, -6)),
        ("BACK_AND_FORTH", 3.5, (3, 3.5, 4, 0, -3, -6)),
        ("BACK_AND_FORTH", 4, (3, 2, 1, -1, 0, -0.5)),
        ("BACK_AND_FORTH", 5, (2, 2, 0.5, -1, 0, -0.5)),
        ("BACK_AND_FORTH", 7, (2, 2, 0.5, 1, 0, 0.5)),
        ("BACK_AND_FORTH", math.nan, (1, 2, 0, 0, 0, 0)),
    ],
)
def test_path_by_hand(repeat: str, time: float, expected: tuple[float, ...]) -> None:
    assert pose_at(repeat, time) == pytest.approx(expected)


@given(st.sampled_from(["ONCE", "LOOP", "BACK_AND_FORTH"]), st.floats(0.01, 50))
def test_velocity_is_the_derivative_of_the_pose(repeat: str, time: float) -> None:
    step = 1e-6
    before, now, after = (np.array(pose_at(repeat, time + k * step)) for k in (-1, 0, 1))
    if np.allclose(before[3:], after[3:]):  # no waypoint between
        assert (after[:3] - before[:3]) / (2 * step) == pytest.approx(now[3:], abs=1e-6)


def test_moving_shapes_are_where_their_path_says() -> None:
    """At 5 s the cart is half-way from (1.6, -0.7) to (1.7, -0.6), turned by 45 degrees."""
    cart, ball = (moving.at(5.0) for moving in floor_plan(load_arena("showcase"), 5.0, 6.0).moving)
    assert cart.points.mean(axis=0) == pytest.approx((1.65, -0.65))
    assert np.ptp(cart.points, axis=0) == pytest.approx(2 * [(0.3 + 0.2) * math.sqrt(0.5)], abs=1e-4)
    assert ball.points[0] == pytest.approx((-0.8, 0.7)) and ball.radius == 0.08


@pytest.mark.unsanitized
def test_schema_and_page_are_fresh() -> None:
    """`make` renews the schema, `make pictures` the page."""
    assert (resources.folder("arenas") / "schema.json").read_text(encoding="utf-8") == arena_pages.schema()
    assert arena_pages.page(PAGE) == PAGE


def test_schema_names_every_key_with_its_limits() -> None:
    definitions = json.loads(arena_pages.schema())["$defs"]
    assert definitions["Disc"]["required"] == ["x_m", "y_m", "radius_m"]
    assert definitions["Disc"]["properties"]["radius_m"]["exclusiveMinimum"] == 0
    assert definitions["Polygon"]["properties"]["corners_m"]["minItems"] == 3
    assert all(definition["additionalProperties"] is False for definition in definitions.values())


def test_page_shows_every_arena_and_an_example_that_loads(tmp_path: Path) -> None:
    for name in arena_names():
        assert f"../images/arena-{name}.png" in PAGE
    example = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)[0]
    assert load_text(tmp_path, example).ray(0, 0.3, 0, 5) == pytest.approx(0.2)
    assert lib.arena_moving_count(load_text(tmp_path, example).handle) == 1
    shown = re.search(r"`yard\.toml(:\d+: disc.*?)`", PAGE)
    assert shown and error_of(tmp_path, example.replace("radius_m = 0.1", "radius_m = 0")) == f"mine.toml{shown[1]}"


@pytest.mark.unsanitized
@pytest.mark.parametrize("name", ["showcase", "empty"])
def test_picture_is_written(tmp_path: Path, name: str) -> None:
    assert arena_picture.write(load_arena(name), tmp_path / "it.png").read_bytes().startswith(b"\x89PNG")


NUMBERS = [
    "nan",
    "-inf",
    "0",
    "-0.0",
    "1e308",
    "1e-308",
    "1000",
    "1000.0001",
    "9" * 400,
    "'x'",
    "[]",
    "{}",
    "true",
    "1979-05-27",
]
PIECES = [
    "[",
    "]",
    "{",
    "}",
    ",",
    "=",
    '"',
    "'''",
    "\n",
    "#",
    "[[disc]]\n",
    "[start]\n",
    "x_m = 1\n",
    "\x00",
    "é",
    ".",
    "0",
]


@st.composite
def spoilt_texts(draw: st.DrawFn) -> str:
    """A bundled arena in which some numbers or characters were replaced, lines lost, doubled or exchanged."""
    text = draw(st.sampled_from(TEXTS))
    for _ in range(draw(st.integers(1, 4))):
        kind = draw(st.sampled_from(["number", "number", "cut", "insert", "line", "copy"]))
        if kind == "number" and (numbers := list(re.finditer(r"-?\d+\.\d+", text))):
            match = draw(st.sampled_from(numbers))
            value = draw(st.sampled_from(NUMBERS) | st.floats(-3, 3).map(lambda v: f"{v:.1f}"))
            text = text[: match.start()] + value + text[match.end() :]
        elif kind in ("cut", "insert"):
            at = draw(st.integers(0, len(text)))
            lost = draw(st.integers(1, 30)) if kind == "cut" else 0
            text = text[:at] + (draw(st.sampled_from(PIECES)) if kind == "insert" else "") + text[at + lost :]
        else:
            lines = text.split("\n")
            line = lines.pop(draw(st.integers(0, len(lines) - 1)))
            if kind == "copy":
                lines.insert(draw(st.integers(0, len(lines))), line)
                lines.insert(draw(st.integers(0, len(lines))), line)
            text = "\n".join(lines)
    return text


def load_or_refuse(folder: Path, text: str | bytes) -> Arena | None:
    """The arena, or None if it was refused by one sentence about the file."""
    refusal = ""
    try:
        return load_text(folder, text)
    except ArenaError as error:
        refusal = str(error)
    assert refusal.startswith("mine.toml")
    assert "\n" not in refusal
    return None


@given(spoilt_texts())
def test_a_spoilt_file_is_refused_in_a_sentence_or_is_an_arena(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    """Never another exception, a hang or an arena that answers nonsense."""
    folder = tmp_path_factory.getbasetemp()
    arena = load_or_refuse(folder, text)
    if arena is None:
        return
    x, y, heading = arena.start
    distance = arena.ray(x, y, heading, 20)
    assert distance is None or 0 <= distance < 20
    assert arena.is_free(x, y, 0.0)
    assert all(np.isfinite(outline).all() for outline in arena.outlines)
    assert np.isfinite(poses_of(arena.movers(7.3))).all()


@given(st.binary(max_size=200))
def test_bytes_are_no_arena(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    load_or_refuse(tmp_path_factory.getbasetemp(), data)
