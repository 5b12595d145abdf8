"""What a row of a list of mutants is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import pytest


class Mutant(NamedTuple):
    """An experiment, what is taken away from it, and how."""

    experiment: str
    taken_away: str
    patch: Callable[[pytest.MonkeyPatch], None]
