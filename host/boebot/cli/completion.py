"""What the shell offers when TAB is pressed after an option or in place of an argument: names of what is bundled, and
files."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

Complete = Callable[[str], list[str]]


def robots(incomplete: str) -> list[str]:
    """Bundled robots, and TOML files."""
    from boebot.description.robots import robot_names

    return [*beginning(incomplete, robot_names()), *_files(incomplete, ".toml")]


def arenas(incomplete: str) -> list[str]:
    """Bundled arenas, and TOML files."""
    from boebot.arenas import arena_names

    return [*beginning(incomplete, arena_names()), *_files(incomplete, ".toml")]


def brains(incomplete: str) -> list[str]:
    """Bundled brains, and files that may hold one."""
    from boebot.brains import bundled

    return [*beginning(incomplete, bundled()), *_files(incomplete, ".py", ".toml")]


def boards(incomplete: str) -> list[str]:
    """What robots with boards run on."""
    return [*beginning(incomplete, ("native", "avr", "direct")), *_files(incomplete)]


def imperfections(incomplete: str) -> list[str]:
    """Names of imperfections, for a value to follow."""
    from boebot import imperfections as table

    return [f"{name}=" for name in beginning(incomplete, table.imperfections())]


def one_of(*names: str) -> Complete:
    """These names."""
    return lambda incomplete: beginning(incomplete, names)


def beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    """Those of these names."""
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
