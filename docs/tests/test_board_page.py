"""docs/how-to/test-a-board.md: what pytest prints at a port, here an emulated Uno's with a boot loader."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim_bridge.tests.test_upload import served
from tools import shown_output

pytestmark = [pytest.mark.soak, pytest.mark.unsanitized]  # four programs are compared or written, by the wall clock

PAGE = Path(__file__).resolve().parents[1] / "how-to" / "test-a-board.md"
PORT = "/dev/ttyACM0"


def test_page_shows_what_is_printed_at_a_port() -> None:
    shown = PAGE.read_text(encoding="utf-8")
    with served() as (port, _):
        there = shown_output.renewed(shown.replace(PORT, port), shown_output.FOLDER / PAGE.stem)
    assert there.replace(port, PORT) == shown
