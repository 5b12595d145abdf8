"""URLs of boards, and the sentences for those that lead nowhere."""

from __future__ import annotations

import os
import socket
import threading
from pathlib import Path

import pytest

from boebot.boards import BoardRequest, board_kinds, is_live, open_board, open_port
from boebot.errors import BoardError
from boebot.robots import load_robot
from peer import Peer, pty

REQUEST = BoardRequest(robot=load_robot("shieldbot"))


def test_emulated_boards_are_found_by_entry_point() -> None:
    assert {"avr", "native"} <= set(board_kinds())


@pytest.mark.parametrize(
    ("url", "live"),
    [
        ("/dev/ttyACM0", True),
        ("COM3", True),
        ("serial:/dev/ttyUSB0?baud=250000", True),
        ("socket://localhost:5000", True),
        ("native", False),
        ("COMET", False),
    ],
)
def test_ports_and_emulated_boards_are_told_apart(url: str, live: bool) -> None:
    assert is_live(url) is live


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("simulator", "there is no board 'simulator'; expected an emulated board"),
        ("/dev/does-not-exist", "there is no port /dev/does-not-exist"),
        ("serial:", "names no port"),
        ("serial:/dev/ttyUSB0?parity=even", "unknown setting 'parity=even'; expected baud=RATE"),
        ("socket://localhost", "no socket address"),
        ("socket://localhost:70000", "no socket address"),
        ("/dev/null", "/dev/null is no serial port"),
    ],
)
def test_url_that_leads_nowhere_is_one_sentence(url: str, sentence: str) -> None:
    with pytest.raises(BoardError, match=sentence):
        open_board(url, REQUEST)


def test_folder_is_no_port(tmp_path: Path) -> None:
    with pytest.raises(BoardError, match="no serial port"):
        open_port(str(tmp_path), 500_000)


@pytest.mark.skipif(os.name != "posix" or os.getuid() == 0, reason="for root nothing is forbidden")
def test_forbidden_port_says_so(tmp_path: Path) -> None:
    port = tmp_path / "port"
    port.touch(mode=0o000)
    with pytest.raises(BoardError, match="permission denied"):
        open_port(str(port), 500_000)


def test_port_is_opened_for_one_program_only() -> None:
    with pty(Peer()) as served:
        first = open_port(served.path, 500_000)
        with pytest.raises(BoardError, match="is busy: another program has it open"):
            open_port(f"serial:{served.path}", 500_000)
        first.close()
        open_port(f"serial:{served.path}?baud=250000", 500_000).close()


def test_socket_carries_bytes_both_ways_and_its_end_is_noticed() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        transport = open_port(f"socket://127.0.0.1:{port}", 500_000)
        connection, _ = server.accept()
        transport.write(b"there")
        assert connection.recv(100) == b"there"
        connection.sendall(b"back")
        assert transport.read(1.0) == b"back"
        assert transport.read(0.01) == b""
        threading.Timer(0.05, connection.close).start()
        with pytest.raises(BoardError, match="has gone"):
            transport.read(2.0)
        transport.close()


def test_closed_socket_refuses() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(BoardError, match="nobody listens there"):
        open_port(f"socket://127.0.0.1:{port}", 500_000)
