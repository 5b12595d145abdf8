"""The sheet that pictures of runs are drawn on: a title, a line of figures, a field with axes in metres, a legend, and
if wished a panel below the field."""

from __future__ import annotations

import io
import textwrap
from typing import TYPE_CHECKING

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from boebot.view import style
from boebot.view.painter import frame

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

    from boebot.arenas.arena import Floats

LEFT_IN, RIGHT_IN = 0.72, 0.18  # beside the field
TALLEST_IN = 8.2  # of the field
LINE_IN, ROW_IN = 0.22, 0.205  # of the caption, of the legend
CAPTION_COLUMNS, TITLE_COLUMNS = 126, 68
PANEL_IN, PANEL_BELOW_IN = 1.5, 0.5  # of the panel below the field, and for the words below it
ENTRY_IN, LETTER_IN = 0.5, 0.062  # of the legend: handle and gaps, one letter
POINTS_AT_ONCE = 500  # of a line: the dashes of a long one at once take 100 MB
PARTING = "   ·   "
PIXELS_PER_INCH = 96  # of a page


class NotebookFigure(Figure):
    """A figure that a notebook shows where it is the last line of a cell. Those of pyplot are shown because pyplot asks
    for it; the kit draws without pyplot."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The figure as PNG, and how large a notebook shows it, in pixels."""
        png = io.BytesIO()
        self.savefig(png, format="png", dpi=self.dpi)
        width, height = (round(PIXELS_PER_INCH * float(inches)) for inches in self.get_size_inches())
        return png.getvalue(), {"width": width, "height": height}


class Sheet:
    """A picture under way.

    Attributes:
        figure: the whole.
        axes: of the field, to draw on.
        panel: the axes below the field, where they were asked for.
    """

    def __init__(
        self,
        low: Floats,
        high: Floats,
        title: str,
        caption: Sequence[str],
        legend: Sequence[Artist],
        panel_rows: int = 0,
    ) -> None:
        """Field from `low` to `high` (m), two corners; parts of the caption; entries of the legend; rows of the
        legend above a panel below the field, 0: there is no panel."""
        self.title, self.caption = title, PARTING.join(caption)
        lines = _wrapped(caption)
        across = style.WIDTH_IN - LEFT_IN - RIGHT_IN
        width, height = (high - low).tolist()
        scale = min(across / width, TALLEST_IN / height)
        longest = max((len(str(entry.get_label())) for entry in legend), default=0)
        columns = max(1, min(len(legend), int(across / (ENTRY_IN + LETTER_IN * longest))))
        rows = -(-len(legend) // columns)
        above = 0.62 + LINE_IN * len(lines)
        foot = ROW_IN * rows + 0.12
        panel_in = PANEL_IN + ROW_IN * panel_rows + 0.15 + PANEL_BELOW_IN if panel_rows else 0.0
        below = 0.5 + panel_in + foot
        tall = height * scale + above + below
        self.figure = NotebookFigure(figsize=(style.WIDTH_IN, tall), dpi=style.DPI, facecolor=style.PAPER)
        FigureCanvasAgg(self.figure)
        inset = (across - width * scale) / 2
        self.axes = self.figure.add_axes(
            (
                (LEFT_IN + inset) / style.WIDTH_IN,
                below / tall,
                width * scale / style.WIDTH_IN,
                height * scale / tall,
            )
        )
        self.axes.set_facecolor(style.PAPER)
        self.panel = self._panel(foot, across, tall) if panel_rows else None
        frame(self.axes, low, high)
        with rc_context({"text.parse_math": False}):  # a $ in a name is a $
            self._write(tall, lines, legend, columns)

    def _panel(self, foot: float, across: float, tall: float) -> Axes:
        """Axes as wide as the sheet, `foot` above its lower edge."""
        return self.figure.add_axes(
            (LEFT_IN / style.WIDTH_IN, (foot + PANEL_BELOW_IN) / tall, across / style.WIDTH_IN, PANEL_IN / tall)
        )

    def _write(self, tall: float, lines: Sequence[str], legend: Sequence[Artist], columns: int) -> None:
        """Title, caption and legend on a sheet of this height, inches."""
        left = 0.18 / style.WIDTH_IN
        shown = textwrap.shorten(self.title, TITLE_COLUMNS, placeholder="…")
        self.figure.text(left, 1 - 0.32 / tall, shown, fontsize=15, weight="bold", color=style.INK, va="center")
        for number, line in enumerate(lines):
            y = 1 - (0.64 + LINE_IN * number) / tall
            self.figure.text(left, y, line, fontsize=9.5, color=style.FAINT, va="center")
        if legend:
            self.figure.legend(
                handles=list(legend), loc="lower center", ncols=columns, frameon=False, fontsize=8.5,
                labelcolor=style.INK, bbox_to_anchor=(0.5, 0.06 / tall), handletextpad=0.5, columnspacing=1.6,
            )  # fmt: skip

    @property
    def width(self) -> int:
        """Of the picture, in pixels of a page."""
        return round(float(self.figure.get_figwidth()) * PIXELS_PER_INCH)

    def save(self, path: Path) -> Path:
        """Writes it as PNG, with title and caption in its text."""
        path.write_bytes(self.png())
        return path

    def png(self) -> bytes:
        """As the bytes of a PNG file, with title and caption in its text."""
        metadata = {"Title": self.title, "Description": self.caption}
        file = io.BytesIO()
        with rc_context({"agg.path.chunksize": POINTS_AT_ONCE}):
            self.figure.savefig(file, format="png", facecolor=style.PAPER, metadata=metadata)
        return file.getvalue()


def _wrapped(parts: Sequence[str]) -> list[str]:
    """The caption in lines that are not too long, broken between its parts."""
    lines: list[str] = []
    for part in parts:
        if lines and len(lines[-1]) + len(PARTING) + len(part) <= CAPTION_COLUMNS:
            lines[-1] += PARTING + part
        else:
            lines.append(part)
    return lines
