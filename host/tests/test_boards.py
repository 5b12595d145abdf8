"""URLs of boards: what they name, and the sentences for those that lead nowhere."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest

from boebot.boards import BoardRequest, board_kinds, is_live, open_board, open_port
from boebot.description.robots import load_robot
from boebot.errors import BoardError
from boebot.link import ports
from lines import line

REQUEST = BoardRequest(robot=load_robot("shieldbot"))


def test_emulated_boards_are_found_by_entry_point() -> None:
    assert {"avr", "native"} <= set(board_kinds())


@pytest.mark.parametrize(
    ("url", "live"),
    [
        ("/dev/ttyACM0", True),
        ("COM3", True),
        ("COM3?baud=115200", True),
        (r"\\.\COM12", True),
        ("serial:/dev/ttyUSB0?baud=250000", True),
        ("socket://localhost:5000", True),
        ("rfc2217://localhost:2217", True),
        ("native", False),
        ("COMET", False),
    ],
)
def test_ports_and_emulated_boards_are_distinguished(url: str, live: bool) -> None:
    assert is_live(url) is live


@dataclass
class Opened:
    """Stands for a transport: what it was asked to open."""

    asked: tuple[Any, ...]
    settings: dict[str, Any] = field(default_factory=dict)
    name: str = "port"


@pytest.mark.parametrize(
    ("url", "kind", "asked", "settings"),
    [
        ("/dev/ttyACM0", "open_serial", ("/dev/ttyACM0", 9600), {"baud_given": False, "reset": True}),
        ("COM3", "open_serial", ("COM3", 9600), {"baud_given": False, "reset": True}),
        ("serial:/dev/a?baud=250000", "open_serial", ("/dev/a", 250_000), {"baud_given": True, "reset": True}),
        ("serial:COM7?reset=no&baud=9600", "open_serial", ("COM7", 9600), {"baud_given": True, "reset": False}),
        ("/dev/a?reset=yes", "open_serial", ("/dev/a", 9600), {"baud_given": False, "reset": True}),
        ("socket://[::1]:5000", "SocketPort", ("::1", 5000), {}),
        ("socket://robot.local:5000/", "SocketPort", ("robot.local", 5000), {}),
        ("rfc2217://h:2217", "open_rfc2217", ("h", 2217, 9600), {"baud_given": False, "reset": True}),
        (
            "rfc2217://[fe80::1]:1?reset=no&baud=115200",
            "open_rfc2217",
            ("fe80::1", 1, 115_200),
            {"baud_given": True, "reset": False},
        ),
    ],
)
def test_url_names_a_port_and_its_settings(
    url: str, kind: str, asked: tuple[Any, ...], settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: dict[str, Opened] = {}
    for name in ("open_serial", "SocketPort", "open_rfc2217"):

        def note(*asked: Any, _name: str = name, **settings: Any) -> Opened:
            return opened.setdefault(_name, Opened(asked, settings))

        monkeypatch.setattr(ports, name, note)
    open_port(url, 9600)
    assert opened == {kind: Opened(asked, settings)}


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("simulator", "there is no board 'simulator'; expected an emulated board"),
        ("/dev/does-not-exist", "there is no port /dev/does-not-exist"),
        ("serial:", "names no port"),
        ("serial:?baud=9600", "names no port"),
        (
            "serial:/dev/ttyUSB0?parity=even",
            "has the setting 'parity=even'; expected baud=RATE, reset=yes or reset=no, each once",
        ),
        ("serial:/dev/ttyUSB0?baud=9600&rtscts=1", "has the setting 'rtscts=1'"),
        ("serial:/dev/ttyUSB0?baud=fast", "has the setting 'baud=fast'; expected baud=RATE"),
        ("serial:/dev/ttyUSB0?reset=maybe", "has the setting 'reset=maybe'; expected baud=RATE, reset=yes"),
        ("serial:/dev/ttyUSB0?baud=9600&baud=9600", "has the setting 'baud=9600'; expected"),
        ("serial:/dev/ttyUSB0?baud=4800", "at 4800 baud; expected 9600 to 1000000"),
        ("rfc2217://localhost:2217?baud=2000000", "at 2000000 baud; expected 9600 to 1000000"),
        ("rfc2217://localhost:2217?logging=debug", "has the setting 'logging=debug'"),
        ("socket://localhost", "is no socket address; expected socket://HOST:PORT"),
        ("socket://localhost:70000", "is no socket address"),
        ("socket://localhost:0", "is no socket address"),
        ("socket://localhost:5000?baud=9600", "has a setting 'baud=9600'; a socket address takes none"),
        ("rfc2217://:2217", "is no rfc2217 address; expected rfc2217://HOST:PORT"),
        ("/dev/null", "/dev/null is no serial port"),
    ],
)
def test_url_that_leads_nowhere_is_one_sentence(url: str, sentence: str) -> None:
    with pytest.raises(BoardError) as refusal:
        open_board(url, REQUEST)
    assert sentence in str(refusal.value)


def test_board_behind_a_port_has_the_robots_rate_unless_the_url_names_one() -> None:
    with line() as board:
        for query, rate in (("", 500_000), ("?baud=115200", 115_200)):
            session = open_board(f"serial:{board.path}{query}", REQUEST)
            assert session.description == f"board at {board.path}"
            assert getattr(session.transport, "baud", None) == rate
            assert not session.drain() and session.counters() == {}
            session.close()
