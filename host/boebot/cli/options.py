"""Options that several sub-commands share, and what the shell completes them to."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from boebot.cli import quantity
from boebot.errors import BoebotError
from boebot.guests import PORTS, guests

SETTINGS: dict[str, Any] = {
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,
    "context_settings": {"help_option_names": ["-h", "--help"]},
}
"""Of everything that typer makes."""

# ---- what the shell offers when TAB is pressed: names of what is bundled, and files ----------------------------------

Complete = Callable[[str], list[str]]


def one_of(names: Callable[[], Iterable[str]], *suffixes: str) -> Complete:
    """These names; with suffixes also files of them, and folders to go on with."""

    def complete(incomplete: str) -> list[str]:
        found = [name for name in names() if name.startswith(incomplete)]
        if suffixes:
            head, slash, begun = incomplete.rpartition("/")
            for path in sorted(Path(head or slash or ".").glob(f"{begun}*")):
                if path.is_dir() or path.suffix in suffixes:
                    found.append(f"{head}{slash}{path.name}{'/' * path.is_dir()}")
        return found

    return complete


# Their modules are imported when TAB is pressed.
complete_robots = one_of(lambda: import_module("boebot.description.robots").robot_names(), ".toml")
complete_arenas = one_of(lambda: import_module("boebot.arenas").arena_names(), ".toml")
complete_brains = one_of(lambda: import_module("boebot.brains").bundled(), ".py", ".toml", ".ino", ".elf", ".hex")


# ---- options ---------------------------------------------------------------------------------------------------------

# Those of one kind, each named as its parameter; `says` is its help.


def time(says: str, least: float = -math.inf) -> Any:
    """A time (s), as a number or with a unit."""
    return typer.Option(metavar="TIME", parser=quantity.parser("s", least), help=says)


def port(says: str, least: int = 0) -> Any:
    """A TCP port."""
    return typer.Option(metavar="PORT", min=least, max=65535, help=says)


def robot(says: str) -> Any:
    """A robot's name or file."""
    return typer.Option(metavar="R", autocompletion=complete_robots, help=says)


def brain(says: str) -> Any:
    """A brain's name or file."""
    return typer.Option(metavar="BRAIN", autocompletion=complete_brains, help=says)


_PORTS = ", ".join(["/dev/ttyACM0", "serial:PORT", "socket://HOST:PORT", *(f"{name}:..." for name in guests(PORTS))])

On = Annotated[
    str,
    typer.Option(
        "--on",
        metavar="BOARD",
        help=f"avr, native, or a port: {_PORTS}.",
    ),
]
RunOn = Annotated[
    str | None,
    typer.Option(
        "--on",
        metavar="BOARD",
        help=f"avr, native, or a port: {_PORTS}; direct for a robot without a board. Else native, or direct.",
    ),
]
RobotName = Annotated[str, robot("Bundled robot or .toml file.")]
ArenaName = Annotated[
    str | None,
    typer.Option(metavar="A", autocompletion=complete_arenas, help="Bundled arena or .toml file (simulated runs)."),
]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Seed of the brain's chance and of the world's noise.")]
Period = Annotated[float | None, time("From step to step, as in 0.05 or 50ms; a multiple of the 10 ms tick.")]
Without = Annotated[
    str | None,
    typer.Option(
        "--without",
        metavar="NAME,...",
        help="Switch off imperfections of simulated robots; `boebot list switches` names them.",
    ),
]
Imperfections = Annotated[
    list[str] | None,
    typer.Option(
        "--imperfection",
        metavar="NAME=VALUE",
        help="Give an imperfection of simulated robots another magnitude, as in servo_lag_s=80ms; again for each "
        "further one; `boebot list imperfections` names them.",
    ),
]
RobotNumber = Annotated[
    int | None, typer.Option("--robot", metavar="N", min=1, help="Which robot of a run of several, from 1.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON in place of the table.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print all figures of the run.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]


def _speed(given: str | float) -> float:
    """Of "0.5", "10" or "max"."""
    if given == "max":
        return math.inf
    with contextlib.suppress(ValueError):
        if 0.01 <= float(given) <= 10_000:
            return float(given)
    raise typer.BadParameter(f"{given!r} is no speed; expected 0.01 to 10000, 1 for real time, or max")


View = Annotated[
    bool, typer.Option("--view", help="Show the run in the browser while it goes on, where people may interfere.")
]
Gdb = Annotated[
    int | None,
    port(
        "Let avr-gdb in at this TCP port of this computer; board and world stand still where it stops them. "
        "Emulated ATmega328P only.",
        least=1,
    ),
]
ServedView = Annotated[bool, typer.Option("--view", help="Show the robot in the browser meanwhile.")]
Speed = Annotated[
    float | None,
    typer.Option(
        "--speed",
        metavar="X",
        parser=_speed,
        help="With --view: how many times as fast as real time a simulated run goes at first, or max. Else 1.",
    ),
]
ViewPort = Annotated[int | None, port("With --view: port of the page, on loopback. Else any.")]


def magnitudes(given: list[str] | None) -> dict[str, float]:
    """Of "NAME=VALUE", with the unit of the imperfection or another.

    Raises:
        BoebotError: there is no such imperfection, or that is no magnitude of it.
    """
    if not given:
        return {}
    from boebot.imperfections import checked, imperfections, unknown  # here: the list of all commands needs none of it

    table = imperfections()
    found: dict[str, float] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or name in found:
            wrong = "twice" if equals else "without a value"
            raise BoebotError(f"--imperfection has {name!r} {wrong}; expected NAME=VALUE, once for each name")
        if name not in table:
            raise BoebotError(f"--imperfection: {unknown(name)}")
        try:
            found[name] = quantity.parse(value, table[name].unit)
        except BoebotError as error:
            raise BoebotError(f"--imperfection {name}: {error}") from None
    return checked(found, "--imperfection")


def names(text: str | None) -> tuple[str, ...]:
    """Of "NAME,NAME"."""
    return () if text is None else tuple(name.strip() for name in text.split(","))


@contextlib.contextmanager
def runner(
    *, view: bool, speed: float | None, port: int | None, waits: bool, types: bool = False
) -> Iterator[Callable[..., Any]]:
    """What carries out a request as `boebot.running.loop.execute` does, in the live view that those options want.
    `waits`: as of `run_viewed`. `types`: what is typed at the terminal goes to the program that drives the robot.

    Raises:
        BoebotError: the port is taken, or options of a live view are given without one.
    """
    typist: dict[str, Any] = {}
    if types:
        from boebot.cli.typist import Typist

        typist["onlooker"] = Typist()
    if not view:
        if speed is not None or port is not None:
            raise BoebotError("--speed and --view-port are of a live view; expected --view with them")
        from boebot.running.loop import execute

        yield functools.partial(execute, **typist)
        return
    from boebot.live.session import opened, run_viewed

    with opened(port=port or 0, speed=None if speed == math.inf else speed or 1.0) as page:
        yield functools.partial(run_viewed, page, waits=waits, **typist)
