"""What pages show of the output of commands is what the commands print today."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

import copied_process
from tools import shown_output

ROOT = Path(__file__).resolve().parents[2]
AT_A_PORT = "test-a-board.md"  # see test_board_page.py
PAGES = [
    page
    for page in sorted(ROOT.glob("docs/**/*.md"))
    if "```console\n" in page.read_text(encoding="utf-8") and page.name != AT_A_PORT
]


@pytest.fixture(autouse=True)
def copied(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands run in copies of this process, as processes that start Python take seconds."""

    def printed(command: str, folder: Path) -> str:
        return copied_process.command(shlex.split(command), folder, {"COLUMNS": "80", "TERM": "dumb"}).stdout

    monkeypatch.setattr(shown_output, "printed", printed)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_page_shows_what_is_printed(page: Path) -> None:
    shown = page.read_text(encoding="utf-8")
    assert shown_output.renewed(shown, shown_output.FOLDER / page.stem) == shown, (
        f"renew it: build/venv/bin/python -m tools.shown_output {page.relative_to(ROOT)}"
    )


def test_a_line_that_is_not_printed_any_more_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="prints no line that begins with 'no such row'"):
        shown_output.renewed("```console\n$ boebot timing --help\nno such row  12\n```\n", tmp_path / "page")


def test_numbers_are_renewed_and_what_is_left_out_stays(tmp_path: Path) -> None:
    page = "Text.\n\n```console\n$ boebot timing --robot arsim\n…\nrobot 'arsim' with 7\n…\n```\n"
    shown = shown_output.renewed(page.replace("with 7", "with a brain period of 7 ms"), tmp_path / "page")
    assert "\n…\nrobot 'arsim' with a brain period of 50 ms: nothing is known of its times" in shown


PAGE_OF_A_CHANGE = """\
```toml
# mine.toml: a robot
extends = "shieldbot"
name = "mine"
```

```diff
--- mine.toml
-name = "mine"
+name = "yours"
```

```console
$ boebot show robot mine.toml
name  mine
```
"""


def test_a_change_that_a_page_shows_is_made(tmp_path: Path) -> None:
    assert re.search(r"\nname +yours\n", shown_output.renewed(PAGE_OF_A_CHANGE, tmp_path / "page"))
    with pytest.raises(ValueError, match=r"mine\.toml does not have once what is to be changed"):
        shown_output.renewed(PAGE_OF_A_CHANGE.replace('-name = "mine"', '-name = "hers"'), tmp_path / "page")
