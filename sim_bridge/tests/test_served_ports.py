"""The ports of a served robot by themselves: who comes and goes, what is heard of them."""

from __future__ import annotations

import os
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import serial

from sim_bridge.served_ports import Port, PtyPort, TcpPort


@contextmanager
def tcp() -> Iterator[tuple[TcpPort, socket.socket]]:
    port = TcpPort(0)
    try:
        with socket.create_connection(("127.0.0.1", int(port.url.rpartition(":")[2]))) as client:
            assert heard(port, 1) == ["came"]
            yield port, client
    finally:
        port.close()


def heard(port: Port, count: int) -> list[str]:
    """What has happened, as soon as it is that much."""
    found, end = [visit.what for visit in port.look()], time.perf_counter() + 5
    while len(found) < count and time.perf_counter() < end:
        port.wait(0.01)
        found += [visit.what for visit in port.look()]
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="inotify")
def test_every_opening_of_a_pty_is_seen_however_short() -> None:
    """As of PlatformIO, which opens and closes the port just before avrdude does; a second opening beside the first one
    leaves DTR on, and is none."""
    port = PtyPort(115_200)
    try:
        first = os.open(port.url, os.O_RDWR)
        os.close(first)
        second = os.open(port.url, os.O_RDWR)
        assert heard(port, 3) == ["came", "went", "came"]
        third = os.open(port.url, os.O_RDWR)
        os.close(third)
        os.write(second, b"F")
        assert heard(port, 0) == [] and port.take(9) == b"F"
        os.close(second)
        assert heard(port, 1) == ["went"]
        with open(port.url, "wb", buffering=0) as shell:  # noqa: PTH123 (echo F >/dev/pts/N)
            shell.write(b"F")
        assert heard(port, 2) == ["came", "went"] and port.take(9) == b"F"
    finally:
        port.close()


@pytest.mark.parametrize("typed", [b"F", b"GO\n", b"GETTING\n"])
def test_the_first_letter_of_a_monitor_is_no_browser(typed: bytes) -> None:
    with tcp() as (port, client):
        client.sendall(typed)
        port.wait(1)
        assert port.look() == [] and port.take(99) == typed


def test_rfc2217_sets_the_rate_and_resets_the_board() -> None:
    port, ended = TcpPort(0), threading.Event()
    seen: list[str] = []

    def serve() -> None:
        while not ended.is_set():
            port.wait(0.01)
            seen.extend(visit.what for visit in port.look())
            port.write(port.take(99).upper())

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        url = port.url.replace("socket", "rfc2217")
        with serial.serial_for_url(url, baudrate=9600, timeout=3) as client:
            assert port.baud() == 9600
            before = seen.count("reset")
            client.dtr = False
            client.dtr = True
            client.write(b"f\xff")
            assert client.read(2) == b"F\xff"
            assert seen.count("reset") == before + 1
            client.baudrate = 115_200
            assert port.baud() == 115_200
    finally:
        ended.set()
        thread.join()
        port.close()
    assert seen[0] == "came"
