"""`boebot doctor --watch`: what both ends of the link count, how fast it is, and how well the board's clock is
known, live."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from boebot.boards import BoardRequest
from boebot.cli import output
from boebot.cli.board_link import board_link
from boebot.description.robots import RobotDescription
from boebot.link import finding
from boebot.link.frame import text
from boebot.link.link import Link
from boebot.link.transport import BaudSelectable, Measures

_PERIOD_S = 1.0
_WAIT_S = 0.05
_CYCLES_PER_S = 16_000_000
_TABLES = ("host", "board_end", "task_longest_s")


def watch(url: str, robot: RobotDescription, seconds: float, as_json: bool) -> None:
    """Shows a table that stays in its place, or a JSON object every second."""
    with board_link(url, BoardRequest(robot=robot, record=False, realtime=True)) as (watched, _):
        if as_json:
            _watch(watched, seconds, lambda seen: output.print_json(seen, indent=None))
        else:
            _show_table(watched, seconds)


def _watch(watched: Link, seconds: float, show: Callable[[dict[str, Any]], None]) -> None:
    """Polls for `seconds`; shows a look every second, and the last one."""
    now = watched.transport.now
    begun = next_look = now()
    next_look += _PERIOD_S
    before = Rates(watched)
    while True:
        ended = now() - begun >= seconds
        if now() >= next_look or ended:
            show(look(watched, before))
            before = Rates(watched)
            next_look += _PERIOD_S
        if ended:
            return
        watched.poll(max(min(next_look - now(), _WAIT_S), 0.0))
        before.events += [str(event) for event in watched.events.fetch()]


class Rates:
    """Counts at one moment, to show how fast they grow."""

    def __init__(self, watched: Link) -> None:
        self.at_s = watched.transport.now()
        self.good = watched.line.decoder.good
        self.events: list[str] = []  # since then


def look(watched: Link, before: Rates) -> dict[str, Any]:
    """All there is to be seen, by name, units in the names."""
    hello, clock, trips = watched.session.hello, watched.clock.estimate, watched.clock.round_trips
    passed_s = watched.transport.now() - before.at_s
    transport = watched.transport
    return {
        "time_s": round(transport.now(), 3),
        "board": transport.name,
        "robot": None if hello is None else text(hello.robot),
        "baud": transport.baud if isinstance(transport, BaudSelectable) else None,
        **(transport.figures() if isinstance(transport, Measures) else {}),
        "session": None if hello is None or not watched.session.is_open else f"{hello.session:06x}",
        "telemetry_period_s": None if hello is None else round(hello.telemetry_period / hello.tick_rate, 6),
        "last_reset": None if hello is None else finding.reset_in_words(hello.reset_cause),
        "session_time_out_s": None if hello is None else hello.session_time_out / 1000,
        "frame_rate_hz": round((watched.line.decoder.good - before.good) / passed_s, 1) if passed_s > 0 else None,
        "round_trip_p50_s": _rounded(trips.quantile(0.5)),
        "round_trip_p99_s": _rounded(trips.quantile(0.99)),
        "clock_offset_s": round(clock.offset, 6) if clock.bounded else None,
        "clock_drift": round(clock.drift, 8) if clock.bounded else None,
        "clock_bound_s": round(clock.bound, 7) if clock.bounded else None,
        "clock_restarts": clock.restarts,
        "events": before.events,
        "host": watched.counters().as_dict(),
        "board_end": dict(watched.board_counters.values) if watched.board_counters.received else None,
        "task_longest_s": {
            name: None if cycles is None else cycles / _CYCLES_PER_S for name, cycles in watched.task_times.items()
        },
    }


def _rounded(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds, 6)


def _show_table(watched: Link, seconds: float) -> None:
    from rich.live import Live

    console = output.console()
    if not console.is_terminal:
        _watch(watched, seconds, lambda seen: console.print(_table(seen)))
        return
    with Live(console=console, auto_refresh=False) as live:
        _watch(watched, seconds, lambda seen: live.update(output.Escaped(_table(seen)), refresh=True))


def _table(seen: dict[str, Any]) -> Any:
    from rich.columns import Columns
    from rich.console import Group

    state = output.table({name: value for name, value in seen.items() if name not in _TABLES})
    counted = output.empty_table()
    counted.add_column("counted", style="dim")
    counted.add_column("host", justify="right")
    counted.add_column("board", justify="right")
    board = seen["board_end"] or {}
    for name in dict.fromkeys((*seen["host"], *board)):
        cells = [f"{end[name]:,}" if name in end else "" for end in (seen["host"], board)]
        counted.add_row(name.replace("_", " "), *cells)
    return Group(state, Columns([counted, _tasks(seen["task_longest_s"])], padding=(0, 4)))


def _tasks(longest_s: Mapping[str, float | None]) -> Any:
    """The longest time of each task, if the board takes any."""
    tasks = output.empty_table()
    tasks.add_column("task", style="dim")
    tasks.add_column("longest (µs)", justify="right")
    for name, took_s in longest_s.items():
        tasks.add_row(name, "" if took_s is None else f"{1e6 * took_s:,.0f}")
    return tasks if any(longest_s.values()) else ""
