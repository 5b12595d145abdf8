"""What a person needs of a page who looks at it, or uses it without mouse or eyes: measured in the browser."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Page

    OpenPage = Callable[..., Page]

WIDTHS = (
    (390, 844),
    pytest.param((768, 1024), marks=pytest.mark.soak),
    (1280, 800),
    pytest.param((1920, 1080), marks=pytest.mark.soak),
)
CONTRAST = 4.5  # of text, WCAG AA
DRAWN_S = 5.0  # a computer that does much else draws late

_FAINT_TEXTS = """least => {
  const light = v => v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4;
  const luminance = ([r, g, b]) => 0.2126 * light(r) + 0.7152 * light(g) + 0.0722 * light(b);
  const channels = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const behind = it => { const c = channels(getComputedStyle(it).backgroundColor);
    return c.length === 4 && c[3] === 0 && it.parentElement ? behind(it.parentElement) : c; };
  const ownText = it => [...it.childNodes].some(child => child.nodeType === 3 && child.textContent.trim());
  return [...document.querySelectorAll("body *")]
    .filter(it => ownText(it) && it.getClientRects().length && !it.disabled)
    .map(it => { const [a, b] = [channels(getComputedStyle(it).color), behind(it)].map(luminance);
      return [it.id || it.textContent.slice(0, 20), (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05)]; })
    .filter(([, contrast]) => contrast < least);
}"""

_CONTROLS = """() => [...document.querySelectorAll("button, select, input, [tabindex]")]
  .filter(it => it.getClientRects().length && !it.disabled && it.tabIndex >= 0)
  .map((it, k) => {
    it.dataset.control = k;
    return [k, it.id, (it.ariaLabel || it.labels?.[0]?.textContent || it.textContent).trim()];
  })"""

_FOCUS = """() => { const it = document.activeElement, style = getComputedStyle(it);
  return [it.dataset.control ?? null, style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2]; }"""


def wait_for(page: Page, expression: str, seconds: float = 30.0) -> None:
    """Until it is true on the page. (Playwright's own way evaluates texts on the page, which its policy forbids.)"""
    end = time.perf_counter() + seconds
    while not page.evaluate(expression):
        assert time.perf_counter() < end, f"{expression} is not so after {seconds} s"
        page.wait_for_timeout(20)


def overflow(page: Page) -> tuple[int, int]:
    """By how many pixels the page is wider and higher than the window."""
    wide, high = page.evaluate(
        "[document.documentElement.scrollWidth - innerWidth, document.documentElement.scrollHeight - innerHeight]"
    )
    return wide, high


def faint_texts(page: Page) -> list[Any]:
    """Texts with too little contrast, each with it, once the page has been drawn with its present colours."""
    end = time.perf_counter() + DRAWN_S
    while found := page.evaluate(_FAINT_TEXTS, CONTRAST):
        if time.perf_counter() > end:
            break
        page.wait_for_timeout(50)
    return list(found)


def controls(page: Page) -> list[tuple[int, str, str]]:
    """Everything that can be used now: number, id and the name that a screen reader says."""
    return [tuple(one) for one in page.evaluate(_CONTROLS)]


def reached_by_tab(page: Page, count: int) -> dict[int, bool]:
    """The controls that come one after the other, by number, and whether one sees that they have the focus."""
    found = {}
    for _ in range(count):
        page.keyboard.press("Tab")
        number, is_seen = page.evaluate(_FOCUS)
        if number is not None:
            found[int(number)] = is_seen
    return found


_PIXELS = """(id, x, y, wide, high) => { // by way of a copy: a canvas that is read often draws in another way
  const it = document.getElementById(id), copy = document.createElement("canvas");
  copy.width = it.width; copy.height = it.height;
  const c = copy.getContext("2d", { willReadFrequently: true }); c.drawImage(it, 0, 0);
  return c.getImageData(x, y, wide ?? it.width, high ?? it.height).data;
}"""


def colours_of(page: Page, canvas: str) -> int:
    """How many colours there are in a canvas: in an empty one there is one."""
    count: int = page.evaluate(f"id => new Set(new Uint32Array(({_PIXELS})(id, 0, 0).buffer)).size", canvas)
    return count


def floor_at(page: Page, x: float, y: float) -> list[int]:
    """Red, green and blue of the arena's background at a place (m), 0 to 255."""
    found: list[int] = page.evaluate(
        f"([x, y]) => [...({_PIXELS})('floor', Math.round(X(x)), Math.round(Y(y)), 1, 1)].slice(0, 3)", [x, y]
    )
    return found
