"""Where a range sensor is on the body and what it sees."""

from __future__ import annotations


def beam_of(
    position: tuple[float, float], heading: float, opening: float, height: float, rays: int
) -> dict[str, float]:
    """beam_parameters in C: m, rad, rad, m."""
    x, y = position
    return {"x": x, "y": y, "heading": heading, "opening": opening, "height": height, "rays": rays}
