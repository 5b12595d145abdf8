"""How sub-commands print: tables for people, JSON for programs, a progress bar for runs.

All that they print goes through `line`, `say`, `print_json` or a `console`: names and errors come from files, boards
and brains, and a control character in them would be an order to the terminal.
"""

from __future__ import annotations

import contextlib
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TextIO

from boebot.errors import printable

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment
    from rich.table import Table

    from boebot.running.loop import Progress


def line(text: str = "", file: TextIO | None = None) -> None:
    """A line for people, at once; on standard output if no file is given."""
    print(printable(text), file=file, flush=True)


def say(sentence: str) -> None:
    """What a user should know, on standard error."""
    line(f"boebot: {sentence}", sys.stderr)


def console(stderr: bool = False) -> Console:
    """What tables and bars are printed on: it highlights nothing by itself, and text is never mark-up."""
    from rich.console import Console, ConsoleRenderable, RenderHook

    class Printable(RenderHook):
        def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
            return [_Escaped(one) for one in renderables]

    made = Console(stderr=stderr, highlight=False, markup=False, emoji=False)
    made.push_render_hook(Printable())
    return made


@dataclass(frozen=True, slots=True)
class _Escaped:
    """What rich prints, its text through `printable`."""

    inside: Any

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        from rich.segment import Segment

        for text, style, control in console.render(self.inside, options):
            yield Segment(text if control else printable(text), style, control)


def print_json(values: Mapping[str, Any], indent: int | None = 1) -> None:
    """One JSON object on standard output, at once: a program may be waiting for it. What is no finite number is null,
    as JSON has none."""
    line(json.dumps(json.loads(json.dumps(values), parse_constant=lambda name: None), indent=indent))


def empty_table(**options: Any) -> Table:
    """A table without columns, as all of them look; `options` of `rich.table.Table`."""
    from rich import box
    from rich.table import Table

    return Table(box=box.SIMPLE_HEAD, pad_edge=False, **options)


def print_table(values: Mapping[str, Any]) -> None:
    """Names, values and units as a table on standard output; unknown values are left out."""
    console().print(table(values))


def table(values: Mapping[str, Any]) -> Table:
    """The same, not yet printed."""
    from boebot.record import figures  # here: what prints no figures loads no numpy

    rows = empty_table(show_header=False)
    rows.add_column(style="dim")
    rows.add_column(justify="right", overflow="fold")
    rows.add_column(style="dim")
    for row in figures.rows(values):
        rows.add_row(*row)
    return rows


def print_columns(
    titles: Sequence[str], rows: Iterable[Sequence[str]], *, numbers: Sequence[int] = (), whole: int = 0
) -> None:
    """A table with a header, if there are rows; which columns hold numbers, how many of the first are not wrapped."""
    printed = empty_table()
    for index, title in enumerate(titles):
        justify: Any = "right" if index in numbers else "left"
        printed.add_column(title, justify=justify, overflow="fold", no_wrap=index < whole)
    for row in rows:
        printed.add_row(*row)
    if printed.rows:
        console().print(printed)


@contextlib.contextmanager
def progress_bar(
    title: str,
    total: float,
    quiet: bool = False,
    unit: str = " s",
    *,
    left: bool = False,
    below: Callable[[], RenderableType] | None = None,
) -> Iterator[Progress]:
    """Gives a function to call with how much of the total is done, such as the seconds that have passed; shows a bar
    meanwhile, without numbers where `unit` is "", with `left` the time that the rest will take, and what `below` gives,
    often and in another thread."""
    if quiet or not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    class Bar(Progress):
        def get_renderables(self) -> Iterable[RenderableType]:
            return [*super().get_renderables(), *([below()] if below else [])]

    bar = Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        *([TextColumn(f"{{task.completed:.0f}}{'' if math.isinf(total) else f' of {total:g}'}{unit}")] if unit else []),
        TimeElapsedColumn(),
        *([TextColumn("left"), TimeRemainingColumn()] if left else []),
        console=console(stderr=True),
        transient=True,
    )
    task = bar.add_task(printable(title), total=None if math.isinf(total) else total)
    with bar:
        yield lambda passed: bar.update(task, completed=passed)
