"""What sub-commands print holds no control character, wherever a name or an error comes from."""

from __future__ import annotations

import ast
import io
import json
import math
import sys
import unicodedata
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot import cli
from boebot.cli import output
from boebot.errors import printable
from boebot.running import loop
from command import boebot
from peer import InProcess, Peer

RED = "\x1b[31mred\x07\x9b0m\u202e\ud800"


@given(st.text())
def test_printable_text_has_no_control_characters(text: str) -> None:
    shown = printable(text)
    assert not {unicodedata.category(char) for char in shown if char != "\n"} & {"Cc", "Cf", "Cs", "Co", "Zl", "Zp"}
    assert printable(shown) == shown
    if text.isprintable():
        assert shown == text


@pytest.mark.parametrize(
    "show",
    [
        output.line,
        output.say,
        lambda text: output.print_json({text: text}),
        lambda text: output.print_columns(("a", "b"), [(f"{text} [bold]not mark-up[/]", "1")]),
        lambda text: output.console().print(text, output.table({text: 1})),
    ],
)
def test_each_way_to_print_shows_them_as_escapes(
    show: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    show(RED)
    printed = "".join(capsys.readouterr())
    assert "[31mred" in printed
    assert all(char.isprintable() for char in printed if char != "\n")


def test_json_has_only_numbers_that_json_has(capsys: pytest.CaptureFixture[str]) -> None:
    output.print_json({"mean": (1.5, -math.inf, math.inf), "none": math.nan})
    assert json.loads(capsys.readouterr().out) == {"mean": [1.5, None, None], "none": None}


def test_bars_show_names_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with output.progress_bar(f"{RED} [bold]{{x}}[/]", 10) as report:
        report(5)
        report(10)
    assert "[31mred\\x07" in terminal.getvalue() and "[bold]{x}[/]" in terminal.getvalue()
    assert "\x1b[31mred" not in terminal.getvalue()


def test_names_and_errors_of_files_come_as_escapes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    peer = Peer()
    monkeypatch.setattr(loop, "open_world", lambda url, requests: InProcess(peer))
    brain = tmp_path / "brain.py"
    brain.write_text(f"def step(robot):\n    raise RuntimeError({RED!r})\n")
    code, out, err = boebot(capsys, "run", str(brain), "--seconds", "1", "--out", str(tmp_path / "\x1b]0;run"))
    assert code == 1 and "\\x1b[31mred" in err and "\\x1b]0;run" in out
    assert all(char.isprintable() for char in out + err if char != "\n")
    robot = tmp_path / "robot.toml"
    robot.write_text('extends = "shieldbot"\n[device."\\u001b[2J"]\ntype = "\\u009b2J"\n')
    code, out, err = boebot(capsys, "run", "wander", "--robot", str(robot))
    assert code == 1 and err.startswith("boebot: robot.toml:2: device.\\x1b[2J: type is")
    assert all(char.isprintable() for char in out + err if char != "\n")


def test_sub_commands_print_in_no_other_way() -> None:
    for source in Path(cli.__file__).parent.glob("*.py"):
        calls = [node.func for node in ast.walk(ast.parse(source.read_text())) if isinstance(node, ast.Call)]
        names = [call.id for call in calls if isinstance(call, ast.Name)]
        allowed = {"output.py": 2, "__init__.py": 1, "teleop.py": 1}  # teleop's line of readings is the kit's own
        assert names.count("print") + names.count("Console") == allowed.get(source.name, 0), source
