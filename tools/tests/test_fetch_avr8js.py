"""The second emulator is used only as it was pinned."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools import fetch_avr8js
from tools.tests.calibration.avr8js import VERSION


@pytest.fixture
def npm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An npm that is found, and nothing fetched yet."""
    tool = tmp_path / "npm"
    monkeypatch.setattr(fetch_avr8js, "FOLDER", tmp_path / "avr8js" / "package")
    monkeypatch.setattr(fetch_avr8js, "MARK", tmp_path / "avr8js" / "fetched")
    monkeypatch.setattr(fetch_avr8js, "find_tool", lambda name: str(tool))
    return tool


def script(tool: Path, text: str) -> None:
    tool.write_text(f"#!/bin/sh\n{text}\n", encoding="ascii")
    tool.chmod(0o755)


def test_another_archive_is_refused(npm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script(npm, f"echo other > avr8js-{VERSION}.tgz")
    assert fetch_avr8js.main() == 1
    assert f"expected {fetch_avr8js.SHA512}" in capsys.readouterr().err
    assert not fetch_avr8js.MARK.parent.exists()


def test_npm_that_fails_is_quoted(npm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script(npm, "echo 'npm error no network' >&2; exit 1")
    assert fetch_avr8js.main() == 1
    assert capsys.readouterr().err.endswith(f"avr8js {VERSION}: npm error no network\n")


def test_npm_that_is_missing_is_named(
    npm: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(fetch_avr8js, "find_tool", lambda name: None)
    assert fetch_avr8js.main() == 1
    assert "npm is not installed" in capsys.readouterr().err


def test_what_is_there_is_not_fetched_again(npm: Path) -> None:
    fetch_avr8js.MARK.parent.mkdir()
    fetch_avr8js.MARK.write_text(fetch_avr8js.SHA512, encoding="ascii")
    assert fetch_avr8js.main() == 0
