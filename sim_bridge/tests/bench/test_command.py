"""`boebot test`: the kit's own tests of boards, in a process by themselves."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import boebot_hil
from boebot.errors import CallError
from sim_bridge.bench import command

pytestmark = pytest.mark.unsanitized  # runs of pytest in processes, of the package that is installed


def test_it_says_how_it_went(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither the settings nor the tests of the folder that it is called in are heeded."""
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --no-such-option\n")
    monkeypatch.chdir(tmp_path)
    assert command.run_suite(["native"], ["-q", "-n0", "-k", "test_handshake_names_version"]) == command.PASSED


BROKEN = """
import pytest

@pytest.fixture(autouse=True)
def broken(monkeypatch):
    from boebot_hil.rig import Rig
    monkeypatch.setattr(Rig, "arm", None)
"""


def test_a_test_by_its_file_that_fails_is_kept_and_its_command_repeats_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken.py").write_text(BROKEN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=os.pathsep)
    test = f"{Path(boebot_hil.__file__).parent}/test_delivery.py::test_each_stop_is_confirmed_with_its_token"
    assert command.run_suite(["native"], ["-q", "-n0", "-p", "broken", test]) == command.FAILED
    (kept,) = (tmp_path / ".uno").iterdir()
    assert {file.name for file in kept.iterdir()} == {"again.txt", "pins.vcd", "run", "serial.txt"}
    assert b"shieldbot" in (kept / "serial.txt").read_bytes()
    again = subprocess.run((kept / "again.txt").read_text(), shell=True, capture_output=True, text=True, check=False)
    assert "1 passed" in again.stdout


@pytest.mark.wall_clock
def test_a_signal_to_the_command_alone_ends_its_tests() -> None:
    command = [sys.executable, "-m", "boebot", "test", "--on", "avr", "-n0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stderr is not None
        for line in process.stdout:
            if line.startswith("collected"):
                break
        process.terminate()
        said = process.stdout.read()  # up to its end: by then no process is left that could write
        assert "KeyboardInterrupt" in said and process.stderr.read() == "boebot: interrupted\n"
    assert process.returncode == 128 + signal.SIGTERM


def test_bad_calls_are_one_sentence(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(CallError, match="no test can run, as pytest says above"):
        command.run_suite(["native"], ["--no-such-option"])
    with pytest.raises(CallError):
        command.run_suite(["foo"], [])
    assert "ERROR: there is no board 'foo'; expected avr, native or a port" in capfd.readouterr().err
    monkeypatch.setattr(command, "find_spec", lambda name: None)
    with pytest.raises(
        CallError, match=r"boebot test needs pytest, which is not installed: pip install 'boebot\[hil\]'"
    ):
        command.run_suite(["native"], [])
