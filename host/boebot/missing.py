"""What is not installed here, each in a sentence with the command to type: a package of one of the kit's extras, a
program of the operating system, a file that only a checkout can build, a library of the kit's own C."""

from __future__ import annotations

import shutil
import struct
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from sysconfig import get_platform
from typing import Any

from boebot import resources
from boebot.errors import BoebotError

_QUOTE = '"' if sys.platform == "win32" else "'"  # round a word for the shell
_INSTALL = {"apt-get": "sudo apt install", "brew": "brew install", "winget": "winget install"}


def package(what: str, name: str, extra: str) -> str:
    """`what` needs a Python package, which an extra of the kit brings."""
    return f"{what} needs {name}, which is not installed: pip install {_QUOTE}boebot[{extra}]{_QUOTE}"


def imported(module: str, what: str, name: str, extra: str, error: type[BoebotError] = BoebotError) -> Any:
    """A module of such a package.

    Raises:
        BoebotError: as `error`; the package is not installed, or cannot be loaded.
    """
    try:
        return import_module(module)
    except ImportError as reason:
        if reason.name is not None and reason.name.partition(".")[0] == module.partition(".")[0]:
            raise error(package(what, name, extra)) from None
        raise error(f"{what} needs {name}, which cannot be loaded: {reason}") from None


def program(what: str, name: str, **packages: str) -> str:
    """`what` needs a program, which is in these packages of the systems' installers (`apt_get`, `brew`, `winget`)."""
    return f"{what} needs {name}, which is not installed: {installer(**packages) or 'expected it on the PATH'}"


def installer(**packages: str) -> str:
    """The command that installs the packages on this system; "": it has no such installer."""
    named = {manager.replace("_", "-"): those for manager, those in packages.items()}
    here = (one for one in _INSTALL if one in named and shutil.which(one))
    return next((f"{_INSTALL[one]} {named[one]}" for one in here), "")


def compiled(module: str) -> tuple[Any, Any]:
    """The `ffi` and `lib` of a module of the kit's that is written in C.

    Raises:
        BoebotError: its file is not there, or cannot be loaded.
    """
    found = find_spec(module)
    if found is None or found.origin is None:
        place = Path(*module.split("."))
        raise BoebotError(f"{place}, a library of boebot for {get_platform()}, is not there; {again()}")
    file = Path(found.origin)
    try:
        if not (wrong := unloadable(file)):
            loaded = import_module(module)
            return loaded.ffi, loaded.lib
    except ImportError as error:
        wrong = str(error).removeprefix(f"{file}: ")
    raise BoebotError(f"{file} cannot be loaded on {get_platform()}: {wrong}; {again(file)}")


def unloadable(library: Path) -> str:
    """Why a library cannot be loaded, as far as Linux's loader would crash or not say it; else "". By the header of
    its format, ELF: its last part, the table of sections, is behind the file's end, or it is unlike cffi's own."""
    import _cffi_backend  # here, as cffi may be what is missing

    with library.open("rb") as file, Path(_cffi_backend.__file__).open("rb") as ours:
        head, like = file.read(64), ours.read(64)
    if len(head) < 64 or not head.startswith(b"\x7fELF\2"):
        return ""
    begin, size, count = struct.unpack_from("<40xQ10xHH", head)
    if begin + size * count > library.stat().st_size:
        return "it is cut short"
    return "" if head[18:20] == like[18:20] else "it is for another processor"


def again(library: Path | None = None) -> str:
    """How to get what was compiled anew, in place of that file if there is one."""
    if resources.checkout() is None:
        return "type `pip install --force-reinstall boebot`"
    return f"{'' if library is None else 'delete it, then '}type `make setup`"


def built(target: str) -> str:
    """What to do about a file of the kit that is not there: a target of make builds it where there is a makefile."""
    only = "" if resources.checkout() is not None else "only a checkout of boebot can "
    return f"{only}build it with `make {target}`"
