"""Colours and widths that all pictures share.

Hues are those of Okabe and Ito, which the colour-blind can distinguish; what matters also differs in form or lightness,
so that it survives a grey printer.
"""

from __future__ import annotations

PAPER = "#fbfaf7"
FLOOR = "#ffffff"
INK = "#2e3440"
FAINT = "#6b7280"
GRID = "#e3e5ea"
RULE = "#d5d7de"  # around panels
QUIET = "#eef0f4"  # what is there but empty
ACCENT = "#0072b2"  # of what can be pressed
ON_ACCENT = "#ffffff"
ALERT = "#b3261e"

EDGE = "#39415a"  # of what is solid
SOLID = "#c3c9d6"
DULL = "#8d93a1"  # solids that throw back little
LOW = "#f1ead9"  # solids that some sensors look over; hatched
PAINT_DARK, PAINT_BRIGHT = "#4c566a", "#ffffff"  # lines on the floor, darker and brighter than it
ROUGH, SMOOTH = "#e3d3b0", "#cfe6f4"  # patches that grip more, and less, than the floor
CHARGER = "#009e73"
LAMP = "#f0e442"
MOVING = "#e69f00"

START, END = "#009e73", "#0072b2"
ESTIMATE = "#d55e00"
TOUCH = "#e69f00"
CONTACT = "#111827"
BODY = "#eef1f6"
PATH = "viridis"  # dark to light in time
PATH_SHARE = 0.9  # of its colours: the last ones are too light for paper

ROBOTS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#4b3f99", "#6b7280")
"""Of the robots of a run of several, by number, over and over."""

DASHES = ((0, ()), (0, (6, 2)), (0, (2, 1.5)), (0, (6, 2, 1.5, 2)))
"""Of their paths: another one each time the colours begin anew, so that 32 robots differ."""

BEHAVIORS = ("#0072b2", "#cc79a7", "#009e73", "#e69f00", "#56b4e9", "#4b3f99", "#8a6d00", "#6b7280")
"""Of the motor behaviors of a brain, in its order, over and over."""

LAYERS = ("#7b4fa3", "#8a6d00", "#c2185b", "#3b8a8c", "#56b4e9", "#6b7280")
"""Of the layers that a brain sketches, in their order, over and over."""

DARK = {
    "paper": "#12151b", "floor": "#1b1f27", "ink": "#e6e9ef", "faint": "#9aa3b2", "grid": "#2a303b", "rule": "#39414f",
    "quiet": "#2a303b", "accent": "#5db2e8", "on-accent": "#0b1218", "alert": "#ff8a80", "edge": "#aeb8cb",
    "solid": "#485164", "dull": "#6d7688", "low": "#3a3527", "paint-dark": "#8b95a9", "paint-bright": "#07090c",
    "rough": "#4a3f26", "smooth": "#1f3c4d", "charger": "#2fc596", "lamp": "#f0e442", "moving": "#e69f00",
    "start": "#2fc596", "end": "#5db2e8", "estimate": "#ff8a3d", "touch": "#ffb627", "contact": "#f4f6fa",
    "body": "#39414f",
}  # fmt: skip
"""What the page has in their place where one prefers dark; lightness is turned round, so paint that is darker than the
floor is brighter here."""

CELL = (0.05, 0.75)  # how opaque a cell of a sketched grid is: free, occupied

WIDTH_IN = 8.4  # of a picture of a run; 1092 pixels
DPI = 130


def paint(name: str, robot: str = END) -> str:
    """The colour that an item of a display list names: of the palette above, "robot" for that one, or "#rrggbb"."""
    if name.startswith("#"):
        return name
    return robot if name == "robot" else str(globals()[name.upper().replace("-", "_")])


def colour(number: int) -> str:
    """Of the robot of that number, from 1."""
    return ROBOTS[(number - 1) % len(ROBOTS)]


def behavior(index: int) -> str:
    """Colour of the motor behavior of that index, from 0."""
    return BEHAVIORS[index % len(BEHAVIORS)]


def layer(index: int) -> str:
    """Colour of the layer of a brain's sketches of that index, from 0."""
    return LAYERS[index % len(LAYERS)]


def dashes(number: int) -> tuple[int, tuple[float, ...]]:
    """Of the path of the robot of that number, from 1."""
    return DASHES[(number - 1) // len(ROBOTS) % len(DASHES)]
