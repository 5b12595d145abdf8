"""The pins of a board as a logic analyser shows them: pins.vcd, a value change dump (IEEE 1364-2005, 18) that
GTKWave and PulseView open.

It has a signal for each pin of each robot. A pin is what the board does to it; where the board has let go of it, what
the outside does, and else 1 by its pull-up, or z. The bits on the serial line are made of its frames. A cycle of the
board is 62.5 ns, so the time scale is 100 ps.
"""

from __future__ import annotations

import heapq
import re
from collections.abc import Iterator, Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import vcd
from numpy.typing import NDArray

from boebot.description.wiring import PINS, users_of_pins
from boebot.devices.device import pin_name
from boebot.errors import BoebotError
from boebot.record.record import HIGH, LINE_FRAME, LOW, RELEASED, net_level

if TYPE_CHECKING:
    from boebot.description.robots import RobotDescription
    from boebot.record.blocks import Block
    from boebot.record.record import Record
    from boebot.record.run import Run

TICK_PS, CLOCK_HZ, FRACTION = 100, 16_000_000, 1 << 16  # of LINE_FRAME
TICKS = 10**12 // TICK_PS // CLOCK_HZ  # 625 in a cycle
VALUES = "01z"  # by LOW, HIGH, RELEASED
RX, TX = 0, 1  # pins of the serial line
BOARD, OUTSIDE, LINE_OUT = range(3)  # who does something to a pin
AT_ONCE = 100_000  # changes that Python looks at
LINE_BITS = 13  # of a frame, at most: start, nine data bits, parity, two stop bits
PIN = np.dtype([("pin", "u1"), ("level", "u1")])


class Changes(NamedTuple):
    """What somebody does to pins, change by change; arrays of one length."""

    ticks: NDArray[np.int64]
    pins: NDArray[np.uint8]
    who: NDArray[np.uint8]
    levels: NDArray[np.uint8]


def write(robots: Sequence[Run], path: Path) -> None:
    """Writes the file of the robots of one run.

    Raises:
        BoebotError: their pins are not recorded.
        ValueError: their times make no sense.
    """
    if not any(robot.record.count("pins") for robot in robots):
        raise BoebotError("the run has no pins to write; expected one with --pins (pins=True)")
    write_boards([(robot.robot, robot.record) for robot in robots], robots[0].summary(), path)


def write_boards(boards: Sequence[tuple[RobotDescription, Record]], comment: str, path: Path) -> None:
    """Writes the file of these boards, whatever has made the records of their pins.

    Raises:
        ValueError: their times make no sense.
    """
    told: list[Iterator[tuple[int, Any, str]]] = []
    about: dict[str, Any] = {"timescale": f"{TICK_PS} ps", "date": "", "comment": _word(comment)}
    with path.open("w", encoding="ascii") as file, vcd.VCDWriter(file, **about) as writer:
        for number, (robot, record) in enumerate(boards, 1):
            scope = f"{_word(robot.name)}_{number}"
            signals = [writer.register_var(scope, name, "wire", size=1, init="z") for name in _names(robot)]
            told.append(_changes(record, signals))
        for tick, signal, value in heapq.merge(*told, key=itemgetter(0)):
            if tick < 0:  # no cycle of a board, which counts from 0
                raise ValueError(f"a pin changes at {tick} ticks of 100 ps")
            writer.change(signal, tick, value)


def _changes(record: Record, signals: Sequence[Any]) -> Iterator[tuple[int, Any, str]]:
    return ((tick, signals[pin], value) for tick, pin, value in values(record))


def _names(robot: RobotDescription) -> list[str]:
    """Of all pins, with the devices there."""
    users = {RX: ["rx"], TX: ["tx"]} | users_of_pins(robot)
    prints = [name if name[0] == "A" else f"D{name}" for name in map(pin_name, range(PINS))]
    return ["_".join([name, *map(_word, users.get(pin, []))]) for pin, name in enumerate(prints)]


def _word(text: str) -> str:
    """As a name in such a file, where a space ends it."""
    return re.sub(r"[^!-~]", "_", text)


def values(record: Record) -> Iterator[tuple[int, int, str]]:
    """Tick of 100 ps, pin and new value of each change of a pin."""
    rests = Changes(*(np.array([value]) for value in (0, RX, OUTSIDE, HIGH)))  # the line, by the USB's chip
    parts = [
        rests,
        _edges(record.block("pins"), BOARD),
        _edges(record.block("inputs"), OUTSIDE),
        _frames(record.block("line_in"), RX, OUTSIDE),
        _frames(record.block("line_out"), TX, LINE_OUT),
    ]
    all_of = Changes(*map(np.concatenate, zip(*parts, strict=True)))
    order = np.argsort(all_of.ticks, kind="stable")
    state = [[RELEASED, RELEASED, HIGH] for _ in range(PINS)]  # of each pin, by who
    shown = ["z"] * PINS
    for some in np.array_split(order, len(order) // AT_ONCE + 1):
        for tick, pin, who, level in zip(*(column[some].tolist() for column in all_of), strict=True):
            state[pin][who] = level
            if (value := VALUES[net_level(*state[pin])]) != shown[pin]:
                shown[pin] = value
                yield tick, pin, value


def _edges(block: Block, who: int) -> Changes:
    rows = block.table(PIN)
    ticks = np.round(block.times * CLOCK_HZ).astype(np.int64) * TICKS
    return Changes(ticks, rows["pin"], np.full(len(ticks), who, np.uint8), rows["level"])


def _frames(block: Block, pin: int, who: int) -> Changes:
    """Of frames their bits: start, eight data bits, the least significant first, then high."""
    rows = block.table(LINE_FRAME)
    start = np.round(block.times * CLOCK_HZ * FRACTION).astype(np.int64)
    bit, frame = np.meshgrid(np.arange(LINE_BITS), np.arange(len(rows)))
    bit, frame = bit[bit <= rows["bits"][frame]], frame[bit <= rows["bits"][frame]]
    at = start[frame] + bit * rows["bit_time"][frame].astype(np.int64)
    ticks = at // FRACTION * TICKS + at % FRACTION * TICKS // FRACTION
    data = rows["byte"][frame] >> np.clip(bit - 1, 0, 7) & 1
    levels = np.select([bit == 0, bit > 8], [LOW, HIGH], data).astype(np.uint8)
    here = np.full(len(ticks), pin, np.uint8)
    return Changes(ticks, here, np.full_like(here, who), levels)
