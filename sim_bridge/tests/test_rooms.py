"""Who may know whom: the world knows neither pins nor boards, boards know no world."""

from __future__ import annotations

import re
from pathlib import Path

ROOM = Path(__file__).resolve().parents[1]
C_FILES = sorted(path for path in ROOM.rglob("*.[ch]") if "simavr" not in path.parts)


def included(path: Path) -> set[str]:
    """The headers of this package that a file includes, named from the room."""
    names = re.findall(r'^\s*#\s*include\s+"([^"]+)"', path.read_text(encoding="utf-8"), re.M)
    found = set()
    for name in names:
        for folder in (path.parent, ROOM):
            target = (folder / name).resolve()
            if target.is_file() and target.is_relative_to(ROOM):
                found.add(target.relative_to(ROOM).as_posix())
                break
    return found


def knows(room: str) -> set[str]:
    """The rooms whose headers the files of `room` include."""
    return {
        name.split("/")[0] for path in C_FILES if path.relative_to(ROOM).parts[0] == room for name in included(path)
    }


def test_world_knows_only_itself() -> None:
    assert knows("world") == {"world"}


def test_boards_know_no_world() -> None:
    assert knows("boards") == {"boards"}


def test_parts_know_the_world_and_the_board_interface_alone() -> None:
    for path in C_FILES:
        if path.relative_to(ROOM).parts[0] == "parts":
            headers = included(path)
            assert {name for name in headers if name.startswith("boards/")} <= {"boards/board.h"}
            assert "loop.h" not in headers


def test_nothing_in_the_simulator_knows_the_protocol() -> None:
    """It carries bytes; messages are the firmware's and the host's."""
    for path in C_FILES:
        if "boards" not in path.relative_to(ROOM).parts:
            assert "messages.h" not in path.read_text(encoding="utf-8")
    for name in ("session.py", "serve.py", "arena.py", "imperfections.py"):
        assert "boebot.link.messages" not in (ROOM / name).read_text(encoding="utf-8")
