"""`boebot faults`: what can fail in a run of a robot, for `boebot run --fault`, with units; and who notices it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from boebot.cli import options, output
from boebot.description.robots import load_robot
from boebot.devices.device import FaultKind
from boebot.errors import CallError
from boebot.running.faults import known

if TYPE_CHECKING:
    from boebot.running.noticed import Noticed

HEADINGS = ["fault", "verdict", "by whom, or why", "after", "wrong", "still"]


def faults(
    robot: Annotated[
        str, typer.Option("--robot", metavar="R", autocompletion=options.complete_robots, help="Whose.")
    ] = "shieldbot",
    table: Annotated[
        bool, typer.Option("--table", help="Run each of them once, simulated: who notices it, and when.")
    ] = False,
    json: options.Json = False,
) -> None:
    """List what can fail in a run of a robot: boebot run --fault NAME[=VALUE]@START[..END].

    A name such as whiskers.stuck is of all whiskers, whisker_left.stuck of one.
    """
    description = load_robot(robot)
    there = known(description)
    if not there:
        raise CallError(f"robot {robot!r} has nothing that can be made to fail; expected a robot with a board")
    names = names_of(there)
    if table:
        from boebot.running.noticed import noticed

        description.expect_kit()
        with output.progress_bar("faults", len(names), json, "") as progress:
            found = []
            for one in noticed(description, names):
                found.append(one)
                progress(len(found))
        rows, titles = [one._asdict() for one in found], HEADINGS
        texts = [row_of(one, there[one.fault][0]) for one in found]
    else:
        rows = [{"name": name, "of": list(whose), **kind._asdict()} for name, (kind, whose) in there.items()]
        titles, texts = ["name", "value", "when", "what happens"], [_listed(name, there[name][0]) for name in names]
    if json:
        output.print_json({"robot": robot, "faults": rows})
    else:
        output.print_columns(titles, texts, whole=1)


def names_of(there: Mapping[str, tuple[FaultKind, tuple[str, ...]]]) -> list[str]:
    """Of a robot's faults (`known`) those of whole groups, and of what belongs to none."""
    members = {one for _, whose in there.values() if len(whose) > 1 for one in whose}
    return [name for name, (_, whose) in there.items() if len(whose) > 1 or not members.issuperset(whose)]


def row_of(one: Noticed, kind: FaultKind) -> list[str]:
    """Of the table of who notices what, as in `HEADINGS`. "wrong": in that share of the steps a reading claims to be
    valid and is another than without the fault; "still": after that time the wheels stood still."""
    after, still = ("" if time_s is None else f"{time_s:.2f} s" for time_s in (one.after_s, one.still_s))
    wrong = "" if one.wrong is None else f"{one.wrong:.0%}"
    value = kind.words[:1] if kind.default is None else (f"{kind.default:g}{kind.unit}",)
    return ["=".join((one.fault, *value)), one.verdict, ", ".join(one.by), after, wrong, still]


def _listed(name: str, kind: FaultKind) -> list[str]:
    """With its range, or all words that there are."""
    value = ", ".join(kind.words)
    if kind.default is not None:
        value = f"{kind.default:g} {kind.unit}".rstrip() + f" ({kind.least:g} to {kind.most:g})"
    return [name, value, kind.when, kind.does]
