"""A figure of matplotlib that a notebook shows. Figures of pyplot are shown because pyplot asks for it; the kit draws
without pyplot."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

PIXELS_PER_INCH = 96  # of a page


class NotebookFigure(Figure):
    """Shown where it is the last line of a cell."""

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The figure as PNG, and how large a notebook shows it, in pixels."""
        png = io.BytesIO()
        self.savefig(png, format="png", dpi=self.dpi)
        width, height = (round(PIXELS_PER_INCH * float(inches)) for inches in self.get_size_inches())
        return png.getvalue(), {"width": width, "height": height}
