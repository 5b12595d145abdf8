"""The live page in a real browser: `boebot run --view`, and every control of it, by mouse and by keys."""

from __future__ import annotations

import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from browser.looks import WIDTHS, controls, faint_texts, overflow, reached_by_tab, wait_for
from command import heed_signals

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from browser.looks import OpenPage

pytest.importorskip("playwright", reason="drives a browser with playwright, which is not installed")
pytest.importorskip("boebot.live", reason="looks at the live view, which is not here")
pytestmark = pytest.mark.unsanitized

AT_ROBOT = """() => { const [x, y] = placeOf(run), box = $('stage').getBoundingClientRect();
  return [box.x + X(x) / ratio, box.y + Y(y) / ratio]; }"""
AT_SHAPE = """() => { const [x, y] = moving[0].at(now + run.begin), box = $('stage').getBoundingClientRect();
  return [box.x + X(x) / ratio, box.y + Y(y) / ratio]; }"""
SIGNALS = "[run.left.last, run.right.last]"

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # without them no page opens by itself

Watch = Callable[..., str]


class Watched:
    """Runs that are watched: processes of the command."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.running: list[subprocess.Popen[str]] = []

    def start(self, *arguments: str) -> str:
        """Returns the page's address."""
        out = self.folder / f"run-{len(self.running)}"
        command = [sys.executable, "-m", "boebot", "run", *arguments, "--view", "--out", str(out)]
        environment = {name: value for name, value in os.environ.items() if name not in DISPLAYS}
        process = subprocess.Popen(
            command,
            text=True,
            stderr=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            env=environment,
            preexec_fn=heed_signals,
        )
        self.running.append(process)
        assert process.stderr is not None
        for said in process.stderr:
            if found := re.search(r"http://\S+", said):
                return found[0]
        raise AssertionError("the run has not said where its page is")

    def stop(self, number: int = -1) -> dict[str, Any]:
        """Ctrl-C; returns the run's figures."""
        self.running[number].send_signal(signal.SIGINT)
        self.running[number].communicate(timeout=60)
        number %= len(self.running)
        summary: dict[str, Any] = json.loads((self.folder / f"run-{number}" / "summary.json").read_text())
        return summary


@pytest.fixture(scope="module")
def watched(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Watched]:
    runs = Watched(tmp_path_factory.mktemp("live"))
    yield runs
    for process in runs.running:
        process.kill()
        process.communicate()


SLIDER = "sliders.find(one => one.parameter.name === '%s')"


@pytest.fixture(scope="module")
def url(watched: Watched) -> str:
    """Of a run with a moving shape, a brain of processes and parameters, which many tests interfere with."""
    return watched.start("demo", "--robot", "shieldbot-charging", "--arena", "showcase", "--seconds", "3600")


@pytest.fixture(scope="module")
def shared(url: str, open_shared: OpenPage) -> Page:
    opened = open_shared(url)
    wait_for(opened, "state !== null && arrivals.length > 2")
    return opened


@pytest.fixture
def page(shared: Page) -> Iterator[Page]:
    """At the end its brain drives the robot, at real time, and the newest moment is shown."""
    yield shared
    shared.evaluate(
        "act({ kind: 'release' }); act({ kind: 'arm' }); send({ type: 'resume' });"
        "send({ type: 'speed', speed: 1 }); setNewest(true); document.activeElement.blur(); $('notice').hidden = true;"
    )
    wait_for(shared, "!state.paused && state.speed === 1 && !robotState().latched && robotState().driver === null")


@pytest.mark.soak
def test_page_shows_the_newest_moment(page: Page) -> None:
    """Evenly, and never an earlier one after a later one."""
    times = page.evaluate(
        """() => new Promise(done => { const seen = [], begun = performance.now();
          const look = stamp => { seen.push([stamp / 1000, now]);
            if (performance.now() - begun < 2000) requestAnimationFrame(look); else done(seen); };
          requestAnimationFrame(look); })"""
    )
    assert all(after[1] >= before[1] for before, after in itertools.pairwise(times))
    wall, shown = (times[-1][k] - times[0][k] for k in (0, 1))
    assert shown == pytest.approx(wall, rel=0.15)
    assert page.evaluate("run.duration - now") < 0.5
    assert page.inner_text("#connection").startswith("live, ")
    assert "demo on shieldbot-charging" in page.inner_text("#title")


@pytest.mark.parametrize("size", WIDTHS)
def test_page_fits_and_can_be_read(url: str, size: tuple[int, int], open_page: OpenPage) -> None:
    page = open_page(url, *size)
    wait_for(page, "state !== null")
    wide, high = overflow(page)
    assert wide == 0 and (high == 0 or size[0] < 760)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        assert faint_texts(page) == [], scheme


def test_every_control_has_a_name_and_is_reached_by_tab(page: Page) -> None:
    page.click("#parameters summary")
    page.keyboard.press("w")
    wait_for(page, "!$('release').disabled")
    found = controls(page)
    assert {"stop", "pause", "step", "restart", "speed", "newest", "move", "power", "release", "slider"} <= {
        name for _, name, _ in found
    }
    assert [name for _, name, spoken in found if len(spoken) < 3] == []
    page.evaluate("document.activeElement.blur()")
    reached = reached_by_tab(page, len(found) + 3)
    assert [name for number, name, _ in found if number not in reached] == [] and all(reached.values())
    page.click("#parameters summary")


def test_pause_step_and_speed(page: Page) -> None:
    page.click("#pause")
    wait_for(page, "state.paused && now === run.duration")
    assert page.inner_text("#pause") == "Resume" and page.inner_text("#connection").startswith("paused")
    before = page.evaluate("run.duration")
    page.wait_for_timeout(300)
    assert page.evaluate("run.duration") == before
    page.click("#step")
    wait_for(page, f"run.duration > {before}")
    page.wait_for_timeout(200)
    assert page.evaluate("run.duration") == pytest.approx(before + 0.05, abs=0.011), "the brain's period"
    page.select_option("#speed", "0.5")
    page.click("#pause")
    wait_for(page, "state.speed === 0.5 && !state.paused")
    page.wait_for_timeout(1500)
    assert page.evaluate("rateOfLate()[0]") == pytest.approx(0.5, abs=0.1)
    page.select_option("#speed", "1")


@pytest.mark.soak
def test_driving_by_keys_and_arrows(page: Page) -> None:
    page.keyboard.down("w")
    wait_for(page, f"{SIGNALS}.every(v => Math.abs(v - 0.6) < 0.02)")
    assert page.inner_text("#driver") == "You drive."
    page.wait_for_timeout(600)
    assert page.evaluate(SIGNALS) == pytest.approx([0.6, 0.6], abs=0.02), "longer than 0.3 s"
    page.keyboard.down("a")
    wait_for(page, "run.left.last < 0.3 && run.right.last > 0.5")
    page.keyboard.up("a")
    page.keyboard.up("w")
    wait_for(page, f"{SIGNALS}.every(v => v === 0)")
    page.keyboard.down("ArrowLeft")
    wait_for(page, "run.left.last < -0.2 && run.right.last > 0.2")
    page.keyboard.up("ArrowLeft")
    page.hover(".way.back")
    page.mouse.down()
    wait_for(page, f"{SIGNALS}.every(v => Math.abs(v + 0.6) < 0.02)")
    page.mouse.up()
    wait_for(page, f"{SIGNALS}.every(v => v === 0)")
    page.focus(".way.ahead")
    page.keyboard.down("Enter")
    wait_for(page, f"{SIGNALS}.every(v => Math.abs(v - 0.6) < 0.02)")
    page.keyboard.up("Enter")
    wait_for(page, f"{SIGNALS}.every(v => v === 0)")
    page.click("#stop")
    wait_for(page, "$('driver').classList.contains('alerted')")
    page.click("#arm")
    wait_for(page, "!$('driver').classList.contains('alerted')")
    page.click("#release")
    wait_for(page, "$('driver').textContent === 'Its brain drives.'")
    assert page.is_disabled("#release")


def test_space_stops_whatever_has_the_focus(page: Page) -> None:
    page.focus("#pause")
    touched = page.evaluate("state.touched")
    for _ in range(5):  # held: a keyboard says it again and again
        page.keyboard.down(" ")
    page.keyboard.up(" ")
    wait_for(page, "$('driver').classList.contains('alerted')")
    assert not page.evaluate("state.paused"), "the button was not pressed"
    assert page.evaluate("state.touched") == touched + 1
    wait_for(page, f"{SIGNALS}.every(v => v === 0)")
    page.click("#arm")
    wait_for(page, "!$('driver').classList.contains('alerted')")
    page.click("#stop")
    wait_for(page, "$('driver').classList.contains('alerted')")


@pytest.mark.soak
def test_robot_is_dragged_or_moved_by_keys(page: Page) -> None:
    page.click("#pause")
    wait_for(page, "state.paused && now === run.duration")
    stage = page.evaluate("(() => { const b = $('stage').getBoundingClientRect(); return [b.x, b.y]; })()")
    for goal in ((0.0, 0.7), (0.0, -0.8)):
        x, y = page.evaluate(AT_ROBOT)
        to_x, to_y = page.evaluate("([x, y]) => [X(x) / ratio, Y(y) / ratio]", list(goal))
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(stage[0] + to_x, stage[1] + to_y, steps=4)
        page.mouse.up()
        wait_for(page, f"Math.hypot(placeOf(run)[0] - {goal[0]}, placeOf(run)[1] - {goal[1]}) < 0.02")
    touched = page.evaluate("state.touched")
    x, y = page.evaluate(AT_ROBOT)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 90, y, steps=3)
    page.keyboard.press("Escape")
    page.mouse.up()
    before = page.evaluate("placeOf(run)")
    assert before[:2] == pytest.approx(goal, abs=0.02), "where it was"
    page.keyboard.press("m")
    assert page.inner_text("#event").startswith("Moving the robot: arrow keys")
    for key in ("ArrowLeft", "ArrowLeft", "Shift+ArrowUp", "q", "Enter"):
        page.keyboard.press(key)
    wait_for(page, f"state.touched === {touched + 1}")
    wait_for(page, f"placeOf(run)[0] < {before[0] - 0.05}")
    after = page.evaluate("placeOf(run)")
    assert after[:2] == pytest.approx([before[0] - 0.1, before[1] + 0.01], abs=1e-3)
    assert math.remainder(after[2] - before[2], 2 * math.pi) == pytest.approx(math.pi / 12, abs=1e-3)
    page.evaluate("act({ kind: 'place', x: -0.2, y: 1.05, heading: 0 })")  # an obstacle stands there
    wait_for(page, "!$('notice').hidden")
    assert "cannot stand" in page.inner_text("#notice")
    assert page.evaluate("placeOf(run)") == pytest.approx(after)


@pytest.mark.soak
def test_finger_drags_the_robot_on_a_phone(url: str, open_page: OpenPage) -> None:
    """Upwards, which elsewhere on the arena scrolls the page."""
    page = open_page(url, 390, 844)
    wait_for(page, "state !== null && arrivals.length > 2")
    touched = page.evaluate("state.touched")
    x, y = page.evaluate(AT_ROBOT)
    touch = page.context.new_cdp_session(page)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    for step in range(1, 8):
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x, "y": y - 4 * step}]})
    assert page.evaluate("isDragging()") and page.evaluate("scrollY") == 0
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    wait_for(page, f"state.touched > {touched} || !$('notice').hidden")


@pytest.mark.soak
def test_moving_shape_is_dragged(page: Page) -> None:
    page.click("#pause")
    wait_for(page, "state.paused && now === run.duration")
    page.evaluate("act({ kind: 'place', x: -1.5, y: -1.0, heading: 0 })")  # out of the way
    wait_for(page, "Math.hypot(placeOf(run)[0] + 1.5, placeOf(run)[1] + 1.0) < 0.02")
    touched = page.evaluate("state.touched")
    x, y = page.evaluate(AT_SHAPE)
    to_x, to_y = page.evaluate("[X(0.3) / ratio, Y(0.65) / ratio]")
    box = page.locator("#stage").bounding_box()
    assert box is not None
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(box["x"] + to_x, box["y"] + to_y, steps=3)
    page.mouse.up()
    wait_for(page, f"state.touched === {touched + 1}")
    page.click("#pause")
    wait_for(page, "!state.paused && Math.hypot(moving[0].at(now + run.begin)[0] - 0.3) < 0.15")


def test_parameters_are_sliders(page: Page) -> None:
    """Those of utilities are in a list that opens."""
    page.locator("#parameters summary").click()
    for name in ("wander.forward", "wander.utility.b"):
        least, most = page.evaluate(f"(({{input}}) => [+input.min, +input.max])({SLIDER % name})")
        value = least + 0.3 * (most - least)
        page.get_by_label(name, exact=True).fill(str(value))
        wait_for(page, f"Math.abs(state.robots[0].parameters['{name}'] - {value}) < 1e-6")


@pytest.mark.soak
def test_one_page_drives_at_a_time(page: Page, url: str, open_page: OpenPage) -> None:
    second = open_page(url)
    page.keyboard.down("w")
    wait_for(second, "$('driver').textContent === 'Another page drives by hand.'")
    second.keyboard.press("w")
    wait_for(second, "!$('notice').hidden")
    assert "another page drives" in second.inner_text("#notice")
    page.keyboard.up("w")


@pytest.mark.soak
def test_scrubbing_back_and_live_again(page: Page) -> None:
    page.focus("#slider")
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    held = page.evaluate("now")
    page.wait_for_timeout(300)
    assert page.evaluate("now") == held and page.get_attribute("#newest", "aria-pressed") == "false"
    page.click("#newest")
    wait_for(page, "run.duration - now < 0.5")
    page.focus("#cursor")
    page.keyboard.press("Home")
    assert page.evaluate("now") < 0.1
    page.keyboard.press("End")
    wait_for(page, "run.duration - now < 0.5")


@pytest.mark.soak
def test_restart_with_another_seed_and_without_an_imperfection(watched: Watched, open_page: OpenPage) -> None:
    page = open_page(watched.start("demo", "--robot", "shieldbot-charging", "--arena", "room", "--seconds", "900"))
    wait_for(page, "state !== null && run.duration > 1")
    page.click("#restart")
    page.fill("#seed", "7")
    box = page.locator("#restartDialog input[type=checkbox]:checked").first
    name = box.get_attribute("name")
    box.uncheck()
    page.keyboard.press("Enter")
    wait_for(page, "live.seed === 7")
    assert page.evaluate("run.duration") < 2 and "seed 7" in page.inner_text("#summary")
    assert [one["name"] for one in page.evaluate("live.imperfections") if one["off"]] == [name]
    summary = watched.stop()
    assert summary["seed"] == 7
    wait_for(page, "$('connection').dataset.kind === 'ended'")
    assert page.is_disabled("#pause")


@pytest.mark.soak
def test_what_cannot_be_done_is_absent(watched: Watched, open_page: OpenPage) -> None:
    """A run in real time does not stand still."""
    page = open_page(watched.start("wander", "--arena", "room", "--realtime", "--seconds", "900"))
    wait_for(page, "state !== null")
    assert [name for name in ("pause", "step", "speed") if page.locator(f"#{name}:visible").count()] == []
    assert page.is_visible("#stop") and page.is_visible("#drive")
    watched.running[-1].kill()


@pytest.mark.soak
def test_lost_connection_is_one_sentence(watched: Watched, browser: Browser) -> None:
    page = browser.new_page()  # what Chromium itself says of a connection refused is on its console
    page.goto(watched.start("wander", "--arena", "room", "--seconds", "900"))
    wait_for(page, "state !== null")
    watched.running[-1].kill()
    wait_for(page, "$('connection').dataset.kind === 'lost'")
    assert page.inner_text("#connection").startswith("Connection lost")
    assert page.is_disabled("#pause") and not page.is_disabled("#newest")
    page.close()


@pytest.mark.soak
def test_interventions_are_counted(watched: Watched, url: str, page: Page) -> None:
    """The last one of this run: what the page says is what the run says."""
    page.keyboard.press("w")
    time.sleep(0.5)
    touched = page.evaluate("state.touched")
    assert touched > 0 and f"touched: {touched}" in page.inner_text("#connection")
    assert page.evaluate("run.events.some(event => event.kind === 'intervention')")
