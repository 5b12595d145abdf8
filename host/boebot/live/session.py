"""A run with a live view, from its first page to its last restart."""

from __future__ import annotations

import contextlib
import html
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from boebot.errors import BoebotError
from boebot.imperfections import switched_off
from boebot.live import messages
from boebot.live.live_view import Heard, LiveView, RestartedError
from boebot.record.run_folder import RunFolder
from boebot.result import Result
from boebot.running.hands import Onlooker, Together
from boebot.running.loop import Progress, execute
from boebot.running.tasks import Request
from boebot.view.display import browse, published


@contextlib.contextmanager
def opened(*, port: int = 0, speed: float | None = 1.0) -> Iterator[LiveView]:
    """A live view, which is shown as the first run begins.

    Raises:
        BoebotError: the port is taken.
    """
    view = LiveView(show, port=port, speed=speed)
    try:
        yield view
    finally:
        view.close()


def show(url: str) -> None:
    """Says the address on standard error, and opens the page where there is a display. A notebook shows a link, for its
    kernel may run elsewhere."""
    link = f'<a href="{html.escape(url)}" target="_blank" rel="noopener">watch it drive</a>'
    if not published(link, f"watch it: {url}"):
        print(f"watch it: {url}", file=sys.stderr, flush=True)
        browse(url)


def run_viewed(
    view: LiveView,
    request: Request,
    progress: Progress | None,
    folder: RunFolder | None,
    *,
    waits: bool,
    onlooker: Onlooker | None = None,
) -> Any:
    """Runs what is requested, and again as often as a page asks for it; returns what came of the last run.

    Args:
        progress, folder: as of `boebot.running.loop.execute`.
        onlooker: who watches it besides, and may interfere.
        waits: at a run's end as long as a page is open, which may ask for another one.
    """
    result: Result | None = None
    everybody = view if onlooker is None else Together(onlooker, view)
    while True:
        try:
            with contextlib.redirect_stdout(Heard(view)):
                result = execute(request, progress, folder, everybody)
        except BoebotError as error:
            if result is None:
                raise
            result.error = error  # the run that was asked for last cannot begin; another one may be asked for
        if not isinstance(result.error, RestartedError):
            may_go_on = waits and not isinstance(result.error, KeyboardInterrupt)
            try:
                if not _ended(view, result, waits=may_go_on):
                    return result
            except KeyboardInterrupt:  # the run is over: what came of it is still to be written
                return result
        restart = view.take_restart()
        if restart is None:
            return result
        request = _afresh(request, restart)


def _ended(view: LiveView, result: Result, *, waits: bool) -> bool:
    """Tells all pages that the run has ended. Where another one may be asked for, waits until a page does, or none is
    open any more, and returns True."""
    robots = result.robots
    tables: list[dict[str, Any]] = [dict(robot.table()) for robot in robots]
    ended = str(tables[0]["ended"]) if result.error is None else str(result.error) or "interrupted"
    again = waits and robots[0].world is not None
    view.announce_end(tables, ended, again=again)
    if again:
        view.wait_for_restart()
    return again


def _afresh(request: Request, wanted: messages.Restart) -> Request:
    off = switched_off(wanted.without)
    members = [
        replace(
            member,
            without=tuple(wanted.without),
            imperfections={name: value for name, value in (member.imperfections or {}).items() if name not in off},
        )
        for member in request.members
    ]
    return replace(request, seed=wanted.seed, members=members)
