"""`boebot new NAME`: writes a brain to start from: a first one, one that runs from top to bottom, or one of several
behaviors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.brains import bundled
from boebot.cli import output
from boebot.errors import BrainError


def template(kind: str, name: str) -> str:
    """The text of a brain of that name: a "step", a "main" or a "brain" of processes, as in new_*.txt here."""
    return Path(__file__).with_name(f"new_{kind}.txt").read_text(encoding="utf-8").replace("NAME", name)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Letters, digits and underscores.")],
    brain: Annotated[bool, typer.Option("--brain", help="A brain of several behaviors, chosen by utility.")] = False,
    main: Annotated[bool, typer.Option("--main", help="A brain that runs from top to bottom: main(robot).")] = False,
) -> None:
    """Write a brain, NAME.py, to start from."""
    if brain and main:
        raise BrainError("--brain and --main are two kinds of brain; expected one of them")
    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise BrainError(f"{stem!r} cannot be a brain's name; expected letters, digits and underscores")
    if stem in bundled():
        raise BrainError(f"{stem!r} is the name of a bundled brain; expected another one")
    path = Path(f"{stem}.py")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template("brain" if brain else "main" if main else "step", stem))
    except FileExistsError:
        raise BrainError(f"{path} exists already; it was left as it is") from None
    except OSError as error:
        raise BrainError(f"{path} cannot be written: {error.strerror}") from None
    output.line(f"wrote {path}; now: boebot run {path} --view")
