"""A drawing as a file, PNG or SVG by its ending: whole or not at all, and the same bytes each time."""

from __future__ import annotations

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


def check(path: Path) -> None:
    """Refuses a file that cannot become a picture, before anything is drawn.

    Raises:
        BoebotError: its ending is neither .png nor .svg.
    """
    if path.suffix.lower() not in FORMATS:
        raise BoebotError(f"{path} is no name of a picture; expected one that ends in {' or '.join(FORMATS)}")


def save(figure: Figure, path: Path, title: str) -> Path:
    """Writes the figure with its title to a path that was checked; in an SVG, texts stay texts.

    Raises:
        BoebotError: the file cannot be written.
    """
    kind = path.suffix.lower().removeprefix(".")
    metadata = {"Title": title, "Date": None} if kind == "svg" else {"Title": title}  # no date: the same bytes

    def write(part: Path) -> None:
        figure.savefig(part, format=kind, facecolor=style.PAPER, metadata=metadata)

    with (
        warnings.catch_warnings(),
        mpl.rc_context({"svg.hashsalt": f"{zlib.crc32(title.encode()):08x}", "svg.fonttype": "none"}),
    ):
        warnings.filterwarnings("ignore", message="Glyph")  # a letter that the font lacks is drawn as a box
        return write_whole(path, write, "the picture")
