"""Two runs of the same brain and seed, on an emulated and a real board or on two emulated ones: from where on they
differ, and whether the brain is to blame.

A brain is a function of its seed and of what it saw. So its commands may differ as soon as telemetry does, and not
before (experiment E68); boebot.running.replayed goes further and asks a brain anew what it would have commanded on that
telemetry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import zip_longest

from boebot.errors import BoebotError
from boebot.link.messages import Telemetry
from boebot.record.blocks import Row
from boebot.record.columns import BoardColumns
from boebot.record.run import Run
from boebot.robot import Command

NOT_SEEN = frozenset(("setpoint_sequence",))
"""Fields of telemetry that say what the host itself sent, and that no device shows to a brain."""

EXPECTED = "expected one with a step of its brain at least"
"""Of a run that is to be compared: that nothing differs from nothing says nothing."""

_OTHER_CLOCKS = ("to_board", "to_host", "event", "truth", "pins", "waits", "shifts")
"""Streams whose times are of the transport's clock, or near it."""


@dataclass(frozen=True)
class Difference:
    """Where two runs differ first."""

    step: int
    """of the brain, from 0"""
    tick: int
    """of the control ticks since the run began, in the first run"""
    what: str
    """"tick", a field of telemetry, or "command\""""
    first: object
    """there, in the first run"""
    second: object
    """and in the second"""

    def __str__(self) -> str:
        return f"step {self.step} (tick {self.tick}): {self.what} is {self.first} and {self.second}"


def telemetry_difference(one: Run, other: Run, fields: tuple[str, ...] = ()) -> Difference | None:
    """The first step at which the brains did not see the same: another tick, or other telemetry.

    Args:
        one, other: runs on boards.
        fields: of telemetry, that count, with "tick"; (): all that a brain can see.

    Raises:
        BoebotError: a run without a board, which has no telemetry.
    """
    rows = [_seen(run) for run in (one, other)]
    for step, (a, b) in enumerate(zip(*rows, strict=False)):
        for name in a._fields:
            if (name in fields or (not fields and name not in NOT_SEEN)) and getattr(a, name) != getattr(b, name):
                return Difference(step, int(one.series.steps[step]), name, getattr(a, name), getattr(b, name))
    return None


def command_difference(one: Run, other: Run) -> Difference | None:
    """The first step at which the brains did not command the same."""
    for step, (a, b) in enumerate(zip(one.record.steps, other.record.steps, strict=False)):
        if a[1:] != b[1:]:
            return Difference(step, a[0], "command", Command(*a[1:]), Command(*b[1:]))
    return None


@dataclass(frozen=True)
class RowDifference:
    """Where the records of two runs differ first."""

    stream: str
    time: float
    """of the run, in s"""
    row: int
    """of the stream, from 0"""
    what: str
    """what differs there, in words: of the first record, and of the second"""

    def __str__(self) -> str:
        return f"stream {self.stream}, {self.time:.4f} s, row {self.row}: {self.what}"


def record_difference(one: Run, other: Run, *, is_cut: bool = False, until_s: float = math.inf) -> RowDifference | None:
    """The first row, in time, that two records do not have in common, bit for bit. `is_cut`: the first record is; what
    the second one has beyond its end is no difference. `until_s`: of the run; rows from then on do not count."""
    found = []
    for stream in sorted(one.record.streams() | other.record.streams()):
        offset_s = one.clock_offset if stream in _OTHER_CLOCKS else 0.0
        rows = zip_longest(one.record.each_row(stream), other.record.each_row(stream))
        for index, (a, b) in enumerate(rows):
            if a is None and is_cut:
                break
            if a != b:
                time_s = min(row[0] for row in (a, b) if row is not None) - offset_s
                if time_s >= until_s:
                    break
                found.append(RowDifference(stream, time_s, index, _in_words(a, b)))
                break
    return min(found, key=lambda difference: difference.time, default=None)


def _in_words(one: Row | None, other: Row | None) -> str:
    if one is None or other is None:
        return f"only the {'second' if one is None else 'first'} has it"
    if one[0] != other[0]:
        return f"its time is {one[0]!r} s and {other[0]!r} s"
    if len(one[1]) != len(other[1]):
        return f"it has {len(one[1])} B and {len(other[1])} B"
    index = next(index for index, (a, b) in enumerate(zip(one[1], other[1], strict=True)) if a != b)
    return f"its byte {index} is 0x{one[1][index]:02X} and 0x{other[1][index]:02X}"


def _seen(run: Run) -> list[Telemetry]:
    if run.layout is not None:
        raise BoebotError(f"robot {run.robot.name!r} has no board, and no telemetry to compare")
    assert isinstance(run.series, BoardColumns)
    return [run.series.telemetry(index) for index in run.series.steps.tolist()]
