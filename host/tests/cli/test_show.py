"""Tests of `boebot show arena` and `boebot show robot`: picture, table, JSON, and what is wrong in one sentence."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from PIL import Image

from boebot.arenas import load_arena
from boebot.description.robots import load_robot, robot_names
from boebot.description.wiring import connections
from boebot.devices.battery import BatteryDivider
from boebot.devices.device import FIVE_VOLTS, GROUND, PACK, SERVO_POWER, kinds
from boebot.devices.display import Display
from boebot.devices.input import Potentiometer, SlideSwitch
from boebot.devices.led import Led
from boebot.view import robot_picture
from command import boebot

SVG = "{http://www.w3.org/2000/svg}"


def texts(svg: Path) -> set[str]:
    """What is written in a picture."""
    return {"".join(element.itertext()).strip() for element in ET.parse(svg).iter(f"{SVG}text")}


def test_arena_is_shown(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "show", "arena", "showcase")
    assert (code, err) == (0, "")
    assert "4 m x 3 m" in out and "cushion" in out and "IR 10%" in out and "arena-showcase.png" in out
    with Image.open("arena-showcase.png") as picture:
        assert picture.info["Title"] == "showcase: one of everything"
    code, out, err = boebot(capsys, "show", "arena", "empty", "--out", "it.svg")
    assert (code, err) == (0, "") and "open field" in out
    assert "empty: empty field" in texts(Path("it.svg"))


def test_arena_as_json(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "show", "arena", "showcase", "--json")
    assert (code, err) == (0, "") and not list(tmp_path.iterdir())
    shown, arena = json.loads(out), load_arena("showcase")
    assert shown["size_m"] == [4.0, 3.0] and tuple(shown["start"].values()) == arena.start
    rows = {row["name"]: row for row in shown["shapes"]}
    assert rows["pillar"] == {
        "kind": "disc", "name": "pillar", "x_m": 0.2, "y_m": -0.9, "width_m": 0.3, "depth_m": 0.3, "height_m": None,
        "remarks": "",
    }  # fmt: skip
    described = arena.description
    groups = ("outline", "obstacle", "wall", "disc", "moving", "patch", "line", "light")
    assert len(shown["shapes"]) == sum(len(getattr(described, group)) for group in groups) + 1  # the charger


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("show", "arena", "statoin"), "did you mean 'station'?"),
        (
            ("show", "arena", "room", "--out", "it.jpg"),
            "it.jpg is no name of a picture; expected one that ends in .png",
        ),
        (("show", "arena", "room", "--out", "no/it.png"), "the picture cannot be written to no: No such file"),
        (("show", "robot", "shieldbott"), "did you mean 'shieldbot'?"),
        (
            ("show", "arena", "room", "--out", "/dev/full/it.png"),
            "cannot be written to /dev/full: Not a directory",
        ),
    ],
)
def test_wrong_request_is_one_sentence(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], sentence: str
) -> None:
    code, out, err = boebot(capsys, *arguments)
    assert (code, out) == (1, "") and sentence in err and err.count("\n") == 1


def test_robot_is_shown_with_its_wiring(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "show", "robot", "boebot")
    assert (code, err) == (0, "") and "A3" in out and "servo port 13" in out
    written, wires = texts(Path("robot-boebot.svg")), connections(load_robot("boebot"))
    assert all({wire.device, wire.to, wire.part, wire.connector} - {""} <= written for wire in wires)
    assert {wire.pin for wire in wires} - {GROUND} <= written  # ground is a sign
    monkeypatch.setenv("COLUMNS", "120")
    code, out, err = boebot(capsys, "show", "robot", "shieldbot", "--out", "it.svg")
    assert (code, err) == (0, "") and "buzzer (off)" in out
    assert "ping" in texts(Path("it.svg")) and "buzzer" not in texts(Path("it.svg"))


@pytest.mark.parametrize("robot", ["arsim-1.2", "own.v2.toml"])
def test_robot_by_arsims_scheme_is_shown_with_it_under_its_whole_name(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, robot: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("own.v2.toml").write_text('extends = "arsim-1.2"\n')
    code, out, err = boebot(capsys, "show", "robot", robot)
    assert (code, err) == (0, "") and re.search(r"^ scheme +arsim *$", out, re.MULTILINE)
    assert Path(f"robot-{robot.removesuffix('.toml')}.svg").is_file()
    assert "scheme" not in boebot(capsys, "show", "robot", "arsim")[1]


def test_a_bundled_name_needs_no_kind(capsys: pytest.CaptureFixture[str]) -> None:
    for name, kind in (("rover", "robot"), ("room", "arena")):
        assert boebot(capsys, "show", name, "--json") == boebot(capsys, "show", kind, "--json", name)
    for name, sentence in (("rovr", "No such command 'rovr'"), ("arsim", "'arena arsim' or 'robot arsim'")):
        code, _, err = boebot(capsys, "show", name)
        assert (code, sentence in err) == (2, True)


def test_robot_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = boebot(capsys, "show", "robot", "shieldbot-basic", "--json")
    assert (code, err) == (0, "")
    shown, robot = json.loads(out), load_robot("shieldbot-basic")
    assert shown["free_pins"] == ["A1", "A2", "A3"]
    assert {row["name"]: row["on"] for row in shown["devices"]} == {name: one.on for name, one in robot.device.items()}
    assert {"device": "light_left", "on": True, "pin": "8", "colour": "", "part": "1 kΩ", "to": "collector",
            "connector": "breadboard"} in shown["wiring"]  # fmt: skip


@pytest.mark.filterwarnings("error:Glyph")
def test_robot_without_a_board_is_shown_without_wiring(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sensors = "".join(
        f"[device.eye_{number}]\ntype = 'sonar'\nposition_m = [0, 0.1]\nheading_rad = 1\n" for number in range(20)
    )
    (tmp_path / "many.toml").write_text(
        f"extends = 'arsim'\nname = '$x_1$ & <b>'\ntitle = '房 {'long ' * 30}'\n{sensors}"
    )
    monkeypatch.chdir(tmp_path)
    code, out, err = boebot(capsys, "show", "robot", "many.toml")
    assert (code, err) == (0, "") and "eye_19" in out and "pin" not in out
    assert {"eye_0, up to 3 m", "eye_19, up to 3 m"} <= texts(Path("robot-many.svg"))
    assert any(text.startswith("$x_1$ & <b>: 房 long") for text in texts(Path("robot-many.svg")))


def test_every_pin_of_every_kind_of_device_has_its_wire() -> None:
    supplies = {FIVE_VOLTS, GROUND, PACK, SERVO_POWER}
    seen = set()
    devices = [device for name in robot_names() for device in load_robot(name).device.values()]
    devices += [SlideSwitch(pin=2, to="supply", resistor=True), Potentiometer(pin="A0"), Led(pin=6, to="supply")]
    devices.append(Display(rs_pin=12, enable_pin=11, d4_pin=5, d5_pin=4, d6_pin=3, d7_pin=2))
    devices.append(Display(rs_pin=12, enable_pin=11, d4_pin=5, d5_pin=4, d6_pin=3, d7_pin=2))
    for device in devices:
        pins = [wire.pin for wire in device.wires() if wire.pin not in supplies]
        assert sorted(pins) == sorted(device.PINS)
        seen.add(type(device))
    assert {kind for kind in kinds() if kind.PINS} <= seen


def test_servos_are_powered_as_the_supply_says() -> None:
    for name, power in (("shieldbot", FIVE_VOLTS), ("boebot", PACK)):
        assert [wire.pin for wire in connections(load_robot(name)) if wire.to == "power" and wire.on][:2] == [power] * 2


@pytest.mark.parametrize("ratio", [1.5, 2.0, 3.0])
def test_battery_is_divided_by_its_ratio(ratio: float) -> None:
    wires = {wire.pin: wire.part for wire in BatteryDivider(pin="A0", ratio=ratio).wires()}
    upper, lower = (float(wires[pin].removesuffix(" kΩ")) for pin in (PACK, GROUND))
    assert (upper + lower) / lower == ratio


@pytest.mark.parametrize("name", ["shieldbot", "rover"])
def test_picture_in_the_docs_is_of_this_kit(name: str, tmp_path: Path) -> None:
    """`make pictures` renews it."""
    shown = Path(__file__).parents[3] / "docs" / "images" / f"robot-{name}.svg"
    assert texts(shown) == texts(robot_picture.write(load_robot(name), tmp_path / "now.svg"))
