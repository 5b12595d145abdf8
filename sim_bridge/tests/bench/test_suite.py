"""`boebot test`: the kit's own tests of boards, in a process by themselves."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot.errors import CallError
from sim_bridge.bench import suite


def test_it_says_how_it_went(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the settings nor the tests of the folder that it is called in are heeded."""
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --no-such-option\n")
    monkeypatch.chdir(tmp_path)
    assert suite.run_suite(["native"], ["-q", "-n0", "-k", "test_handshake_names_version"]) == suite.PASSED


def test_bad_calls_are_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(CallError, match="no test can run, as pytest says above"):
        suite.run_suite(["native"], ["--no-such-option"])
    monkeypatch.setattr(suite, "find_spec", lambda name: None)
    with pytest.raises(
        CallError, match=r"boebot test needs pytest, which is not installed: pip install 'boebot\[hil\]'"
    ):
        suite.run_suite(["native"], [])
