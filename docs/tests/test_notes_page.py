"""The page of what differs from the lecture notes names files that are there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "reference" / "notes.md").read_text(encoding="utf-8")


def test_every_file_is_there() -> None:
    files = re.findall(r"`((?:host|sim_bridge|protocol)/[\w./]+)`", PAGE)
    assert len(files) > 30
    assert not [file for file in files if not (ROOT / file).is_file()]


def test_nothing_cites_what_a_reader_cannot_open() -> None:
    """Papers of those who made the kit, which are not in it."""
    names = re.compile(r"\b(?:THEORY|ANCHORS|HARDWARE)\b[ ,:.]|of the specification|The specification's")
    sources = [
        path
        for folder in ("firmware", "host", "hil_tests", "protocol", "sim_bridge", "tools", "docs")
        for kind in ("*.py", "*.[chS]", "*.toml", "*.md", "*.def")
        for path in (ROOT / folder).rglob(kind)
    ]
    assert len(sources) > 500
    citing = [path for path in sources if names.search(path.read_text(encoding="utf-8")) and path != Path(__file__)]
    assert not citing, [str(path.relative_to(ROOT)) for path in citing]
