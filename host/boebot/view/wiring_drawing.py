"""Draws how a robot's devices are wired, with matplotlib: the board in the middle, a box for each device beside it,
`..._left` on the left. Wires to pins are lines; those to the supply and to ground end at a sign. Lengths in inches."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from matplotlib.patches import FancyBboxPatch, Rectangle

from boebot.devices.device import FIVE_VOLTS, GROUND, PACK
from boebot.view import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from boebot.description.wiring import Connection

WIDTH = style.WIDTH_IN
ROW, GAP = 0.21, 0.16  # from terminal to terminal, between two boxes
EDGE, BOX = 0.15, 1.75  # beside the boxes, and their width
BOARD = 1.1  # its width
PIN = (WIDTH - BOARD) / 2  # where the board begins
RAIL = 0.75  # length of a wire to a sign, beyond its part
JOINED = 0.2  # from the box to where wires of one terminal meet
PART_AT, PART_LENGTH, PART_HEIGHT = 0.48, 0.5, 0.15  # of the symbol of a part, from the box on
HEADING = 2  # rows of a box above its terminals
NAME_SIZE, SMALL_SIZE = 8.0, 6.8

COLOURS = {"red": "#c62828", "black": style.INK, "white": "#ffffff"}
SUPPLIES = {FIVE_VOLTS: "#c62828", PACK: style.ESTIMATE, GROUND: style.INK}
SIGNAL = style.END


def height(connections: Sequence[Connection]) -> float:
    """What the drawing needs."""
    return max((_tall(side) for side in _sides(connections)), default=0.0) + 2 * GAP


def draw_wiring(axes: Axes, connections: Sequence[Connection], board: str) -> None:
    """Fills axes of `WIDTH` by `height(connections)`; `board`: its name."""
    tall = height(connections)
    axes.set_xlim(0, WIDTH)
    axes.set_ylim(0, tall)
    axes.axis("off")
    axes.add_patch(_rounded(PIN, 0.04, BOARD, tall - 0.08, facecolor="#dfe9f3", edgecolor=style.EDGE, lw=1.4))
    axes.text(
        WIDTH / 2, tall / 2, board, fontsize=10, weight="bold", color=style.EDGE, rotation=90, ha="center", va="center"
    )
    for mirrored, side in enumerate(_sides(connections)):
        y = tall - GAP
        for wires in side:
            _Box(axes, bool(mirrored), y).draw(wires)
            y -= _box_height(wires) + GAP


def _sides(connections: Sequence[Connection]) -> tuple[list[list[Connection]], list[list[Connection]]]:
    """The wires of each device left and right of the board; devices without a side fill up the shorter one."""
    devices = [list(wires) for _, wires in groupby(connections, key=lambda wire: wire.device)]
    left = [wires for wires in devices if wires[0].device.endswith("_left")]
    right = [wires for wires in devices if wires[0].device.endswith("_right")]
    for wires in devices:
        if wires not in left and wires not in right:
            min(left, right, key=_tall).append(wires)
    return left, right


def _tall(side: Sequence[Sequence[Connection]]) -> float:
    return sum(_box_height(wires) for wires in side) + GAP * max(len(side) - 1, 0)


def _box_height(wires: Sequence[Connection]) -> float:
    return (HEADING + len(wires)) * ROW


class _Box:
    """One device, its upper edge at `y`; mirrored: on the right."""

    def __init__(self, axes: Axes, mirrored: bool, y: float) -> None:
        self._axes, self._mirrored, self._top = axes, mirrored, y

    def _x(self, x: float) -> float:
        return WIDTH - x if self._mirrored else x

    def _write(self, x: float, y: float, text: str, size: float, align: str, **look: Any) -> None:
        if self._mirrored:
            align = {"left": "right", "right": "left"}.get(align, align)
        self._axes.text(self._x(x), y, text, fontsize=size, ha=align, va="center", zorder=6, **look)

    def _line(self, x: Sequence[float], y: Sequence[float], colour: str, width: float = 1.5) -> None:
        at = [self._x(one) for one in x]
        if colour == COLOURS["white"]:
            self._axes.plot(at, y, color=style.FAINT, lw=width + 1.4, zorder=3, solid_capstyle="butt")
        self._axes.plot(at, y, color=colour, lw=width, zorder=3.1, solid_capstyle="butt")

    def draw(self, wires: Sequence[Connection]) -> None:
        """Box, terminals, wires."""
        tall = _box_height(wires)
        corner = min(self._x(EDGE), self._x(EDGE + BOX))
        box = _rounded(corner, self._top - tall, BOX, tall, facecolor=style.FLOOR, edgecolor=style.EDGE, lw=1.1)
        self._axes.add_patch(box)
        self._write(
            EDGE + 0.09, self._top - 0.85 * ROW, wires[0].device, NAME_SIZE, "left", weight="bold", color=style.INK
        )
        self._write(EDGE + 0.09, self._top - 1.65 * ROW, wires[0].connector, SMALL_SIZE, "left", color=style.FAINT)
        y = self._top - HEADING * ROW - 0.4 * ROW
        begun: dict[str, float] = {}
        for wire in wires:
            begin = EDGE + BOX
            if wire.to in begun:  # the same terminal once more
                begin += JOINED
                self._line((begin, begin), (begun[wire.to], y), style.INK, 1.2)
            else:
                self._write(begin - 0.09, y, wire.to, SMALL_SIZE, "right", color=style.INK)
            begun[wire.to] = y
            self._wire(wire, begin, y)
            y -= ROW

    def _wire(self, wire: Connection, begin: float, y: float) -> None:
        supply = SUPPLIES.get(wire.pin)
        colour = COLOURS.get(wire.colour, supply or SIGNAL)
        end = PIN if supply is None else EDGE + BOX + RAIL + (PART_LENGTH if wire.part else 0.0)
        self._line((begin, end), (y, y), colour)
        if wire.part:
            self._part(wire.part, EDGE + BOX + PART_AT, y)
        if supply is None:
            self._write(PIN + 0.07, y, wire.pin, NAME_SIZE, "left", weight="bold", color=style.EDGE)
        elif wire.pin == GROUND:
            for number, half in enumerate((0.07, 0.045, 0.02)):
                self._line((end + 0.035 * number,) * 2, (y - half, y + half), supply, 1.4)
        else:
            self._line((end,) * 2, (y - 0.06, y + 0.06), supply, 1.6)
            self._write(end + 0.06, y, wire.pin, SMALL_SIZE, "left", color=supply)

    def _part(self, part: str, x: float, y: float) -> None:
        left = min(self._x(x), self._x(x + PART_LENGTH))
        look: dict[str, Any] = {"facecolor": style.FLOOR, "edgecolor": style.EDGE, "lw": 0.9, "zorder": 5}
        self._axes.add_patch(Rectangle((left, y - PART_HEIGHT / 2), PART_LENGTH, PART_HEIGHT, **look))
        self._write(x + PART_LENGTH / 2, y - 0.008, part, 6.3, "center", color=style.INK)


def _rounded(x: float, y: float, width: float, tall: float, **look: Any) -> FancyBboxPatch:
    return FancyBboxPatch((x, y), width, tall, boxstyle="round,pad=0,rounding_size=0.05", zorder=2, **look)
