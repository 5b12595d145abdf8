"""`boebot flash` with real avrdude, into the Uno that `boebot serve --bootloader` offers: what goes well, and one
sentence in bounded time for what does not, after which another try works."""

from __future__ import annotations

import signal
import subprocess
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest
import serial
from serial.tools import list_ports
from serving import serving

import copied_process
from boebot import flashing
from boebot.cli import flash as command
from boebot.errors import BoardError, CallError
from sim_bridge.sessions.session import SimSession
from sim_bridge.tests.test_upload import program, served

pytestmark = pytest.mark.wall_clock

SMALL = bytes.fromhex("529a5a9affcf") + bytes(range(250)) * 3
LARGE = SMALL + bytes(range(251)) * 40
PATIENCE_S = 3.0  # of these tests; a user's is longer


def boebot(*arguments: str) -> copied_process.Done:
    return copied_process.command(arguments, Path.cwd())


def uno(*options: str) -> AbstractContextManager[tuple[str, subprocess.Popen[str]]]:
    """The URL of an Uno that another process serves, and that process."""
    return serving("--on", "avr", "--bootloader", "--arena", "empty", *options)


def test_the_kits_firmware_is_written_and_shakes_hands() -> None:
    with uno("--pty", "--robot", "rover") as (port, _):
        done = boebot("flash", "--on", port, "--robot", "shieldbot")
        assert done.returncode == 0, done.stderr
        written, answers = done.stdout.splitlines()
        assert written.startswith("shieldbot.elf: 2") and written.endswith(f"the board at {port}, and read back")
        assert answers.startswith("it answers: firmware ") and ", pin map shieldbot, image of 2" in answers


def test_a_program_of_ones_own_prints_its_first_line(tmp_path: Path) -> None:
    image = program(tmp_path, b"hello\n")
    with uno("--tcp", "0", "--robot", "rover") as (port, _):
        done = boebot("flash", str(image), "--on", port)
    assert done.returncode == 0 and done.stdout.splitlines()[1].endswith("it prints: hello"), done.stdout + done.stderr


# ---- what goes wrong -------------------------------------------------------------------------------------------------


def flashed(port: str, data: bytes = SMALL) -> None:
    flashing.write(data, port, silence_s=PATIENCE_S)


def test_what_holds_the_port_is_named_and_a_retry_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor is there any avrdude at first."""
    with served() as (port, _):
        with monkeypatch.context() as changed:
            changed.setenv("PATH", str(tmp_path))
            with pytest.raises(BoardError, match="needs avrdude, which is not installed: expected it on the PATH"):
                flashed(port)
        with serial.Serial(port), pytest.raises(BoardError, match=f"^{port} is busy: this program itself"):
            flashed(port)
        flashed(port)


def test_a_rate_that_no_port_has_is_refused_before_the_board_is_touched() -> None:
    done = boebot("flash", "--baud", "300", "--on", "/dev/no-board")
    assert done.returncode == 2 and "Invalid value for '--baud'" in done.stderr


def test_of_several_ports_none_is_guessed(monkeypatch: pytest.MonkeyPatch) -> None:
    for there, sentence in (
        ([], "no board at a USB port"),
        (["/dev/a", "/dev/b"], "several USB ports, /dev/a, /dev/b;"),
    ):
        ports = [type("Port", (), {"device": name, "vid": 0x2341}) for name in there]
        ports.append(type("Port", (), {"device": "/dev/ttyS0", "vid": None}))  # a computer's own
        monkeypatch.setattr(list_ports, "comports", lambda ports=ports: ports)
        with pytest.raises(BoardError if not there else CallError, match=sentence):
            command._only_port()


def spoilt(deed: Callable[[SimSession], None], at: int) -> str:
    """The sentence for an upload on which something is done once the board has sent that many bytes; another try must
    work then."""
    with served() as (port, session):

        def watch() -> None:
            begin = session.board.counters()["bytes_out"]
            while session.board.counters()["bytes_out"] < begin + at:
                time.sleep(0.001)
            deed(session)

        thread = threading.Thread(target=watch)
        thread.start()
        begun = time.perf_counter()
        with pytest.raises(BoardError) as caught:
            flashed(port, LARGE)
        assert time.perf_counter() - begun < 30
        thread.join()
        flashed(port)
    return str(caught.value)


@pytest.mark.soak
@pytest.mark.parametrize("at", [60, 200, 5000], ids=["begin", "writing", "verifying"])
def test_a_brown_out_in_mid_upload(at: int) -> None:
    """The boot loader starts the program then."""
    assert "answer" in spoilt(lambda session: session.board.reset("brown_out"), at)


@pytest.mark.soak
def test_a_byte_that_is_lost() -> None:
    assert "answer" in spoilt(lambda session: session.robot.send(b"\x00"), 60)


@pytest.mark.parametrize("mark", [0, pytest.param(5, marks=pytest.mark.soak), pytest.param(70, marks=pytest.mark.soak)])
def test_the_cable_is_pulled_out(mark: int) -> None:
    """Before the first answer, while it writes, while it reads back."""
    with uno("--pty", "--robot", "rover") as (port, server):
        if not mark:
            server.send_signal(signal.SIGSTOP)
            threading.Timer(1.0, server.kill).start()
        begun = time.perf_counter()
        with pytest.raises(BoardError, match=rf"^the board at {port} (does not|stopped)"):
            flashing.write(
                LARGE, port, lambda share: server.kill() if share >= mark > 0 else None, silence_s=PATIENCE_S
            )
        assert time.perf_counter() - begun < 15
    with served() as (port, _):  # plugged in again
        flashed(port)


@pytest.mark.soak
def test_an_upload_that_is_aborted_leaves_the_port_free() -> None:
    def interrupt(share: float) -> None:
        if share > 20:
            raise KeyboardInterrupt

    with served() as (port, _):
        with pytest.raises(KeyboardInterrupt):
            flashing.write(LARGE, port, interrupt)
        flashed(port)


@pytest.mark.soak
def test_uploads_hold_on_a_busy_computer() -> None:
    """30 KB, four at once, beside eight programs that compute."""
    data = SMALL + bytes(range(251)) * 117
    busy = [subprocess.Popen(["timeout", "60", "sh", "-c", "while :; do :; done"]) for _ in range(8)]
    failed: list[str] = []

    def upload(where: tuple[str, ...]) -> None:
        with uno(*where, "--robot", "rover") as (port, _):
            for _ in range(2):
                try:
                    flashing.write(data, port)
                except BoardError as error:
                    failed.append(str(error))

    try:
        threads = [threading.Thread(target=upload, args=(where,)) for where in [("--pty",), ("--tcp", "0")] * 2]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        for process in busy:
            process.terminate()
            process.wait()
    assert failed == []
