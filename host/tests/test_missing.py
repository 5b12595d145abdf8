"""What is not installed, in a sentence with the command to type; each extra by a command: tools/tests/test_wheel.py."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import boebot
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


def test_a_copy_of_another_system_is_one_sentence(tmp_path: Path) -> None:
    """Its parts in C have other names: another system's wheel, unpacked by hand."""
    library = Path(boebot.__file__).parent
    shutil.copytree(library, tmp_path / "boebot", ignore=shutil.ignore_patterns("*.so", "*.pyd", "__pycache__"))
    command = [sys.executable, "-c", "from boebot.cli import main; main()", "list", "robots"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.startswith("boebot: this copy of boebot is of another system, or not compiled: No module named")
    assert ended.stderr.endswith(": pip install --force-reinstall boebot\n") and len(ended.stderr.splitlines()) == 1


def test_what_only_a_checkout_can_build(monkeypatch: pytest.MonkeyPatch) -> None:
    assert missing.built("firmware") == "build it with `make firmware`"
    monkeypatch.setattr(resources, "checkout", lambda: None)
    assert missing.built("firmware") == "only a checkout of boebot can build it with `make firmware`"
