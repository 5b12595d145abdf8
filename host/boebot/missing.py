"""What is not installed here, each in a sentence with the command to type: a package of one of the kit's extras, a
program of the operating system, a file that only a checkout can build."""

from __future__ import annotations

import re
import shutil
import sys
from importlib import import_module
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


def in_c(error: ImportError) -> str:
    """Of a module of the kit's that is written in C and cannot be loaded; "": the error is about something else."""
    if not re.match(r"(boebot|sim_bridge)\..*\b_\w+$", error.name or ""):
        return ""
    way = "pip install --force-reinstall boebot" if resources.checkout() is None else "make setup"
    return f"this copy of boebot is of another system, or not compiled: {error}; for {get_platform()}: {way}"


def built(target: str) -> str:
    """What to do about a file of the kit that is not there: a target of make builds it where there is a makefile."""
    only = "" if resources.checkout() is not None else "only a checkout of boebot can "
    return f"{only}build it with `make {target}`"
