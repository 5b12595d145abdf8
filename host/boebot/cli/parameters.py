"""`boebot parameters`: the board's parameters, listed, read, set, saved and reset."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Annotated, Any

import typer

from boebot.boards import BoardRequest, open_board
from boebot.cli import options, output
from boebot.link import messages
from boebot.link.session import Link, parameter_counts, parameter_spec
from boebot.robots import load_robot

app = typer.Typer(help="List, read, set, save and reset the board's parameters.", no_args_is_help=True)

Name = Annotated[str, typer.Argument(metavar="NAME", help="As `boebot parameters list` names it.")]


@contextlib.contextmanager
def _link(on: str, robot: str) -> Iterator[Link]:
    """A session with the board, for as long as the block lasts. Nothing moves."""
    session = open_board(on, BoardRequest(robot=load_robot(robot), record=False))
    try:
        link = Link(session.transport, record=False)
        link.open()
        for notice in link.notices:
            output.say(notice)
        yield link
        link.close()
    finally:
        session.close()


def described(name: str, value: float) -> dict[str, Any]:
    """A parameter and its value, by name."""
    spec = parameter_spec(name)
    return {
        "name": name,
        "value": round(value, 9),
        "unit": spec.unit,
        "least": round(spec.minimum * spec.scale, 9),
        "greatest": round(spec.maximum * spec.scale, 9),
        "meaning": spec.doc,
    }


def _show(name: str, value: float, as_json: bool) -> None:
    if as_json:
        output.print_json(described(name, value))
    else:
        print(f"{name} = {value:.9g} {parameter_spec(name).unit}")


@app.command("list")
def list_all(on: options.On = "native", robot: options.RobotName = "shieldbot", json: options.Json = False) -> None:
    """All parameters: value, unit, range, meaning."""
    with _link(on, robot) as link:
        rows = [described(name, link.get_parameter(name)) for name in messages.PARAMETERS]
        assert link.hello is not None
        saved = bool(link.hello.parameters_saved)
    if json:
        output.print_json({"saved": saved, "parameters": rows})
        return
    output.print_rows(
        ("parameter", "value", "unit", "range", "meaning"),
        [
            (
                row["name"],
                f"{row['value']:.9g}",
                row["unit"],
                f"{row['least']:.9g} … {row['greatest']:.9g}",
                row["meaning"],
            )
            for row in rows
        ],
    )
    print("in force at start: those that were saved" if saved else "in force at start: the image's defaults")


@app.command()
def get(
    name: Name, on: options.On = "native", robot: options.RobotName = "shieldbot", json: options.Json = False
) -> None:
    """One parameter's value."""
    parameter_spec(name)
    with _link(on, robot) as link:
        value = link.get_parameter(name)
    _show(name, value, json)


@app.command("set", context_settings={"ignore_unknown_options": True})  # a value may begin with a minus sign
def set_one(
    name: Name,
    value: Annotated[float, typer.Argument(metavar="VALUE", help="In the parameter's unit.")],
    on: options.On = "native",
    robot: options.RobotName = "shieldbot",
    json: options.Json = False,
) -> None:
    """Set a parameter until the board's next reset; `save` keeps it."""
    parameter_counts(name, value)
    with _link(on, robot) as link:
        now = link.set_parameter(name, value)
    _show(name, now, json)


@app.command()
def save(on: options.On = "native", robot: options.RobotName = "shieldbot", json: options.Json = False) -> None:
    """Write all parameters to the board's EEPROM: they outlast resets and power cuts."""
    with _link(on, robot) as link:
        link.save_parameters()
    _done("saved", json)


@app.command()
def reset(on: options.On = "native", robot: options.RobotName = "shieldbot", json: options.Json = False) -> None:
    """All parameters to the image's defaults; what is saved stays until `save`."""
    with _link(on, robot) as link:
        link.reset_parameters()
    _done("reset", json)


def _done(what: str, as_json: bool) -> None:
    if as_json:
        output.print_json({what: True})
    else:
        print(f"all parameters are {what}")
