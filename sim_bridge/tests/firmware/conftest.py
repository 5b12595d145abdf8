"""`rig`: a board in an empty field, greeted and armed."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from boebot_hil.rig import Rig


@pytest.fixture
def rig(board_url: str) -> Iterator[Rig]:
    with Rig.open(board_url) as rig:
        rig.start()
        yield rig
