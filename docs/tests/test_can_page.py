"""Runs each command of the page of the CAN tools as it stands, in order, on an emulated robot."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import signal
import socket
import struct
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from PIL import Image

pytestmark = pytest.mark.wall_clock

PAGE = Path(__file__).resolve().parents[1] / "how-to" / "can.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PORT, SECONDS = "29536", "--seconds 30"  # of the page


class Shell:
    """Runs lines of the page in a folder."""

    def __init__(self, folder: Path, setting: str) -> None:
        self._folder = folder
        self._setting = setting
        path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
        # Without a terminal's size: pytest's workers have one there, and it would win over that of `on_screen`.
        others = {name: value for name, value in os.environ.items() if name not in ("LINES", "COLUMNS")}
        self._environment = others | {"PATH": path, "TERM": "xterm", "MPLBACKEND": "Agg"}

    def start(self, line: str, stdin: int = subprocess.DEVNULL, out: int = subprocess.PIPE) -> subprocess.Popen[bytes]:
        command = ["bash", "-c", f"{self._setting}\n{line}"]
        return subprocess.Popen(
            command,
            cwd=self._folder,
            env=self._environment,
            stdin=stdin,
            stdout=out,
            stderr=out,
            start_new_session=True,
        )

    def run(self, line: str) -> str:
        """What it prints; it must succeed."""
        (printed,) = self.run_all([line])
        return printed

    def run_all(self, lines: list[str]) -> list[str]:
        """The same of several, side by side."""
        printed = []
        for line, started in [(line, self.start(line)) for line in lines]:
            out, err = started.communicate(timeout=60)
            assert started.returncode == 0, f"{line}\n{err.decode()}"
            printed.append(out.decode())
        return printed

    @contextlib.contextmanager
    def in_background(self, line: str) -> Iterator[None]:
        """While it runs; ended by Ctrl-C."""
        started = self.start(line)
        try:
            yield
            assert started.poll() is None, line
        finally:
            os.killpg(started.pid, signal.SIGINT)
            started.communicate(timeout=20)

    @contextlib.contextmanager
    def on_screen(self, line: str) -> Iterator[bytearray]:
        """While it shows something on a terminal: all that it has shown. Ended by the key q."""
        screen, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 200, 120, 0, 0))
        started = self.start(line, terminal, terminal)
        os.close(terminal)
        shown = bytearray()

        def read() -> None:
            with contextlib.suppress(OSError):  # the terminal has gone
                while data := os.read(screen, 65536):
                    shown.extend(data)

        reader = threading.Thread(target=read)
        reader.start()
        try:
            yield shown
            os.write(screen, b"q")
            assert started.wait(20) == 0, line
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)
                started.wait()
            reader.join()
            os.close(screen)


def wait_for_port(port: int) -> None:
    """Until somebody listens there."""
    for _ in range(200):
        with contextlib.suppress(OSError), socket.create_connection(("localhost", port), 1.0):
            return
        threading.Event().wait(0.05)
    raise AssertionError("the bridge does not listen")


def wait_for(shown: bytearray, text: bytes) -> None:
    """Until a program has drawn that."""
    for _ in range(400):
        if text in shown:
            return
        threading.Event().wait(0.05)
    raise AssertionError(f"there is no {text!r} on the screen: {shown!r}")


def test_ten_commands(tmp_path: Path) -> None:
    with socket.create_server(("localhost", 0)) as free:
        port = free.getsockname()[1]
    text = PAGE.read_text().replace(PORT, str(port)).replace(SECONDS, "--seconds 2")
    blocks = BLOCK.findall(text)
    lines = [line for language, block in blocks if language == "sh" for line in block.splitlines()]
    bridge, database, setting, viewer, monitor, logger, drive, plot, replay, report, by_hand = lines
    (code,) = (block for language, block in blocks if language == "py")
    (printed,) = (block for language, block in blocks if language == "text")
    (tmp_path / "set_point.py").write_text(code)
    shell = Shell(tmp_path, setting)
    with shell.in_background(bridge):
        shell.run(database)
        wait_for_port(port)
        with shell.in_background(logger), shell.on_screen(viewer) as raw, shell.on_screen(monitor) as named:
            wait_for(named, b"Received")
            shell.run(drive)
        assert b"621" in raw and b"321" in raw, "heartbeat and telemetry"
        assert b"telemetry_5(" in named and b"ping_echo" in named and b"setpoint_signal(" in named
        assert shell.run(by_hand) == printed
    _, compared, _ = shell.run_all([plot, replay, report])
    assert Image.open(tmp_path / "ping.png").size[0] > 300
    assert "commands are the same" in compared
    with can.LogReader(tmp_path / "driven" / "can.blf") as log:
        assert sum(message.arbitration_id == 0x321 for message in log) > 180
