"""docs/reference/imperfections.md has every row of the table of imperfections; without all of them a robot is ideal."""

from __future__ import annotations

import math
import re
from pathlib import Path

import msgspec
import pytest

import boebot
from boebot.description.robots import load_robot
from boebot.devices.device import Sensor, VehicleDevice, kinds
from boebot.imperfections import Imperfection, imperfections, switches

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "reference" / "imperfections.md").read_text(encoding="utf-8")
HEADERS = "\n".join(path.read_text() for path in sorted((ROOT / "sim_bridge" / "world").rglob("*.h")))
KINDS = {kind.__struct_config__.tag: kind for kind in kinds()}


def line(row: Imperfection) -> str:
    """The row as the page has it."""
    value = "–" if row.value is None else f"{row.value:g}"
    off = f"`{row.switch}`" + (f": {row.neutral:g}" if row.neutral else "") if row.switch else "–"
    cells = (f"`{row.name}`", value, row.unit or "–", row.what, row.drawn or "–", off, row.source)
    return f"| {' | '.join(cells)} |"


def without_board(row: Imperfection) -> bool:
    return all(issubclass(KINDS.get(kind, object), VehicleDevice) for kind in row.of)


def test_the_page_has_the_table() -> None:
    """Robots with a board and their bodies first; then those without one."""
    rows = sorted(imperfections().values(), key=without_board)
    assert [said for said in PAGE.splitlines() if said.startswith("| `")] == [line(row) for row in rows]


def test_the_page_has_every_switch() -> None:
    assert set(switches()) == {row.switch for row in imperfections().values() if row.switch}
    assert all(len(name) <= 20 and len(what) <= 80 for name, what in switches().items())


def test_defaults_are_those_of_the_keys_in_robots_files() -> None:
    """What a robot's own file says has its default there, in the device; the table must not say another."""
    noisy = set()
    for row in imperfections().values():
        for kind in (KINDS[of] for of in row.of if row.key and of in KINDS):
            (field,) = (field for field in msgspec.structs.fields(kind) if field.name == row.key)
            assert field.default == row.value, row.name
            noisy.add(f"{kind.__name__}.{row.key}")
    for kind in KINDS.values():
        if issubclass(kind, VehicleDevice):
            keys = [field.name for field in msgspec.structs.fields(kind)]
            assert {f"{kind.__name__}.{key}" for key in keys if re.match("sigma|miss|bias", key)} <= noisy
    sensors = {tag for tag, kind in KINDS.items() if issubclass(kind, Sensor)}
    assert set(imperfections()["sensor_period_s"].of) == sensors - {"odometer"}


def test_the_page_has_what_the_simulator_keeps_fixed() -> None:
    for name in ("SERVO_MOTOR_HOLD_S", "SUPPLY_ERRATIC_V", "SUPPLY_RESET_V"):
        (value,) = re.findall(rf"^#define {name} ([\d.]+)", HEADERS, re.MULTILINE)
        assert f"{float(value):g} " in PAGE.partition("## Fixed")[2]
    supply = load_robot("shieldbot").supply
    assert supply is not None
    for key in ("full_v", "empty_v", "capacity_as", "resistance_ohm", "drop_out_v"):
        assert f"`supply.{key}`: {getattr(supply, key):g}" in PAGE.replace("\n", " ")


def test_a_robot_without_any_imperfection_drives() -> None:
    """Full speed is then that of the curve, 51.25 rpm tanh(200 / 78.5) of a wheel of 33.1 mm."""
    result = boebot.run(
        lambda robot: robot.drive(1, 1), arena="empty", on="native", seconds=2, without=tuple(switches())
    )
    speed = 51.25 * math.tanh(200 / 78.5) * 2 * math.pi / 60 * 0.0331
    assert result.true_pose is not None
    late = result.true_pose.x[-1] - result.true_pose.x[-101]
    assert late == pytest.approx(speed, rel=0.03)
