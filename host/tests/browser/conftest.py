"""A real browser for the tests in this folder: Chromium, driven by playwright (the extra `browser`). Without one of
them they are skipped."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from browser.looks import OpenPage

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
PHONE = 500  # pixels; what is narrower has fingers


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("drives Chromium, which is not installed")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[OpenPage]:
    """Opens a page; at the test's end none of them may have said anything on the console."""
    with pages(browser) as opened:
        yield opened


@pytest.fixture(scope="module")
def open_shared(browser: Browser) -> Iterator[OpenPage]:
    """The same for pages that several tests share, up to the last one of their file."""
    with pages(browser) as opened:
        yield opened


@contextlib.contextmanager
def pages(browser: Browser) -> Iterator[OpenPage]:
    """Opens pages until the block ends."""
    from browser.looks import wait_for

    said: list[str] = []
    with contextlib.ExitStack() as contexts:

        def opened(url: str, width: int = 1280, height: int = 800, scheme: Any = "light") -> Page:
            finger = width < PHONE
            context = browser.new_context(
                viewport={"width": width, "height": height}, color_scheme=scheme, has_touch=finger, is_mobile=finger
            )
            contexts.callback(context.close)
            page = context.new_page()
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.goto(url)
            wait_for(page, "run !== null && run.time.length > 0")
            return page

        yield opened
    assert said == []
