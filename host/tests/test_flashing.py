"""Programs that cannot be written into a board; those that can: cli/test_flash.py."""

from __future__ import annotations

from pathlib import Path

import pytest

from boebot import flashing
from boebot.errors import BoardError, CallError


def flashed(port: str, data: bytes = b"\x01\x02") -> None:
    flashing.write(data, port)


def test_avrdude_that_is_missing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BoardError, match=r"needs avrdude, which is not installed: expected it on the PATH$"):
        flashed("/dev/robot")


@pytest.mark.parametrize(
    ("port", "sentence"),
    [
        ("/dev/no-board", "/dev/no-board cannot be opened: no such file or directory"),
        ("socket://127.0.0.1:1", "socket://127.0.0.1:1 cannot be opened: connection refused"),
    ],
)
def test_a_port_that_is_none(port: str, sentence: str) -> None:
    with pytest.raises(BoardError, match=sentence):
        flashed(port)


def test_what_cannot_be_written() -> None:
    with pytest.raises(BoardError, match="has 32257 bytes; expected 32256 at most"):
        flashed("/dev/robot", bytes(32257))
    for port in ("avr", "rfc2217://host:1"):
        with pytest.raises(CallError, match="cannot be written through"):
            flashed(port)
    with pytest.raises(CallError, match="is no socket address; expected socket://HOST:PORT"):
        flashed("socket://host")
