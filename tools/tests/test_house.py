"""Lines of code are counted without comments and docstrings; a room that grows is named; numbers shrink."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tools import house

PYTHON = '''"""A docstring
of two lines."""

# a comment
NAME = """a text
of two lines"""


def work() -> int:
    """Another."""
    return (
        1  # and code
    )
'''
C = """/* a comment
   of two lines */
int x; /* code */

// a comment
int y;
"""


def test_lines_of_code_are_those_that_do_something() -> None:
    assert house.code_lines("a.py", PYTHON) == 6
    assert house.code_lines("a.c", C) == 2
    assert house.code_lines("a.sh", "#!/bin/sh\n# comment\nset -e\n") == 1


def test_rooms_and_guests() -> None:
    assert house.room("host/boebot/link/ports/tcp.py") == "host/boebot/link"
    assert house.room("sim_bridge/boards/avr/avr_pins.c") == "sim_bridge/boards" and house.room("setup.py") == "."
    assert house.is_guest("tools") and house.is_guest("host/avr_timing/flow")
    assert not house.is_guest("host/boebot") and not house.is_guest("sim_bridge")


def test_room_that_grows_is_named_and_numbers_only_shrink(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    numbers = house.ROOT / "build" / tmp_path.name
    monkeypatch.setattr(house, "NUMBERS", numbers)
    numbers.write_text('"a" = 10\n"b" = { lines = 20, why = "two lines" }\n"c" = 30\n"gone" = 5\n')
    most, found = house.allowed(), Counter({"a": 11, "b": 20, "c": 7, "new": 3})
    numbers.unlink()
    first, second = house.grown(found, most)
    assert first.startswith("a has 11 lines of code,") and "allows 10: expected fewer" in first
    assert second.startswith("new has 3 lines of code,")
    assert house.shrunk(found, most) == f'{house.HEAD}"a" = 10\n"b" = {{ lines = 20, why = "two lines" }}\n"c" = 7\n'
    assert "why" not in house.shrunk(Counter({"b": 19}), most).removeprefix(house.HEAD)
