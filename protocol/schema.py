"""The protocol's schema, read from messages.toml and checked; generate.py turns it into code and tables."""

from __future__ import annotations

import dataclasses
import json
import re
import tomllib
import typing
import zlib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any

HERE = Path(__file__).resolve().parent
TASKS = HERE.parent / "firmware" / "src" / "tasks.def"

DELIVERIES = ("handshake", "telemetry", "set_point", "stop", "exactly_once")
# Keys that both ends need not agree on. The firmware checks a parameter's range.
NOT_ON_THE_WIRE = (
    "doc",
    "device",
    "devices",
    "default",
    "default_from",
    "each_task",
    "since",
    "docs",
    "can_id",
    "cycle_ms",
)
MINORS = 16
PARAMETER_TYPES = ("u16", "i16")  # what the board keeps of each
DEVICES = {"devices": 0, "more_devices": 16}  # parameters of 16 devices flags each, and the first of these

# wire type -> (size in bytes, C type, struct letter, least, greatest)
INTEGERS: dict[str, tuple[int, str, str, int, int]] = {
    "u8": (1, "uint8_t", "B", 0, 2**8 - 1),
    "u16": (2, "uint16_t", "H", 0, 2**16 - 1),
    "u32": (4, "uint32_t", "I", 0, 2**32 - 1),
    "i8": (1, "int8_t", "b", -(2**7), 2**7 - 1),
    "i16": (2, "int16_t", "h", -(2**15), 2**15 - 1),
    "i32": (4, "int32_t", "i", -(2**31), 2**31 - 1),
}


MADE_NOTE = "Made by protocol/generate.py; do not edit."


def c_header(name: str, doc: str, lines: list[str]) -> str:
    """The text of firmware/src/generated/<name>."""
    guard = "GENERATED_" + re.sub(r"\W", "_", name).upper()
    head = [f"/* {name}: {doc}", f" * {MADE_NOTE} */", f"#ifndef {guard}", f"#define {guard}"]
    return "\n".join([*head, *lines, "", "#endif", ""])


def python_head(doc: str) -> list[str]:
    """The first lines of a Python module."""
    return [
        f'"""{doc}',
        "",
        MADE_NOTE,
        '"""',
        "",
        "# fmt: off",
        "# ruff: noqa: E501",
        "",
        "from __future__ import annotations",
    ]


def number(value: float) -> str:
    """A number as short as it can be written."""
    return str(int(value)) if float(value).is_integer() else repr(float(value))


def unit_per_count(scale: float, unit: str) -> str:
    """What one count stands for: "0.0625 us", "ms", or nothing."""
    return " ".join(part for part in ("" if scale == 1.0 else number(scale), unit) if part)


@dataclass(frozen=True)
class Field:
    """One field of a message."""

    name: str
    type: str
    unit: str = ""
    scale: float = 1.0
    min: int | None = None
    max: int | None = None
    flags: str = ""
    enum: str = ""
    doc: str = ""

    @property
    def comment(self) -> str:
        """Unit, scale and explanation in one phrase."""
        parts = (unit_per_count(self.scale, self.unit), self.flags or self.enum, self.doc)
        return "; ".join(part for part in parts if part)

    @property
    def text_length(self) -> int:
        """Bytes of a text field; 0 for an integer."""
        return int(self.type[5:-1]) if self.type.startswith("text[") else 0

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return self.text_length or INTEGERS[self.type][0]

    @property
    def least(self) -> int:
        """Smallest count allowed."""
        return self.min if self.min is not None else INTEGERS[self.type][3]

    @property
    def greatest(self) -> int:
        """Largest count allowed."""
        return self.max if self.max is not None else INTEGERS[self.type][4]


@dataclass(frozen=True)
class Message:
    """One message: a fixed list of fields, hence one exact length."""

    name: str
    id: int
    direction: str
    delivery: str
    doc: str
    fields: list[Field]
    since: int = 0
    devices: list[str] = dataclasses.field(default_factory=list)  # of the firmware, that fill it (device_header.py)
    can_id: int = 0  # of its first CAN frame at node 0; 0: it goes by ISO-TP (host/boebot_can/generator)
    cycle_ms: int = 0  # time between two of them by default; 0: sent when there is something to say

    @property
    def length(self) -> int:
        """Payload bytes."""
        return sum(field.size for field in self.fields)

    @property
    def format(self) -> str:
        """Of the payload, in Python's struct notation."""
        return "<" + "".join(
            f"{field.text_length}s" if field.text_length else INTEGERS[field.type][2] for field in self.fields
        )


@dataclass(frozen=True)
class Flags:
    """A set of named bits."""

    doc: str
    type: str
    bits: list[str]
    device: list[str] = dataclasses.field(default_factory=list)  # of the devices flags: the robot's, one for each bit
    docs: dict[str, str] = dataclasses.field(default_factory=dict)
    since: dict[str, int] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True)
class Enum:
    """Named values, counted from 0."""

    doc: str
    values: list[str] = dataclasses.field(default_factory=list)
    each_task: str = ""  # names of further values, one for each task of the firmware, whose name replaces {}
    tasks: int = 0  # how many of the values, the last ones, are such
    docs: dict[str, str] = dataclasses.field(default_factory=dict)
    since: dict[str, int] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True)
class Parameter:
    """A value of the firmware that the host may change at run time."""

    name: str
    id: int
    type: str
    unit: str
    doc: str
    min: int = 0
    max: int = 0
    scale: float = 1.0
    default: int | None = None
    default_from: str = ""
    since: int = 0


@dataclass(frozen=True)
class Schema:
    """Everything that messages.toml says."""

    version: int
    minor: int
    flags: dict[str, Flags]
    enum: dict[str, Enum]
    message: list[Message]
    parameter: list[Parameter]

    @property
    def hash(self) -> int:
        """CRC-32 of what all of this version have in common: neither what later minor versions have added, nor the
        firmware's tasks, nor explanations."""
        messages = [message for message in self.message if not message.since]
        return _crc32([self.version, _base_flags(self.flags), _base_values(self.enum), messages, self._base_parameters])

    def message_hash(self, message: Message) -> int:
        """The same of one message, with the flags and values that its fields name; the parameters belong to
        set_parameter.
        """
        named = _base_flags({field.flags: self.flags[field.flags] for field in message.fields if field.flags})
        values = _base_values({field.enum: self.enum[field.enum] for field in message.fields if field.enum})
        parameters = self._base_parameters if message.name == "set_parameter" else []
        return _crc32([message, named, values, parameters])

    @property
    def version_byte(self) -> int:
        """Version and minor version as in hello and open."""
        return self.version * MINORS + self.minor

    @property
    def _base_parameters(self) -> list[tuple[int, str, str, str, float]]:
        """Without their ranges, which the board checks."""
        return [(p.id, p.name, p.type, p.unit, p.scale) for p in self.parameter if not p.since]

    def of_direction(self, direction: str) -> list[Message]:
        """The messages to one side."""
        return [message for message in self.message if message.direction == direction]

    @property
    def devices_parameters(self) -> dict[str, int]:
        """Those of DEVICES that it has."""
        return {p.name: DEVICES[p.name] for p in self.parameter if p.name in DEVICES}


def _base_flags(flags: dict[str, Flags]) -> dict[str, Any]:
    return {name: (some.type, some.bits[: len(some.bits) - len(some.since)]) for name, some in flags.items()}


def _base_values(enums: dict[str, Enum]) -> dict[str, list[str]]:
    return {name: some.values[: len(some.values) - some.tasks - len(some.since)] for name, some in enums.items()}


def _crc32(part: Any) -> int:
    return zlib.crc32(json.dumps(_without_docs(part), sort_keys=True).encode())


def _without_docs(node: Any) -> Any:
    if dataclasses.is_dataclass(node) and not isinstance(node, type):
        return _without_docs(dataclasses.asdict(node))
    if isinstance(node, dict):
        return {key: _without_docs(value) for key, value in node.items() if key not in NOT_ON_THE_WIRE}
    if isinstance(node, (list, tuple)):
        return [_without_docs(value) for value in node]
    return node


def load(path: Path = HERE / "messages.toml") -> Schema:
    """Reads and checks the schema.

    Raises:
        ValueError: no valid TOML, an unknown key, a value of another type, a name or number that is used twice, or a
            field that names what is not there.
    """
    return checked(toml(path), path.name)


def toml(path: Path) -> dict[str, Any]:
    """What a file of the protocol or of a robot says. Raises ValueError: no valid TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path.name}: no valid TOML: {error}") from None


def checked(table: dict[str, Any], place: str) -> Schema:
    """The schema that a table of TOML says; see `load`."""
    schema = _with_device_ranges(_with_tasks(_converted(Schema, table, place)))
    _unique("message", [m.name for m in schema.message], [m.id for m in schema.message])
    _unique("parameter", [p.name for p in schema.parameter], [p.id for p in schema.parameter])
    if [p.id for p in schema.parameter] != list(range(len(schema.parameter))):
        raise ValueError("parameter ids must count from 0 without gaps, in order")
    if len(schema.flags["devices"].device) != len(schema.flags["devices"].bits):
        raise ValueError("flags devices: expected one device for each bit")
    for message in schema.message:
        if (message.id >= 0x80) != (message.direction == "to_host"):
            raise ValueError(f"message {message.name}: ids from 0x80 on are for messages to the host")
        if message.delivery not in DELIVERIES:
            raise ValueError(f"message {message.name}: unknown delivery {message.delivery!r}")
        names = [field.name for field in message.fields]
        if message.delivery == "exactly_once" and names[:1] != ["number"]:
            raise ValueError(f"message {message.name}: delivered exactly once, so its first field must be number")
        if message.delivery == "set_point" and names[-2:] != ["time_to_live", "answers_tick"]:
            raise ValueError(f"message {message.name}: a set-point, so it must end with time_to_live and answers_tick")
        for field in message.fields:
            if not field.text_length and field.type not in INTEGERS:
                raise ValueError(f"message {message.name}: field {field.name} has unknown type {field.type!r}")
            if field.flags and field.flags not in schema.flags:
                raise ValueError(f"message {message.name}: field {field.name} names unknown flags {field.flags!r}")
            if field.enum and field.enum not in schema.enum:
                raise ValueError(f"message {message.name}: field {field.name} names unknown enum {field.enum!r}")
    _pad(schema)
    for message in schema.message:
        alike = {m.delivery for m in schema.of_direction(message.direction) if m.length == message.length}
        if message.delivery == "handshake" and alike != {"handshake"}:
            raise ValueError(
                f"message {message.name}: of the handshake, so no other message {message.direction} may be as long: "
                "a wrong bit in the id would change the checksum's seed"
            )
    for message in schema.message:
        exposed = [m.name for m in schema.of_direction(message.direction) if m.length == message.length - 2]
        if message.id.bit_count() == 1 and exposed and message.delivery != "handshake":
            raise ValueError(
                f"message {message.name}: a wrong bit can make 00 of id {message.id:#04x}, and what follows is as "
                f"long as {exposed[0]}; expected an id with two bits set"
            )
    _check_since(schema)
    for parameter in schema.parameter:
        if parameter.type not in PARAMETER_TYPES:
            raise ValueError(f"parameter {parameter.name}: type {parameter.type!r} is none of {PARAMETER_TYPES}")
        _, _, _, least, greatest = INTEGERS[parameter.type]
        if not least <= parameter.min < parameter.max <= greatest:
            raise ValueError(f"parameter {parameter.name}: {parameter.min} to {parameter.max} is no range of its type")
        if not (parameter.min < 0 if parameter.type == "i16" else parameter.min < 2**15):
            raise ValueError(f"parameter {parameter.name}: the firmware tells the types apart by the minimum's sign")
        if parameter.default is not None and not parameter.min <= parameter.default <= parameter.max:
            raise ValueError(f"parameter {parameter.name}: its default is not within its range")
    return schema


def _converted(kind: Any, value: Any, place: str) -> Any:
    """A value of TOML as a class of this file, or as the type of one of its fields.

    Raises:
        ValueError: a key that the class does not have, one that is missing, or a value of another type.
    """
    if isinstance(kind, UnionType):  # with None, for a key that may be missing
        kind = typing.get_args(kind)[0]
    if kind is float and type(value) is int:
        return float(value)
    plain = dict if dataclasses.is_dataclass(kind) else typing.get_origin(kind) or kind
    if type(value) is not plain:
        raise ValueError(f"{place}: expected {plain.__name__}, got {value!r}")
    if dataclasses.is_dataclass(kind):
        return _instance(kind, value, place)
    if plain is list:
        (of,) = typing.get_args(kind)
        return [_converted(of, one, f"{place}[{i}]") for i, one in enumerate(value)]
    if plain is dict:
        _, of = typing.get_args(kind)
        return {key: _converted(of, one, f"{place}.{key}") for key, one in value.items()}
    return value


def _instance(kind: Any, table: dict[str, Any], place: str) -> Any:
    types, required = _keys(kind)
    if unknown := [key for key in table if key not in types]:
        raise ValueError(f"{place}: there is no key {unknown[0]!r} here; expected {', '.join(types)}")
    if missing := [key for key in required if key not in table]:
        raise ValueError(f"{place}: {missing[0]} is missing")
    return kind(**{key: _converted(types[key], one, f"{place}.{key}") for key, one in table.items()})


@cache
def _keys(kind: Any) -> tuple[dict[str, Any], list[str]]:
    """The keys of a class with their types, and those of them that have no default."""
    none = dataclasses.MISSING
    required = [one.name for one in dataclasses.fields(kind) if one.default is none and one.default_factory is none]
    return typing.get_type_hints(kind), required


def _with_device_ranges(schema: Schema) -> Schema:
    """The ranges of the parameters that hold the devices flags follow from these."""
    bits = len(schema.flags["devices"].bits)
    wanted = [name for name, first in DEVICES.items() if first < bits]
    if bits > 32 or list(schema.devices_parameters) != wanted:
        raise ValueError(
            f"flags devices has {bits} bits; expected 32 at most, 16 each in the parameters {' and '.join(wanted)}"
        )
    every = (1 << bits) - 1
    ranges = {name: every >> first & 0xFFFF for name, first in schema.devices_parameters.items()}
    parameters = [dataclasses.replace(p, max=ranges.get(p.name, p.max)) for p in schema.parameter]
    return dataclasses.replace(schema, parameter=parameters)


def _pad(schema: Schema) -> None:
    """Gives a byte more to a message that is as long as one of the handshake that stands before it: else a wrong bit in
    the id would change the checksum's seed and nothing more."""
    taken: set[tuple[str, int]] = set()
    for message in schema.message:
        if message.delivery == "handshake":
            taken.add((message.direction, message.length))
        elif (message.direction, message.length) in taken:
            end = len(message.fields) - (2 if message.delivery == "set_point" else 0)
            message.fields.insert(end, Field("padding", "u8", max=0, doc="for no message of the handshake is as long"))


def _with_tasks(schema: Schema) -> Schema:
    tasks = list(dict.fromkeys(re.findall(r"^TASK\((\w+),", TASKS.read_text(encoding="utf-8"), re.MULTILINE)))
    enums = {
        name: dataclasses.replace(
            enum, values=enum.values + [enum.each_task.format(task) for task in tasks], tasks=len(tasks)
        )
        if enum.each_task
        else enum
        for name, enum in schema.enum.items()
    }
    return dataclasses.replace(schema, enum=enums)


def _check_since(schema: Schema) -> None:
    """Refuses additions that a client of the same version could not ignore."""
    if not 0 <= schema.minor < MINORS:
        raise ValueError(f"minor {schema.minor}: expected 0 to {MINORS - 1}")
    said = [(f"message {m.name}", m.since) for m in schema.message] + [
        (f"parameter {p.name}", p.since) for p in schema.parameter
    ]
    lists = [(f"flags {name}", f.bits, f.since) for name, f in schema.flags.items()] + [
        (f"enum {name}", e.values, e.since) for name, e in schema.enum.items()
    ]
    explained = [(flags.bits, flags.docs) for flags in schema.flags.values()]
    explained += [(enum.values, enum.docs) for enum in schema.enum.values()]
    for names, docs in explained:
        if unknown := set(docs) - set(names):
            raise ValueError(f"docs of {', '.join(sorted(unknown))}; expected some of {', '.join(names)}")
    for where, names, since in lists:
        if list(since) != names[len(names) - len(since) :]:
            raise ValueError(f"{where}: since names {', '.join(since)}; expected its last ones, in order")
        said += [(f"{where}, {name}", minor) for name, minor in since.items()]
    for where, minor in said:
        if not 0 <= minor <= schema.minor:
            raise ValueError(f"{where}: since minor version {minor}; expected 0 to minor, {schema.minor}")
    for name, enum in schema.enum.items():
        if enum.each_task and enum.since:
            raise ValueError(f"enum {name}: the tasks follow its own values, so that none can be added")
    for message in schema.message:
        longest = max(m.length for m in schema.of_direction(message.direction) if not m.since)
        if message.since and (message.length > longest or message.delivery == "handshake"):
            raise ValueError(
                f"message {message.name}: added, so it may have {longest} bytes at most and cannot be of the handshake"
            )


def _unique(kind: str, names: list[str], ids: list[int]) -> None:
    twice = [name for name in names if names.count(name) > 1] + [hex(i) for i in ids if ids.count(i) > 1]
    if twice:
        raise ValueError(f"{kind}: {', '.join(sorted(set(twice)))} used twice")
