"""`rig`: a board in an empty field, greeted and armed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sim_bridge.tests.rigs import SessionRig


@pytest.fixture
def rig(board_url: str) -> Iterator[SessionRig]:
    with SessionRig.open(board_url) as rig:
        rig.start()
        yield rig
