"""The fixture `uno` on a board behind a port: an emulated one, served with its boot loader, so that avrdude writes and
reads it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from boebot.errors import CallError
from sim_bridge.bench import command
from sim_bridge.bench import uno as of_uno
from sim_bridge.tests.bench.test_plugin import SERVO, run
from sim_bridge.tests.boards.avr.avr_program import compiled
from sim_bridge.tests.test_upload import served

pytest_plugins = ["pytester"]
pytestmark = [pytest.mark.wall_clock, pytest.mark.unsanitized]

TESTS = """
@pytest.mark.uno(image="own.elf", baud=9600, motors=False)
def test_answers(uno):
    uno.serial.expect(b"ready", within=0.1)  # from when the boot loader has begun the program
    uno.serial.send(b"+")
    uno.serial.expect(b"+", within=0.01)
    uno.fault(f"serial.doubled=1@{uno.now}..{uno.now + 1}")
    uno.serial.send(b"-")
    uno.serial.expect(b"--", within=0.01)

@pytest.mark.uno(image="own.elf", baud=9600, motors=False)
def test_world(uno):
    uno.reset()

@pytest.mark.uno(image="own.elf", baud=9600)
def test_moves(uno):
    pass

@pytest.mark.uno(image="own.elf", motors=False)
def test_without_rate(uno):
    pass
"""


def test_a_port_is_written_only_when_it_may_be(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled(SERVO, Path(pytester.path, "own.elf"))
    with served() as (port, _):
        result = run(pytester, TESTS, f"--uno-on={port}")
        result.assert_outcomes(errors=3, skipped=1)
        result.stdout.fnmatch_lines([
            f"uno: the board at {port} has another program than own.elf; expected it, or --uno-flash",
            f"uno: {port} does not know the program's bit rate; expected it in the mark: baud=9600",
        ])  # fmt: skip
        result = run(pytester, TESTS, f"--uno-on={port}", "--uno-flash")
        result.assert_outcomes(passed=1, errors=1, skipped=2)
        result.stdout.fnmatch_lines([
            "1 x a test cannot reach the reset line of a board at a port",
            "1 x the program may turn motors; expected --uno-motors, or motors=False in the mark",
        ])  # fmt: skip
        monkeypatch.setattr(of_uno, "_holds", {})
        result = run(pytester, TESTS, f"--uno-on={port}", "-k", "answers")
        result.assert_outcomes(passed=1)
    shutil.rmtree(pytester.path / ".uno", ignore_errors=True)


def test_several_processes_do_not_open_one_port(pytester: pytest.Pytester) -> None:
    result = run(pytester, TESTS, "--uno-on=/dev/ttyACM7", "-n", "2")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*--uno-on=/dev/ttyACM7: one process at a time can have it open; expected no -n"])


def test_a_board_without_the_kits_firmware_is_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with served(image=compiled(SERVO, tmp_path / "own.elf")) as (port, _), pytest.raises(CallError):
        command.run_suite([port], ["-q"])
    sentence = f"the board at {port} does not speak the kit's protocol; expected its firmware: boebot flash --on {port}"
    assert sentence in capfd.readouterr().err
