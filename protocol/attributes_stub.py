"""Makes `boebot/devices/attributes.pyi`: the names by which a brain reads devices, with their types, for editors and
type checkers. The names are the usual ones of each kind of device, and those that the bundled robots give them.

The kinds are found in the sources of `host/boebot/devices`, by the standard library alone; the robots in
`protocol/robots`.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import robot_files

ROOT = Path(__file__).resolve().parents[1]
DEVICES = ROOT / "host" / "boebot" / "devices"
STUB = DEVICES / "attributes.pyi"

HEAD = '''"""Made by protocol/generate.py; do not edit."""

from typing import TypeVar

'''
CLASS = """
Reading = TypeVar("Reading")

class Attributes:
    def device(self, name: str, reading: type[Reading]) -> Reading: ...
"""


class Kind(NamedTuple):
    """One class of a device's file."""

    module: str
    bases: list[str]
    tag: str | None
    reading: str | None
    names: tuple[str, ...]


def kinds() -> dict[str, Kind]:
    """All classes of the devices' files, by name."""
    found = {}
    for path in sorted(DEVICES.glob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef):
                found[node.name] = _kind(path.stem, node)
    return found


def _kind(module: str, node: ast.ClassDef) -> Kind:
    values = {
        line.target.id: line.value
        for line in node.body
        if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name) and line.value is not None
    }
    reading, names = values.get("READING"), values.get("NAMES")
    return Kind(
        module,
        [base.id for base in node.bases if isinstance(base, ast.Name)],
        next((ast.literal_eval(word.value) for word in node.keywords if word.arg == "tag"), None),
        reading.id if isinstance(reading, ast.Name) else None,
        () if names is None else ast.literal_eval(names),
    )


def _inherited(classes: dict[str, Kind], name: str) -> Iterator[Kind]:
    """A class and what it inherits from, nearest first."""
    if name in classes:
        yield classes[name]
        for base in classes[name].bases:
            yield from _inherited(classes, base)


def readings() -> dict[str, set[str]]:
    """Types of the readings by the name of the device, as "module.Type"."""
    classes = kinds()
    by_tag: dict[str, str] = {}
    found: dict[str, set[str]] = {}
    for name, kind in classes.items():
        line = list(_inherited(classes, name))
        owner = next((one for one in line if one.reading is not None), None)
        if kind.tag is None or owner is None:
            continue
        by_tag[kind.tag] = f"{owner.module}.{owner.reading}"
        for usual in next((one.names for one in line if one.names), ()):
            found.setdefault(usual, set()).add(by_tag[kind.tag])
    for robot in robot_files.load_all():
        for device, table in robot.devices.items() if robot.takes_brain else ():
            if table.get("type") in by_tag:
                found.setdefault(device, set()).add(by_tag[table["type"]])
    return found


def stub() -> str:
    """The text of the stub."""
    found = readings()
    types = sorted({one for several in found.values() for one in several})
    lines = [f"from boebot.devices.{module} import {name}" for module, name in (one.split(".") for one in types)]
    properties = []
    for device in sorted(found):
        several = " | ".join(one.partition(".")[2] for one in sorted(found[device]))
        properties.append(f"    @property\n    def {device}(self) -> {several}: ...\n")
    return HEAD + "\n".join(lines) + "\n" + CLASS + "".join(properties)
