"""--view: a run with a live view in the browser."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from boebot.cli import output
from boebot.errors import BoebotError
from boebot.running.tasks import Request

if TYPE_CHECKING:
    from boebot.boards import BoardRequest
    from boebot.live.live_view import LiveView
    from boebot.live.served_view import ServedView


def view(*, view: bool, speed: float | None, port: int | None) -> contextlib.AbstractContextManager[LiveView | None]:
    """The live view that those options want, open; None: none.

    Raises:
        BoebotError: the port is taken, or options of a live view are given without one.
    """
    if not view:
        if speed is not None or port is not None:
            raise BoebotError("--speed and --view-port are of a live view; expected --view with them")
        return contextlib.nullcontext()
    from boebot.live.controls import usual_speed
    from boebot.live.session import opened

    return opened(_tell, port=port or 0, speed=1.0 if speed is None else usual_speed(speed))


@contextlib.contextmanager
def served_view(request: BoardRequest, kind: str, *, view: bool, port: int | None) -> Iterator[ServedView | None]:
    """The same of a robot that is served on that kind of board.

    Raises:
        BoebotError: the port is taken, or is given without --view.
    """
    if not view:
        if port is not None:
            raise BoebotError("--view-port is of a live view; expected --view with it")
        yield None
        return
    from boebot.live.served_view import ServedView
    from boebot.live.session import show

    page = ServedView(request, kind, port=port or 0)
    try:
        show(page.url, _tell)
        yield page
    finally:
        page.close()


def run(page: LiveView, request: Request, run_all: Callable[[Request], Any], *, waits: bool = True) -> Any:
    """Runs it, and again as often as a page asks for that; `waits`: at the end as long as one is open."""
    from boebot.live.session import run_viewed

    return run_viewed(page, request, run_all, waits=waits)


def _tell(url: str) -> None:
    output.say(f"watch it: {url}")
