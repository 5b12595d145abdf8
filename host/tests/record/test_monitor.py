"""The serial monitor: lines and their times, texts to look for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.record.monitor import LINE_MAXIMUM, PATIENCE_S, Monitor


def heard(
    *pieces: tuple[float, bytes], expected: str = "", unwanted: str = ""
) -> tuple[Monitor, list[tuple[float, str]]]:
    shown: list[tuple[float, str]] = []
    monitor = Monitor(lambda time_s, line: shown.append((time_s, line)), expected, unwanted)
    for time_s, data in pieces:
        monitor.hear(time_s, data)
    return monitor, shown


def test_a_line_has_the_time_of_its_first_byte() -> None:
    _, shown = heard((0.1, b"on"), (0.2, b"e\r"), (0.3, b"\n\ntw"), (0.4, b"o\n"))
    assert shown == [(0.1, "one"), (0.3, ""), (0.3, "two")]


def test_a_prompt_is_shown_after_a_while_and_the_rest_at_the_end() -> None:
    monitor, shown = heard((0.1, b"> "))
    monitor.wait(0.1 + PATIENCE_S / 2)
    assert shown == []
    monitor.wait(0.1 + PATIENCE_S)
    monitor.hear(1.0, b"end")
    monitor.close()
    assert shown == [(0.1, "> "), (1.0, "end")]


def test_bytes_that_are_no_text_and_lines_without_end_are_shown_all_the_same() -> None:
    _, shown = heard((0.0, b"\xff\xc3\xa4\n"), (1.0, b"x" * LINE_MAXIMUM), (1.1, b"x\n"))
    assert shown == [(0.0, "\\xffä"), (1.0, "x" * LINE_MAXIMUM), (1.1, "x")]


@given(st.lists(st.binary(max_size=5), max_size=20), st.text("ab\n", min_size=1, max_size=4))
def test_a_text_is_found_however_it_comes_in_pieces(pieces: list[bytes], text: str) -> None:
    monitor, _ = heard(*((0.0, piece) for piece in pieces), expected=text, unwanted=text)
    assert monitor.found == monitor.failed == (text.encode() in b"".join(pieces))


@pytest.mark.parametrize(("text", "found", "failed"), [(b"ok bad", 1, 0), (b"bad ok", 0, 1), (b"no", 0, 0)])
def test_of_two_texts_the_first_one_counts(text: bytes, found: bool, failed: bool) -> None:
    monitor, _ = heard(*((0.0, bytes([byte])) for byte in text), expected="ok", unwanted="bad")
    assert (monitor.found, monitor.failed) == (found, failed)


@pytest.mark.parametrize(("expected", "found"), [("", False), ("ready", True), ("Ready", False)])
def test_nothing_is_found_where_nothing_is_looked_for(expected: str, found: bool) -> None:
    monitor, _ = heard((0.0, b"rea"), (0.5, b"dy"), expected=expected)
    assert monitor.found == found and not monitor.failed
