"""Descriptions in TOML: every error names file, line, key and what was expected; keys are found in any layout."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boebot.description import toml_files
from boebot.description.robots import load_robot
from boebot.description.toml_files import DEPTH_MAXIMUM, KEY_MAXIMUM, SIZE_MAXIMUM, TEXT_MAXIMUM, line_of
from boebot.errors import ArenaError, RobotError

LAYOUT = '''# a comment with [brackets] and "quotes"
title = "a ] string } with # signs"   # line 2
long = """three
lines [of]
text"""
plain = \'\'\'one " two
\'\'\'
[a]
"quoted key" = 1
b.c = [1, [2, 3],
  # a comment ]
  [4,
   { x = 5, y = [ 6 ] }],
]

[[part]]
name = 'first'
[[part.hole]]
x = 1
[part.hole.edge]
z = 2
[[part]]
name = "second"
hole = [{ x = 7 },
  { x = 8 }]
[[part.screw]]
x = 3
[[part.screw]]
x = 4
[a.d]
last = 1979-05-27T07:32:00Z
'''


def test_every_key_is_found_in_its_line() -> None:
    wanted = {
        "title": 2, "long": 3, "plain": 6, "a": 8, "a.quoted key": 9, "a.b": 10, "a.b.c": 10, "part": 16,
        "part[0].name": 17, "part[0].hole[0]": 18, "part[0].hole[0].x": 19, "part[0].hole[0].edge.z": 21, "part[1]": 22,
        "part[1].hole": 24, "part[1].screw[0].x": 27, "part[1].screw[1].x": 29, "a.d.last": 31,
    }  # fmt: skip
    for text in (LAYOUT, LAYOUT.replace("\n", "\r\n")):
        found = {place: line_of(text, place) for place in wanted}
        assert found == {place: (line, place) for place, line in wanted.items()}
    assert line_of(LAYOUT, "a.b.nothing[3].there") == (10, "a.b")
    assert line_of(LAYOUT, "a.b.c[2][1].y[0]") == (10, "a.b.c")  # within a value in brackets
    assert line_of(LAYOUT, "nothing") == (1, "")


def places(value: Any, place: str) -> set[str]:
    """All places in a table."""
    if isinstance(value, dict):
        below = [(f"{place}.{name}" if place else name, entry) for name, entry in value.items()]
    elif isinstance(value, list):
        below = [(f"{place}[{index}]", entry) for index, entry in enumerate(value)]
    else:
        below = []
    return {place}.union(*(places(entry, inner) for inner, entry in below))


PIECES = st.sampled_from(
    [
        "[a]",
        "[a.b]",
        "[[c]]",
        "[[c.d]]",
        "[c.d.e]",
        "k = 1",
        "m = [1, [2, {x = 3}],\n]",
        "n.o = 'q # ]'",
        'p = """\n"""',
        "#",
    ]
)


@given(st.lists(PIECES, max_size=12))
def test_the_scan_sees_what_tomllib_sees(pieces: list[str]) -> None:
    text = "\n".join(pieces)
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return
    there = {place for place in places(table, "") if "m[" not in place}
    assert {place for place in there | {"b", "a.c", "c[9]", "z"} if line_of(text, place)[1] == place} == there


class Screw(msgspec.Struct, forbid_unknown_fields=True):
    x: int


class Part(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    screw: list[Screw] = []


class Whole(msgspec.Struct, forbid_unknown_fields=True):
    part: list[Part]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("part = 1", "it.toml:1: part: expected array, got int"),
        ("# nothing", "it.toml: the key 'part' is missing"),
        ("\n[[part]]\n\n[[part]]\nname = 'b'", "it.toml:2: part[0]: the key 'name' is missing"),
        ("[[part]]\nname = 'a'\n[[part.screw]]\nx = 'y'", "it.toml:4: part[0].screw[0].x: expected int, got str"),
        ("[[part]]\nname = 'a'\nscrew = [{x = 1},\n{y = 2}]", "it.toml:3: part[0].screw[1]: there is no key 'y' here"),
        ("[[part]]\nname = 'a'\nscrew = [\n{x = inf}]", "it.toml:3: part[0].screw[0].x: expected a finite number"),
        (f"x = 1\ny = {'9' * 5000}", "it.toml:2: a number has 5000 digits; expected a finite number"),
        ("a = 1\nb = 2\na = 3", "it.toml:3: 'a' is given twice; expected each key and table once"),
        ("a = 1\na = [\n2\n]\nb = 2", "it.toml:4: a key is given twice; expected each key and table once"),
        ("[x]\na = 1\n[x]\nb = 1\n", "it.toml:3: 'x' is given twice; expected each key and table once"),
        ("a = 1\n[[a]]\nb = 1\n", "it.toml:2: 'a' is given twice; expected each key and table once"),
        ("a = {b = 1, b = 2}\n", "it.toml:1: 'b' is given twice; expected each key and table once"),
        ("a = ", "it.toml is no valid TOML: Invalid value (at end of document)"),
        (f"x = {'9' * 400}", "it.toml:1: x: expected a finite number"),
        (f"x = {'[' * 100_000}", "it.toml is "),
    ],
)
def test_errors_have_their_line(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "it.toml"
    file.write_text(text)
    with pytest.raises(RobotError) as caught:
        toml_files.convert(toml_files.read(file, RobotError), Whole, file.name, RobotError)
    assert str(caught.value).startswith(sentence)
    assert "\n" not in str(caught.value)


def test_a_byte_order_mark_is_passed_over(tmp_path: Path) -> None:
    """As Windows' Notepad writes it; lines of errors are the same."""
    file = tmp_path / "it.toml"
    for text in ("x = 1\n", f"x = 1\ny = [{'[1, 2], ' * 9000}]\n"):
        file.write_bytes(b"\xef\xbb\xbf" + text.encode())
        assert toml_files.read(file, RobotError) == tomllib.loads(text)
    file.write_bytes("\ufeff[[part]]\n\nname = 1".encode())
    with pytest.raises(RobotError, match=r"^it\.toml:3: part\[0\]\.name: expected str, got int$"):
        toml_files.convert(toml_files.read(file, RobotError), Whole, file.name, RobotError)


def test_a_file_too_large_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "it.toml"
    file.write_text("#" * (SIZE_MAXIMUM + 1))
    with pytest.raises(RobotError, match=r"it\.toml has 8,000,001 bytes; expected at most 8,000,000"):
        toml_files.read(file, RobotError)


DEEP = "[" * DEPTH_MAXIMUM + "]" * DEPTH_MAXIMUM
HOSTILE = {  # texts that took minutes, or ended in a traceback
    ".".join("a" * 1000) + " = 1": ":1: a key has 1,000 parts; expected at most 16",
    "\n[" + " . ".join(["a", '"b.c"', "'d'"] * 30_000) + "]": ":2: a key has 90,000 parts; expected at most 16",
    "\n".join(f"[{'.'.join('a' * n)}]" for n in range(1, 18)): ":17: a key has 17 parts; expected at most 16",
    f"x = {DEEP}": " is nested too deeply; expected at most 16 tables and arrays inside one another",
    f"{'a' * 7_000_000} = 1": ": a key has 7,000,000 characters; expected at most 100",
    f"x = [{{ '{'a' * 101}' = 1 }}]": ": a key has 101 characters; expected at most 100",
    f"x = ['{'a' * 1001}']": ": a text has 1,001 characters; expected at most 1,000",
    "x = 0.5e-31" + "9" * 1_000_000: ":1: there is no key 'x' here",
    "x = [[1, 2]" + " " * 1_000_000 + "y": " is no valid TOML: ",
    '\\"""x\n' * 100_000: " is no valid TOML: ",
    "x = '''\n" + "''x\n" * 100_000: " is no valid TOML: ",
    "x = " + "a" * 1_000_000: " is no valid TOML: ",
    "x = [" + "1," * 100_000 + "]\npart = 1": ":1: there is no key 'x' here",
}


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_a_hostile_text_ends_soon_in_a_sentence(tmp_path: Path, text: str) -> None:
    file = tmp_path / "it.toml"
    file.write_text(text)
    begun = time.process_time()
    with pytest.raises(RobotError) as caught:
        toml_files.convert(toml_files.read(file, RobotError), Whole, file.name, RobotError)
    assert time.process_time() - begun < 5
    assert str(caught.value).startswith(f"it.toml{HOSTILE[text]}"), str(caught.value)[:300]
    assert len(str(caught.value)) < 300


def test_a_file_at_the_limits_is_read(tmp_path: Path) -> None:
    key = ".".join("a" * (DEPTH_MAXIMUM - 1))
    text = f"{key} = '{'t' * TEXT_MAXIMUM}' # {'a.' * 99}\n{'k' * KEY_MAXIMUM} = {DEEP[1:-1]}\n"
    text += "x = [1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5]\n"
    text += f"y = 'not.a.key{'.x' * 99}'\n"
    file = tmp_path / "it.toml"
    file.write_text(text)
    assert toml_files.read(file, RobotError) == tomllib.loads(text)


def test_a_robot_that_extends_another_names_the_right_file_and_line(tmp_path: Path) -> None:
    for name, text in {
        "base.toml": "extends = 'shieldbot'\n[body]\nmass_kg = 'much'",
        "robot.toml": f"extends = '{tmp_path / 'base.toml'}'\n\ntitle = 'mine'",
        "other.toml": f"extends = '{tmp_path / 'base.toml'}'\n\n[body]\nmass_kg = 1.0\nradius_m = 'r'",
    }.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(RobotError, match=r"base\.toml:3: body\.mass_kg: expected float, got str"):
        load_robot(tmp_path / "robot.toml")
    with pytest.raises(RobotError, match=r"other\.toml:5: body\.radius_m: expected float, got str"):
        load_robot(tmp_path / "other.toml")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[device.pingg]\non = false", r"^mine\.toml:2: device\.pingg: 'shieldbot' has no such device; .*'ping'\?$"),
        ("remove = ['pingg']", r"^mine\.toml removes device 'pingg', which 'shieldbot' does not have; .*'ping'\?$"),
        ("[device.it]\ntype = 'pingg'", r"^mine\.toml:3: device\.it: type is 'pingg'; .*; did you mean 'ping'\?$"),
    ],
)
def test_the_device_that_was_meant_is_named(tmp_path: Path, text: str, sentence: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(f"extends = 'shieldbot'\n{text}\n")
    with pytest.raises(RobotError, match=sentence):
        load_robot(file)


def test_reading_a_large_file_is_announced_and_its_errors_have_their_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "large.toml"
    row = "[[obstacle]]\ncorners_m = [[0.25, 0.5], [1.5, 0.5], [1.5, 1.5]]\n"
    file.write_text(row * 40_000 + "wrong = \n", encoding="utf-8")
    with pytest.raises(ArenaError, match=r"large\.toml is no valid TOML: Invalid value \(at line 80001"):
        toml_files.read(file, ArenaError)
    assert capsys.readouterr().err == "reading large.toml, 2.5 MB ...\n"
