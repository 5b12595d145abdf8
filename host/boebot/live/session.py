"""A run with a live view, from its first page to its last restart."""

from __future__ import annotations

import contextlib
import os
import sys
import webbrowser
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, TypeVar

from boebot.live import messages
from boebot.live.live_view import Heard, LiveView, RestartedError
from boebot.record.result import RunResult, TogetherResult
from boebot.running.tasks import Request

Result = TypeVar("Result", RunResult, TogetherResult)


@contextlib.contextmanager
def opened(say: Callable[[str], None], *, port: int = 0, speed: float | None = 1.0) -> Iterator[LiveView]:
    """A live view, which is shown in the browser, where there is a display, as the first run begins. `say`: is then
    told its address.

    Raises:
        BoebotError: the port is taken.
    """
    view = LiveView(lambda url: show(url, say), port=port, speed=speed)
    try:
        yield view
    finally:
        view.close()


def show(url: str, say: Callable[[str], None]) -> None:
    """Tells the address, and opens the page where there is a display."""
    say(url)
    if has_display():
        with contextlib.suppress(webbrowser.Error):
            webbrowser.open(url)


def has_display() -> bool:
    """Somebody could see a browser."""
    return sys.platform in ("win32", "darwin") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def run_viewed(view: LiveView, request: Request, run: Callable[[Request], Result], *, waits: bool) -> Result:
    """Runs what is requested, and again as often as a page asks for it; returns what came of the last run.

    Args:
        run: carries out a request, with the view as its onlooker.
        waits: at a run's end as long as a page is open, which may ask for another one.
    """
    while True:
        with contextlib.redirect_stdout(Heard(sys.stdout, view)):
            result = run(request)
        restart = view.restart
        if not isinstance(result.error, RestartedError):
            restart = _ended(view, result, waits=waits and not isinstance(result.error, KeyboardInterrupt))
        if restart is None:
            return result
        request = _afresh(request, restart)


def _ended(view: LiveView, result: RunResult | TogetherResult, *, waits: bool) -> messages.Restart | None:
    """Tells all pages that the run has ended. Returns what a page asks for then."""
    robots = [result] if isinstance(result, RunResult) else result.robots
    tables: list[dict[str, Any]] = [dict(robot.table()) for robot in robots]
    ended = str(tables[0]["ended"]) if result.error is None else str(result.error) or "interrupted"
    again = waits and robots[0].world is not None
    view.announce_end(tables, ended, again=again)
    if not again:
        return None
    with contextlib.suppress(KeyboardInterrupt):
        return view.wait_for_restart()
    return None


def _afresh(request: Request, wanted: messages.Restart) -> Request:
    members = [replace(member, without=tuple(wanted.without)) for member in request.members]
    return replace(request, seed=wanted.seed, members=members)
