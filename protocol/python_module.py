"""The Python module of the messages, host/boebot/link/messages.py."""

from __future__ import annotations

import schema


def python_module(spec: schema.Schema) -> str:
    """host/boebot/link/messages.py"""
    doc = "Every message of the protocol, from protocol/messages.toml: wire integers in, wire integers out."
    lines = [
        *schema.python_head(doc),
        "",
        "import struct",
        "from enum import IntEnum, IntFlag",
        "from typing import ClassVar, NamedTuple, Self",
        "",
        f"PROTOCOL_VERSION = 0x{spec.version_byte:02X}  # {spec.version}.{spec.minor}",
        f"SCHEMA_HASH = 0x{spec.hash:08X}",
    ]
    for name, flags in spec.flags.items():
        lines += ["", "", f"class {class_name(name)}(IntFlag):", f'    """{flags.doc}"""', ""]
        lines += [f"    {bit.upper()} = 1 << {i}" for i, bit in enumerate(flags.bits)]
    devices = spec.flags["devices"]
    lines += ["", "", "# The robot's device behind each bit.", "DEVICE_OF_BIT: dict[Devices, str] = {"]
    lines += [f'    Devices.{bit.upper()}: "{name}",' for bit, name in zip(devices.bits, devices.device, strict=True)]
    lines += ["}", "# The parameters that hold these flags, 16 bits each, and the first bit of each."]
    lines += [f"DEVICES_PARAMETERS = {spec.devices_parameters}"]
    lines += [
        "",
        "",
        "class _Values(IntEnum):",
        '    """Values by name; one that a later minor version has added is called by its number."""',
        "",
        "    @classmethod",
        "    def _missing_(cls, value: object) -> _Values | None:",
        "        if not isinstance(value, int):",
        "            return None",
        "        unknown = int.__new__(cls, value)",
        '        unknown._name_, unknown._value_ = f"UNKNOWN_{value}", value',
        "        return unknown",
    ]
    for name, enum in spec.enum.items():
        lines += ["", "", f"class {class_name(name)}(_Values):", f'    """{enum.doc}"""', ""]
        lines += [f"    {value.upper()} = {i}" for i, value in enumerate(enum.values)]
    for message in spec.message:
        lines += python_message(message)
    lines += ["", "", "Message = ("]
    lines += [f"    {'' if i == 0 else '| '}{class_name(m.name)}" for i, m in enumerate(spec.message)]
    lines += [")", "", "MESSAGES: dict[int, type[Message]] = {"]
    lines += [f"    0x{m.id:02X}: {class_name(m.name)}," for m in spec.message]
    lines += ["}", "", "# In which devices speak besides telemetry.", "DEVICE_MESSAGES: tuple[type[Message], ...] = ("]
    lines += [f"    {class_name(m.name)}," for m in spec.message if m.devices and m.name != "telemetry"]
    lines += [")", "", "# id -> hash of the message", "HASHES: dict[int, int] = {"]
    lines += [f"    0x{m.id:02X}: 0x{spec.message_hash(m):08X}," for m in spec.message]
    lines += ["}"]
    lines += ["", "", "class ParameterSpec(NamedTuple):", '    """A run-time parameter of the firmware."""', ""]
    lines += ["    id: int", "    unit: str  # the host's: SI; us for pulse widths and edges, as in data sheets"]
    lines += ["    scale: float  # unit per count", "    minimum: int  # counts"]
    lines += ["    maximum: int  # counts", "    doc: str"]
    lines += [
        '    default_from: str = ""  # key of the robot description that gives the default',
        "    since: int = 0  # minor version",
        "",
        "",
        "PARAMETERS: dict[str, ParameterSpec] = {",
    ]
    for p in spec.parameter:
        unit, scale = ("s", p.scale / 1000) if p.unit == "ms" else (p.unit, p.scale)
        row = f'{p.id}, "{unit}", {scale!r}, {p.min}, {p.max}, "{p.doc}"'
        row += f', "{p.default_from}"' if p.default_from else ""
        row += f", since={p.since}" if p.since else ""
        lines.append(f'    "{p.name}": ParameterSpec({row}),')
    lines += ["}", ""]
    return "\n".join(lines)


def python_message(message: schema.Message) -> list[str]:
    """The class of one message."""
    name = class_name(message.name)
    lines = ["", "", f"class _{name}Fields(NamedTuple):"]
    for field in message.fields:
        comment = field.comment
        kind = "bytes" if field.text_length else "int"
        shadows = "  # type: ignore[assignment]" if hasattr(tuple, field.name) else ""
        default = " = 0" if field.name == "padding" else ""
        lines.append(f"    {field.name}: {kind}{default}{shadows}" + (f"  # {comment}" if comment else ""))
    if not message.fields:
        lines.append("    pass")
    return [
        *lines,
        "",
        "",
        f"class {name}(_{name}Fields):",
        f'    """{message.doc}"""',
        "",
        "    __slots__ = ()",
        f"    ID: ClassVar[int] = 0x{message.id:02X}",
        f'    NAME: ClassVar[str] = "{message.name}"',
        f'    DELIVERY: ClassVar[str] = "{message.delivery}"',
        f"    LENGTH: ClassVar[int] = {message.length}",
        f'    STRUCT: ClassVar[struct.Struct] = struct.Struct("{message.format}")',
        "",
        "    def pack(self) -> bytes:",
        '        """The payload."""',
        "        return self.STRUCT.pack(*self)",
        "",
        "    @classmethod",
        "    def unpack(cls, payload: bytes) -> Self:",
        '        """The message in a payload of exactly its length."""',
        "        return cls(*cls.STRUCT.unpack(payload))",
    ]


def class_name(name: str) -> str:
    """telemetry -> Telemetry, setpoint_signal -> SetpointSignal"""
    return "".join(part.capitalize() for part in name.split("_"))
