"""TOML descriptions (robots, arenas): found by bundled name or path, read, and checked against their types.

What is wrong is said with the file, the full key and what was expected there.
"""

from __future__ import annotations

import math
import tomllib
import types
import typing
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from boebot import resources
from boebot.errors import BoebotError

_T = TypeVar("_T")


def bundled_names(kind: str) -> list[str]:
    """The bundled descriptions in the folder "robots" or "arenas"."""
    return sorted(path.stem for path in resources.folder(kind).glob("*.toml"))


def find(kind: str, name: str | Path, error: type[BoebotError]) -> Path:
    """The file of a bundled name, or the .toml file that `name` is. Raises `error` if there is none."""
    path, thing = Path(name), kind.removesuffix("s")
    if path.suffix == ".toml":
        if path.is_file():
            return path
        raise error(f"there is no {thing} file {path}")
    known = bundled_names(kind)
    if str(name) not in known:
        raise error(f"there is no {thing} {str(name)!r}; expected one of {', '.join(known)}, or a .toml file")
    return resources.folder(kind) / f"{name}.toml"


def read(path: Path, error: type[BoebotError]) -> dict[str, Any]:
    """The file's table. Raises `error` if it cannot be read or is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as cause:
        raise error(f"{path.name} cannot be read: {cause}") from None
    except tomllib.TOMLDecodeError as cause:
        raise error(f"{path.name} is no valid TOML: {cause}") from None


def convert(table: dict[str, Any], kind: type[_T], file: str, error: type[BoebotError]) -> _T:
    """The table as a `kind`, all of its numbers finite. Raises `error`, which names file, key and what was expected."""
    if place := _not_finite(table, ""):
        raise error(f"{file}: {place}: expected a finite number")
    try:
        return msgspec.convert(table, kind)
    except msgspec.ValidationError as cause:
        raise error(f"{file}: {_fault(table, kind, '') or cause}") from None


def _not_finite(value: Any, key: str) -> str | None:
    """The key of the first number in `value` that is infinite or none."""
    if isinstance(value, dict):
        places = ((f"{key}.{name}" if key else name, entry) for name, entry in value.items())
    elif isinstance(value, list):
        places = ((f"{key}[{index}]", entry) for index, entry in enumerate(value))
    else:
        return key if isinstance(value, float) and not math.isfinite(value) else None
    return next((found for place, entry in places if (found := _not_finite(entry, place))), None)


def _fault(value: Any, kind: Any, key: str) -> str | None:
    """The first thing in `value` that does not fit `kind`, with its key."""
    at = f"{key}: " if key else ""
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if origin in (types.UnionType, typing.Union) and all(_is_struct(choice) for choice in inner):
        if not isinstance(value, dict):
            return f"{at}expected a table"
        choices = {choice.__struct_config__.tag: choice for choice in inner}
        tag_field = inner[0].__struct_config__.tag_field
        if value.get(tag_field) not in choices:
            return f"{at}{tag_field} is {value.get(tag_field)!r}; expected one of {', '.join(sorted(choices))}"
        rest = {name: entry for name, entry in value.items() if name != tag_field}
        return _fault(rest, choices[value[tag_field]], key)
    if _is_struct(kind) and isinstance(value, dict):
        fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
        for name in value:
            if name not in fields:
                return f"{at}there is no key {name!r} here; expected {', '.join(fields)}"
        for name, field in fields.items():
            if name not in value:
                if field.required:
                    return f"{at}the key {name!r} is missing"
            elif fault := _fault(value[name], field.type, f"{key}.{name}" if key else name):
                return fault
        return None
    if origin in (list, dict) and isinstance(value, origin):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        places = ((f"{key}.{place}" if origin is dict else f"{key}[{place}]", item) for place, item in items)
        return next((fault for place, item in places if (fault := _fault(item, inner[-1], place))), None)
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as cause:
        what, _, place = str(cause).replace("`", "").partition(" - at $")
        return f"{key}{place}: {what[0].lower()}{what[1:]}"
    return None


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)
