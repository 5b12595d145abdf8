"""The protocol's schema, read from messages.toml and checked; generate.py turns it into code and tables."""

from __future__ import annotations

import json
import re
import tomllib
import zlib
from pathlib import Path
from typing import Any

import msgspec

HERE = Path(__file__).resolve().parent
TASKS = HERE.parent / "firmware" / "src" / "tasks.def"

DELIVERIES = ("handshake", "telemetry", "set_point", "stop", "exactly_once")
NOT_ON_THE_WIRE = ("doc", "device", "default", "default_from", "each_task")  # keys that both ends need not agree on
PARAMETER_TYPES = ("u16", "i16")  # what the board keeps of each

# wire type -> (size in bytes, C type, struct letter, least, greatest)
INTEGERS: dict[str, tuple[int, str, str, int, int]] = {
    "u8": (1, "uint8_t", "B", 0, 2**8 - 1),
    "u16": (2, "uint16_t", "H", 0, 2**16 - 1),
    "u32": (4, "uint32_t", "I", 0, 2**32 - 1),
    "i8": (1, "int8_t", "b", -(2**7), 2**7 - 1),
    "i16": (2, "int16_t", "h", -(2**15), 2**15 - 1),
    "i32": (4, "int32_t", "i", -(2**31), 2**31 - 1),
}


class Field(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
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
    def text_length(self) -> int:
        """Bytes of a text field; 0 for an integer."""
        return int(self.type[5:-1]) if self.type.startswith("text[") else 0

    @property
    def size(self) -> int:
        """Bytes on the wire."""
        return self.text_length or INTEGERS[self.type][0]

    @property
    def struct_code(self) -> str:
        """The field's letter in Python's struct notation."""
        return f"{self.text_length}s" if self.text_length else INTEGERS[self.type][2]

    @property
    def least(self) -> int:
        """Smallest count allowed."""
        return self.min if self.min is not None else INTEGERS[self.type][3]

    @property
    def greatest(self) -> int:
        """Largest count allowed."""
        return self.max if self.max is not None else INTEGERS[self.type][4]


class Message(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """One message: a fixed list of fields, hence one exact length."""

    name: str
    id: int
    direction: str
    delivery: str
    doc: str
    fields: list[Field]

    @property
    def length(self) -> int:
        """Payload bytes."""
        return sum(field.size for field in self.fields)


class Flags(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A set of named bits."""

    doc: str
    type: str
    bits: list[str]
    device: list[str] = []  # of the devices flags: the robot's device behind each bit


class Enum(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Named values, counted from 0."""

    doc: str
    values: list[str] = []
    each_task: str = ""  # names of further values, one for each task of the firmware, whose name replaces {}


class Parameter(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A value of the firmware that the host may change at run time."""

    name: str
    id: int
    type: str
    unit: str
    doc: str
    min: int
    max: int
    scale: float = 1.0
    default: int | None = None
    default_from: str = ""


class Schema(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Everything that messages.toml says."""

    version: int
    flags: dict[str, Flags]
    enum: dict[str, Enum]
    message: list[Message]
    parameter: list[Parameter]

    @property
    def hash(self) -> int:
        """CRC-32 of what both ends must agree on: everything but the explanations."""
        return _crc32(self)

    def message_hash(self, message: Message) -> int:
        """CRC-32 of what both ends must agree on in one message, with the flags and values that its fields name; the
        parameters belong to set_parameter.
        """
        named = {field.flags: self.flags[field.flags] for field in message.fields if field.flags}
        values = {field.enum: self.enum[field.enum] for field in message.fields if field.enum}
        parameters = self.parameter if message.name == "set_parameter" else []
        return _crc32([message, named, values, parameters])

    def of_direction(self, direction: str) -> list[Message]:
        """The messages to one side."""
        return [message for message in self.message if message.direction == direction]


def _crc32(part: Any) -> int:
    return zlib.crc32(json.dumps(_without_docs(msgspec.to_builtins(part)), sort_keys=True).encode())


def _without_docs(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _without_docs(value) for key, value in node.items() if key not in NOT_ON_THE_WIRE}
    if isinstance(node, list):
        return [_without_docs(value) for value in node]
    return node


def load(path: Path = HERE / "messages.toml") -> Schema:
    """Reads and checks the schema.

    Raises:
        ValueError: a name or number is used twice, or a field names what is not there.
    """
    schema = _with_tasks(msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8")), Schema))
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
    for message in schema.message:
        alike = {m.delivery for m in schema.of_direction(message.direction) if m.length == message.length}
        if message.delivery == "handshake" and alike != {"handshake"}:
            raise ValueError(
                f"message {message.name}: of the handshake, so no other message {message.direction} may be as long: "
                "a wrong bit in the id would change the checksum's seed"
            )
    for parameter in schema.parameter:
        if parameter.type not in PARAMETER_TYPES:
            raise ValueError(f"parameter {parameter.name}: type {parameter.type!r} is none of {PARAMETER_TYPES}")
        _, _, _, least, greatest = INTEGERS[parameter.type]
        if not least <= parameter.min < parameter.max <= greatest:
            raise ValueError(f"parameter {parameter.name}: {parameter.min} to {parameter.max} is no range of its type")
    return schema


def _with_tasks(schema: Schema) -> Schema:
    tasks = re.findall(r"^TASK\((\w+),", TASKS.read_text(encoding="utf-8"), re.MULTILINE)
    enums = {
        name: msgspec.structs.replace(enum, values=enum.values + [enum.each_task.format(task) for task in tasks])
        if enum.each_task
        else enum
        for name, enum in schema.enum.items()
    }
    return msgspec.structs.replace(schema, enum=enums)


def _unique(kind: str, names: list[str], ids: list[int]) -> None:
    twice = [name for name in names if names.count(name) > 1] + [hex(i) for i in ids if ids.count(i) > 1]
    if twice:
        raise ValueError(f"{kind}: {', '.join(sorted(set(twice)))} used twice")
