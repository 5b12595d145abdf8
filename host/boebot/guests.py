"""What packages beside the core add to it. They join by entry points, each under a name in one of these groups:

    boebot.boards     a kind of emulated board       boebot.boards.WorldFactory
    boebot.servers    who offers emulated robots     boebot.boards.Server
    boebot.ports      a scheme of URLs               Callable[[str], Transport], given the whole URL
    boebot.commands   a sub-command                  Command
    boebot.lists      a list of `boebot list`        Callable[[], list[dict[str, Any]]]: rows with a name and a title
    boebot.formats    a format of `boebot report`    Callable[[Mapping[int, Run], Path], list[Path]]: it writes a file
                                                     of that name for robots, by their numbers, into a folder
    boebot.records    a foreign record, by suffix    boebot.guests.ReadRecord
    boebot.checks     what cannot be in time         boebot.running.tasks.Check
    boebot.bounds     what functions take at most    boebot.guests.BoundsOf
    boebot.functions  a function of `boebot`         Callable, named as in the package: boebot.NAME
    boebot.folders    a folder of many runs          Folder; the name is that of a file by which it is known

Nothing of a guest is imported before it is asked for. The entry points are looked up once per process; names of the
core come before those of guests.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NamedTuple, Protocol, cast

from boebot.errors import BoebotError

PORTS, COMMANDS, LISTS, FORMATS, RECORDS, CHECKS, BOUNDS, FUNCTIONS, FOLDERS = (
    f"boebot.{group}"
    for group in ("ports", "commands", "lists", "formats", "records", "checks", "bounds", "functions", "folders")
)


class Command(NamedTuple):
    """A sub-command. The entry point stands in a module that imports next to nothing: it is loaded for the list of
    all, the work only when the command is given."""

    line: str
    """In the list of all commands."""
    work: str
    """`module:name` of a function, or of a typer.Typer."""


class Folder(NamedTuple):
    """A kind of folder that holds many runs; each is `module:name`, imported when it is needed."""

    report: str
    """Prints what came of them, and draws it: called with the folder, and whether to print JSON."""
    request: str
    """The `boebot.running.tasks.Request` of one run: called with the folder and the run's number."""


def folder_of(path: Path) -> Folder | None:
    """The kind of a folder of many runs; None: it is none that is known."""
    found = (guest for name, guest in guests(FOLDERS).items() if (path / name).is_file())
    kind = next(found, None)
    return None if kind is None else cast(Folder, kind.load())


class ReadRecord(Protocol):
    """Reads a record that others have made, as far as a run shows in it."""

    def __call__(self, path: Path, robot: str | None, node: str | None, seed: int) -> Any:
        """The run of one board (a `boebot.record.run.Run`): of that kind (None: as it says itself), of that name
        there (None: the only one), with that seed of the brain's chance.

        Raises:
            BoebotError: it cannot be read.
        """


class BoundsOf(Protocol):
    """Works out how long functions of a program for the ATmega328P can take."""

    def __call__(self, image: Path, entries: Collection[int]) -> Mapping[int, int | str]:
        """For each function of an ELF file, by its first address: the most cycles from its first instruction to the
        end of its return, interrupts aside; or a sentence why there is no bound."""


class Guest(NamedTuple):
    """An entry point."""

    name: str
    place: str
    """`module:name`."""

    def load(self) -> Any:
        """What it names, imported.

        Raises:
            BoebotError: it is broken, or what it needs is not installed.
        """
        module, _, attribute = self.place.partition(":")
        try:
            return getattr(import_module(module), attribute)
        except BoebotError:
            raise
        except Exception as error:  # whatever a package does as it is imported
            raise BoebotError(
                f"{self.name!r} of an installed package cannot be loaded: {self.place}: {type(error).__name__}: {error}"
            ) from error


@cache
def guests(group: str) -> Mapping[str, Guest]:
    """The entry points of a group by name, in the order of their names."""
    return {one.name: Guest(one.name, one.value) for one in sorted(_all().select(group=group))}


_all = cache(entry_points)
