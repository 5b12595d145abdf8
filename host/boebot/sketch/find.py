"""What a path is: an Arduino sketch or a PlatformIO project, and the files that belong to it.

As Arduino has it, a sketch is a folder with an .ino file of its name; all .ino files beside that are part of it, and so
is what lies in its folder `src`. A single .ino file that lies elsewhere is a sketch, too: many keep several in one
folder. Either takes the libraries in the folder `libraries` beside it.
"""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
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
    """A sketch's files.

    Attributes:
        name: of its main file.
        folder: where it lies, absolute.
        shown: that folder as the user named it.
        files: by their paths in the folder.
    """

    name: str
    folder: Path
    shown: Path
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class Project:
    """A PlatformIO project.

    Attributes:
        name: of its folder.
        folder: absolute.
        shown: as the user named it.
    """

    name: str
    folder: Path
    shown: Path


def find(path: Path) -> Sketch | Project:
    """The sketch or project that a path means.

    Raises:
        CallError: there is none, or more than one.
        BoebotError: a file cannot be read.
    """
    try:
        if path.name == PROJECT:
            path = path.parent
        if not path.is_dir():
            if path.suffix not in INO or not path.is_file():
                raise CallError(f"there is no sketch {path}; expected an .ino file, or a folder with one")
            is_whole = path.stem == path.absolute().parent.name
            return _sketch(path.parent, path.name, _inos(path.parent) if is_whole else [path.name], with_src=is_whole)
        folder = path.resolve()
        if (path / PROJECT).is_file():
            return Project(name=as_utf8(folder.name), folder=folder, shown=path)
        inos = _inos(path)
        named = [name for name in inos if Path(name).stem in (folder.name, path.absolute().name)]
        if not inos:
            raise CallError(f"{path} is neither a sketch nor a PlatformIO project; expected an .ino file or {PROJECT}")
        if not named and len(inos) > 1:
            names = ", ".join(map(as_utf8, inos))
            raise CallError(f"{path} holds several sketches, {names}; expected one of them, or one named {folder.name}")
        return _sketch(path, (named or inos)[0], inos, with_src=True)
    except OSError as error:
        raise BoebotError(f"{error.filename or path} cannot be read: {error.strerror or error}") from None


def _inos(folder: Path) -> list[str]:
    return sorted(one.name for one in folder.iterdir() if one.suffix in INO and one.name[0] != "." and one.is_file())


def _sketch(folder: Path, main: str, inos: list[str], *, with_src: bool) -> Sketch:
    beside = [one for one in folder.iterdir() if one.suffix in CODE and one.is_file()]
    within = [*below(folder / "src")] if with_src else []
    libraries = below(folder / LIBRARIES, OF_LIBRARY, NOT_BUILT)
    files = sorted([*(folder / name for name in inos), *beside, *within, *libraries])
    if odd := next((one for one in files if _ODD.search(one.name)), None):
        raise CallError(f"{odd} cannot be built: expected a file name without $, quotes, ; and \\")
    return Sketch(
        name=as_utf8(main),
        folder=folder.resolve(),
        shown=folder,
        files={one.relative_to(folder).as_posix(): regular(one, SIZE_MAXIMUM).read_bytes() for one in files},
    )


def below(folder: Path, endings: tuple[str, ...] = (*CODE, *INO), without: Collection[str] = ()) -> Iterator[Path]:
    """Files whose names end so, however deep, but for those in folders `without`, and in hidden ones."""
    for where, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if name[0] != "." and name.lower() not in without]
        yield from (one for name in names if name.endswith(endings) and (one := Path(where, name)).is_file())
