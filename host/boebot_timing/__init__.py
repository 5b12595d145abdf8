"""Timing budgets: what the firmware may take, what it can take at most, and whether both fit (notes, section 3.2).

A guest of the library: `boebot timing`, and the check whether a robot, a brain's period and a line go together.
Bounds come from `avr_timing`, which analyses the machine code; measurements come from the emulator (`emulated`) and
from boards, as `measured.Measurement`.
"""

from boebot.guests import Command

COMMAND = Command(
    "What the firmware may take, what it took, and whether that fits its budgets.", "boebot_timing.command:timing"
)
