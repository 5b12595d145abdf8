"""`boebot list WHAT`: what there is, with a line for each: robots, arenas, brains, sketches, behaviors,
imperfections, switches that take them away, and what guests add (boebot.guests).
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from boebot import behaviors
from boebot.arenas import arena_names, load_arena
from boebot.brain.process import MotorBehavior
from boebot.brains import bundled_files
from boebot.cli import options, output
from boebot.description.robots import RobotDescription, load_robot, robot_names
from boebot.errors import did_you_mean
from boebot.guests import LISTS, guests
from boebot.imperfections import imperfections, switches
from boebot.sketches import NAMES, sketch

Row = dict[str, Any]
KINDS = ("robots", "arenas", "brains", "sketches", "behaviors", "imperfections", "switches", *guests(LISTS))


def list_names(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="WHAT",
            autocompletion=options.one_of(lambda: KINDS),
            help=f"One of {', '.join(KINDS)}; without it all of them.",
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """List what is bundled, by the names that other commands and Python understand.

    Imperfections are set by --imperfection and in robots' files; switches take them away, by --without.
    """
    if what is not None and what not in KINDS:
        raise typer.BadParameter(
            f"there is no list of {what!r}; expected {', '.join(KINDS)}{did_you_mean(what, KINDS)}"
        )
    found = {name: _rows(name) for name in KINDS if what in (None, name)}
    if json:
        output.print_json(found)
        return
    for name, rows in found.items():
        if len(found) > 1:
            output.line(name)
        _print(rows)


def _rows(kind: str) -> list[Row]:
    rows: Callable[[], list[Row]] = _ROWS[kind] if kind in _ROWS else guests(LISTS)[kind].load()
    return rows()


def _print(rows: Sequence[Row]) -> None:
    if "neutral" in rows[0]:
        rows = [_in_short(row) for row in rows]
    titles = [title for title in ("name", "value", "title", "on") if title in rows[0]]  # more is in --json
    output.print_columns(titles, ([row[title] for title in titles] for row in rows), whole=1)


def _robots() -> list[Row]:
    found = (load_robot(name) for name in robot_names())
    return [{"name": one.name, "title": one.title, "on": _runs_on(one)} for one in found]


def _runs_on(robot: RobotDescription) -> str:
    if not robot.takes_brain:
        return "programs of your own"
    return "a board" if robot.has_board else "direct"


def _arenas() -> list[Row]:
    found = (load_arena(name).description for name in arena_names())
    return [{"name": one.name, "title": one.title} for one in found]


def _brains() -> list[Row]:
    return [{"name": name, "title": _first_line(path)} for name, path in sorted(bundled_files().items())]


def _first_line(path: Path) -> str:
    """What a brain's file says of itself: of a TOML file its first comment."""
    text = path.read_text(encoding="utf-8")
    said = (ast.get_docstring(ast.parse(text)) or "") if path.suffix == ".py" else text.removeprefix("# ")
    return said.partition("\n")[0]


def _sketches() -> list[Row]:
    found = (sketch(name) for name in NAMES)
    return [{"name": one.name, "title": one.title, "on": f"{one.robot} in {one.arena}"} for one in found]


def _behaviors() -> list[Row]:
    kinds = (getattr(behaviors, name) for name in behaviors.__all__)
    found = [kind for kind in kinds if issubclass(kind, MotorBehavior)]
    return [{"name": kind.__name__, "title": (inspect.getdoc(kind) or "").partition("\n")[0]} for kind in found]


def _imperfections() -> list[Row]:
    return [
        {"name": row.name, "value": row.value, "unit": row.unit, "title": row.what, "drawn": row.drawn}
        | {"switch": row.switch, "neutral": row.neutral if row.switch else None, "source": row.source}
        | {"of": list(row.of), "least": row.least, "most": row.most, "whole": row.whole}
        for row in imperfections().values()
    ]


def _in_short(row: Row) -> Row:
    """An imperfection in three columns."""
    value = "by its file" if row["value"] is None else f"{row['value']:g} {row['unit']}"
    drawn = f", drawn for each {row['drawn']}" if row["drawn"] else ""
    off = f"; without {row['switch']}: {row['neutral']:g}" if row["switch"] else ""
    return {"name": row["name"], "value": value, "title": f"{row['title']}{drawn}{off}"}


def _switches() -> list[Row]:
    return [{"name": name, "title": what} for name, what in switches().items()]


_ROWS: dict[str, Callable[[], list[Row]]] = {
    "robots": _robots,
    "arenas": _arenas,
    "brains": _brains,
    "sketches": _sketches,
    "behaviors": _behaviors,
    "imperfections": _imperfections,
    "switches": _switches,
}
