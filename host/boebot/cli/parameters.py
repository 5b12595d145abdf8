"""`boebot parameters`: the board's parameters, listed, read, set, saved and reset."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from typing import Annotated, Any

import typer

from boebot.boards import BoardRequest, is_live
from boebot.cli import options, output, quantity
from boebot.cli.board_link import board_link
from boebot.description.robots import load_robot
from boebot.link import messages
from boebot.link.link import Link
from boebot.link.parameter_requests import parameter_counts, parameter_spec

app = typer.Typer(
    help="List, read, set, save and reset the board's parameters.",
    no_args_is_help=True,
    add_completion=False,
    **options.SETTINGS,
)

Name = Annotated[str, typer.Argument(metavar="NAME", help="As `boebot parameters list` names it.")]


Save = Annotated[bool, typer.Option("--save", help="Also write all parameters to the board's EEPROM, at once.")]

_TELEMETRY_S = 1.0  # how long to wait for the first telemetry


@contextlib.contextmanager
def _link(on: str, robot: str, *, changes: bool = False) -> Iterator[Link]:
    """A session with the board, for as long as the block lasts. Nothing moves. Where parameters are to be changed, a
    reset by the opening is reported: it forgets those that were set before and not saved."""
    begun_s = time.perf_counter()
    with board_link(on, BoardRequest(robot=load_robot(robot), record=False)) as (link, _):
        if changes and is_live(on) and _was_reset_since(link, begun_s):
            output.say(
                f"opening {link.transport.name} has reset the board: it has the parameters that were saved, or its "
                "image's defaults; what was set and not saved is lost"
            )
        yield link


def _was_reset_since(link: Link, begun_s: float) -> bool:
    """Whether a live board's ticks began after that instant of `time.perf_counter()`; False if it sends none."""
    end_s = link.transport.now() + _TELEMETRY_S
    while link.telemetry.latest is None and link.transport.now() < end_s:
        link.poll(_TELEMETRY_S / 20)
    if link.telemetry.latest is None:
        return False
    up_s = messages.Telemetry.unpack(link.telemetry.latest).tick * link.session.tick_s
    return up_s <= link.transport.now() - begun_s


def _save(link: Link, on: str) -> None:
    link.parameters.save()
    if not is_live(on):
        output.say(f"the EEPROM of the emulated board {on!r} ends with this command, and all that is saved in it")


def _say_how_long(what: str, on: str, saved: bool) -> None:
    """Says how long a change lasts that is not saved."""
    if not saved:
        until = "until the board's next reset" if is_live(on) else "until this command ends, and its emulated board"
        output.say(f"{what} only {until}; --save keeps it")


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


def _show(name: str, value: float) -> None:
    output.line(f"{name} = {value:.9g} {parameter_spec(name).unit}")


@app.command("list")
def list_all(on: options.On = "native", robot: options.RobotName = "shieldbot", json: options.Json = False) -> None:
    """All parameters: value, unit, range, meaning."""
    with _link(on, robot) as link:
        rows = [described(name, link.parameters.get(name)) for name in link.parameters.names]
        saved = bool(link.open().parameters_saved)
    if json:
        output.print_json({"saved": saved, "parameters": rows})
        return
    ranges = [f"{row['least']:.9g} … {row['greatest']:.9g}: {row['meaning']}" for row in rows]
    cells = ((row["name"], f"{row['value']:.9g}", row["unit"], text) for row, text in zip(rows, ranges, strict=True))
    output.print_columns(("parameter", "value", "unit", "range and meaning"), cells, numbers=(1,), whole=3)
    output.line("in force at start: those that were saved" if saved else "in force at start: the image's defaults")


@app.command()
def get(name: Name, on: options.On = "native", robot: options.RobotName = "shieldbot") -> None:
    """One parameter's value."""
    parameter_spec(name)
    with _link(on, robot) as link:
        value = link.parameters.get(name)
    _show(name, value)


@app.command("set", context_settings={"ignore_unknown_options": True})  # a value may begin with a minus sign
def set_one(
    name: Name,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="In the parameter's unit, or with another: 50ms.")],
    on: options.On = "native",
    robot: options.RobotName = "shieldbot",
    save: Save = False,
) -> None:
    """Set a parameter until the board's next reset; --save keeps it. Opening a port resets most boards."""
    number = quantity.parse(value, parameter_spec(name).unit)
    parameter_counts(name, number)
    with _link(on, robot, changes=True) as link:
        now = link.parameters.set(name, number)
        if save:
            _save(link, on)
    _show(name, now)
    _say_how_long(f"{name} lasts", on, save)


@app.command("save")
def save_all(on: options.On = "native", robot: options.RobotName = "shieldbot") -> None:
    """Write all parameters to the board's EEPROM: they outlast resets and power cuts."""
    with _link(on, robot, changes=True) as link:
        _save(link, on)
    output.line("all parameters are saved")


@app.command("reset")
def reset_all(on: options.On = "native", robot: options.RobotName = "shieldbot", save: Save = False) -> None:
    """All parameters to the image's defaults, until the board's next reset; --save keeps that."""
    with _link(on, robot, changes=True) as link:
        link.parameters.reset()
        if save:
            _save(link, on)
    output.line(f"all parameters are reset{' and saved' if save else ''}")
    _say_how_long("the reset of the parameters lasts", on, save)
