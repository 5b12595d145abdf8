"""Tests with `board_url` run on both emulated boards; on one they are marked for, `soak_on_avr`, in soaks only."""

from __future__ import annotations

import pytest


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "board_url" in metafunc.fixturenames:
        marked = metafunc.definition.get_closest_marker
        boards = [
            pytest.param(url, marks=pytest.mark.soak if marked(f"soak_on_{url}") else ()) for url in ("native", "avr")
        ]
        metafunc.parametrize("board_url", boards, scope="session")
