"""One suite for every board: `pytest hil_tests --on native --on avr` (the default: both), or `--on /dev/ttyACM0`.

Tests that reach for the board's pins or for the true path carry the mark `emulated`; on a board behind a port they are
left out and counted as deselected.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from boebot.boards import is_live
from hil_tests.rig import Rig


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--on", action="append", help="board under test: native, avr, or a port; may be given again")


def boards(config: pytest.Config) -> list[str]:
    return config.getoption("--on") or ["native", "avr"]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "board_url" in metafunc.fixturenames:
        urls = [
            pytest.param(
                url, marks=pytest.mark.soak if metafunc.definition.get_closest_marker(f"soak_on_{url}") else ()
            )
            for url in boards(metafunc.config)
        ]
        metafunc.parametrize("board_url", urls, scope="session")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out what only an emulated board can be asked, where all boards under test are behind ports."""

    def out_of_reach(item: pytest.Item) -> bool:
        spec = getattr(item, "callspec", None)
        under_test = [spec.params["board_url"]] if spec and "board_url" in spec.params else boards(config)
        return all(map(is_live, under_test)) and item.get_closest_marker("emulated") is not None

    left_out = [item for item in items if out_of_reach(item)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture
def rig(board_url: str) -> Iterator[Rig]:
    """The board, greeted."""
    with Rig.open(board_url) as rig:
        rig.start()
        yield rig
