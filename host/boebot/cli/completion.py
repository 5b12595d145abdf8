"""What the shell offers when TAB is pressed after an option or in place of an argument: names of what is bundled, and
files."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

Complete = Callable[[str], list[str]]


def robots(incomplete: str) -> list[str]:
    """Bundled robots, and TOML files."""
    from boebot.description.robots import robot_names

    return [*_beginning(incomplete, robot_names()), *_files(incomplete, ".toml")]


def arenas(incomplete: str) -> list[str]:
    """Bundled arenas, and TOML files."""
    from boebot.arenas import arena_names

    return [*_beginning(incomplete, arena_names()), *_files(incomplete, ".toml")]


def brains(incomplete: str) -> list[str]:
    """Bundled brains, and files that may hold one."""
    from boebot.brains import bundled

    return [*_beginning(incomplete, bundled()), *_files(incomplete, ".py", ".toml")]


def experiments(incomplete: str) -> list[str]:
    """Experiments of the notes."""
    from boebot.experiments import all_experiments

    return _beginning(incomplete, all_experiments())


def boards(incomplete: str) -> list[str]:
    """What robots with boards run on."""
    return [*_beginning(incomplete, ("native", "avr", "direct")), *_files(incomplete)]


def imperfections(incomplete: str) -> list[str]:
    """Names of imperfections, for a value to follow."""
    from boebot import imperfections as table

    return [f"{name}=" for name in _beginning(incomplete, table.imperfections())]


def one_of(*names: str) -> Complete:
    """These names."""
    return lambda incomplete: _beginning(incomplete, names)


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]


def _files(incomplete: str, *suffixes: str) -> list[str]:
    """Those of these suffixes, and folders to go on with; without suffixes all of them, once a path has begun."""
    head, slash, begun = incomplete.rpartition("/")
    if not suffixes and not slash:
        return []
    found = []
    for path in sorted(Path(head or slash or ".").glob(f"{begun}*")):
        if path.name.startswith(".") and not begun:
            continue
        if path.is_dir():
            found.append(f"{head}{slash}{path.name}/")
        elif not suffixes or path.suffix in suffixes:
            found.append(f"{head}{slash}{path.name}")
    return found
