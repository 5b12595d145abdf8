"""TOML descriptions (robots, arenas): found by bundled name or path, read, and checked against their types.

Errors are one sentence with the file, the line, the full key and what was expected there.
"""

from __future__ import annotations

import re
import reprlib
import sys
import threading
import tomllib
import types
import typing
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import msgspec

from boebot import resources
from boebot.errors import BoebotError, did_you_mean, expected_one, printable

_T = TypeVar("_T")

_CONVERTING = threading.Lock()  # msgspec looks at a type when it first meets it, and no two threads may do that at once
# A hostile file ends in one sentence and in bounded time. Parts of a dotted key are counted before tomllib reads the
# text: its time grows with their square.
SIZE_MAXIMUM = 8_000_000  # bytes of a file
DEPTH_MAXIMUM = 16  # tables and arrays inside one another, and parts of a dotted key
KEY_MAXIMUM = 100  # characters of a key, or of one part of a dotted key
TEXT_MAXIMUM = 1000  # characters of a text

_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\]++|\\.)*"?|'[^']*'?)"""
_STRING_OR_COMMENT = re.compile(r'''(?s:"""(?:[^\\]|\\.)*?"{3,5}|\'{3}.*?\'{3,5})|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|#.*''')
_KEY = re.compile(rf"#.*|{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*")
SLOW = 2_000_000  # bytes that take about a second: a notice says why nothing happens


class Table(dict[str, Any]):
    """What a file says, with the texts it came from: so that errors can name the line.

    Attributes:
        sources: names and texts of files; a key of an earlier one replaces that of a later one.
    """

    sources: tuple[tuple[str, str], ...] = ()


class Fault(NamedTuple):
    """An error in a table.

    Attributes:
        place: where, as `line_of` takes it.
        what: the rest of the sentence, with the key.
    """

    place: str
    what: str


def bundled_names(kind: str) -> list[str]:
    """The bundled descriptions in the folder "robots" or "arenas"."""
    return sorted(path.stem for path in resources.folder(kind).glob("*.toml"))


def find(kind: str, name: str | Path, error: type[BoebotError]) -> Path:
    """The file of a bundled name, or the .toml file that `name` is. Raises `error` if there is none."""
    thing = kind.removesuffix("s")
    if not isinstance(name, (str, Path)):
        raise error(f"{thing} is {reprlib.repr(name)}; expected a name or a .toml file")
    path = Path(name)
    if path.suffix == ".toml":
        if path.is_file():
            return path
        raise error(f"there is no {thing} file {path}; expected a .toml file")
    known = bundled_names(kind)
    if str(name) not in known:
        raise error(
            f"there is no {thing} {str(name)!r}; expected one of {', '.join(known)}, or a .toml file"
            + did_you_mean(str(name), known)
        )
    return resources.folder(kind) / f"{name}.toml"


def read(path: Path, error: type[BoebotError]) -> Table:
    """The file's table. Raises `error` if it cannot be read or is no TOML."""
    try:
        size = path.stat().st_size
        if size > SIZE_MAXIMUM:
            raise error(f"{path.name} has {size:,} bytes; expected at most {SIZE_MAXIMUM:,}")
        if size > SLOW:
            print(f"reading {printable(path.name)}, {size / 1e6:.1f} MB ...", file=sys.stderr)
        text = path.read_text(encoding="utf-8-sig")  # some editors begin with a byte order mark
        if fault := fault_of_text(text):
            raise error(f"{path.name}{fault}")
        table = Table(tomllib.loads(text))
    except (OSError, UnicodeDecodeError) as cause:
        raise error(f"{path.name} cannot be read: {cause}") from None
    except RecursionError:
        raise error(f"{path.name} is nested too deeply; expected a flat description") from None
    except ValueError as cause:  # also a number of thousands of digits, which tomllib passes on
        raise error(_no_toml(path.name, text, cause)) from None
    if fault := fault_of_table(table):
        raise error(f"{path.name}{fault}")
    table.sources = ((path.name, text),)
    return table


def _no_toml(name: str, text: str, cause: ValueError) -> str:
    """The sentence about a text that tomllib refuses; in our words where its own say nothing to most people."""
    what = " ".join(str(cause).split())
    if not isinstance(cause, tomllib.TOMLDecodeError):
        most = sys.get_int_max_str_digits()
        digits = next((run for run in re.finditer("[0-9_]+", text) if len(run[0]) >= most), None)
        line = text.count("\n", 0, digits.start()) + 1 if digits else 1
        return (
            f"{name}:{line}: a number has {len(digits[0]) if digits else 'too many'} digits; expected a finite number"
        )
    at = re.search(r"\(at line (\d+), ", what)
    line = int(at[1]) if at else text.rstrip("\n").count("\n") + 1
    if what.startswith(("Cannot overwrite a value", "Duplicate inline table key", "Cannot declare")):
        said = re.search(r"key '(.*)' \(at ", what) or re.match(
            r"[\s\[]*([^\s=\[\]]+)\s*[=\]]", text.split("\n")[line - 1]
        )
        return f"{name}:{line}: {repr(said[1]) if said else 'a key'} is given twice; expected each key and table once"
    return f"{name} is no valid TOML: {what}"


def fault_of_text(text: str) -> str:
    """The error in a text that has not been read, one too long or too deep, with its line first; "": none."""
    for number, line in enumerate(text.split("\n"), 1):
        if line.count(".") < DEPTH_MAXIMUM:
            continue
        for key in _KEY.finditer(line):
            if key[0].startswith("#"):
                break
            if key[0].count(".") >= DEPTH_MAXIMUM and (parts := len(re.findall(_PART, key[0]))) > DEPTH_MAXIMUM:
                return f":{number}: a key has {parts:,} parts; expected at most {DEPTH_MAXIMUM}"
    return ""


def fault_of_table(table: dict[str, Any]) -> str:
    """The error in a table that is too long or too deep; "": none."""
    level: list[Any] = [table]
    for _ in range(DEPTH_MAXIMUM):
        below: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                if (longest := max(map(len, value), default=0)) > KEY_MAXIMUM:
                    return f": a key has {longest:,} characters; expected at most {KEY_MAXIMUM}"
                value = value.values()
            below += [entry for entry in value if isinstance(entry, (dict, list, str))]
        if (longest := max((len(entry) for entry in below if isinstance(entry, str)), default=0)) > TEXT_MAXIMUM:
            return f": a text has {longest:,} characters; expected at most {TEXT_MAXIMUM:,}"
        level = [entry for entry in below if not isinstance(entry, str)]
        if not level:
            return ""
    return f" is nested too deeply; expected at most {DEPTH_MAXIMUM} tables and arrays inside one another"


def overlaid(merged: dict[str, Any], top: dict[str, Any], base: dict[str, Any]) -> Table:
    """`merged` as a table that came from `top`, and where that says nothing from `base`."""
    table = Table(merged)
    table.sources = tuple(source for layer in (top, base) if isinstance(layer, Table) for source in layer.sources)
    return table


def where(table: dict[str, Any], file: str, place: str) -> str:
    """The file, with the line of the place if the table was read from it: "room.toml:12". Of several files the one that
    has more of the place."""
    sources = table.sources if isinstance(table, Table) and place else ()
    found = [(name, *line_of(text, place)) for name, text in sources]
    if not found:
        return file
    name, line, _ = max(found, key=lambda one: len(one[2]))
    return f"{name}:{line}"


def line_of(text: str, place: str) -> tuple[int, str]:
    """The line, from 1, of a place such as "a.b[2].c", the key c in the third table of the array a.b; and what of the
    place begins there: where the text does not say it, the innermost table around it, and of a part of a value in
    brackets the whole value. tomllib, which has read the text, does not say it."""
    lines, last, table, depth = {"": 1}, dict[str, int](), "", 0  # last: number of the last table of each array of them

    def noted(place: str, key: str) -> str:
        for part in re.findall(_PART, key):
            if place in last:
                place = f"{place}[{last[place]}]"
            place = _below(place, part.strip("\"'"))
            lines.setdefault(place, number)
        return place

    # within strings, which may have several lines, signs mean nothing
    plain = _STRING_OR_COMMENT.sub(lambda found: re.sub(r"[][{}=]|#.*", "_", found[0]), text)
    for number, line in enumerate(plain.split("\n"), 1):
        if depth == 0 and (header := re.match(r"\s*\[(\[?)([^]]*)", line)):
            table = noted("", header[2])
            if header[1]:
                last[table] = last.get(table, -1) + 1
            if table in last:
                table = f"{table}[{last[table]}]"
                lines.setdefault(table, number)
        elif depth == 0 and (key := re.match(r"[^=]*(?==)", line)):
            noted(table, key[0])
        depth += sum((sign in "[{") - (sign in "]}") for sign in line)
    around = place
    while around not in lines:
        around = around[: max(around.rfind("."), around.rfind("["), 0)]
    return lines[around], around


def table_at(table: dict[str, Any], place: str) -> dict[str, Any]:
    """The table at a place such as "process.wander", or an empty one."""
    found: Any = table
    for part in place.split(".") if place else ():
        found = found.get(part) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else {}


def convert(table: dict[str, Any], kind: type[_T], file: str, error: type[BoebotError]) -> _T:
    """The table as a `kind`, all of its numbers finite.

    Raises `error`, which names file, line, key and what was expected.
    """
    fault = _not_finite(table, "")
    if fault is None:
        try:
            with _CONVERTING:
                return msgspec.convert(table, kind)
        except msgspec.ValidationError as cause:
            fault = _fault(table, kind, "") or Fault("", str(cause))
    raise error(f"{where(table, file, fault.place)}: {fault.what}")


def _not_finite(value: Any, key: str) -> Fault | None:
    """The first number in `value` that is infinite, none, or beyond what floating-point numbers hold."""
    if isinstance(value, dict):
        places = ((f"{key}.{name}" if key else name, entry) for name, entry in value.items())
    elif isinstance(value, list):
        if _all_finite(value):
            return None
        places = ((f"{key}[{index}]", entry) for index, entry in enumerate(value))
    elif isinstance(value, (int, float)) and not abs(value) < 1e300:
        return Fault(key, f"{key}: expected a finite number")
    else:
        return None
    return next((found for place, entry in places if (found := _not_finite(entry, place))), None)


def _all_finite(rows: list[Any]) -> bool:
    """Whether these are rows of finite numbers, found without looking at each in Python; False: look."""
    try:
        return bool(sum(map(abs, chain.from_iterable(rows))) < 1e300)
    except (TypeError, OverflowError):
        return False


def _fault(value: Any, kind: Any, key: str) -> Fault | None:
    """The first thing in `value` that does not fit `kind`."""
    origin, inner = typing.get_origin(_plain(kind)), typing.get_args(_plain(kind))
    if origin in (types.UnionType, typing.Union) and all(_is_struct(choice) for choice in inner):
        return _union_fault(value, inner, key)
    if _is_struct(kind) and isinstance(value, dict) and (fault := _struct_fault(value, kind, key)):
        return fault
    if origin in (list, dict) and isinstance(value, origin):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        places = ((_below(key, str(place)) if origin is dict else f"{key}[{place}]", item) for place, item in items)
        if fault := next((fault for place, item in places if (fault := _fault(item, inner[-1], place))), None):
            return fault
    if (choices := _choices(kind)) and value not in choices:
        known = [str(choice) for choice in choices]
        return Fault(key, f"{key} is {reprlib.repr(value)}; {expected_one(str(value), known)}")
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError as cause:
        what, _, place = str(cause).replace("`", "").partition(" - at $")
        at = f"{key}{place}: " if key or place else ""
        return Fault(key + place, f"{at}{what[0].lower()}{what[1:]}")
    return None


def _union_fault(value: Any, choices: tuple[Any, ...], key: str) -> Fault | None:
    """Of tables that say by one of their keys what they are."""
    at = f"{key}: " if key else ""
    if not isinstance(value, dict):
        return Fault(key, f"{at}expected a table")
    by_tag = {choice.__struct_config__.tag: choice for choice in choices}
    field = choices[0].__struct_config__.tag_field
    tag = value.get(field)
    if not isinstance(tag, str) or tag not in by_tag:
        known = sorted(map(str, by_tag))
        hint = did_you_mean(tag, known) if isinstance(tag, str) else ""
        return Fault(
            _below(key, field), f"{at}{field} is {reprlib.repr(tag)}; expected one of {', '.join(known)}{hint}"
        )
    return _fault({name: entry for name, entry in value.items() if name != field}, by_tag[tag], key)


def _struct_fault(value: dict[str, Any], kind: Any, key: str) -> Fault | None:
    at = f"{key}: " if key else ""
    fields = {field.encode_name: field for field in msgspec.structs.fields(kind)}
    for name in value:
        if name not in fields:
            hint = did_you_mean(name, fields)
            return Fault(_below(key, name), f"{at}there is no key {name!r} here; expected {', '.join(fields)}{hint}")
    for name, field in fields.items():
        if name not in value:
            if field.required:
                return Fault(key, f"{at}the key {name!r} is missing")
        elif fault := _fault(value[name], field.type, _below(key, name)):
            return fault
    return None


def _choices(kind: Any) -> tuple[Any, ...]:
    """The values that a Literal allows, () for any other type."""
    return typing.get_args(_plain(kind)) if typing.get_origin(_plain(kind)) is typing.Literal else ()


def _plain(kind: Any) -> Any:
    """A type without its bounds."""
    return typing.get_args(kind)[0] if typing.get_origin(kind) is typing.Annotated else kind


def _below(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)
