"""What the live view costs a run with a client that only reads, and how often Chromium redraws the page.

Chromium draws the page at 1280 × 800 and needs no display; playwright starts it (`pip install -e '.[browser]'`).
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from boebot.live.live_view import LiveView
from boebot.running.tasks import Member, Request
from tools.tests.bench.figures import Peer, figure, loop_s, ran

SECONDS = 400.0
SECONDS_IN_REAL_TIME = 10.0
LOOPS = Peer("loops of 50,000 turns in Python", lambda: 1.0 / loop_s(50_000))


def read(url: str) -> None:
    """Reads the stream of that page until it ends, and does nothing with it."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect
    from websockets.typing import Origin

    address, _, query = url.partition("/?")
    stream = f"{address.replace('http', 'ws', 1)}/stream?{query}"
    with contextlib.suppress(ConnectionClosed), connect(stream, origin=Origin(address), max_size=None) as connection:
        connection.send(json.dumps({"type": "hello"}))
        print("here", flush=True)
        while True:
            connection.recv(decode=False)


def draw(url: str) -> None:
    """Shows the page, and prints how often it drew its arena in a second."""
    import shutil

    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(url)
        print("here", flush=True)
        while page.evaluate("run === null || arrivals.length < 10"):
            page.wait_for_timeout(100)
        print(page.evaluate(_COUNT), flush=True)
        browser.close()


_COUNT = """() => new Promise(done => { const draw = drawStage; let count = 0; const begun = performance.now();
  drawStage = () => { count++; draw(); };
  setTimeout(() => { drawStage = draw; done(1000 * count / (performance.now() - begun)); }, 5000); })"""


@contextlib.contextmanager
def looking(how: Callable[[str], None], url: str) -> Iterator[list[str]]:
    """A process that looks at the page; at the end the list has what it has printed."""
    command = [sys.executable, "-c", f"from tools.tests.bench.live import {how.__name__}; {how.__name__}({url!r})"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        if process.stdout.readline().strip() != "here":
            raise RuntimeError(f"nobody can {how.__name__} the page of the live view here")
        printed: list[str] = []
        yield printed
        printed += process.communicate("enough\n", timeout=30)[0].split()


def faster(watched: bool) -> float:
    """How many times as fast as real time a run is; `watched`: somebody reads its stream."""
    request = Request.single("wander", arena="room", on="native", seconds=SECONDS, period=0.01)
    if not watched:
        return ran(request).real_time_factor or 0.0
    view = LiveView(lambda url: None, speed=None)
    with looking(read, view.url), contextlib.closing(view):
        return ran(request, onlooker=view).real_time_factor or 0.0


@figure("live view: unpaced native run with a client that reads, against one without", "×", at_least=0.8, rounds=9,
        of="median")  # fmt: skip
def with_a_reader() -> float:
    """Speed of a run that is watched, over that of the runs before and after it, which are not."""
    before, watched = faster(False), faster(True)
    return 2.0 * watched / (before + faster(False))


@figure(
    "live view: redraws of the page at 1280 × 800, three robots, one with a laser of 682 rays",
    "1/s",
    times_at_least=0.05,
    peers=[LOOPS],
)
def redraws() -> float:
    with tempfile.TemporaryDirectory() as folder:
        laser, brain = Path(folder) / "laser.toml", Path(folder) / "circle.py"
        laser.write_text("extends = 'roller'\nname = 'laser'\n[device.laser]\nrays = 682\nstep_rad = 0.006135923\n")
        brain.write_text("def step(robot):\n    robot.drive(0.3, 0.4)\n")
        members = [
            Member(brain=str(brain), robot=str(laser), pose=(-0.8, 0.0, 0.0)),
            Member(brain="wander", pose=(0.0, 0.8, 0.0)),
            Member(brain="demo", robot="shieldbot-charging", pose=(0.7, -1.1, 2.0)),
        ]
        request = Request(members=members, arena="room", seconds=SECONDS_IN_REAL_TIME)
        view = LiveView(lambda url: None)
        with looking(draw, view.url) as printed, contextlib.closing(view):
            ran(request, onlooker=view)
    return float(printed[0])
