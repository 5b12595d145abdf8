"""Programs written into the emulated board as into a robot: by avrdude over a pseudo-terminal, through a bootloader."""

from __future__ import annotations

import re
import shlex
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from boebot.boards import BoardRequest
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot.link.ports import open_serial
from hil_tests.bootloader import KITS, of_chip
from sim_bridge.serve import carry
from sim_bridge.served_ports import PtyPort
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import AVR, open_on
from tools.tests.calibration import board
from tools.tests.calibration.talk import START, Talk

pytestmark = pytest.mark.emulated

ROOT = Path(__file__).resolve().parents[1]
TUTORIAL = ROOT / "docs" / "tutorial" / "first-brain.md"
PATIENCE_S = 10.0  # by the wall clock: the bootloader waits one second for a program


@contextmanager
def served(bootloader: Path) -> Iterator[tuple[str, SimSession]]:
    """The port of an emulated board, as `boebot serve` offers it."""
    request = BoardRequest(robot=load_robot("rover"), arena="empty", noise=False, bootloader=str(bootloader))
    session, port, ended = open_on(AVR, request), PtyPort(board.BAUD), threading.Event()
    thread = threading.Thread(target=carry, args=(session, port, lambda: not ended.is_set(), lambda _: None))
    thread.start()
    try:
        yield port.url, session
    finally:
        ended.set()
        thread.join()
        port.close()
        session.close()


def heard(port: str, question: bytes) -> Iterator[bytes]:
    """What a program says that is asked again and again, from its start: opening the port resets the board."""
    line = open_serial(port, board.BAUD, baud_given=True)
    end = time.monotonic() + PATIENCE_S
    try:
        while time.monotonic() < end:
            line.write(question)
            yield line.read(board.ASK_AGAIN_S)
    finally:
        line.close()


def test_avrdude_writes_the_calibration_program() -> None:
    """And reads it back; then the program begins."""
    with served(KITS) as (port, _):
        board.flash(port)
        talk = Talk()
        for data in heard(port, START):
            talk.hear(data)
            if talk.heard_name:
                return
    raise AssertionError("the program does not speak")


def test_another_chip_is_not_written(tmp_path: Path) -> None:
    image = of_chip(0x1E9801, tmp_path)  # an ATmega2560
    with served(image) as (port, _), pytest.raises(BoardError, match=f"could not flash .* {port}"):
        board.flash(port)


@pytest.mark.soak
def test_the_tutorials_upload_works_as_written() -> None:
    """PlatformIO, avrdude, bootloader, firmware: afterwards the board says who it is."""
    found = re.search(r"^pio (.*)$", TUTORIAL.read_text(), re.MULTILINE)
    assert found
    with served(KITS) as (port, _):
        words = shlex.split(found[1].replace("/dev/ttyACM0", port))
        done = subprocess.run([ROOT / "tools" / "pio", *words], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        decoder = frame.Decoder(frame.NO_SESSION)
        for data in heard(port, b""):
            for message_id, _, payload in decoder.feed(data):
                if message_id == messages.Hello.ID:
                    assert messages.Hello.unpack(payload).robot.rstrip(b"\0") == b"shieldbot"
                    return
    raise AssertionError("the board does not say hello")
