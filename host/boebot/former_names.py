"""Names that were renamed: who uses a former one gets an error that names the new one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn

DISTANCE = "true_distance, which only a simulator knows, or odometry_distance"
CONTACTS = "true_contacts, which only a simulator knows, or whisker_touches"

FIGURES: Mapping[str, str] = {
    "distance_m": "true_distance_m, which only a simulator knows, or odometry_distance_m",
    "contacts": CONTACTS,
    "contact": "true_contact, which only a simulator knows",
    "odometry": "odometry_source",
    "period_ms": "period_s",
    "longest_step_ms": "longest_step_s of wall_clock()",
    "longest_step_s": "longest_step_s of wall_clock()",
    "long_steps": "long_steps of wall_clock()",
    "real_time_factor": "real_time_factor of wall_clock()",
    "slow_reading_age_ms": "slow_reading_age_s",
}
"""Figures of a run and columns of run.csv."""


def refusal(name: str, former: Mapping[str, str]) -> str:
    """The sentence that refuses a former name; "" for any other name."""
    return f"{name!r} was renamed; expected {former[name]}" if name in former else ""


class FormerNames:
    """A class some of whose attributes were renamed: `FORMER` has the new name of each."""

    FORMER: ClassVar[Mapping[str, str]] = {}

    if not TYPE_CHECKING:  # type checkers find unknown names themselves

        def __getattr__(self, name: str) -> NoReturn:
            kind = type(self).__name__
            said = refusal(name, self.FORMER) or f"{kind!r} object has no attribute {name!r}"
            raise AttributeError(said, name=name, obj=self)


class Figures(dict[str, Any]):
    """A run's figures by name; a former name is a KeyError that names the new one."""

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(refusal(name, FIGURES) or name)
