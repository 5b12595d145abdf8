"""Each test of boebot_hil names what it proves by words of PROTOCOL.md; each point of that page that promises something
of a board has a test."""

from __future__ import annotations

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "protocol" / "PROTOCOL.md").read_text(encoding="utf-8")
# What a host promises (host/tests/link), and what every frame of every test shows.
OF_THE_HOST = (
    *("On opening its port the host", "If `session` is 0, the host draws", "A host that hears a `hello`"),
    *("**set_point**: the latest counts", "`id` names the message", "COBS (consistent overhead", "`c2 c1 c0` carry"),
)


def plain(text: str) -> str:
    """Words alone, with one space between two."""
    return " ".join(text.split())


def promises() -> dict[str, list[str]]:
    """The words that the tests of the suite quote, by test."""
    found = {}
    for path in sorted((ROOT / "hil_tests" / "boebot_hil").glob("test_*.py")):
        for test in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(test, ast.FunctionDef) and test.name.startswith("test_"):
                marks = [mark for mark in test.decorator_list if ast.unparse(mark).startswith("pytest.mark.promise(")]
                quoted = [argument for mark in marks if isinstance(mark, ast.Call) for argument in mark.args]
                found[f"{path.name}: {test.name}"] = [plain(ast.literal_eval(words)) for words in quoted]
    return found


def points() -> list[str]:
    """The points of the page's lists, under the headings that are about more than one message."""
    sections = re.findall(r"^## (Frame|Session|Delivery|Fail-safe)$\n(.*?)(?=^## )", PAGE, re.MULTILINE | re.DOTALL)
    assert len(sections) == 4
    pieces = [piece for _, text in sections for piece in re.split(r"^(?:\*|\d\.) ", text, flags=re.MULTILINE)[1:]]
    return [plain(piece.split("\n\n")[0]) for piece in pieces]


def test_each_test_quotes_the_page() -> None:
    page = plain(PAGE)
    tests = promises()
    assert len(tests) >= 60
    assert [name for name, words in tests.items() if not words] == []
    assert [(name, word) for name, words in tests.items() for word in words if word not in page] == []


def test_each_point_of_the_page_has_a_test() -> None:
    quoted = [words for found in promises().values() for words in found]
    assert len(points()) > 30
    unproved = [point for point in points() if not any(words in point for words in quoted)]
    assert [point for point in unproved if not point.startswith(OF_THE_HOST)] == []
