"""The robots of robots/*.toml as the firmware needs them: pins, what is switched on, and keys that give defaults.

Read by Python's standard library alone. Only what the headers need is checked here; the rest of a robot's description
is checked by the library (`boebot.description.robots`), whenever somebody uses the robot.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any, NamedTuple

import schema

FOLDER = Path(__file__).resolve().parent / "robots"
NO_BOARD = "none"
PIN_MAP = r"[A-Za-z0-9-]*"  # a name in C, with _ for -, and in files
NEEDED = ("name", "title", "board", "body", "device")
QUARTER = 0.25  # of the time between two edges of an encoder: what is shorter is a bounce


class Robot(NamedTuple):
    """One robot's file, laid over those that it extends."""

    file: str
    table: dict[str, Any]

    @property
    def pin_map(self) -> str:
        """Of the board's firmware; "" without a board, and where it runs none of the kit's."""
        return str(self.table.get("pin_map", "")) if self.table["board"] != NO_BOARD and self.takes_brain else ""

    @property
    def takes_brain(self) -> bool:
        """Whether a brain can drive it: by the kit's firmware, or directly."""
        return bool(self.table.get("firmware", "kit") == "kit")

    @property
    def has_image(self) -> bool:
        """Whether its pin map is its own; other robots run the image of the one that is named like the map."""
        return bool(self.pin_map) and self.table["name"] == self.pin_map

    @property
    def devices(self) -> dict[str, dict[str, Any]]:
        """Name -> keys."""
        found: dict[str, dict[str, Any]] = self.table["device"]
        return found

    def has(self, device: str) -> bool:
        """Whether the robot has a device of that name, switched on."""
        return device in self.devices and bool(self.devices[device].get("on", True))

    def pins(self, device: str) -> dict[str, int]:
        """Role of each pin ("" for the key `pin`, "led" for `led_pin`, "a" for `pin_a`) and its Arduino number.

        Raises:
            ValueError: there is no such pin.
        """
        return {
            key.removeprefix("pin").removesuffix("pin").strip("_"): self._pin(f"device.{device}.{key}", value)
            for key, value in self.devices[device].items()
            if key.startswith("pin_") or f"_{key}".endswith("_pin")
        }

    def _pin(self, key: str, pin: object) -> int:
        numbers = {number: number for number in range(14)} | {f"A{i}": 14 + i for i in range(6)}
        if type(pin) not in (int, str) or pin not in numbers:
            raise ValueError(f"{self.file}: {key}: there is no pin {pin!r}; expected 0..13 or 'A0'..'A5'")
        return numbers[pin]

    def value(self, key: str) -> float | None:
        """The number that a key such as "servo_left.centre_us", "body.track_width_m" or "robot.encoder_gap_us" stands
        for; None: the robot does not say it.

        Raises:
            ValueError: it is no number, or a key is missing from which it follows.
        """
        owner, _, name = key.partition(".")
        if key == "robot.encoder_gap_us":
            return self._encoder_gap_us()
        table = self.table.get(owner, {}) if owner in ("body", "supply") else self.devices.get(owner, {})
        if name in table and type(table[name]) not in (int, float):
            raise ValueError(f"{self.file}: {key}: expected a number, got {table[name]!r}")
        return float(table[name]) if name in table else None

    def _needed(self, key: str) -> float:
        value = self.value(key)
        if value is None:
            raise ValueError(f"{self.file}: {key} is missing")
        return value

    def _encoder_gap_us(self) -> float:
        """The same as `encoder_gap_us` of the library's robots, which no file says: it follows from other keys."""
        if "encoder_left" not in self.devices:
            return 0.0
        radius_m, edges = self._needed("body.wheel_radius_m"), self._needed("encoder_left.edges_per_turn")
        edge_m = len(self.pins("encoder_left")) * (2 * math.pi * radius_m / edges)
        return min(QUARTER * edge_m / self._needed("body.wheel_speed_maximum_m_s") * 1e6, 65535.0)


def load(path: Path) -> Robot:
    """The robot of a file.

    Raises:
        ValueError: no valid TOML, a missing key, a pin map that is no name in C, a robot that extends one that is not
            there, or two devices on one pin.
    """
    robot = Robot(path.name, _read(path, ()))
    if missing := [key for key in NEEDED if key not in robot.table]:
        raise ValueError(f"{path.name}: {missing[0]} is missing")
    if not re.fullmatch(PIN_MAP, robot.pin_map):
        raise ValueError(f"{path.name}: pin_map is {robot.pin_map!r}; expected letters, digits and hyphens")
    owners: dict[int, str] = {}
    for device in robot.devices if robot.pin_map else ():
        for pin in robot.pins(device).values():
            if pin in owners:
                name = pin if pin < 14 else f"A{pin - 14}"
                raise ValueError(f"{path.name}: {owners[pin]} and {device} cannot share pin {name}")
            owners[pin] = device
    return robot


def load_all() -> list[Robot]:
    """The robots of the folder."""
    return [load(path) for path in sorted(FOLDER.glob("*.toml"))]


def _read(path: Path, seen: tuple[Path, ...]) -> dict[str, Any]:
    table = schema.toml(path)
    tables: dict[str, Any] = {key: table[key] for key in ("body", "supply", "device") if key in table}
    if isinstance(devices := tables.get("device"), dict):
        tables |= {f"device.{name}": device for name, device in devices.items()}
    if wrong := [key for key, value in tables.items() if not isinstance(value, dict)]:
        raise ValueError(f"{path.name}: {wrong[0]}: expected a table")
    base, removed = table.pop("extends", None), table.pop("remove", [])
    if not isinstance(removed, list):
        raise ValueError(f"{path.name}: remove: expected a list")
    if base is None:
        return table
    below = FOLDER / f"{base}.toml"
    if not below.is_file() or below in seen:
        raise ValueError(f"{path.name} extends {base!r}; expected another robot of {FOLDER.name}")
    under = _read(below, (*seen, path))
    under["device"] = {name: device for name, device in under["device"].items() if name not in removed}
    return _overlay(under, table)


def _overlay(base: dict[str, Any], top: dict[str, Any]) -> dict[str, Any]:
    """`top` over `base`; a table that names its type replaces the whole table below it."""
    merged = dict(base)
    for key, value in top.items():
        below = merged.get(key)
        laid_over = isinstance(value, dict) and isinstance(below, dict) and "type" not in value
        merged[key] = _overlay(below, value) if laid_over and isinstance(below, dict) else value
    return merged
