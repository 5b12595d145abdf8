"""A guest that is broken is named in one sentence, and leaves the rest usable."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from boebot import guests
from command import boebot


@pytest.fixture
def _broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package whose command and whose check cannot be imported, and with a command that is none."""
    (tmp_path / "sick-1.0.dist-info").mkdir()
    text = "[boebot.commands]\nsick = a_module_that_is_not_there:COMMAND\nodd = math:pi\n"
    text += "[boebot.checks]\nsick = a_module_that_is_not_there:CHECK\n"
    (tmp_path / "sick-1.0.dist-info" / "entry_points.txt").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    caches = (guests._all, guests.guests)
    for one in caches:
        one.cache_clear()
    yield
    for one in caches:
        one.cache_clear()


@pytest.mark.usefixtures("_broken")
def test_a_broken_guest_is_one_sentence_and_other_commands_work(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "sick")
    assert (code, out) == (1, "") and len(err.splitlines()) == 1
    assert "'sick' of an installed package cannot be loaded: a_module_that_is_not_there:COMMAND" in err
    code, out, err = boebot(capsys, "--help")
    assert (code, err) == (0, "") and "cannot be loaded" in out and "run" in out


@pytest.mark.usefixtures("_broken")
def test_a_command_that_is_none_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "odd")
    assert (code, out) == (1, "") and len(err.splitlines()) == 1 and "no command: math:pi; expected" in err


@pytest.mark.usefixtures("_broken")
def test_a_broken_check_refuses_runs_that_are_not_forced(capsys: pytest.CaptureFixture[str]) -> None:
    command = ("run", "wander", "--seconds", "0.1")
    code, out, err = boebot(capsys, *command)
    assert (code, out) == (1, "") and len(err.splitlines()) == 1
    assert "'sick' of an installed package cannot be loaded" in err and "--force-timing runs it all the same" in err
    assert boebot(capsys, *command, "--force-timing")[0] == 0
