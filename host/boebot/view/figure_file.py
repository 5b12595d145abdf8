"""A drawing as a file, PNG or SVG by its ending: whole or not at all, and the same bytes each time."""

from __future__ import annotations

import io
import warnings
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

from boebot.errors import BoebotError
from boebot.record.run_folder import write_whole
from boebot.view import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg")
_UNSAID: dict[str, dict[str, None]] = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}


def check(path: Path) -> None:
    """Refuses a file that cannot become a picture, before anything is drawn.

    Raises:
        BoebotError: its ending is neither .png nor .svg.
    """
    if path.suffix.lower() not in FORMATS:
        raise BoebotError(f"{path} is no name of a picture; expected one that ends in {' or '.join(FORMATS)}")


def save(figure: Figure, path: Path, title: str) -> Path:
    """Writes the figure with its title to a path that was checked.

    Raises:
        BoebotError: the file cannot be written.
    """
    drawn = as_bytes(figure, path.suffix.lower().removeprefix("."), title)
    return write_whole(path, lambda part: part.write_bytes(drawn), "the picture")


def as_bytes(figure: Figure, kind: str, title: str, dpi: float | str = "figure") -> bytes:
    """The figure with its title as "png" or "svg"; in an SVG, texts stay texts."""
    with (
        io.BytesIO() as file,
        warnings.catch_warnings(),
        mpl.rc_context({"svg.hashsalt": f"{zlib.crc32(title.encode()):08x}", "svg.fonttype": "none"}),
    ):
        warnings.filterwarnings("ignore", message="Glyph")  # a letter that the font lacks is drawn as a box
        figure.savefig(file, format=kind, dpi=dpi, facecolor=style.PAPER, metadata={"Title": title, **_UNSAID[kind]})
        return file.getvalue()
