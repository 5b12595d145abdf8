"""Where the kit's files are: in a checkout they stay in their rooms, in a wheel they travel inside the packages."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_CHECKOUT = _PACKAGE.parents[1]

# kind of file -> (inside the installed package, in a checkout)
_FOLDERS: dict[str, tuple[Path, Path]] = {
    "robots": (_PACKAGE / "data" / "robots", _CHECKOUT / "protocol" / "robots"),
    "images": (_PACKAGE / "data" / "images", _CHECKOUT / "build" / "images"),
    "protocol": (_PACKAGE / "data" / "protocol", _CHECKOUT / "protocol"),
    "arenas": (_PACKAGE / "arenas" / "bundled", _PACKAGE / "arenas" / "bundled"),
}


def checkout() -> Path | None:
    """The repository that this package runs from, or None when it was installed from a wheel."""
    return _CHECKOUT if (_CHECKOUT / "protocol" / "messages.toml").is_file() else None


def folder(kind: str) -> Path:
    """The folder that holds `kind`: "robots", "images" (firmware), "protocol" (the database of its messages) or
    "arenas"."""
    installed, in_checkout = _FOLDERS[kind]
    return in_checkout if checkout() is not None else installed


def version() -> str:
    """This kit's version, `boebot.__version__`."""
    try:
        return version_of("boebot")
    except PackageNotFoundError:  # the sources alone
        return "not installed"
