"""The sentences about resets by a board's watchdog."""

from __future__ import annotations

from boebot.boards import WatchdogReset
from boebot.record import figures


def reset(number: int, address: int, place: str = "") -> WatchdogReset:
    return WatchdogReset(cycle=number * 1_600_000, time_s=number / 10, address=address, place=place)


IN_A, IN_B = "in a (a.c:5)", "in b (b.c:7)"


def test_no_reset_has_no_sentence() -> None:
    assert figures.hang_sentences([]) == []
    assert figures.hang_places([]) is None


def test_each_place_has_one_sentence_by_its_first_reset() -> None:
    """Two instructions of one line are one place; without lines each address is."""
    resets = [reset(1, 0x1A2, IN_A), reset(2, 0x30, IN_B), reset(3, 0x1A4, IN_A), reset(4, 0x40)]
    assert figures.hang_sentences(resets) == [
        f"the watchdog reset the program, which it found at address 0x01A2 in cycle 1600000 {IN_A}; 2 times in all",
        f"the watchdog reset the program, which it found at address 0x0030 in cycle 3200000 {IN_B}",
        "the watchdog reset the program, which it found at address 0x0040 in cycle 6400000",
    ]
    assert figures.hang_places(resets) == f"0x01A2 {IN_A}, 2 times; 0x0030 {IN_B}; 0x0040"
