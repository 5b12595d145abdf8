"""How sub-commands print: tables for people, JSON for programs, a progress bar for runs that take longer than 2 s."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from boebot import figures
from boebot.driving import Progress

BAR_AFTER_S = 2.0
STEP_S = 5.0  # a step of a brain that takes longer is spoken of
_GAP = 3  # between the columns of a table
_INDENT = 4  # of a sentence below its row
_SENTENCE_LEAST = 40  # columns that a sentence beside its row wants


def say(sentence: str) -> None:
    """What a user should know, on standard error."""
    print(f"boebot: {sentence}", file=sys.stderr, flush=True)


def print_json(values: Mapping[str, Any]) -> None:
    """One JSON object on standard output, at once: a program may be waiting for it."""
    print(json.dumps(values, indent=1), flush=True)


def print_table(values: Mapping[str, Any]) -> None:
    """Names, values and units as a table on standard output; what is not known is left out."""
    from rich.console import Console

    Console().print(table(values))


def table(values: Mapping[str, Any]) -> Any:
    """The same as a `rich.table.Table`."""
    from rich import box
    from rich.table import Table

    rows = Table(box=box.SIMPLE_HEAD, show_header=False, pad_edge=False)
    rows.add_column(style="dim")
    rows.add_column(justify="right", overflow="fold")
    rows.add_column(style="dim")
    for row in figures.rows(values):
        rows.add_row(*row)
    return rows


def print_rows(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """A table with a header; the second column holds numbers, the last one sentences. Where the terminal is too narrow
    for those beside the rest, each stands below its row."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console()
    widths = [max(len(row[index]) for row in (header, *rows)) for index in range(len(header) - 1)]
    beside = console.width - sum(widths) - _GAP * len(widths) >= _SENTENCE_LEAST
    if beside:
        printed = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        for index, title in enumerate(header):
            printed.add_column(title, justify="right" if index == 1 else "left", no_wrap=index < len(widths))
        for row in rows:
            printed.add_row(*row)
        console.print(printed)
        return

    def line(cells: Sequence[str]) -> str:
        placed = (
            cell.rjust(width) if index == 1 else cell.ljust(width)
            for index, (cell, width) in enumerate(zip(cells, widths, strict=False))
        )
        return (" " * _GAP).join(placed).rstrip()

    console.print(line(header), style="bold", highlight=False)
    for row in rows:
        console.print(line(row), highlight=False)
        for part in textwrap.wrap(row[-1], max(console.width - _INDENT, _SENTENCE_LEAST)):
            console.print(" " * _INDENT + part, style="dim", highlight=False)


@contextlib.contextmanager
def progress_bar(title: str, seconds: float) -> Iterator[Progress]:
    """Gives a function to call with the seconds that have passed; shows a bar once 2 s of wall time have gone by."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn(title),
        BarColumn(),
        TextColumn("{task.completed:.0f} s" if math.isinf(seconds) else "{task.completed:.0f} of {task.total:g} s"),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task("run", total=None if math.isinf(seconds) else seconds)
    begun = time.monotonic()
    shown = False

    def report(passed: float) -> None:
        nonlocal shown
        if not shown and time.monotonic() - begun > BAR_AFTER_S:
            bar.start()
            shown = True
        bar.update(task, completed=passed)

    try:
        yield report
    finally:
        if shown:
            bar.stop()


@contextlib.contextmanager
def share_bars(names: Sequence[str]) -> Iterator[Callable[[Mapping[str, float]], None]]:
    """Gives a function to call with the shares that are done, 0 to 1, by name. Shows a bar for each that is under way
    and one for all, once 2 s of wall time have gone by."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    bars = Progress(*columns, console=Console(stderr=True), transient=True)
    overall = bars.add_task(f"{len(names)} experiments", total=len(names), visible=len(names) > 1)
    tasks = {name: bars.add_task(name, total=1.0, visible=False, start=False) for name in names}
    done = dict.fromkeys(names, 0.0)
    timer = threading.Timer(BAR_AFTER_S, bars.start)
    timer.daemon = True

    def report(shares: Mapping[str, float]) -> None:
        for name, share in shares.items():
            if not bars.tasks[tasks[name]].started:
                bars.start_task(tasks[name])
            done[name] = share
            bars.update(tasks[name], completed=share, visible=share < 1.0)
        bars.update(overall, completed=sum(done.values()))

    timer.start()
    try:
        yield report
    finally:
        timer.cancel()
        timer.join()
        bars.stop()


@contextlib.contextmanager
def step_watch(progress: Progress) -> Iterator[Progress]:
    """Gives a function to call in place of `progress`; says so once if it is not called again for 5 s."""
    called_at = math.inf  # the run has not begun
    ended = threading.Event()

    def report(passed: float) -> None:
        nonlocal called_at
        called_at = time.monotonic()
        progress(passed)

    def watch() -> None:
        while not ended.wait(0.1):
            if time.monotonic() - called_at > STEP_S:
                sentence = f"the brain has been in its step for {STEP_S:g} s; Ctrl-C ends it"
                print(f"boebot: {sentence}", file=sys.stderr, flush=True)
                return

    threading.Thread(target=watch, daemon=True).start()
    try:
        yield report
    finally:
        ended.set()
