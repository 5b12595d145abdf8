"""Rows of points read by themselves: the table is always the one that tomllib gives, the errors are its own."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot import resources
from boebot.description import toml_files, toml_numbers
from boebot.errors import ArenaError

TEXTS = [path.read_text(encoding="utf-8") for path in sorted(resources.folder("arenas").glob("*.toml"))]
ROWS = "[[0, 1], [-2.5, 3e2], [ 0.125,\n-0 ],\t[1E-3, 7],\n]"
PIECES = [
    f"a = {ROWS}\n",
    f"b = {{ c = {ROWS}, d = [{ROWS}, 1.5] }}\n",
    "[[shape]]\ncorners_m = [[0, 0], [1, 0], [1, 1]]\n",
    f'text = """ x = {ROWS} " "" """\n',
    f"literal = ''' y = {ROWS.splitlines()[0]} '''\n",
    'short = "= [[1, 2]] \\" # no comment"\n',
    "plain = '= [[1, 2]]'\n",
    "# z = [[1, 2], [3, 4]] in a comment with an open \" and '\n",
    "hole = 0.5e-310000000\n",
    "more = [[1, 2, 3], [4, 5]]\n",
    "odd = [[1_000, 2], [+1, 0x10]]\n",
    "last = [[1, 2], [inf, nan]]  # [[9, 9]]\n",
    "[[1, 2]] = 3\n",
    "bad = [[1, 2],, [3, 4]]\n",
    "bad = [[01, 2]]\n",
    "[table]\n",
    "= [[1, 2]]\n",
    'open = "\n',
    '"""',
    "'",
    "=",
    "]",
]


def outcome(loads: Any, text: str) -> str:
    """What it gives, with the types of all numbers, or what it says."""
    try:
        return repr(loads(text))
    except tomllib.TOMLDecodeError as error:
        return f"error: {error}"


@given(st.lists(st.sampled_from(PIECES), max_size=7).map("".join))
def test_a_text_means_what_it_means_to_tomllib(text: str) -> None:
    assert outcome(toml_numbers.loads, text) == outcome(tomllib.loads, text)


@given(
    st.sampled_from(TEXTS), st.integers(0, 3000), st.sampled_from(["", "[", "]", ",", '"', "#", "=", "\n", "e", "_"])
)
def test_a_spoilt_arena_means_what_it_means_to_tomllib(text: str, at: int, instead: str) -> None:
    spoilt = text[: at % len(text)] + instead + text[at % len(text) + 1 :]
    assert outcome(toml_numbers.loads, spoilt) == outcome(tomllib.loads, spoilt)


def test_rows_are_cut_out_and_all_else_is_not() -> None:
    assert toml_numbers._PAIRS.sub("", PIECES[0] + PIECES[2]) == "a \n[[shape]]\ncorners_m \n"
    for piece in PIECES[3:13]:
        rest = toml_numbers._PAIRS.sub(lambda match: match[0] if match["rows"] is None else "", piece)
        assert rest == piece


def test_reading_a_large_file_is_announced_and_its_errors_have_their_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "large.toml"
    row = "[[obstacle]]\ncorners_m = [[0.25, 0.5], [1.5, 0.5], [1.5, 1.5]]\n"
    file.write_text(row * 40_000 + "wrong = \n", encoding="utf-8")
    with pytest.raises(ArenaError, match=r"large\.toml is no valid TOML: Invalid value \(at line 80001"):
        toml_files.read(file, ArenaError)
    assert capsys.readouterr().err == "reading large.toml, 2.5 MB ...\n"
