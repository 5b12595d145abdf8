"""Faults of what is no part of a simulated robot: its board, the board's EEPROM, the bit rate of its host. Those of the
bytes on the line are in boebot.link.bad_line."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from functools import partial

from boebot.boards import RESET_CAUSES
from sim_bridge.boards.board import EEPROM_SIZE
from sim_bridge.pins import BoardPins
from sim_bridge.sim import SimRobot

ERASED = 0xFF  # a cell of the EEPROM that nothing was written to

Acting = tuple[Callable[[], object], Callable[[], int]]
"""What ends a fault that has begun, and what says how often it has changed something so far."""


def _reset(robot: SimRobot, _: int, cause: float) -> Acting:
    BoardPins(robot).reset(RESET_CAUSES[int(cause)])
    return int, lambda: 1


def _brown_out(robot: SimRobot, _: int, volts: float) -> Acting:
    """It changes the supply, whether or not that resets the board."""
    pins = BoardPins(robot)
    pins.supply(volts)
    return partial(pins.supply, None), lambda: 1


def _corrupted(robot: SimRobot, _: int, count: float) -> Acting:
    """Of the bytes that were written, where there are any."""
    pins = BoardPins(robot)
    draw, cells = random.Random(f"eeprom {pins.cycle}"), pins.read_eeprom()
    places = [place for place, cell in enumerate(cells) if cell != ERASED] or list(range(EEPROM_SIZE))
    hit = draw.sample(places, min(round(count), len(places)))
    for place in hit:
        pins.write_eeprom(place, [cells[place] ^ draw.randrange(1, 256)])
    return int, lambda: len(hit)


def _rate_off(robot: SimRobot, baud: int, share: float) -> Acting:
    """What that changes shows on the line (boebot.link.bad_line)."""

    def is_off(by: float) -> None:
        return robot.line_rate(round(baud * (1.0 + by))) if baud else robot.follow_line(by)

    is_off(share)
    return partial(is_off, 0.0), int


KINDS: Mapping[str, Callable[[SimRobot, int, float], Acting]] = {
    "board.reset": _reset,
    "board.brown_out": _brown_out,
    "eeprom.corrupted": _corrupted,
    "serial.rate": _rate_off,
}
"""What begins each, by name; it gets the bit rate of the host's side of the line (0: it follows the board's), and a
value."""
