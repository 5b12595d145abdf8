"""Why a board started, in words: the last reset by its hello."""

from __future__ import annotations

from boebot.link import messages

_IN_TASK = "WATCHDOG_IN_"


def by_watchdog(cause: int) -> bool:
    """Whether the watchdog reset the board: the firmware hung or fell behind for good."""
    return cause >= messages.ResetCause.WATCHDOG


def hang_in_words(cause: int) -> str:
    """Where the firmware hung, as the watchdog found it: an interrupt that hung counts as what it interrupted."""
    name = in_words(cause).removeprefix("watchdog, ")
    also = "an interrupt meanwhile" if name.startswith("in task") else "the link, the main loop or an interrupt"
    return f"its watchdog, {name}: the firmware hung there, in {also}, or fell behind for good"


def in_words(cause: int) -> str:
    """As in "watchdog, in task encoder"; a cause that this kit does not know has its number as its name."""
    name = messages.ResetCause(cause).name
    if name.startswith(_IN_TASK):
        return f"watchdog, in task {name.removeprefix(_IN_TASK).lower()}"
    if cause == messages.ResetCause.WATCHDOG:
        return "watchdog, outside of its tasks"
    return name.lower().replace("_", " ")
