"""How many changes of the encoders' lines and the light sensor's may wait in their ring: whether it can become full.

A poll works off what waits when it begins; what comes from then on waits for the next poll. There are two ways in which
that one can be far off:

* A slot begins with a poll. Its tasks follow, and after them the next poll is that of a slot that waits, or one of its
  own if changes are due. So no more than one slot lies in between, however many of them wait.
* No slot waits, and changes that are not due stay. The main loop works off one frame and looks again.

A poll frees one place after the other: until it has freed the first, and between any two of them, more can come.
All times are in cycles.
"""

from __future__ import annotations

from collections.abc import Sequence

from avr_timing.interrupts.response import Schedule, Source, response
from boebot_timing.costs import Costs
from boebot_timing.firmware import Firmware
from boebot_timing.loads import ENCODERS, Load


def of_image(firmware: Firmware, found: Costs, schedule: Schedule, asked: Load) -> int | None:
    """Changes that wait at most under a load that is no overload; None: no encoders."""
    row = next((row for row in firmware.table.interrupts if row.vector == ENCODERS), None)
    if row is None or not found.change:
        return None
    changes = asked.sources(row, 0)
    return most_waiting(found, schedule, found.requested(firmware, asked), changes, found.latencies[row.name] or 0)


def most_waiting(
    found: Costs, schedule: Schedule, interrupts: Sequence[Source], changes: Sequence[Source], latency: int
) -> int | None:
    """Changes that wait at most; None: overload.

    What a poll finds makes the time to the next one longer, and that what the next one finds. From an empty ring on,
    no poll finds more than the least number that this leaves as it is.

    Args:
        found: what the pieces of the work cost.
        schedule: the slots.
        interrupts: all of them, without what they leave to the main loop.
        changes: of the lines; their cycles do not count.
        latency: from a change to its interrupt, at which it comes into the ring.
    """
    slots = max(map(schedule.work, range(len(schedule.slots))))

    def peak(work: int, left: int) -> int | None:
        """With some work before the next poll looks, and changes that wait already."""
        most = freed = 0
        while True:
            until = response(work + (freed + 1) * found.change, interrupts)
            if until is None:
                return None
            waiting = left + sum(one.requests(until + latency + 1) for one in changes) - freed
            if waiting <= 0:
                return most
            most, freed = max(most, waiting), freed + 1

    needed = peak(found.loop + found.frame + found.round, found.changes_due - 1)
    while needed is not None:
        more = peak(slots + needed * found.change + found.round, 0)
        if more is not None and more <= needed:
            break
        needed = more
    return needed
