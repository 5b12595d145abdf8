"""The list of random mutants is one that random_mutants.py can run, and its changes are those that it names."""

from __future__ import annotations

import json

import pytest

from tools.tests.mutations import KINDS, c_edits, python_edits
from tools.tests.random_mutants import LIST, OUTCOMES, ROOMS


def test_list_is_whole() -> None:
    mutants = json.loads(LIST.read_text(encoding="utf-8"))["mutants"]
    assert len({mutant["id"] for mutant in mutants}) == len(mutants) >= 90
    for mutant in mutants:
        assert mutant["room"] in ROOMS, mutant["id"]
        assert mutant["kind"] in KINDS, mutant["id"]
        assert mutant["before"] != mutant["after"], mutant["id"]
        assert set(mutant["results"]) <= {"before", "after"}, mutant["id"]
        assert all(result.startswith(OUTCOMES) for result in mutant["results"].values()), mutant["id"]


def changed(source: str, language: str) -> list[str]:
    """The single line of a source, in all ways that it may be changed."""
    edits = (python_edits if language == "python" else c_edits)(source.encode(), 1)
    return [source[:start] + instead + source[end:] for _, start, end, instead in edits]


@pytest.mark.parametrize(
    ("language", "source", "expected"),
    [
        ("python", "x = a < 2", {"x = a <= 2", "x = a < 3"}),
        ("python", "not a and f(b, c)", {"not a or f(b, c)", "a and f(b, c)", "not a and f(c, b)"}),
        ("python", "self.x = 'a + 1'", {"pass"}),
        ("python", "raise ValueError(1, 'a')", {"pass"}),
        ("python", "x: Literal[1] = y", set()),
        ("python", "def f(): return y", {"def f(): return None"}),
        (
            "c",
            "  x = a + f(b, c);  // 3\n",
            {"  x = a - f(b, c);  // 3\n", "  x = a + f(c, b);  // 3\n", "  ;  // 3\n"},
        ),
        ("c", '  if (!a) print("1 < 2");\n', {'  if (a) print("1 < 2");\n'}),
        ("c", "  return a[2u];\n", {"  return a[3u];\n", "  return 0;\n"}),
        ("c", "#define A 1\n", set()),
    ],
)
def test_changes(language: str, source: str, expected: set[str]) -> None:
    assert set(changed(source, language)) == expected
