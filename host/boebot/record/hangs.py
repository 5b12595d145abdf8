"""What the watchdog's resets of an emulated board amount to, in words: where the program hung, and how often there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from boebot.boards import WatchdogReset

PLACES_AT_MOST = 4  # that get a sentence each


def sentences(resets: Sequence[WatchdogReset]) -> list[str]:
    """For people: one for each place, by its first reset."""
    found = []
    for first, count in _by_place(resets):
        times = "" if count == 1 else f"; {count} times in all"
        found.append(f"{first}{times}")
    if others := _others(resets):
        found.append(f"the watchdog reset the program {others} times more, at other places")
    return found


def places(resets: Sequence[WatchdogReset]) -> str | None:
    """For a table: `0x1A72 in motion_signals (motion.c:54), 3 times`; None: it reset nothing."""
    parts = []
    for first, count in _by_place(resets):
        times = "" if count == 1 else f", {count} times"
        parts.append(f"0x{first.address:04X} {first.place}".rstrip() + times)
    if others := _others(resets):
        parts.append(f"elsewhere {others} times")
    return "; ".join(parts) or None


def _place(reset: WatchdogReset) -> str:
    return reset.place or f"0x{reset.address:04X}"


def _by_place(resets: Sequence[WatchdogReset]) -> list[tuple[WatchdogReset, int]]:
    """The first reset at each place and how many there were, for the places that get a sentence each."""
    counts = Counter(map(_place, resets))
    first = {_place(reset): reset for reset in reversed(resets)}
    return [(first[name], count) for name, count in list(counts.items())[:PLACES_AT_MOST]]


def _others(resets: Sequence[WatchdogReset]) -> int:
    """Resets at all further places."""
    return len(resets) - sum(count for _, count in _by_place(resets))
