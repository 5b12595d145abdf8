"""`boebot serve` and clients that mean harm or come at the wrong time: noise, floods, a second client, a browser."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import copied_process

pytestmark = pytest.mark.wall_clock

NOISE = random.Random(1).randbytes(1_000_000)


class Server:
    """A `boebot serve` in a process of its own."""

    def __init__(self, folder: Path, *where: str) -> None:
        self.path = folder / "served.txt"
        command = [sys.executable, "-m", "boebot", "serve", "--on", "native", *where]
        with self.path.open("w") as out:
            self.process = subprocess.Popen(command, stdout=out)
        self.said("Ctrl-C")
        self.url = self.path.read_text().splitlines()[0].rpartition(" ")[2]

    def said(self, words: str) -> str:
        """All that it has printed, once those words are in it."""
        end = time.perf_counter() + 10
        while words not in (printed := self.path.read_text()):
            assert time.perf_counter() < end and self.process.poll() is None, f"expected {words!r} in {printed!r}"
            time.sleep(0.02)
        return printed

    def client(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", int(self.url.rpartition(":")[2])), timeout=3.0)

    def memory_mb(self) -> float:
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1024

    def end(self) -> None:
        self.process.send_signal(signal.SIGINT)
        assert self.process.wait(timeout=10) == 0


@pytest.fixture(scope="module")
def tcp(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    server = Server(tmp_path_factory.mktemp("tcp"), "--tcp", "0")
    yield server
    server.end()


def info(server: Server) -> copied_process.Done:
    return copied_process.command(["doctor", server.url, "--identity", "--json"], Path.cwd())


def drives(server: Server) -> None:
    """A client that comes now meets the robot."""
    done = info(server)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["reset_cause"] == "external"


@pytest.mark.soak
def test_after_a_megabyte_of_noise_the_next_clients_drive(tcp: Server) -> None:
    with tcp.client() as noisy:
        noisy.sendall(NOISE)
        noisy.shutdown(socket.SHUT_WR)
        drives(tcp)
    for _ in range(2):
        drives(tcp)


@pytest.mark.skipif(sys.platform != "linux", reason="no /proc")
def test_flood_is_taken_at_the_rate_of_the_line_and_gives_way_to_the_next_client(tcp: Server) -> None:
    before = tcp.memory_mb()
    with tcp.client() as flood:
        flood.settimeout(0.7)
        sent = 0
        with contextlib.suppress(TimeoutError):
            while sent < 50_000_000:
                sent += flood.send(NOISE)
        assert sent < 50_000_000, "the rest waits at the client"
        assert tcp.memory_mb() < before + 10
        drives(tcp)
        with pytest.raises(OSError, match=r"reset|pipe"):
            flood.sendall(NOISE)
    tcp.said("went: it sends more than the line carries")


def test_second_client_is_refused_with_a_sentence_and_the_first_one_stays(tcp: Server) -> None:
    with tcp.client() as first:
        assert first.recv(1), "it hears the board"
        name = f"127.0.0.1:{first.getsockname()[1]}"
        done = info(tcp)
        assert done.returncode == 1
        assert done.stderr == (
            f"boebot: {tcp.url} was closed by the other side, which says "
            f"'boebot serve: refused, {name} is connected to this robot'\n"
        )
        assert first.recv(1), "and goes on"
        assert f"was refused: {name} is connected" in tcp.said("was refused: 127")
    printed = tcp.said(f"{name} went\n")
    assert f"{name} came; the board is reset\n" in printed
    drives(tcp)


@pytest.mark.parametrize(
    "pieces", [[b"GET /x HTTP/1.1\r\nHost: y\r\n\r\n"], [b"PO", b"ST / HTTP/1.1\r\n\r\n" + NOISE[:999]]]
)
def test_browser_is_refused(tcp: Server, pieces: list[bytes]) -> None:
    with tcp.client() as browser:
        for piece in pieces:
            browser.sendall(piece)
            time.sleep(0.05)
        heard = b"".join(iter(lambda: browser.recv(4096), b""))
        name = f"127.0.0.1:{browser.getsockname()[1]}"
    assert b"HTTP/1.1 403 Forbidden\r\n" in heard and heard.endswith(b"serial line, no web page\r\n")
    tcp.said(f"{name} was refused: it speaks HTTP, as browsers do")


def test_robot_is_served_on_when_nobody_reads_who_comes() -> None:
    command = [sys.executable, "-m", "boebot", "serve", "--on", "native", "--tcp", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        url, drive_it = process.stdout.readline().split()[-1], process.stdout.readline()
        assert drive_it.startswith("drive it:")
        process.stdout.close()
        for _ in range(2):
            with socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])), timeout=3.0) as client:
                assert client.recv(1)
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 0


@pytest.mark.skipif(sys.platform != "linux", reason="no /proc")
def test_noise_on_a_pseudo_terminal_ends_with_its_client(tmp_path: Path) -> None:
    server = Server(tmp_path, "--pty")
    try:
        port = os.open(server.url, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        sent, end = 0, time.perf_counter() + 30.0
        while sent < 100_000 and time.perf_counter() < end:
            with contextlib.suppress(BlockingIOError):
                sent += os.write(port, NOISE[:4096])
        assert sent >= 100_000, "as fast as it takes it: the line carries 50,000 in a second"
        os.close(port)
        server.said(f"process {os.getpid()} ({Path('/proc/self/comm').read_text().strip()}) went")
        drives(server)
    finally:
        server.end()
