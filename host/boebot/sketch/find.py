"""What a path is: an Arduino sketch or a PlatformIO project, and the files that belong to it.

As Arduino has it, a sketch is a folder with an .ino file of its name; all .ino files beside that are part of it, and so
is what lies in its folder `src`. A single .ino file that lies elsewhere is a sketch, too: many keep several in one
folder. Either takes the libraries in the folder `libraries` beside it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from boebot.errors import BoebotError, CallError, as_utf8
from boebot.files import regular

INO = (".ino", ".pde")  # the second is the name of before 2011
PROJECT = "platformio.ini"
CODE = (".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx", ".inc", ".ipp", ".tpp", ".S", ".s", ".def")
LIBRARIES = "libraries"
OF_LIBRARY = (*CODE, "library.properties", "library.json")  # how the names of a library's files end
NOT_BUILT = {"examples", "extras", "docs", "test", "tests"}  # folders of a library
_ODD = re.compile(r"""["'`$;\\\x00-\x1f]""")  # what PlatformIO takes in no file name
SIZE_MAXIMUM = 4 << 20  # bytes of a file


@dataclass(frozen=True, kw_only=True)
class Sketch:
    """A sketch, or a PlatformIO project.

    Attributes:
        name: of the sketch's main file, or of the project's folder.
        folder: where it lies, absolute.
        shown: that folder as the user named it.
        files: the sketch's, by their paths in the folder; none of a project, whose own file says them.
    """

    name: str
    folder: Path
    shown: Path
    files: Mapping[str, bytes] = field(default_factory=dict)


def find(path: Path) -> Sketch:
    """The sketch or project that a path means.

    Raises:
        CallError: there is none, or more than one.
        BoebotError: a file cannot be read.
    """
    try:
        if path.name == PROJECT:
            path = path.parent
        if (path / PROJECT).is_file():
            return Sketch(name=as_utf8(path.resolve().name), folder=path.resolve(), shown=path)
        if path.is_dir():
            return _sketch(path / _main(path), is_whole=True)
        if path.suffix not in INO or not path.is_file():
            raise CallError(f"there is no sketch {path}; expected an .ino file, or a folder with one")
        return _sketch(path, is_whole=path.stem == path.absolute().parent.name)
    except OSError as error:
        raise BoebotError(f"{error.filename or path} cannot be read: {error.strerror or error}") from None


def _inos(folder: Path) -> list[str]:
    return sorted(one.name for one in folder.iterdir() if one.suffix in INO and one.name[0] != "." and one.is_file())


def _main(folder: Path) -> str:
    inos, its = _inos(folder), folder.resolve().name
    named = [name for name in inos if Path(name).stem in (its, folder.absolute().name)]
    if not inos:
        raise CallError(f"{folder} is neither a sketch nor a PlatformIO project; expected an .ino file or {PROJECT}")
    if not named and len(inos) > 1:
        names = ", ".join(map(as_utf8, inos))
        raise CallError(f"{folder} holds several sketches, {names}; expected one of them, or one named {its}")
    return (named or inos)[0]


def _sketch(main: Path, *, is_whole: bool) -> Sketch:
    """`is_whole`: the folder is one sketch."""
    folder = main.parent
    inos = [folder / name for name in _inos(folder)] if is_whole else [main]
    beside = [one for one in folder.iterdir() if one.suffix in CODE and one.is_file()]
    within = [*below(folder / "src")] if is_whole else []
    files = sorted([*inos, *beside, *within, *below(folder / LIBRARIES, OF_LIBRARY, NOT_BUILT)])
    if odd := next((one for one in files if _ODD.search(one.name)), None):
        raise CallError(f"{odd} cannot be built: expected a file name without $, quotes, ; and \\")
    return Sketch(
        name=as_utf8(main.name),
        folder=folder.resolve(),
        shown=folder,
        files={one.relative_to(folder).as_posix(): regular(one, SIZE_MAXIMUM).read_bytes() for one in files},
    )


def below(folder: Path, endings: tuple[str, ...] = (*CODE, *INO), without: Collection[str] = ()) -> Iterator[Path]:
    """Files whose names end so, however deep, but for those in folders `without`, and in hidden ones."""
    for where, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name[0] != "." and name.lower() not in without]
        yield from (one for name in names if name.endswith(endings) and (one := Path(where, name)).is_file())
