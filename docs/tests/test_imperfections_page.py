"""docs/reference/imperfections.md says what the code has: every parameter, its value, and its switch."""

from __future__ import annotations

import math
import re
from pathlib import Path

import msgspec
import pytest

import boebot
from boebot.description.robots import load_robot
from boebot.devices.device import Sensor, VehicleDevice, kinds
from sim_bridge.robots import imperfections
from sim_bridge.robots.switches import switches

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "reference" / "imperfections.md").read_text()
NUMBER = re.compile(r"(?<![\w.])(-?\d+(?:\.\d+)?(?:e-?\d+)?)( %)?")
HEADERS = "\n".join(path.read_text() for path in sorted((ROOT / "sim_bridge" / "world").rglob("*.h")))
Row = tuple[tuple[str, ...], list[float], str]


def rows() -> list[Row]:
    """Parameters, the numbers of nominal value and spread, and what is said of switching it off, of each row."""
    found = []
    for line in PAGE.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not line.startswith("| ") or "`" not in line:
            continue
        parameter = next(index for index, cell in enumerate(cells) if cell.startswith("`"))
        values = " ".join(cells[1 : parameter - 1])  # between what it is and where it is from
        numbers = [float(number) / (100 if percent else 1) for number, percent in NUMBER.findall(values)]
        off = cells[parameter + 1] if len(cells) > parameter + 1 else ""
        found.append((tuple(re.findall(r"`([\w.]+)`", cells[parameter])), numbers, off))
    return found


KINDS = {kind.__name__: kind for kind in (Sensor, *kinds())}


CONSTANTS = imperfections.parameters()


def value(name: str) -> tuple[float, ...]:
    """Of a parameter in the code, as a tuple."""
    if name.startswith("supply."):
        return (float(getattr(load_robot("shieldbot").supply, name.removeprefix("supply."))),)
    if "." in name:
        struct, key = name.split(".")
        fields = {field.name: field.default for field in msgspec.structs.fields(KINDS[struct])}
        return (float(fields[key]),)
    if name in CONSTANTS:
        found = CONSTANTS[name]
        return found if isinstance(found, tuple) else (float(found),)
    (defined,) = re.findall(rf"^#define {name} ([\d.e-]+)", HEADERS, re.MULTILINE)
    return (float(defined),)


ROWS = rows()


@pytest.mark.parametrize(("names", "numbers", "off"), ROWS, ids=[row[0][0] for row in ROWS])
def test_row_says_what_the_code_has(names: tuple[str, ...], numbers: list[float], off: str) -> None:
    assert [pytest.approx(part) for name in names for part in value(name)] == numbers


def test_every_parameter_has_one_row() -> None:
    named = [name for names, _, _ in ROWS for name in names]
    constants = CONSTANTS.keys() - {"RPM", "NO_PIN"}
    noisy = {
        f"{struct.__name__}.{field.name}"
        for struct in KINDS.values()
        if issubclass(struct, VehicleDevice)
        for field in msgspec.structs.fields(struct)
        if re.match("sigma|miss|bias", field.name)
    }
    assert len(named) == len(set(named)) and constants | noisy <= set(named)


@pytest.mark.parametrize(("names", "numbers", "off"), ROWS, ids=[row[0][0] for row in ROWS])
def test_row_names_its_switch(names: tuple[str, ...], numbers: list[float], off: str) -> None:
    """And the neutral value of what the switch sets, where that is not 0; no other switch sets anything of the row."""
    pairs = [(name, switch.neutral) for name, switch in switches().items()]
    switched = {name: neutral[key] for name, neutral in pairs for key in names if key in neutral}
    if off in ("", "–"):
        assert not switched
        return
    said = re.fullmatch(r"`(\w+)`(?:, noise)?(?:: ([\d.]+))?", off)
    assert said is not None and switched == {said[1]: float(said[2] or 0)}


def test_everything_switched_has_a_row() -> None:
    named = {name for names, _, _ in ROWS for name in names}
    assert {key for switch in switches().values() for key in switch.neutral} <= named


def test_a_robot_without_any_imperfection_drives() -> None:
    """Full speed is then that of the curve, 51.25 rpm tanh(200 / 78.5) of a wheel of 33.1 mm."""
    result = boebot.run(
        lambda robot: robot.drive(1, 1), arena="empty", on="native", seconds=2, without=tuple(switches())
    )
    speed = 51.25 * math.tanh(200 / 78.5) * 2 * math.pi / 60 * 0.0331
    assert result.true_pose is not None
    late = result.true_pose.x[-1] - result.true_pose.x[-101]
    assert late == pytest.approx(speed, rel=0.03)
