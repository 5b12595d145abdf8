"""One suite for every board: `pytest hil_tests --on native --on avr` (the default: both), or `--on /dev/ttyACM0`.

Tests that reach for the board's pins say so by the fixture `rig_with_pins`; on a real board they are not collected.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from boebot.boards import is_live
from rig import Rig


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--on", action="append", help="board under test: native, avr, or a port; may be given again")


def boards(config: pytest.Config) -> list[str]:
    return config.getoption("--on") or ["native", "avr"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "board_url" in metafunc.fixturenames:
        metafunc.parametrize("board_url", boards(metafunc.config), scope="session")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out, and counts as deselected, what needs the pins of a board whose pins nobody can reach."""

    def unreachable(item: pytest.Item) -> bool:
        spec = getattr(item, "callspec", None)
        url = spec.params.get("board_url", "") if spec else ""
        return is_live(url) and "rig" not in getattr(item, "fixturenames", ())

    left_out = [item for item in items if unreachable(item)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture
def rig(board_url: str) -> Iterator[Rig]:
    """The board, greeted."""
    with Rig.open(board_url) as rig:
        rig.start()
        yield rig
