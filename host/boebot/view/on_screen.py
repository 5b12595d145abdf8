"""A run where somebody looks at it: its page in a browser, its picture within a notebook."""

from __future__ import annotations

import base64
import os
import sys
import tempfile
import webbrowser
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.errors import BoebotError
from boebot.view import picture, replay, together_picture

if TYPE_CHECKING:
    from boebot.record.result import RunResult, TogetherResult
    from boebot.view.sheet import Sheet


def drawn(result: RunResult) -> Sheet:
    """The picture of a run.

    Raises:
        BoebotError: no control tick of it is known.
    """
    _check([result])
    return picture.draw(result)


def drawn_together(result: TogetherResult) -> Sheet:
    """The picture of a run of several robots.

    Raises:
        BoebotError: as `drawn`.
    """
    _check(result.robots)
    return together_picture.draw(result)


def play(results: Sequence[RunResult]) -> Path:
    """Writes the page of the robots of a run to a temporary file, and opens it in the browser where there is a display.

    Raises:
        BoebotError: as `drawn`.
    """
    _check(results)
    path = Path(tempfile.mkdtemp(prefix="boebot-")) / "replay.html"
    replay.write([result for result in results if result.ticks], path)
    if has_display():
        webbrowser.open(path.as_uri())
    return path


def has_display() -> bool:
    """A browser can show something; on Linux and the like the environment says so."""
    return sys.platform in ("win32", "darwin") or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")))


def html_image(sheet: Sheet) -> str:
    """A picture within HTML, which needs no file beside it."""
    data = base64.b64encode(sheet.png()).decode("ascii")
    return f'<img alt="the run from above" width="{sheet.width}" src="data:image/png;base64,{data}">'


def _check(results: Sequence[RunResult]) -> None:
    if not any(result.ticks for result in results):
        raise BoebotError("the run has no control tick that could be drawn; expected one that was recorded")
