"""How what a test asks of a board ends where it does not come: a wait in vain, or a board that cannot do it."""

from __future__ import annotations

from boebot.errors import BoebotError

LONGEST_S = 86_400.0  # that a test lets pass at once


class WaitError(AssertionError):
    """What a test waited for did not come within its time. The text says what it was, and what came instead."""

    __module__ = "uno"  # as reports name it, whose lines are short


class Cannot(BoebotError):  # noqa: N818 (not a failure: the plugin skips the test)
    """The board under test cannot be asked that, as its kind has no such thing: a test is skipped, with this reason."""
