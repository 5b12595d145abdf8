"""A run as a terminal shows it: five rows of what matters, and below them what should be zero and is not."""

from __future__ import annotations

from enum import Enum
from typing import Any

import typer

from boebot.cli import output
from boebot.record import figures
from boebot.record.result import RunResult, TogetherResult

ZERO = (
    "late_steps",
    "long_steps",
    "lost_frames",
    "bad_frames",
    "overruns",
    "dead_man_stops",
    "fallback_takeovers",
    "resets",
    "sessions_lost",
    "hung_at",
    "unrealisable",
)
"""Figures that should be zero, or nothing."""

HEADER = ("robot", "true distance (m)", "true contacts", "whisker touches", "brain")


_EARLY = "early, by an error"


class Detail(Enum):
    """How much is printed of a run."""

    FEW = "what matters"
    ALL = "all figures"
    NOTHING = "nothing but errors"
    JSON = "all figures as JSON"


def detail(*, json: bool, verbose: bool, quiet: bool) -> Detail:
    """By the options of that name; one of them at most."""
    chosen = [kind for kind, wanted in ((Detail.JSON, json), (Detail.ALL, verbose), (Detail.NOTHING, quiet)) if wanted]
    if len(chosen) > 1:
        raise typer.BadParameter("expected one of --json, --verbose and --quiet")
    return chosen[0] if chosen else Detail.FEW


def print_run(result: RunResult | TogetherResult, wanted: Detail, *, is_said: bool = False) -> None:
    """The table of a run, if any time has passed in it. JSON is for the caller, who knows its files. `is_said`: the
    sentence of the error that has ended it follows, and is not printed here."""
    robots = [result] if isinstance(result, RunResult) else result.robots
    several = len(robots) > 1
    if is_said and not any(robot.run_time for robot in robots):
        return
    if wanted is Detail.ALL:
        for number, robot in enumerate(robots, 1):
            if several:
                output.line(f"robot {number}")
            output.print_table(robot.table() | ({"ended": _EARLY} if is_said else {}))
            output.line("by this computer's clock:")
            output.print_table(robot.wall_clock())
    elif wanted is Detail.FEW:
        if several:
            output.print_rows(HEADER, [_row(number, robot) for number, robot in enumerate(robots, 1)])
        else:
            table = output.empty_table(show_header=False)
            table.add_column(style="dim")
            table.add_column(overflow="fold")
            for name, words in five_rows(robots[0]):
                table.add_row(name, _EARLY if is_said and name == "ended" else words)
            output.console().print(table)
        for number, robot in enumerate(robots, 1):
            if wrong := not_zero(robot):
                output.line(f"{f'robot {number}: ' if several else ''}expected none: {', '.join(wrong)}")


def five_rows(result: RunResult) -> list[tuple[str, str]]:
    """Name and words of each."""
    table = result.table()
    where = f" in {table['arena']}" if table["arena"] else ""
    changed = f", without {table['without']}" if table["without"] else ""
    changed += f", with {table['imperfections']}" if table["imperfections"] else ""
    faster = f", {result.real_time_factor:.3g} times real time" if result.real_time_factor else ""
