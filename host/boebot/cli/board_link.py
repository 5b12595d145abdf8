"""The link to a board for sub-commands that look at it and move nothing; and what `boebot doctor` shows of it: with
--identity who is there, with --watch what both ends count, how fast the link is, how well the board's clock is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from boebot.boards import BoardRequest, open_board
from boebot.cli import output
from boebot.description.robots import RobotDescription
from boebot.errors import BoardError
from boebot.link import finding, messages
from boebot.link.frame import text
from boebot.link.link import Link
from boebot.link.transport import BaudSelectable, Measures

_PERIOD_S = 1.0
_WAIT_S = 0.05
_CYCLES_PER_S = 16_000_000
_TABLES = ("host", "board_end", "task_longest_s")


@contextmanager
def board_link(url: str, request: BoardRequest) -> Iterator[tuple[Link, str]]:
    """A session with the board, for as long as the block lasts, and the board in a few words. The link's sentences for
    the user are printed when they come at the opening, and else at the end.

    Raises:
        BoebotError: no board answers there.
    """
    session = open_board(url, request)
    try:
        link = Link(session.transport)
        link.open()
        _say(link)
        yield link, session.description
        link.close()
        _say(link)
    finally:
        session.close()


def _say(link: Link) -> None:
    for notice in link.notices:
        output.say(notice)
    link.notices.clear()


# ---- who is there ----------------------------------------------------------------------------------------------------


def show_identity(url: str, robot: RobotDescription, as_json: bool) -> None:
    """Says who is at a port: firmware, compiler, image, devices."""
    with board_link(url, BoardRequest(robot=robot, record=False)) as (link, description):
        hello = link.open()
        identity = link.identity()
        values: dict[str, Any] = {
            "board": description,
            "robot": text(hello.robot),
            "protocol_version": finding.version_name(hello.protocol_version),
            "schema": f"{hello.schema_hash:08x}",
            "firmware": text(identity.firmware_version),
            "compiler": text(identity.compiler),
            "pin_map": text(identity.pin_map),
            "image_size_bytes": identity.image_size or None,
            "image_hash": f"{identity.image_hash:08x}" if identity.image_size else None,
            "tick_rate_hz": hello.tick_rate,
            "telemetry_period_s": round(hello.telemetry_period / hello.tick_rate, 6),
            "session_time_out_s": hello.session_time_out / 1000,
            "boot_counter": hello.boot_counter,
            "reset_cause": finding.reset_in_words(hello.reset_cause),
            "parameters_saved": bool(hello.parameters_saved),
            "devices": [
                device.name.lower() for device in messages.Devices if hello.devices & device and device.name is not None
            ],
        }
        names = [name for name in link.parameters.names if name not in messages.DEVICES_PARAMETERS]
        parameters = {name: round(link.parameters.get(name), 6) for name in names}
        telemetry = _latest(link)
    values["supply_v"] = telemetry.supply / 1000 or None
    values["latch"] = _name(messages.Latch, telemetry.latch)
    values["uptime_s"] = round(telemetry.tick / hello.tick_rate, 2)
    values["status"] = [flag.name.lower() for flag in messages.Status if telemetry.status & flag and flag.name]
    if as_json:
        output.print_json(values | {"parameters": parameters})
        return
    output.print_table(values | {"status": values["status"] or "nothing to report"})
    output.print_table({f"{name}": f"{value:g} {messages.PARAMETERS[name].unit}" for name, value in parameters.items()})


def _latest(link: Link) -> messages.Telemetry:
    for _ in range(50):
        telemetry = link.poll(0.02)
        if telemetry:
            return messages.Telemetry.unpack(telemetry[-1][0])
    raise BoardError(f"the board at {link.transport.name} sends no telemetry")


def _name(kind: type[messages.Latch], value: int) -> str:
    return kind(value).name.lower().replace("_", " ")


# ---- what both ends count --------------------------------------------------------------------------------------------


def watch_link(url: str, robot: RobotDescription, seconds: float, as_json: bool) -> None:
    """Shows a table that stays in its place, or a JSON object every second."""
    with board_link(url, BoardRequest(robot=robot, record=False, realtime=True)) as (watched, _):
        _watch(watched, seconds, (lambda seen: output.print_json(seen, indent=None)) if as_json else _show)


def _watch(watched: Link, seconds: float, show: Callable[[dict[str, Any]], None]) -> None:
    """Polls for `seconds`; shows a look every second, and the last one."""
    now, decoder = watched.transport.now, watched.line.decoder
    begun = last = now()
    next_look, good = begun + _PERIOD_S, decoder.good
    events: list[str] = []
    while True:
        ended = now() - begun >= seconds
        if now() >= next_look or ended:
            show(look(watched, now() - last, decoder.good - good, events))
            last, good, events = now(), decoder.good, []
            next_look += _PERIOD_S
        if ended:
            return
        watched.poll(max(min(next_look - now(), _WAIT_S), 0.0))
        events += [str(event) for event in watched.events.fetch()]


def look(watched: Link, passed_s: float, frames: int, events: list[str]) -> dict[str, Any]:
    """All there is to be seen, by name, units in the names; frames and events came in the time that has passed."""
    hello, clock, trips = watched.session.hello, watched.clock.estimate, watched.clock.round_trips
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
        "frame_rate_hz": round(frames / passed_s, 1) if passed_s > 0 else None,
        "round_trip_p50_s": _rounded(trips.quantile(0.5)),
        "round_trip_p99_s": _rounded(trips.quantile(0.99)),
        "clock_offset_s": round(clock.offset, 6) if clock.bounded else None,
        "clock_drift": round(clock.drift, 8) if clock.bounded else None,
        "clock_bound_s": round(clock.bound, 7) if clock.bounded else None,
        "clock_restarts": clock.restarts,
        "events": events,
        "host": watched.counters().as_dict(),
        "board_end": dict(watched.board_counters.values) if watched.board_counters.received else None,
        "task_longest_s": {
            name: None if cycles is None else cycles / _CYCLES_PER_S for name, cycles in watched.task_times.items()
        },
    }


def _rounded(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds, 6)


def _show(seen: dict[str, Any]) -> None:
    """As tables, which stay in their place on a terminal."""
    if (screen := output.console()).is_terminal:
        screen.clear()
    output.print_table({name: value for name, value in seen.items() if name not in _TABLES})
    ends = host, board = seen["host"], seen["board_end"] or {}
    counted = ([name.replace("_", " "), *(f"{end.get(name, '')}" for end in ends)] for name in {**host, **board})
    output.print_columns(("counted", "host", "board"), counted, numbers=(1, 2))
    if any(seen["task_longest_s"].values()):  # the board takes times
        tasks = seen["task_longest_s"].items()
        longest = ([name, "" if took_s is None else f"{1e6 * took_s:,.0f}"] for name, took_s in tasks)
        output.print_columns(("task", "longest (µs)"), longest, numbers=(1,))
