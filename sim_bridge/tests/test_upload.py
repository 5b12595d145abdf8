"""Programs written into the emulated board as into a robot: by avrdude over a pseudo-terminal, through a bootloader."""

from __future__ import annotations

import contextlib
import re
import shlex
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import serial

from boebot.boards import BoardRequest, open_port
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import frame, messages
from boebot.link.ports import open_serial, pulse_dtr
from sim_bridge.serve import carry
from sim_bridge.served_ports import Port, PtyPort, TcpPort
from sim_bridge.sessions.session import SimSession
from sim_bridge.sessions.world import AVR, open_on
from sim_bridge.tests.boards.avr.avr_program import assemble
from sim_bridge.tests.boards.avr.bootloader import KITS, of_chip
from tools.tests.calibration import board
from tools.tests.calibration.talk import START, Talk

pytestmark = pytest.mark.unsanitized

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "reference" / "robots.md"
PATIENCE_S = 10.0  # by the wall clock: the bootloader waits one second for a program


@contextmanager
def served(
    bootloader: Path = KITS, image: Path | None = None, *, tcp: bool = False
) -> Iterator[tuple[str, SimSession]]:
    """The port of an emulated Uno, as `boebot serve` offers it."""
    request = BoardRequest(
        robot=load_robot("rover"),
        arena="empty",
        noise=False,
        image=None if image is None else str(image),
        bootloader=str(bootloader),
    )
    session, ended = open_on(AVR, request), threading.Event()
    port: Port = TcpPort(0) if tcp else PtyPort(board.BAUD)
    thread = threading.Thread(
        target=carry,
        args=(session, port, lambda: not ended.is_set(), lambda _: None),
        kwargs={"has_bootloader": True},
    )
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
    end = time.perf_counter() + PATIENCE_S
    try:
        while time.perf_counter() < end:
            line.write(question)
            yield line.read(board.ASK_AGAIN_S)
    finally:
        line.close()


def test_avrdude_writes_the_calibration_program() -> None:
    """And reads it back; then the program begins."""
    with served() as (port, _):
        board.flash(port)
        talk = Talk()
        for data in heard(port, START):
            talk.hear(data)
            if talk.heard_name:
                return
    raise AssertionError("the program does not speak")


def test_another_chip_is_not_written(tmp_path: Path) -> None:
    image = of_chip(0x1E9801, tmp_path)  # an ATmega2560
    with served(image) as (port, _):
        for _ in range(2):  # the first try keeps nothing
            with pytest.raises(BoardError, match=f"{port} has the signature 1e9801"):
                board.flash(port)
    with served() as (port, _):
        board.flash(port)


PRINTS = """
main: ldi r24, 103 ; 9600 baud
 sts UBRR0L, r24
 ldi r24, 0x08
 sts UCSR0B, r24
"""
PRINTS_ONE = """
{0}: lds r25, UCSR0A
 sbrs r25, 5
 rjmp {0}b
 ldi r24, {1}
 sts UDR0, r24
"""


EDGE = b"\xf0"  # its frame has one falling edge: who begins to listen in the middle takes no other for a start bit


def program(folder: Path, says: bytes = b"h") -> Path:
    """That prints this for ever, at 9600 bit/s."""
    image = folder / "program.elf"
    parts = [PRINTS_ONE.format(number, byte) for number, byte in enumerate(says, 1)]
    image.write_bytes(assemble(PRINTS + "".join(parts) + "\n rjmp 1b"))
    return image


def test_the_boot_loader_waits_for_a_client_that_a_busy_computer_lets_wait(tmp_path: Path) -> None:
    """Longer than its own second, before the first byte and after another. Then the program goes on as soon as the
    client leaves."""
    with served(image=program(tmp_path)) as (port, session):
        with serial.Serial(port, 115_200, timeout=PATIENCE_S) as client:
            for pause_s in (1.5, 1.5):
                time.sleep(pause_s)
                client.write(b"0 ")
                assert client.read(2) == b"\x14\x10"
            assert session.sim.cycle < 1.0 * 16e6
        end = time.perf_counter() + PATIENCE_S
        while not session.board.counters()["bytes_out"] > 4 and time.perf_counter() < end:
            time.sleep(0.01)
        assert session.board.counters()["bytes_out"] > 4


def test_a_monitor_that_only_listens_meets_the_program_at_its_own_rate(tmp_path: Path) -> None:
    """A bare TCP port has no rate: the boot loader's is 115,200 bit/s, the program's 9600."""
    with served(image=program(tmp_path), tcp=True) as (url, _):
        client = open_port(url, 9600)
        begun, heard = time.perf_counter(), b""
        while not heard and time.perf_counter() < begun + PATIENCE_S:
            heard = client.read(0.1)
        client.close()
        assert set(heard) == set(b"h")


@pytest.mark.soak
def test_platformios_upload_works_as_written() -> None:
    """PlatformIO, avrdude, bootloader, firmware: afterwards the board says who it is."""
    found = re.search(r"`pio (.* /dev/ttyACM0)`", PAGE.read_text())
    assert found
    with served() as (port, _):
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


@pytest.mark.soak
def test_avrdude_writes_through_an_rfc2217_client_whose_dtr_resets(tmp_path: Path) -> None:
    """avrdude 7.1 speaks no RFC 2217, so pyserial does for it; the program is heard by the same client."""
    image = tmp_path / "program.hex"
    subprocess.run(["avr-objcopy", "-O", "ihex", program(tmp_path, EDGE), image], check=True)
    with served(tcp=True) as (url, _), socket.create_server(("127.0.0.1", 0)) as here:
        line = serial.serial_for_url(url.replace("socket", "rfc2217"), 115_200, timeout=0.005)
        words = f"-p atmega328p -c arduino -b 115200 -P net:127.0.0.1:{here.getsockname()[1]} -D -U flash:w:{image}:i"
        with line, subprocess.Popen(["avrdude", *words.split()], stderr=subprocess.DEVNULL) as tool:
            client, _ = here.accept()
            client.setblocking(False)
            assert pulse_dtr(line)
            while tool.poll() is None:
                with contextlib.suppress(OSError):
                    line.write(client.recv(4096))
                with contextlib.suppress(OSError):
                    client.sendall(line.read(line.in_waiting or 1))
            client.close()
            assert tool.returncode == 0
            line.baudrate, line.timeout = 9600, PATIENCE_S
            assert line.read_until(3 * EDGE).endswith(3 * EDGE)
            line.baudrate = 115_200
            assert pulse_dtr(line)
            line.write(b"0 ")  # the program would not answer
            assert line.read_until(b"\x14\x10").endswith(b"\x14\x10")
