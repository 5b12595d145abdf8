"""The figures of docs/reference/navigation-figures.md keep their criteria: hundreds of runs, in `make soak`.

Ten of each are in `make test`: test_office_tasks.py, test_localization.py, test_explore.py.
"""

from __future__ import annotations

import pytest

from boebot_course.tests.navigation_figures.figures import FIGURES


@pytest.mark.soak
@pytest.mark.unsanitized
@pytest.mark.parametrize("name", FIGURES)
def test_criteria_are_met(name: str) -> None:
    measured = FIGURES[name]()
    assert any(one.expected != "no criterion" for one in measured) or name == "Rooms that look alike"
    assert not [f"{one.name}: {one.text}, expected {one.expected}" for one in measured if not one.is_met]
