"""The replay page in a real browser: mouse, fingers, keys; what it shows; narrow and wide, light and dark."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import boebot
from browser.looks import WIDTHS, colours_of, controls, faint_texts, floor_at, overflow, reached_by_tab, wait_for

if TYPE_CHECKING:
    from playwright.sync_api import Page

    from boebot.result import RunResult, TogetherResult
    from browser.looks import OpenPage

pytest.importorskip("playwright", reason="drives a browser with playwright, which is not installed")
pytestmark = pytest.mark.unsanitized
SECONDS = 6.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunResult, str]:
    """A robot with a board whose pins are recorded, and its page."""
    folder = tmp_path_factory.mktemp("one")
    result = boebot.run("wander", robot="boebot", arena="showcase", on="avr", seconds=SECONDS, pins=True)
    result.save(folder)
    return result, (folder / "replay.html").as_uri()


@pytest.fixture(scope="module")
def together(tmp_path_factory: pytest.TempPathFactory) -> tuple[TogetherResult, str]:
    """Two robots, one with a brain of processes."""
    folder = tmp_path_factory.mktemp("two")
    members = [
        boebot.Member(brain=brain, robot=robot, pose=pose)
        for brain, robot, pose in (
            ("wander", "shieldbot", (0.0, 0.8, 0.0)),
            ("demo", "shieldbot-charging", (0.7, -1.1, 2.0)),
        )
    ]
    result = boebot.run_together(members, arena="room", seconds=SECONDS)
    result.save(folder)
    return result, (folder / "replay.html").as_uri()


@pytest.fixture(scope="module")
def shared(run: tuple[RunResult, str], open_shared: OpenPage) -> Page:
    opened: Page = open_shared(run[1])
    return opened


@pytest.fixture
def page(shared: Page) -> Page:
    """The first run's, as it has just been opened."""
    shared.mouse.move(0, 0)
    shared.evaluate(
        "setPlaying(false); spanLength = null; spanBegin = 0; $('speed').value = '1';"
        "$('signals').scrollTop = 0; document.activeElement.blur(); fitView(); show(page);"
    )
    return shared


def at_robot(page: Page) -> tuple[float, float]:
    """Where the chosen robot is on the screen."""
    x, y = page.evaluate(
        "() => { const [x, y] = placeOf(run), box = $('stage').getBoundingClientRect();"
        " return [box.x + X(x) / ratio, box.y + Y(y) / ratio]; }"
    )
    return x, y


def lane(page: Page, name: str, time: float) -> tuple[float, float]:
    """Where a moment of a lane is on the screen."""
    x, y = page.evaluate(
        "([name, t]) => { const at = $('cursor').getBoundingClientRect();"
        " const box = laneBoxes().find(one => one.lane.name === name);"
        " return [at.x + box.px(t) / ratio, at.y + box.middle / ratio]; }",
        [name, time],
    )
    return x, y


@pytest.mark.parametrize("size", WIDTHS)
def test_page_fits_and_can_be_read(size: tuple[int, int], run: tuple[RunResult, str], open_page: OpenPage) -> None:
    page = open_page(run[1], *size)
    wide, high = overflow(page)
    assert wide == 0 and (high == 0 or size[0] < 760), "only a phone scrolls"
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        assert faint_texts(page) == [], scheme
    assert all(colours_of(page, canvas) > 3 for canvas in ("floor", "stage", "tracks")), "something is drawn"
    arena, panel = page.locator("#arena").bounding_box(), page.locator("#sensors").bounding_box()
    assert arena is not None and panel is not None
    if size[0] < 760:
        assert panel["y"] > arena["y"] + arena["height"] and panel["width"] > 0.9 * arena["width"]
    else:
        assert panel["x"] > arena["x"] + arena["width"]


@pytest.mark.soak
def test_dark_page_is_dark(run: tuple[RunResult, str], open_page: OpenPage) -> None:
    """And is drawn anew when the system changes."""
    page = open_page(run[1], scheme="light")
    place = -1.05, -1.25  # nothing stands there
    assert min(floor_at(page, *place)) > 200
    page.emulate_media(color_scheme="dark")
    page.wait_for_timeout(200)
    assert max(floor_at(page, *place)) < 60


def test_every_control_has_a_name_and_is_reached_by_tab(
    together: tuple[TogetherResult, str], open_page: OpenPage
) -> None:
    page = open_page(together[1])
    found = controls(page)
    assert {"play", "slider", "speed", "robot", "stage", "cursor", "zoomIn", "follow", "after"} <= {
        name for _, name, _ in found
    }
    assert [name for _, name, spoken in found if len(spoken) < 3] == []
    reached = reached_by_tab(page, len(found) + 3)
    assert [name for number, name, _ in found if number not in reached] == []
    assert all(reached.values()), "one sees where the focus is"


def test_wheel_drag_and_keys_move_the_view(page: Page) -> None:
    before = page.evaluate("[scale, shiftX, shiftY]")
    x, y = at_robot(page)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -400)
    wait_for(page, "scale > 1.5 * fitScale()")
    assert at_robot(page) == pytest.approx((x, y), abs=0.5), "what is under the pointer stays there"
    page.mouse.move(x + 200, y)
    page.mouse.down()
    page.mouse.move(x + 260, y - 35, steps=3)
    page.mouse.up()
    assert at_robot(page) == pytest.approx((x + 60, y - 35), abs=0.5)
    page.keyboard.press("0")
    assert page.evaluate("[scale, shiftX, shiftY]") == pytest.approx(before)
    page.keyboard.press("+")
    page.click("#zoomIn")
    assert page.evaluate("scale") == pytest.approx(before[0] * 1.4**2)
    page.keyboard.press("-")
    page.click("#zoomOut")
    assert page.evaluate("scale") == pytest.approx(before[0])
    x, y = at_robot(page)
    page.focus("#stage")
    page.keyboard.press("Shift+ArrowRight")
    assert at_robot(page) == pytest.approx((x - 60, y), abs=0.5)


@pytest.mark.soak
def test_view_follows_the_robot(page: Page) -> None:
    page.keyboard.press("f")
    stage = page.locator("#stage").bounding_box()
    assert stage is not None
    middle = stage["x"] + stage["width"] / 2, stage["y"] + stage["height"] / 2
    for time in (1.0, 5.0):
        page.evaluate("t => seek(t)", time)
        assert at_robot(page) == pytest.approx(middle, abs=1.0)
    assert page.get_attribute("#follow", "aria-pressed") == "true"
    page.keyboard.press("0")
    assert page.get_attribute("#follow", "aria-pressed") == "false"


@pytest.mark.soak
def test_two_fingers_zoom_on_a_phone(run: tuple[RunResult, str], open_page: OpenPage) -> None:
    page = open_page(run[1], 390, 844)
    before = page.evaluate("scale")
    touch = page.context.new_cdp_session(page)
    for kind, apart in (("touchStart", 30), ("touchMove", 60), ("touchMove", 90), ("touchEnd", 0)):
        points = [{"x": 195 + side * apart, "y": 250, "id": side + 1} for side in (-1, 1)] if apart else []
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    assert page.evaluate("scale") == pytest.approx(3 * before, rel=0.05)


def test_keys_play_and_scrub(page: Page) -> None:
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("now") == pytest.approx(0.1)
    page.keyboard.press(" ")
    wait_for(page, "now > 0.6")
    assert page.inner_text("#play") == "Pause"
    page.keyboard.press(" ")
    page.keyboard.press("End")
    assert page.evaluate("now") == pytest.approx(SECONDS)
    page.keyboard.press("Shift+ArrowLeft")
    assert page.evaluate("now") == pytest.approx(SECONDS - 5)
    page.keyboard.press("Home")
    assert page.evaluate("now") == 0
    page.focus("#speed")
    page.keyboard.press("ArrowDown")
    assert page.evaluate("now") == 0, "a list has its own keys"


def test_events_one_after_the_other(together: tuple[TogetherResult, str], open_page: OpenPage) -> None:
    """Of the second robot: the switches of its brain, at their times."""
    page = open_page(together[1] + "#robot=2")
    record = together[0].robots[1].brain_record
    assert record is not None
    switches = [switch for switch in record.switches if switch.time > 0.01]
    assert len(switches) >= 2
    for switch in switches[:2]:
        page.keyboard.press("n")
        assert page.evaluate("now") == pytest.approx(switch.time, abs=1e-3)
        assert page.inner_text("#event").startswith(f"{switch.time:.2f} s: switch to {switch.on}: ")
        assert page.inner_text("#behavior") == switch.on
        step = int(np.searchsorted(record.time, switch.time - 1e-6))
        utility = f"{record.utility_of(switch.on)[step]:+.2f}".replace("-", "−")
        assert page.inner_text(".utility.active").split() == [switch.on, utility]
    page.click("#before")
    assert page.evaluate("now") == pytest.approx(switches[0].time, abs=1e-3)


def test_another_robot_without_loading_anew(together: tuple[TogetherResult, str], open_page: OpenPage) -> None:
    page = open_page(together[1])
    page.evaluate("() => { window.same = true; seek(3.21); }")
    assert page.is_hidden("#mind")
    page.select_option("#robot", "2")
    assert page.evaluate("window.same") and page.is_visible("#mind")
    assert page.inner_text("#title").startswith("demo on shieldbot-charging")
    shift = together[0].robots[0].clock_offset - together[0].robots[1].clock_offset
    assert page.evaluate("now") == pytest.approx(3.21 + shift, abs=1e-6), "the same moment"


def test_values_under_the_pointer(run: tuple[RunResult, str], page: Page) -> None:
    result, _ = run
    for time in (1.0, 4.0):
        page.mouse.move(*lane(page, "motors", time))
        told = float(page.inner_text("#tip").split(" s")[0])
        assert told == pytest.approx(time, abs=0.02)
        index = int(np.searchsorted(result.series.time, told + 0.005)) - 1
        left, right = (values[index] for values in result.series.signals)
        assert page.inner_text("#tip").endswith(f"motors: left {left:+.2f}, right {right:+.2f}".replace("-", "−"))
    page.mouse.move(5, 5)
    assert page.is_hidden("#tip")


def test_time_axis_zooms_down_to_pulses(run: tuple[RunResult, str], page: Page) -> None:
    """A servo's pulse on its pin is as long as telemetry says."""
    result, _ = run
    edges = result.record.table("pins", np.dtype([("pin", "u1"), ("level", "u1")]))
    times = result.record.times_of("pins") - result.clock_offset
    own = (edges["pin"] == 13) & (times > 3.0)
    begin = float(times[own & (edges["level"] == 1)][0])
    end = float(times[own & (edges["level"] == 0) & (times > begin)][0])
    pulse = result.series.number("servo_left", "pulse")[int(np.searchsorted(result.series.time, begin)) - 1]
    assert (end - begin) * 1e6 == pytest.approx(pulse, abs=8)
    page.evaluate("t => { zoomTime(1e-3, t); seek(t); }", begin)
    first, last = page.evaluate("span()")
    assert last - first == pytest.approx(SECONDS * 1e-3, rel=0.01)
    page.evaluate("$('signals').scrollTop = 1000")
    page.mouse.move(*lane(page, "13 servo left", (begin + end) / 2))
    assert page.inner_text("#tip").endswith(f"13 servo left: high for {(end - begin) * 1e6:.0f} µs")
    for _ in range(30):
        page.mouse.wheel(0, 600)
    wait_for(page, f"span()[1] - span()[0] > {SECONDS - 0.1}")


def test_slider_and_lanes_scrub(page: Page) -> None:
    page.mouse.click(*lane(page, "motors", 2.0))
    assert page.evaluate("now") == pytest.approx(2.0, abs=0.02)
    page.focus("#slider")
    page.keyboard.press("End")
    assert page.evaluate("now") == pytest.approx(SECONDS)
    assert page.inner_text("#clock") == f"{SECONDS:.2f} / {SECONDS:.2f} s"
    page.click("#longer")
    page.click("#shorter")
    assert math.isclose(page.evaluate("span()[1] - span()[0]"), SECONDS / 2, rel_tol=0.01)


@pytest.mark.soak
def test_page_needs_no_network(run: tuple[RunResult, str], open_page: OpenPage) -> None:
    """And is allowed none."""
    page = open_page(run[1])
    asked: list[Any] = []
    page.on("request", lambda request: asked.append(request.url))
    page.reload()
    page.wait_for_timeout(300)
    assert asked == [run[1]]
    assert "connect-src" not in page.content().partition("<title>")[0]
