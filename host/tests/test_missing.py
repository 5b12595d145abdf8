"""What is not installed, in a sentence with the command to type; each extra by a command: tools/tests/test_wheel.py."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot import missing, resources
from boebot.errors import BoardError


def test_a_program_is_brought_by_the_systems_installer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert missing.installer(apt_get="gcc-avr", brew="avr-gcc") == ""
    for name in ("brew", "apt-get"):  # where both are, the first of the list
        (tmp_path / name).touch(0o755)
    assert missing.installer(brew="avr-gcc") == "brew install avr-gcc"
    needs = "Flashing needs avrdude, which is not installed: "
    assert missing.program("Flashing", "avrdude", apt_get="avrdude") == needs + "sudo apt install avrdude"
    assert missing.program("Flashing", "avrdude", winget="X") == needs + "expected it on the PATH"


def test_a_package_that_is_broken_is_no_missing_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_package.py").write_text("import not_there_at_all\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(BoardError, match=r"^CAN needs x, which cannot be loaded: No module named 'not_there_at_all'$"):
        missing.imported("broken_package", "CAN", "x", "can", BoardError)
    with pytest.raises(BoardError, match=r"^CAN needs x, which is not installed: pip install .boebot\[can\].$"):
        missing.imported("not_there.module", "CAN", "x", "can", BoardError)


def test_what_only_a_checkout_can_build(monkeypatch: pytest.MonkeyPatch) -> None:
    assert missing.built("firmware") == "build it with `make firmware`"
    monkeypatch.setattr(resources, "checkout", lambda: None)
    assert missing.built("firmware") == "only a checkout of boebot can build it with `make firmware`"
