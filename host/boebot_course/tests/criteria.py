"""What tests of experiments share: which criteria are missed."""

from __future__ import annotations

from collections.abc import Sequence

from boebot_course.experiment import Measured


def missed(measured: Sequence[Measured]) -> list[str]:
    """Names of those that are outside their criteria."""
    return [one.name for one in measured if not one.is_met]
