"""Faults of what is no part of a simulated robot: its board, the board's EEPROM, the bit rate of its host. Those of the
bytes on the line are in boebot.link.bad_line."""

from __future__ import annotations

import random

from boebot.boards import RESET_CAUSES
from sim_bridge.boards.board import EEPROM_SIZE
from sim_bridge.pins import BoardPins
from sim_bridge.sim import SimRobot

ERASED = 0xFF  # a cell of the EEPROM that nothing was written to


class BoardFault:
    """One of them."""

    def __init__(self, robot: SimRobot, pins: BoardPins, baud: int, value: float) -> None:
        """`baud`: the bit rate of the host's side of the line; 0: it follows the board's."""
        self._robot, self._pins, self._baud, self._value, self._fired = robot, pins, baud, value, 0

    @property
    def fired(self) -> int:
        """How often it has changed something so far."""
        return self._fired

    def begin(self) -> None:
        """It is time."""

    def end(self) -> None:
        """It is over."""


class Reset(BoardFault):
    """The microcontroller is reset, by the cause of that number."""

    def begin(self) -> None:
        """See `BoardFault`."""
        self._pins.reset(RESET_CAUSES[int(self._value)])
        self._fired = 1


class BrownOut(BoardFault):
    """The rail is held at so many volts. It has changed something where the brown-out detector resets the board, or the
    board goes astray above the detector's voltage."""

    _before: int | None = None  # brown-outs until it began

    def begin(self) -> None:
        """See `BoardFault`."""
        self._before = sum(self._pins.brown_outs())
        self._pins.supply(self._value)

    def end(self) -> None:
        """See `BoardFault`."""
        self._pins.supply(None)

    @property
    def fired(self) -> int:
        """See `BoardFault`."""
        return 0 if self._before is None else sum(self._pins.brown_outs()) - self._before


class Corruption(BoardFault):
    """So many bytes of the EEPROM get other values: of those that were written, where there are any."""

    def begin(self) -> None:
        """See `BoardFault`."""
        draw, cells = random.Random(f"eeprom {self._pins.cycle}"), self._pins.read_eeprom()
        places = [place for place, cell in enumerate(cells) if cell != ERASED] or list(range(EEPROM_SIZE))
        for place in draw.sample(places, min(round(self._value), len(places))):
            self._pins.write_eeprom(place, [cells[place] ^ draw.randrange(1, 256)])
            self._fired += 1


class RateOff(BoardFault):
    """The host's bit rate is off by that share. What that changes shows on the line (boebot.link.bad_line)."""

    def begin(self) -> None:
        """See `BoardFault`."""
        self._set(self._value)

    def end(self) -> None:
        """See `BoardFault`."""
        self._set(0.0)

    def _set(self, off: float) -> None:
        if self._baud:
            self._robot.line_rate(round(self._baud * (1.0 + off)))
        else:
            self._robot.follow_line(off)


KINDS: dict[str, type[BoardFault]] = {
    "board.reset": Reset,
    "board.brown_out": BrownOut,
    "eeprom.corrupted": Corruption,
    "serial.rate": RateOff,
}
