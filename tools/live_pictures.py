"""Films the live view for the documentation: a run of the demonstration brain, in real time, in Chromium.

    python -m tools.live_pictures

Writes docs/images/live.gif, in which the pointer drags the robot once, and docs/images/live-*.png. It needs Chromium
and playwright (the extra `browser`).
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

PROJECT = Path(__file__).resolve().parents[1]
IMAGES = PROJECT / "docs" / "images"
FOLDER = PROJECT / "build" / "pictures"
ROBOT, ARENA, SEED = "shieldbot-charging", "station", 1
FILMED_S = 15.0  # length of the run that is filmed
WIDTH, HEIGHT = 900, 800  # pixels
BEGIN_S = 2.0  # of the film, by the run's time
MOVE_S = 4.0  # when the pointer begins to move
AFTER_S = 4.5  # for which the film goes on once the robot is elsewhere
GOAL = (0.6, -0.1)  # m, where it puts it
COLOURS = 256
LAST_S = 0.5  # that the film's last picture stays
LONGEST_S = 60.0  # of waiting
Place = tuple[float, float]  # on the page (pixels)
SEVERAL = re.compile(r"^```python\n(# two\.py:.*?)^```$", re.MULTILINE | re.DOTALL)
"""The README's brain of several behaviors."""
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")  # where no browser is to open by itself

_POINTER = """() => {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  const arrow = document.createElementNS("http://www.w3.org/2000/svg", "path");
  arrow.setAttribute("d", "M1 1 L1 19 L6 14.5 L9.5 22 L12.5 20.6 L9.2 13.4 L15.5 13 Z");
  for (const [name, value] of [["fill", "#10141b"], ["stroke", "#fff"], ["stroke-width", "1.4"]])
    arrow.setAttribute(name, value);
  svg.append(arrow);
  Object.assign(svg.style, { position: "fixed", left: 0, top: 0, width: "18px", height: "25px", zIndex: 9,
    pointerEvents: "none" });
  document.body.append(svg);
  const move = event => { svg.style.transform = `translate(${event.clientX - 1}px, ${event.clientY - 1}px)`; };
  addEventListener("pointermove", move, true);
}"""
"""Chromium without a window draws no pointer."""
_AT = """([x, y]) => { const box = $("stage").getBoundingClientRect();
  return [box.x + X(x) / ratio, box.y + Y(y) / ratio]; }"""
"""Where a place of the arena (m) is on the page (pixels)."""


@contextlib.contextmanager
def watched(name: str, *arguments: str) -> Iterator[str]:
    """A run of the command with a live view, into a folder of that name; gives the page's address. It ends with the
    block."""
    environment = {key: value for key, value in os.environ.items() if key not in DISPLAYS}
    command = [sys.executable, "-m", "boebot", "run", *arguments, "--view", "--out", str(FOLDER / name)]
    process = subprocess.Popen(command, text=True, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, env=environment)
    assert process.stderr is not None
    try:
        for said in process.stderr:
            if found := re.search(r"http://\S+", said):
                yield found[0]
                break
        else:
            raise SystemExit("live_pictures.py: the run has not said where its page is")
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


def opened(browser: Browser, url: str, width: int, height: int, **options: Any) -> Page:
    """The page of a run that has begun, in a window of that size (pixels)."""
    page = browser.new_context(viewport={"width": width, "height": height}, **options).new_page()
    page.goto(url)
    until(page, "run !== null && run.duration > 0.1")
    return page


def until(page: Page, expression: str) -> None:
    """Waits until it is true on the page."""
    end = time.perf_counter() + LONGEST_S
    while not page.evaluate(expression):
        if time.perf_counter() > end:
            raise SystemExit(f"live_pictures.py: {expression} is not so on the page after {LONGEST_S:g} s")
        page.wait_for_timeout(20)


def at_robot(page: Page) -> Place:
    """Where the robot is on the page (pixels)."""
    x, y = page.evaluate(_AT, page.evaluate("placeOf(run).slice(0, 2)"))
    return x, y


class Film:
    """Pictures of a page, taken again and again while something goes on there."""

    def __init__(self, page: Page) -> None:
        self.page, self.pictures, self.times = page, list[Image.Image](), list[float]()

    def take(self) -> None:
        """One picture."""
        self.times.append(time.perf_counter())
        self.pictures.append(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))

    def until(self, seconds: float) -> None:
        """Films until that time of the run."""
        while self.page.evaluate("now") < seconds:
            self.take()

    def glide(self, begin: Place, end: Callable[[], Place], seconds: float) -> None:
        """The pointer goes there as a hand would, slowly at first and at last."""
        begun = time.perf_counter()
        while (part := min(1.0, (time.perf_counter() - begun) / seconds)) < 1.0:
            eased = part * part * (3 - 2 * part)
            self.page.mouse.move(*(a + eased * (b - a) for a, b in zip(begin, end(), strict=True)))
            self.take()
        self.page.mouse.move(*end())

    def write(self, path: Path) -> None:
        """As an animated picture that begins anew at its end, with the most frequent colours of a few as they are: the
        page has few, and edges of letters between them."""
        counts: Counter[tuple[int, int, int]] = Counter()
        for one in self.pictures[:: len(self.pictures) // 3]:
            for count, colour in one.getcolors(WIDTH * HEIGHT) or []:
                counts[colour] += count  # type: ignore[index]
        palette = Image.new("P", (1, 1))
        palette.putpalette([part for colour, _ in counts.most_common(COLOURS) for part in colour])
        first, *others = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in self.pictures)
        ends = [*self.times[1:], self.times[-1] + LAST_S]
        lasting = [round(1000 * (end - begin)) for begin, end in zip(self.times, ends, strict=True)]
        first.save(path, save_all=True, append_images=others, duration=lasting, loop=0, optimize=True)


def film(page: Page) -> Film:
    """A stretch of a run, in which the robot is dragged once."""
    page.evaluate(_POINTER)
    page.click("#shorter")
    begin = (0.72 * WIDTH, 0.38 * HEIGHT)  # where it is in the way of nothing
    page.mouse.move(*begin)
    taken = Film(page)
    until(page, f"now >= {BEGIN_S}")
    taken.until(MOVE_S)
    taken.glide(begin, lambda: at_robot(page), 0.8)
    page.mouse.down()
    goal = tuple(page.evaluate(_AT, GOAL))
    taken.glide(at_robot(page), lambda: goal, 1.2)
    page.mouse.up()
    end_s = page.evaluate("now") + AFTER_S
    taken.glide(goal, lambda: begin, 0.9)
    taken.until(end_s)
    return taken


def stills(browser: Browser) -> None:
    """A page in an arena with all there is; the cards for driving by hand and for a brain's parameters."""
    with watched("showcase", "demo", "--robot", ROBOT, "--arena", "showcase", "--seconds", "3600") as url:
        page = opened(browser, url, 1280, 900)
        until(page, "now >= 14")
        page.screenshot(path=IMAGES / "live-page.png")
        page.close()
    several = FOLDER / "two.py"
    found = SEVERAL.search((PROJECT / "README.md").read_text(encoding="utf-8"))
    assert found is not None
    several.write_text(found[1], encoding="utf-8")
    with watched("several", str(several), "--seconds", "3600") as url:
        page = opened(browser, url, 1280, 2400)
        page.locator("#parameters").screenshot(path=IMAGES / "live-parameters.png")
        page.keyboard.down("w")
        until(page, "$('driver').textContent === 'You drive.'")
        page.locator("#drive").screenshot(path=IMAGES / "live-hand.png")
        page.keyboard.up("w")
        page.close()


def main() -> None:
    """Writes all of them."""
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise SystemExit("live_pictures.py: there is no Chromium; expected Debian's package chromium")
    from playwright.sync_api import sync_playwright

    with (
        sync_playwright() as playwright,
        contextlib.closing(playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])) as browser,
    ):
        run = ("demo", "--robot", ROBOT, "--arena", ARENA, "--seed", str(SEED), "--seconds", f"{FILMED_S:g}")
        with watched("live", *run) as url:
            page = opened(browser, url, WIDTH, HEIGHT)
            taken = film(page)
            until(page, "ended !== null")
            page.close()
        taken.write(IMAGES / "live.gif")
        stills(browser)


if __name__ == "__main__":
    main()
