"""What is not installed, in a sentence with the command to type; each extra by a command: tools/tests/test_wheel.py."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import _cffi_backend
import pytest

from boebot import missing, resources
from boebot.errors import BoardError

ROOT = Path(__file__).parents[2]


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


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout with libraries to damage."""
    folder = tmp_path_factory.mktemp("checkout")
    for name in ("host", "sim_bridge"):
        ignored = shutil.ignore_patterns("__pycache__", "tests", "*.c")
        shutil.copytree(ROOT / name, folder / name, ignore=ignored)
    for name in ("protocol", "build"):
        (folder / name).symlink_to(ROOT / name)
    return folder


def run_in(copy: Path, board: str) -> subprocess.CompletedProcess[str]:
    script = """
import sys
sys.meta_path = [one for one in sys.meta_path if "editable" not in repr(one)]  # which finds the true checkout's modules
from boebot.cli import main
main()"""
    command = [sys.executable, "-c", script, "run", "wander", "--on", board, "--seconds", "0.1"]
    there = os.environ | {"PYTHONPATH": f"{copy / 'host'}{os.pathsep}{copy}"}
    return subprocess.run(command, cwd=copy, env=there, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("library", "board", "other"),
    [
        ("sim_bridge/_core", "native", "avr"),
        ("sim_bridge/boards/avr/_avr", "avr", "native"),
        ("sim_bridge/images/firmware-shieldbot", "native", "avr"),
        ("host/boebot/arenas/_arena", "native", "avr"),
        ("host/boebot/link/_codec", "avr", "native"),
    ],
)
def test_a_library_that_cannot_be_loaded_is_one_sentence(copy: Path, library: str, board: str, other: str) -> None:
    """Cut short, empty, of another processor, of another module, or not there; other boards do without the AVR's and
    the firmware's."""
    (file,) = copy.glob(f"{library}.*so")
    whole = file.read_bytes()
    elsewhere = bytearray(whole)
    elsewhere[18:20] = b"\xb7\0" if whole[18] != 0xB7 else b"\x3e\0"  # e_machine: aarch64, or else x86-64
    damaged = {
        "it is cut short": whole[: len(whole) // 2],
        "file too short": b"",
        "it is for another processor": bytes(elsewhere),
        "PyInit_|no firmware_board_api": Path(_cffi_backend.__file__).read_bytes(),
    }
    for reason, data in damaged.items():
        file.unlink()
        file.write_bytes(data)
        ended = run_in(copy, board)
        assert ended.returncode == 1 and len(ended.stderr.splitlines()) == 1, ended.stderr
        assert f"{file} cannot be loaded" in ended.stderr and re.search(reason, ended.stderr), ended.stderr
        assert ended.stderr.endswith("; delete it, then type `make setup`\n")
    is_needed_everywhere = not library.endswith(("_avr", "shieldbot"))
    assert run_in(copy, other).returncode == is_needed_everywhere
    file.unlink()
    ended = run_in(copy, board)
    assert ended.returncode == 1 and len(ended.stderr.splitlines()) == 1, ended.stderr
    assert re.search(r"is not there; type|there is no firmware .*; build it with", ended.stderr)
    assert ended.stderr.endswith(" `make setup`\n")
    file.write_bytes(whole)
    assert run_in(copy, board).returncode == 0


def test_what_only_a_checkout_can_build(monkeypatch: pytest.MonkeyPatch) -> None:
    assert missing.built("firmware") == "build it with `make firmware`"
    monkeypatch.setattr(resources, "checkout", lambda: None)
    assert missing.built("firmware") == "only a checkout of boebot can build it with `make firmware`"
