"""A long record in windows: consecutive parts of it, each a small record in memory, that overlap by one tick.

Whatever is computed of a run by windows takes no more memory than a window, however long the run was.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from boebot.link.messages import DevicesTelemetry
from boebot.record.blocks import Block, Group, joined
from boebot.record.keepers import InMemory
from boebot.record.record import Record
from boebot.showing import VALUES

TICKS = 20_000
TRUTH_BEFORE_S = 0.5  # of the truth, before a window's first tick
LATE_TICKS = 100  # after a window's last one: a message of a slow device may come so much later than its reading
OF_TICKS = ("telemetry", "readings", "command", VALUES, DevicesTelemetry.NAME)  # streams on the run's clock


@dataclass(frozen=True)
class Window:
    """A part of a record.

    Attributes:
        record: the rows of its ticks; the first tick is also the last one of the window before, if there was one. Of
            other streams than those of ticks, commands, slow devices, shown values and the truth it has none.
        first: index of the first tick that no window before has had: 0 or 1.
    """

    record: Record
    first: int


def windows(record: Record, clock_offset_s: float) -> Iterator[Window]:
    """The windows of a record, oldest first, of `TICKS` ticks each and a rest."""
    waiting: dict[str, Block] = {}
    first = 0
    stream = record.tick_stream
    for group in record.groups():
        for name in (*OF_TICKS, "truth"):
            if name in group:
                waiting[name] = joined(waiting.get(name), group[name])
        while stream in waiting and len(waiting[stream]) - first > TICKS + LATE_TICKS:
            last = first + TICKS - 1
            end_s, late_s = waiting[stream].times[[last, last + LATE_TICKS]].tolist()
            window, waiting = cut(waiting, end_s, late_s, clock_offset_s)
            yield Window(record_of(window), first)
            first = 1
    if stream in waiting and len(waiting[stream]) > first:
        yield Window(record_of(waiting), first)


def cut(waiting: Group, end_s: float, late_s: float, clock_offset_s: float) -> tuple[Group, dict[str, Block]]:
    """What belongs to a window that ends with the tick of that time, and what to the next one."""
    window, rest = {}, {}
    for name, block in waiting.items():
        if name == "truth":
            window[name] = block
            begin = bisect.bisect_left(block.times, end_s + clock_offset_s - TRUTH_BEFORE_S)
            rest[name] = block.part(begin, len(block))
            continue
        end = bisect.bisect_right(block.times, end_s)
        is_message = name == DevicesTelemetry.NAME
        window[name] = block.part(0, bisect.bisect_right(block.times, late_s) if is_message else end)
        rest[name] = block.part(max(end - 1, 0), len(block))  # the newest one holds
        if is_message and end:
            rest[name] = replace(rest[name], times=np.append(end_s, rest[name].times[1:]))
    return _filled(window), _filled(rest)


def _filled(blocks: Group) -> dict[str, Block]:
    return {name: block for name, block in blocks.items() if len(block)}


def record_of(group: Group) -> Record:
    """A record of this group alone."""
    keeper = InMemory()
    keeper.write(group, 0.0)
    return Record(keeper, is_new=False)
