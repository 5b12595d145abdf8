"""How long things may take from event to effect, derived from the schedule alone, before anything is measured.

What is assumed of the image, and proven elsewhere (its timing table, tasks.def):
* the tasks of a slot, with all interrupts and the link's work, end within the slot's 40,000 cycles;
* the link is polled after each task, and a poll takes a frame in less time than the line takes to bring the next.

All limits in cycles.
"""

from __future__ import annotations

from typing import NamedTuple

from boebot_timing.emulated.line import BYTE_CYCLES
from boebot_timing.emulated.loads import TICK_CYCLES

SLOT_CYCLES, SERVO_FRAME_CYCLES = TICK_CYCLES // 4, 2 * TICK_CYCLES  # tasks.def


class Limits(NamedTuple):
    """Least and most; None: nothing is said."""

    least: int | None
    most: int | None


EXACT = Limits(-16, 16)  # servo width and period: 1 us, under every load
ECHO = Limits(-16, 16)  # the same, whole microseconds included

RISE = 8_000  # from the slot's start to the rising edge (servo.c)
TELEMETRY_BYTES = 46
RING_BYTES = 127 + 2  # most that waits on the way back: the ring, the transmitter's buffer and its shift register
LONGEST_TASK = 5_000  # of all budgets
FRAME_ARRIVES = 16 * BYTE_CYCLES  # the next set-point's
# From a frame's last byte to its being carried out: the task that runs ends, then the poll's frame before this one and
# this one are worked off; interrupts take at most every second cycle of the meantime.
REACTION = 2 * (LONGEST_TASK + 2 * FRAME_ARRIVES)
# From a tick's start to the end of its telemetry's last byte: it is sent within slot 0, behind all that waits.
TOLD_LATEST = SLOT_CYCLES + RING_BYTES * BYTE_CYCLES
TOLD_EARLIEST = TELEMETRY_BYTES * BYTE_CYCLES

BYTE_TO_REACTION = Limits(0, REACTION + RING_BYTES * BYTE_CYCLES)


def setpoint_to_pulse(slot: int) -> Limits:
    """To the rise of the first changed pulse of the servo whose slot of the servo frame is `slot`. A set-point takes
    effect with the next frame: at the earliest it is carried out just before slot 0 begins, at the latest just after,
    and then waits for a whole frame."""
    to_rise = slot * SLOT_CYCLES + RISE
    return Limits(to_rise, to_rise + SERVO_FRAME_CYCLES + REACTION)


# Sampled at the start of each slot, pressed at the second sample in a row (whisker.c), reported in slot 0. Earliest:
# pressed just before the sample of slot 3, which may itself be late by almost a slot. The latest: just after that
# sample; slots 0 and 1 sample it, and the next slot 0 reports it.
WHISKER = Limits(TOLD_EARLIEST, SLOT_CYCLES + TICK_CYCLES + TOLD_LATEST)

# Counted, or captured, at once; reported in the next slot 0 whose task has not yet run.
NEXT_TICK = Limits(TOLD_EARLIEST, TICK_CYCLES + TOLD_LATEST)
