"""A run where somebody looks at it: its page in a browser or within a notebook, its picture within a notebook."""

from __future__ import annotations

import base64
import html
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from boebot.errors import BoebotError
from boebot.view import picture, replay
from boebot.view.display import browse, published

if TYPE_CHECKING:
    from boebot.record.run import Run
    from boebot.view.picture import Sheet

FRAME_HEIGHT = 680  # pixels: the page fills what it is given


def drawn(robots: Sequence[Run], error: BaseException | None) -> Sheet:
    """The picture of a run.

    Raises:
        BoebotError: no control tick of it is known.
    """
    _check(robots)
    return picture.draw(robots, error)


def play(results: Sequence[Run]) -> Path | None:
    """Shows the page of the robots of a run: in a notebook below the cell. Elsewhere it is written to a temporary file,
    and opened in the browser where there is a display; returns its path.

    Raises:
        BoebotError: as `drawn`.
    """
    _check(results)
    page = replay.page_text([result for result in results if result.ticks])
    if published(html_frame(page), "<replay of the run>"):
        return None
    path = Path(tempfile.mkdtemp(prefix="boebot-")) / "replay.html"
    path.write_text(page, encoding="utf-8")
    browse(path.as_uri())
    return path


def html_image(sheet: Sheet) -> str:
    """A picture within HTML, which needs no file beside it."""
    data = base64.b64encode(sheet.png()).decode("ascii")
    return f'<img alt="the run from above" width="{sheet.width}" src="data:image/png;base64,{data}">'


def html_frame(page: str) -> str:
    """A page within HTML, which needs no file beside it. Its scripts run, and cannot reach what is around it."""
    opening = f'<iframe title="replay of the run" sandbox="allow-scripts" width="100%" height="{FRAME_HEIGHT}"'
    return f'{opening} style="border: 0" srcdoc="{html.escape(page)}"></iframe>'


def _check(results: Sequence[Run]) -> None:
    if not any(result.ticks for result in results):
        raise BoebotError("the run has no control tick that could be drawn; expected one that was recorded")
