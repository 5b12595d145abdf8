"""The layers from which normal draws come (world/noise.h), for protocol/generate.py: world/generated/noise_layers.h.

256 layers of equal area lie under the bell exp(-x² / 2): the lowest one is a rectangle and the tail beyond it, the
others are rectangles, each as high as brings it to that area (Doornik, "An improved ziggurat method to generate normal
random samples"). Worked out in 50 digits, so that the edges are the same doubles on every machine.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from pathlib import Path

HEADER = Path(__file__).resolve().parents[1] / "generated" / "noise_layers.h"
LAYERS = 256
TAIL = Decimal("3.6541528853610087716454297203995157629748933421139")  # begins here: then the highest layer ends at 1
TERMS = 400  # of the tail's continued fraction


def built(spec: object) -> dict[Path, str]:
    """As of generate.py."""
    rows = "".join(f"    {edge.hex()},\n" for edge in edges())
    doc = "the right edges of the layers under the bell, the widest first, by generator/noise_files.py."
    return {HEADER: f"/* noise_layers.h: {doc} */\nconst double noise_layer_edges[NOISE_LAYERS + 1] = {{\n{rows}}};\n"}


def pages(spec: object) -> dict[Path, str]:
    """As of generate.py: none."""
    return {}


def parts(spec: object) -> dict[str, str]:
    """As of generate.py: none."""
    return {}


def edges() -> list[float]:
    """Edge 1 is where the tail begins, edge 0 is so wide that a rectangle up to it has the area of layer 0."""
    with localcontext(prec=50):
        beyond = TAIL
        for term in range(TERMS, 0, -1):
            beyond = TAIL + term / beyond
        height = (-TAIL * TAIL / 2).exp()
        area = height * (TAIL + 1 / beyond)
        found = [area / height, TAIL]
        while len(found) < LAYERS:
            height += area / found[-1]
            found.append((-2 * height.ln()).sqrt())
        return [*map(float, found), 0.0]
