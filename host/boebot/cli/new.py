"""`boebot new NAME`: writes a brain to start from: a first one, one that runs from top to bottom, or one of several
behaviors; or copies a bundled sketch."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from boebot.brains import bundled
from boebot.cli import output
from boebot.errors import BoebotError, BrainError, CallError, did_you_mean
from boebot.sketches import NAMES, sketch


def template(kind: str, name: str) -> str:
    """The text of a brain of that name: a "step", a "main" or a "brain" of processes, as in new_*.txt here."""
    return Path(__file__).with_name(f"new_{kind}.txt").read_text(encoding="utf-8").replace("NAME", name)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Letters, digits and underscores.")],
    brain: Annotated[bool, typer.Option("--brain", help="A brain of several behaviors, chosen by utility.")] = False,
    main: Annotated[bool, typer.Option("--main", help="A brain that runs from top to bottom: main(robot).")] = False,
    from_sketch: Annotated[
        bool,
        typer.Option(
            "--sketch", help="A copy of the bundled sketch of that name, NAME/NAME.ino; `boebot list sketches` has all."
        ),
    ] = False,
) -> None:
    """Write a brain, NAME.py, or a sketch for the Uno, to start from."""
    if from_sketch:
        if brain or main:
            raise CallError("--sketch copies a sketch, --brain and --main write a brain; expected one of them")
        _copy_sketch(name)
        return
    if brain and main:
        raise BrainError("--brain and --main are two kinds of brain; expected one of them")
    stem = name.removesuffix(".py")
    if not stem.isidentifier():
        raise BrainError(f"{stem!r} cannot be a brain's name; expected letters, digits and underscores")
    if stem in bundled():
        raise BrainError(f"{stem!r} is the name of a bundled brain; expected another one")
    path = Path(f"{stem}.py")
    _write(path, template("brain" if brain else "main" if main else "step", stem))
    output.line(f"wrote {path}; now: boebot run {path} --view")


def _copy_sketch(name: str) -> None:
    if name not in NAMES:
        raise CallError(f"there is no sketch {name!r}; expected {', '.join(NAMES)}{did_you_mean(name, NAMES)}")
    found, path = sketch(name), Path(name, f"{name}.ino")
    _write(path, found.text)
    output.line(f"wrote {path}; now: boebot run {path} --robot {found.robot} --arena {found.arena} --view")


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(exist_ok=True)
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError as error:  # the file, or one that has the folder's name
        raise BoebotError(f"{error.filename} exists already; it was left as it is") from None
    except OSError as error:
        raise BoebotError(f"{path} cannot be written: {error.strerror}") from None
