"""What a row of the calibration is: a small program in assembler, and what it must measure after the data sheet.

"data sheet" is the one of the ATmega328P (DS40002061B), "manual" the AVR instruction set manual (DS40002198), column
AVRe.
"""

from __future__ import annotations

from dataclasses import dataclass

CPU_HZ = 16_000_000
STAMP_CYCLES = 6  # program.S: what is measured when nothing stands between `begin` and `finish`
LAP = 65_536  # counts of Timer 1


@dataclass(frozen=True, kw_only=True)
class Row:
    """One measurement.

    `code` holds `begin` and `finish`, or leaves the stamps r3:r2 and r5:r4, or, with `is_number`, a number in r25:r24.
    """

    group: str
    what: str
    expected: int | tuple[int, int]  # or the smallest and largest that the data sheet allows
    source: str  # where the data sheet says so
    code: str
    around: int = 0  # cycles of what stands around the measured thing and is measured with it
    is_number: bool = False  # a number that is no time between two stamps
    scale: int = 1  # cycles for each count of Timer 1
    laps: int = 0  # of Timer 1 between the stamps, which do not show in the number
    edges: tuple[int, int] = (-2, -1)  # which of the row's edges at pin 13 are the two stamps
    unit: str = "cycles"
    difference: str = ""  # why the emulator is known not to agree
    board_only_shown: str = ""  # why a real board's value is no verdict

    def value(self, number: int) -> int:
        """What was measured, from the number that the program sent."""
        return (number + self.laps * LAP) * self.scale - self.around

    def value_at_pin(self, distance: int) -> int:
        """The same from the distance of two edges at pin 13, in cycles."""
        return distance - self.around

    def is_right(self, value: int) -> bool:
        """Whether the data sheet allows it."""
        low, high = self.expected if isinstance(self.expected, tuple) else (self.expected, self.expected)
        return low <= value <= high

    @property
    def expected_text(self) -> str:
        """What the data sheet says, for people."""
        if isinstance(self.expected, tuple):
            return f"{self.expected[0]} to {self.expected[1]}"
        return str(self.expected)


def timed(code: str, before: str = "", after: str = "") -> str:
    """The row's code for `code` between the two stamps."""
    return f"operands\n{before}\nbegin\n{code}\nfinish\n{after}"
