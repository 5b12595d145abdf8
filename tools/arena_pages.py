"""Writes what documents arena files, from their types (boebot/arenas/description.py).

python -m tools.arena_pages --schema      bundled/schema.json, the JSON schema of an arena file: `make`
python -m tools.arena_pages --pictures    docs/images/arena-NAME.png of each bundled arena, and the tables of keys in
                                          docs/reference/arenas.md: `make pictures`
"""

from __future__ import annotations

import json
import sys
import typing
from typing import Any

import msgspec

from boebot import resources
from boebot.arenas.arena import arena_names, load_arena
from boebot.arenas.description import ArenaDescription, Shape

SCHEMA_URI = "http://json-schema.org/draft-07/schema#"
LIMITS = ("minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum")
BEGIN, END = "<!-- keys: begin -->", "<!-- keys: end -->"
OF_SHAPES = ("name", *Shape.__struct_fields__)  # keys of all that keeps robots out
UNITS = {"m": "m", "rad": "rad", "s": "s", "w": "W"}  # by a key's last part


def schema() -> str:
    """The JSON schema of an arena file."""
    made = _whole(msgspec.json.schema(ArenaDescription))
    return json.dumps({"$schema": SCHEMA_URI, "title": "arena file", **made}, indent=2, ensure_ascii=False) + "\n"


def _whole(value: Any) -> Any:
    """The schema with limits such as 1000.0 as 1000: which of the two msgspec gives depends on who was imported first,
    for `typing` keeps one of annotations that are equal."""
    if isinstance(value, dict):
        return {
            key: int(item) if key in LIMITS and isinstance(item, float) and item.is_integer() else _whole(item)
            for key, item in value.items()
        }
    return [_whole(item) for item in value] if isinstance(value, list) else value


def page(text: str) -> str:
    """The page with its tables of keys made anew."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{_tables()}{END}{after}"


def _tables() -> str:
    """One table per kind of table in a file."""
    definitions = msgspec.json.schema(ArenaDescription)["$defs"]
    sections = [_section("at the top of the file", definitions["ArenaDescription"])]
    titles: dict[str, list[str]] = {}
    for key, value in definitions["ArenaDescription"]["properties"].items():
        if name := _table_of(value):
            titles.setdefault(name, []).append(f"`[[{key}]]`" if value.get("type") == "array" else f"`[{key}]`")
    sections += [_section(", ".join(keys), definitions[name]) for name, keys in titles.items()]
    shape = definitions["Disc"] | {
        "description": "Outlines, obstacles, walls, discs and moving shapes have these, too."
    }
    shape["properties"] = {key: shape["properties"][key] for key in OF_SHAPES}
    sections.append(_section("every shape", shape))
    sections.append(_section("a waypoint of `path`", definitions["Waypoint"]))
    return "\n".join(sections)


def _table_of(value: dict[str, Any]) -> str | None:
    """The definition that a key's value, or the items of its array, refers to."""
    choices = [value, value.get("items", {}), *value.get("allOf", ()), *value.get("anyOf", ())]
    found = next((choice["$ref"] for choice in choices if isinstance(choice, dict) and "$ref" in choice), None)
    return None if found is None else str(found).rsplit("/", 1)[-1]


def _section(title: str, definition: dict[str, Any]) -> str:
    properties = definition["properties"]
    has_more = set(OF_SHAPES) < set(properties)
    rows = [
        f"| `{key}` | {_unit(key)} | {_values(value)} | {_default(key, value, definition)} | {_meaning(value)} |"
        for key, value in properties.items()
        if key == "path" or not (_table_of(value) or (has_more and key in OF_SHAPES))
    ]
    text = " ".join(definition.get("description", "").split())
    head = "| key | unit | values | default | meaning |\n|---|---|---|---|---|"
    return "\n".join([f"### {title[0].upper()}{title[1:]}", "", text, "", head, *rows, ""])


def _unit(key: str) -> str:
    return UNITS.get(key.rpartition("_")[2], "–")


def _plain(value: dict[str, Any]) -> dict[str, Any]:
    """Without the choice of leaving a value out."""
    return next((choice for choice in value.get("anyOf", ()) if choice.get("type") != "null"), value)


def _values(value: dict[str, Any]) -> str:
    plain = _plain(value)
    if "enum" in plain:
        return ", ".join(f'"{name}"' for name in plain["enum"])
    if plain.get("type") == "array":
        inner = plain["items"]
        return f"at least {plain['minItems']} " + ("waypoints" if "$ref" in inner else "pairs of numbers")
    if plain.get("type") != "number":
        return "text"
    low = next(
        (f"{sign} {plain[key]:g}" for sign, key in ((">", "exclusiveMinimum"), ("≥", "minimum")) if key in plain), ""
    )
    high = f"≤ {plain['maximum']:g}" if "maximum" in plain else ""
    return ", ".join(bound for bound in (low, high) if bound) or "number"


def _default(key: str, value: dict[str, Any], definition: dict[str, Any]) -> str:
    if key in definition.get("required", ()):
        return "required"
    default = value.get("default")
    return "–" if default in (None, "") else (f"{default:g}" if isinstance(default, float) else f'"{default}"')


def _meaning(value: dict[str, Any]) -> str:
    return typing.cast(str, _plain(value).get("description", value.get("description", "")))


def main() -> None:
    """Writes what is asked for."""
    if sys.argv[1:] == ["--schema"]:
        (resources.folder("arenas") / "schema.json").write_text(schema(), encoding="utf-8")
    elif sys.argv[1:] == ["--pictures"] and (root := resources.checkout()) is not None:
        from boebot.view import arena_picture

        document = root / "docs" / "reference" / "arenas.md"
        document.write_text(page(document.read_text(encoding="utf-8")), encoding="utf-8")
        for name in arena_names():
            arena_picture.write(load_arena(name), root / "docs" / "images" / f"arena-{name}.png")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
